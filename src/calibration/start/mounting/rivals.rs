//! Detection of statements in `run.toml` that the recording contradicts, before any estimate: axes, the sensitivity of
//! a triad, or swapped triads.
//!
//! Each statement competes with alternatives, weighted by the likelihood of the motion, as for axes. Other gyro
//! sensitivities are tested only if the gyros measure a turn incorrectly.

use nalgebra::{DMatrix, DVector, Vector3};

use super::contradiction::Contradiction;
use super::likelihood::TooSmall;
use super::motion::Motion;
use super::sensitivity::{Axes, NEXT_RANGE, Sensitivity};
use super::{FALSE_ALARMS, Hypotheses, Mounting, OTHERS, Part, TOLD_APART};
use crate::calibration::problem::Problem;
use crate::imu::{AxisOrder, PerSensor, Sensor};
use crate::run::Run;
use crate::statistics::median;

/// Sensitivities from a hundredth to a hundred times the stated one are tested: a radian is 57 degrees.
const WIDEST: f64 = 100.0;
/// Each tested sensitivity is this many times the previous one, so that the residual rotation between two of them is in
/// the linear range.
const STEP: f64 = 1.1;
/// Within the widest data-sheet tolerance, 10 %, a stated sensitivity counts as correct for any prior; more than
/// halfway to the next range, it counts as wrong. In between, it may deviate by this many prior σ.
const CARELESS: f64 = 10.0;
const WIDEST_TOLERANCE: f64 = 0.1;

impl Contradiction {
    /// The first run of a problem that contradicts its statements, if any.
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
        let stated = Weighed::of(problem, run, &measured);
        let beyond_chance = stated.log_likelihood - FALSE_ALARMS.ln();
        if let Some((axes, factor)) = by_magnitude(run, &measured) {
            let exchanged = exchanged(run);
            let problem = Problem::new(&exchanged, &problem.options);
            let motion = Motion::of(&problem, 0, &exchanged);
            // Without moves there is nothing to explain.
            let is_told = !motion.moves.is_empty() && motion.moves.len() >= measured.moves.len();
            let is_likely = || Weighed::of(&problem, &exchanged, &motion).explains(beyond_chance);
            return Some(if is_told && is_likely() {
                Self::Exchanged
            } else {
                Self::Sensitivity(Sensitivity::of(run, Sensor::Accel, axes, vec![factor]))
            });
        }
        if !run.recording.imu.has(Sensor::Gyro) {
            return None;
        }
        let mounting = Mounting::likeliest(problem, run, &measured);
        let misses = measured.misses_a_turn(WIDEST_TOLERANCE / 2.0);
        if mounting.is_none() && (stated.is_explained || !misses) {
            return None;
        }
        // Three quarters of a turn equal a quarter the other way: if hypotheses are equally likely, the axes are
        // reported.
        let least = mounting.as_ref().map_or(beyond_chance, |mounting| {
            let axes = (TooSmall::CARELESS, mounting.orders);
            sum(&parts(problem, run, &measured, axes)) + TOLD_APART.ln()
        });
        let sensitivity = Axes::ALL.into_iter().find_map(|axes| {
            let rival = |factor| {
                let rival = less_sensitive(run, axes, factor);
                let motion = Motion::of(problem, recording, &rival);
                (rival, motion)
            };
            let tried = factors(|factor| {
                let (rival, motion) = rival(factor);
                sum(&parts(problem, &rival, &motion, (TooSmall::ANY, AS_STATED)))
            });
            let (factor, _) = *tried.first()?;
            let factors = told_apart(&tried);
            let is_likely = || {
                let (rival, motion) = rival(factor);
                Weighed::of(problem, &rival, &motion).explains(least)
            };
            let is_another = stated.is_nothing || is_another(run, Sensor::Gyro, factor);
            let is_told = factors.len() <= 1 + OTHERS && is_another;
            (is_told && is_likely()).then(|| Sensitivity::of(run, Sensor::Gyro, axes, factors))
        });
        let sensitivity = sensitivity.map(Self::Sensitivity);
        sensitivity
            .or(mounting.map(Self::Axes))
            .or(stated.is_nothing.then_some(Self::Unexplained))
    }
}

/// Whether a triad this many times as sensitive as stated has a different sensitivity, rather than too small a prior.
fn is_another(run: &Run, sensor: Sensor, factor: f64) -> bool {
    let prior = run.instrument.prior.get(sensor);
    let mut sigma = prior.scale_sigma.max();
    if sensor == Sensor::Accel {
        sigma = sigma.hypot(prior.bias_sigma.max() / run.site.gravity);
    }
    is_beyond_tolerance(factor, sigma)
}

/// Whether a sensitivity that is this many times the stated one means that the statement is wrong, and not only that
/// the relative prior σ is too small.
pub fn is_beyond_tolerance(factor: f64, sigma: f64) -> bool {
    factor.abs().ln().abs() > (CARELESS * sigma).clamp(WIDEST_TOLERANCE, NEXT_RANGE.ln())
}

/// The accelerometers whose specific force at rest does not match gravity, with the ratio.
///
/// If the attitudes separate the axes, the ellipsoid of all dwells gives the sensitivity of each, beside its bias;
/// otherwise the magnitude gives that of the triad.
fn by_magnitude(run: &Run, motion: &Motion) -> Option<(Axes, f64)> {
    let mut forces: Vec<Vector3<f64>> = motion.rests.iter().map(|rest| rest.accel.found).collect();
    if forces.is_empty() {
        let imu = &run.recording.imu;
        let rates = imu.accel.iter().map(|sample| sample / imu.period);
        forces = rates.map(|force| force / run.site.gravity).collect();
    }
    let is_another = |factor: &f64| is_another(run, Sensor::Accel, *factor);
    let ellipsoid = ellipsoid(&forces, 6).or_else(|| ellipsoid(&forces, 3));
    if let Some((centre, each)) = ellipsoid {
        let others: Vec<usize> = (0..3).filter(|&axis| is_another(&each[axis])).collect();
        if let [axis] = others[..] {
            return Some((Axes::One(axis), each[axis]));
        }
        forces.iter_mut().for_each(|force| *force -= centre);
    }
    let magnitude = median(&mut forces.iter().map(Vector3::norm).collect::<Vec<_>>())?;
    is_another(&magnitude).then_some((Axes::All, magnitude))
}

/// Smallest eigenvalue of the correlations of the unknowns of an ellipsoid. Forces that are known to a thousandth give
/// its axes to a few hundredths, and a different sensitivity is a tenth or more.
const TOLD: f64 = 1e-3;

/// Centre and half axes of the ellipsoid `Σ a_i f_i² + b_i f_i = 1` through forces, with `b` (six unknowns) or about
/// zero (three); `None` if they do not show it.
fn ellipsoid(forces: &[Vector3<f64>], unknowns: usize) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let entry = |row: usize, k: usize| forces[row][k % 3].powi(if k < 3 { 2 } else { 1 });
    let mut design = DMatrix::from_fn(forces.len(), unknowns, entry);
    let sizes: Vec<f64> = design
        .column_iter_mut()
        .map(|mut column| column.normalize_mut())
        .collect();
    let correlations = design.tr_mul(&design);
    if !correlations.iter().all(|of| of.is_finite()) {
        return None;
    }
    let is_told = correlations.symmetric_eigenvalues().min() > TOLD;
    let right = design.tr_mul(&DVector::repeat(forces.len(), 1.0));
    let found = correlations.cholesky().filter(|_| is_told)?.solve(&right);
    let found: Vec<f64> = found
        .iter()
        .zip(sizes)
        .map(|(of, size)| of / size)
        .collect();
    let squares = Vector3::from_column_slice(&found[..3]);
    if squares.min() <= 0.0 {
        return None;
    }
    let centre = Vector3::from_fn(|k, _| found.get(k + 3).map_or(0.0, |b| -b / (2.0 * squares[k])));
    let beyond = 1.0 + centre.component_mul(&centre).dot(&squares);
    Some((centre, squares.map(|a| (beyond / a).sqrt())))
}

/// The most likely factor, and others that are hardly less likely and distinct.
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

/// The tested gyro sensitivities with the log-likelihood of each, the most likely first, accurate to a thousandth.
fn factors(log_likelihood: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let reach = (WIDEST.ln() / STEP.ln()) as i32;
    let weighed = |factor| (factor, log_likelihood(factor));
    let mut tried: Vec<_> = (-reach..=reach).map(|k| weighed(STEP.powi(k))).collect();
    let mut step = STEP.sqrt();
    while step > 1.001 {
        tried.sort_by(|a, b| b.1.total_cmp(&a.1));
        tried.extend([tried[0].0 / step, tried[0].0 * step].map(weighed));
        step = step.sqrt();
    }
    tried.sort_by(|a, b| b.1.total_cmp(&a.1));
    tried
}

/// Copy of the run with the sensitivity of these gyros multiplied by `factor`.
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

/// A run with the columns of its triads swapped.
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

/// A statement or an alternative, weighted by the likelihood of the resulting motion.
struct Weighed {
    /// Log-likelihood with noise and prior close to the stated ones.
    log_likelihood: f64,
    /// Whether the hypothesis is more likely than no explanation, and hardly more likely with any other noise and
    /// prior.
    is_explained: bool,
    /// Whether the hypothesis is less likely than no explanation for any noise and prior.
    is_nothing: bool,
}

impl Weighed {
    fn of(problem: &Problem, run: &Run, motion: &Motion) -> Self {
        let parts = |too_small| parts(problem, run, motion, (too_small, AS_STATED));
        let is_nothing = |parts: &[Part]| parts.iter().any(|part| part.of < part.none);
        let (careless, any) = (parts(TooSmall::CARELESS), parts(TooSmall::ANY));
        let log_likelihood = sum(&careless);
        Self {
            log_likelihood,
            is_explained: !is_nothing(&careless) && sum(&any) - log_likelihood < -FALSE_ALARMS.ln(),
            is_nothing: is_nothing(&any),
        }
    }

    /// Whether the hypothesis explains the motion and is more likely than this.
    fn explains(&self, least: f64) -> bool {
        self.is_explained && self.log_likelihood > least
    }
}

const AS_STATED: PerSensor<AxisOrder> = PerSensor {
    gyro: AxisOrder::IDENTITY,
    accel: AxisOrder::IDENTITY,
};

/// Likelihood of the motion with these axes, from all sources.
fn parts(
    problem: &Problem,
    run: &Run,
    motion: &Motion,
    (too_small, orders): (TooSmall, PerSensor<AxisOrder>),
) -> Vec<Part> {
    // The rate at rest scales with the trial factor, so it does not distinguish between factors.
    let mut motion = motion.clone();
    motion.upward = None;
    // The first order is as stated.
    let tried = if orders == AS_STATED { 1 } else { usize::MAX };
    let all: Vec<AxisOrder> = AxisOrder::all().take(tried).collect();
    Hypotheses::among(problem, run, &motion, &all, too_small).parts(&orders)
}

fn sum(parts: &[Part]) -> f64 {
    parts.iter().map(|part| part.of).sum()
}
