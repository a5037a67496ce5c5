//! What `run.toml` states and the record contradicts, before any estimate: axes, the sensitivity of a triad, triads whose
//! columns are exchanged.
//!
//! Each statement has rivals, and the likelihood of the motion under each is its weight, as for axes. Another
//! sensitivity of the gyros is only looked for where what is stated needs a larger prior, or noise more than ten times as
//! large.

use std::fmt;

use nalgebra::{Matrix3, Vector3};

use super::likelihood::TooSmall;
use super::motion::Motion;
use super::sensitivity::{Axes, Sensitivity};
use super::{FALSE_ALARMS, Hypotheses, Mounting, TOLD_APART};
use crate::calibration::problem::Problem;
use crate::imu::{AxisOrder, PerSensor, Sensor};
use crate::run::Run;
use crate::statistics::median;

/// Sensitivities from a hundredth to a hundred times the stated one are tried …
const WIDEST: f64 = 100.0;
/// … each this many times the one before: a turn that is linear in what is left between two.
const STEP: f64 = 1.05;
/// The sensitivity of the next range differs by two: half way to it …
pub const NEXT_RANGE: f64 = std::f64::consts::SQRT_2;
/// … a stated one is wrong however large its prior, and within the widest tolerance of data sheets, 10 %, it is right
/// however small. Between these it may be this many σ of its prior off.
const CARELESS: f64 = 10.0;
const WIDEST_TOLERANCE: f64 = 0.1;

/// What `run.toml` states and the record contradicts.
#[derive(Debug, Clone, PartialEq)]
pub enum Contradiction {
    /// Axes that are swapped, reversed or left-handed.
    Axes(Mounting),
    /// A triad that is this many times as sensitive as stated.
    Sensitivity(Sensitivity),
    /// Quaternions of the table in another order, or of the inverse, in words.
    Quaternions(String),
    /// Motion that nothing explains that is tried.
    Unexplained,
    /// Columns of gyros named for accelerometers, and the other way round.
    Exchanged,
}

impl Contradiction {
    /// The first run of a problem that contradicts what is stated of it, if there is one.
    pub fn of<'a>(problem: &Problem<'a>) -> Option<(&'a Run, Self)> {
        let mut runs = problem.runs().enumerate();
        runs.find_map(|(recording, run)| Some((run, Self::of_run(problem, recording, run)?)))
    }

    fn of_run(problem: &Problem, recording: usize, run: &Run) -> Option<Self> {
        if let Some(said) = run
            .observed_table(problem.model.aiding)
            .and_then(|_| run.table_quaternions())
        {
            return Some(Self::Quaternions(said));
        }
        let measured = Motion::of(problem, recording, run);
        let of_stated = Weighed::of(problem, run, &measured, TooSmall::CARELESS_PRIOR);
        let gain = |rival: &Run| {
            let problem = Problem::new(rival, &problem.options);
            let motion = Motion::of(&problem, 0, rival);
            let of = Weighed::of(&problem, rival, &motion, TooSmall::CARELESS_PRIOR);
            match of.is_explained {
                true => of.log_likelihood - of_stated.log_likelihood,
                false => f64::NEG_INFINITY,
            }
        };
        let limit = -FALSE_ALARMS.ln();
        if let Some((axes, factor)) = by_magnitude(run, &measured) {
            return Some(match gain(&exchanged(run)) > limit {
                true => Self::Exchanged,
                false => Self::Sensitivity(Sensitivity::of(run, Sensor::Accel, axes, vec![factor])),
            });
        }
        let mountings = Hypotheses::of(problem, run, measured.clone());
        let mounting = Mounting::likeliest(problem, run, &mountings);
        let is_explained = || {
            let of = |too_small| Weighed::of(problem, run, &measured, too_small);
            let stated = of(TooSmall::STATED_PRIOR);
            stated.is_explained && of(TooSmall::ANY).log_likelihood - stated.log_likelihood < limit
        };
        if mounting.is_none() && is_explained() {
            return None;
        }
        let of_axes = Axes::ALL.map(|axes| {
            let tried = factors(|factor| gain(&less_sensitive(run, axes, factor)));
            let largest = tried
                .first()
                .map_or(f64::NEG_INFINITY, |likeliest| likeliest.1);
            (axes, tried, largest)
        });
        let likeliest = of_axes.into_iter().max_by(|a, b| a.2.total_cmp(&b.2));
        let by_mounting = mounting
            .as_ref()
            .map_or(limit, |of| of.log_ratio.max(limit));
        match likeliest {
            Some((axes, tried, gain))
                if gain > by_mounting && is_another(run, Sensor::Gyro, tried[0].0) =>
            {
                let factors = told_apart(&tried);
                Some(Self::Sensitivity(Sensitivity::of(
                    run,
                    Sensor::Gyro,
                    axes,
                    factors,
                )))
            }
            _ => mounting.map(Self::Axes).or_else(|| {
                let any = Weighed::of(problem, run, &measured, TooSmall::ANY);
                (!any.is_explained).then_some(Self::Unexplained)
            }),
        }
    }
}

/// Whether a triad this many times as sensitive as stated has another sensitivity, and not a prior stated too small.
fn is_another(run: &Run, sensor: Sensor, factor: f64) -> bool {
    let prior = run.instrument.prior.get(sensor);
    let mut sigma = prior.scale_sigma.max();
    if sensor == Sensor::Accel {
        sigma = sigma.hypot(prior.bias_sigma.max() / run.site.gravity);
    }
    factor.ln().abs() > (CARELESS * sigma).clamp(WIDEST_TOLERANCE, NEXT_RANGE.ln())
}

/// The accelerometers whose specific force at rest is another than gravity, and how many times it is that.
///
/// Where the attitudes tell the axes apart, `Σ (f_i / s_i)² = 1` of all dwells gives the sensitivity of each; else the
/// magnitude gives that of the triad.
fn by_magnitude(run: &Run, motion: &Motion) -> Option<(Axes, f64)> {
    let mut forces: Vec<Vector3<f64>> = motion.rests.iter().map(|rest| rest.accel.found).collect();
    if forces.is_empty() {
        let imu = &run.recording.imu;
        let rates = imu.accel.iter().map(|sample| sample / imu.period);
        forces = rates.map(|force| force / run.site.gravity).collect();
    }
    let is_another = |factor: &f64| is_another(run, Sensor::Accel, *factor);
    let squares = forces.iter().map(|force| force.component_mul(force));
    let (normal, right) = squares.clone().fold(
        (Matrix3::zeros(), Vector3::zeros()),
        |(normal, right), of| (normal + of * of.transpose(), right + of),
    );
    // Of dwells with each axis up and down each is as large as the others.
    let eigen = normal.symmetric_eigenvalues();
    let of_axes = (eigen.min() > eigen.max() / WIDEST.powi(2))
        .then(|| normal.cholesky())
        .flatten()
        .map(|normal| {
            normal
                .solve(&right)
                .map(|square| square.max(f64::MIN_POSITIVE).sqrt().recip())
        });
    if let Some(each) = of_axes {
        let others: Vec<usize> = (0..3).filter(|&axis| is_another(&each[axis])).collect();
        if let [axis] = others[..] {
            return Some((Axes::One(axis), each[axis]));
        }
    }
    let magnitude = median(&mut forces.iter().map(Vector3::norm).collect::<Vec<_>>())?;
    is_another(&magnitude).then_some((Axes::All, magnitude))
}

/// The likeliest factor, and those that are hardly less likely and differ from all before.
fn told_apart(tried: &[(f64, f64)]) -> Vec<f64> {
    let mut chosen: Vec<f64> = Vec::new();
    let hardly_less = tried
        .iter()
        .filter(|of| tried[0].1 - of.1 < TOLD_APART.ln());
    for (factor, _) in hardly_less {
        if chosen
            .iter()
            .all(|of| (of / factor).ln().abs() > NEXT_RANGE.ln())
        {
            chosen.push(*factor);
        }
    }
    chosen
}

/// The gyros' sensitivities that are tried with what each gains, the likeliest first; it is found to a thousandth.
fn factors(gain: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let reach = (WIDEST.ln() / STEP.ln()) as i32;
    let with_gain = |factor| (factor, gain(factor));
    let mut tried: Vec<_> = (-reach..=reach).map(|k| with_gain(STEP.powi(k))).collect();
    let mut step = STEP.sqrt();
    while step > 1.001 {
        tried.sort_by(|a, b| b.1.total_cmp(&a.1));
        tried.extend([tried[0].0 / step, tried[0].0 * step].map(with_gain));
        step = step.sqrt();
    }
    tried.sort_by(|a, b| b.1.total_cmp(&a.1));
    tried
}

/// A run as it is if these gyros are so many times as sensitive as stated.
fn less_sensitive(run: &Run, axes: Axes, factor: f64) -> Run {
    let mut run = run.clone();
    let by = Vector3::from_fn(|axis, _| match axes {
        Axes::One(one) if one != axis => 1.0,
        _ => factor.recip(),
    });
    let samples = run.recording.imu.gyro.to_mut();
    samples
        .iter_mut()
        .for_each(|sample| sample.component_mul_assign(&by));
    let prior = &mut run.instrument.prior.gyro;
    prior.bias.component_mul_assign(&by);
    prior.bias_sigma.component_mul_assign(&by);
    run
}

/// A run with the columns of its triads exchanged.
fn exchanged(run: &Run) -> Run {
    let mut run = run.clone();
    let nominal = &run.instrument.nominal;
    let unit = nominal.gyro.0.component_div(&nominal.accel.0);
    let imu = &mut run.recording.imu;
    std::mem::swap(&mut imu.gyro, &mut imu.accel);
    let scaled = |samples: &mut Vec<Vector3<f64>>, by: Vector3<f64>| {
        samples
            .iter_mut()
            .for_each(|sample| sample.component_mul_assign(&by));
    };
    scaled(imu.accel.to_mut(), unit);
    scaled(imu.gyro.to_mut(), unit.map(f64::recip));
    run
}

/// What is stated, weighed by the motion that it makes of a record.
struct Weighed {
    /// Logarithm of its likelihood, or of that of nothing being as it should where that is larger.
    log_likelihood: f64,
    /// Whether it explains more than nothing does.
    is_explained: bool,
}

impl Weighed {
    fn of(problem: &Problem, run: &Run, motion: &Motion, too_small: TooSmall) -> Self {
        // A rate at rest is as large as the factor that is tried makes it: it does not tell factors apart.
        let mut motion = motion.clone();
        motion.upward = None;
        let stated = AxisOrder::IDENTITY;
        let hypotheses = Hypotheses::among(problem, run, motion, &[stated], too_small);
        let parts = hypotheses.parts(&PerSensor::from_fn(|_| stated));
        Self {
            log_likelihood: parts.iter().map(|part| part.of.max(part.none)).sum(),
            is_explained: parts.iter().all(|part| part.of >= part.none),
        }
    }
}

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Axes(mounting) => mounting.fmt(f),
            Self::Sensitivity(sensitivity) => sensitivity.fmt(f),
            Self::Quaternions(said) => f.write_str(said),
            Self::Unexplained => f.write_str(
                "gyros, accelerometers and what run.toml states of the motion do not fit together, nor with other axes \
                 or sensitivities. turncal check shows the turns: look for logs of two runs or clocks, rows that are \
                 lost, labels of other sections, a dead axis",
            ),
            Self::Exchanged => f.write_str(
                "the columns of gyros and accelerometers are exchanged: gravity is in the columns that run.toml names \
                 for the gyros. Exchange gyro and accel in columns of [imu], with their units and [imu.prior]",
            ),
        }
    }
}
