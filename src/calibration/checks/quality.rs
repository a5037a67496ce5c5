//! Quality of a calibration, judged by references that do not require the truth: gravity and turns.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::attitude::{exp, level, log, tilt};
use crate::calibration::iterations::Solved;
use crate::calibration::linearisation::singular;
use crate::calibration::start::closed_form::six_position_by;
use crate::calibration::{
    CalibrationError, ClosedForm, Linearisation, Outcome, Problem, Reference, Stretch,
};
use crate::imu::{InstallationForm, PerSensor, Sensed, Sensor, TermVector, Triad};
use crate::navigation::{Navigator, State};
use crate::recording::LabelledMotion;
use crate::run::{Dwell, Run};
use crate::statistics::median;
use crate::units::MICRO_G;

/// Residuals of gravity and turns after a calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// Residuals over the whole recording.
    pub all: Measures,
    /// Cross-validation: residuals of a calibration without every other dwell, evaluated in the omitted dwells and the
    /// turns that end in them; `None` if the other dwells do not give a calibration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out: Option<Measures>,
    /// Residuals in each dwell.
    #[serde(skip)]
    pub dwells: Vec<DwellResidual>,
    /// Residuals in the excluded dwells, from the calibration without them.
    #[serde(skip)]
    pub held_out_dwells: Vec<DwellResidual>,
    /// Residuals in each dwell before calibration, that is, with nominal scales, no misalignments and no biases.
    #[serde(skip)]
    pub nominal_dwells: Vec<DwellResidual>,
}

/// Residuals in one dwell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DwellResidual {
    /// Number, from 1.
    pub number: usize,
    /// Magnitude of the mean specific force minus gravity, m/s².
    pub gravity: f64,
    /// Angle between the gravity direction measured by the accelerometers and the direction that the gyros carried over
    /// from the previous dwell, rad; `None` in the first dwell of a stretch.
    pub direction: Option<f64>,
}

/// Residuals in dwells and over turns.
#[derive(Debug, Clone, PartialEq)]
pub struct Residuals {
    dwells: Vec<DwellResidual>,
    /// Direction residuals, rad.
    turns: Vec<f64>,
}

impl Residuals {
    /// Medians of the magnitudes: gravity residuals as a fraction of gravity, and direction residuals as a fraction of
    /// a turn; `None` if there are no residuals.
    pub fn middle(&self) -> [Option<f64>; 2] {
        let gravity = self
            .dwells
            .iter()
            .map(|of| of.gravity.abs() / (1e6 * MICRO_G));
        let direction = self.dwells.iter().filter_map(|of| of.direction);
        [
            median(&mut gravity.collect::<Vec<_>>()),
            median(&mut direction.map(|angle| angle / TAU).collect::<Vec<_>>()),
        ]
    }

    fn measures(&self) -> Measures {
        Measures {
            gravity: self.dwells.iter().map(|of| of.gravity).collect(),
            direction: self.dwells.iter().filter_map(|of| of.direction).collect(),
            turns: self.turns.iter().copied().collect(),
        }
    }
}

impl Quality {
    fn new(all: Residuals, held_out: Option<Residuals>, nominal: Residuals) -> Self {
        Self {
            all: all.measures(),
            held_out: held_out.as_ref().map(Residuals::measures),
            dwells: all.dwells,
            held_out_dwells: held_out.map_or_else(Vec::new, |of| of.dwells),
            nominal_dwells: nominal.dwells,
        }
    }
}

/// Deviations from the references of a body at rest and in turns.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Measures {
    /// Magnitude of the mean specific force in each dwell minus gravity, m/s².
    #[serde(rename = "gravity_m_s2")]
    pub gravity: Spread,
    /// Angle in each dwell between the directions of gravity from the accelerometers and from the gyros, propagated
    /// from the previous dwell, rad.
    #[serde(rename = "direction_rad")]
    pub direction: Spread,
    /// Error of the gyros over a turn between two readings of the table, or about the axis of a
    /// labelled turn, rad.
    #[serde(rename = "turns_rad")]
    pub turns: Spread,
}

/// Statistics of the deviations of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Spread {
    /// Number of deviations; if zero, the other figures are also zero.
    pub count: usize,
    /// Root mean square of the deviations.
    pub rms: f64,
    /// The largest magnitude of a deviation.
    pub largest: f64,
}

impl FromIterator<f64> for Spread {
    fn from_iter<I: IntoIterator<Item = f64>>(departures: I) -> Self {
        let (mut count, mut sum, mut largest) = (0, 0.0, 0f64);
        for departure in departures {
            count += 1;
            sum += departure * departure;
            largest = largest.max(departure.abs());
        }
        Self {
            count,
            rms: (sum / count.max(1) as f64).sqrt(),
            largest,
        }
    }
}

impl Outcome {
    /// Residuals of gravity and turns over the whole recording.
    ///
    /// # Errors
    /// Returns [`CalibrationError`] if the outcome belongs to a different problem.
    pub(in crate::calibration) fn residuals(
        &self,
        problem: &Problem,
    ) -> Result<Residuals, CalibrationError> {
        let at = Linearisation {
            triads: self.estimate.triads,
            ..self.solved.estimate.clone()
        };
        residuals(problem, &at, |_| true)
    }

    /// The quality of this calibration of a problem.
    ///
    /// Cross-validation solves the chain without the rows of every other dwell, at the linearisation point of the last pass.
    ///
    /// # Errors
    /// Returns [`CalibrationError`] if the outcome belongs to a different problem.
    pub fn quality(&self, problem: &Problem) -> Result<Quality, CalibrationError> {
        let Solved {
            script, effects, ..
        } = &*self.solved;
        let enough = every_other(problem).is_some();
        // Half of the dwells may be too few.
        let half = enough.then_some(()).and_then(|()| {
            let chain = effects.chain(problem, script).ok()?;
            let half = chain.observed_in(|dwell| dwell % 2 == 0);
            let of_half = effects.weighed_anew(&half, problem, script).ok()?;
            let moved = of_half.filtered.moved(&script.at, &of_half.posterior);
            Some(moved)
        });
        let held_out = half.map(|half| residuals(problem, &half, |k| k % 2 == 1));
        // Only the instrument differs; the attitudes are the same.
        let nominal = nominal(self.solved.estimate.initial_attitudes.clone());
        let before = residuals(problem, &nominal, |_| true)?;
        let all = self.residuals(problem)?;
        Ok(Quality::new(all, held_out.transpose()?, before))
    }
}

impl ClosedForm {
    /// The quality of this calibration of a problem.
    ///
    /// For labelled sections, cross-validation uses the dwells without a label; otherwise every other dwell, as in
    /// [`Outcome::quality`].
    ///
    /// # Errors
    /// Returns [`CalibrationError`] if the closed form belongs to a different problem.
    pub fn quality(&self, problem: &Problem) -> Result<Quality, CalibrationError> {
        let run = problem.run();
        let of = |triads: &PerSensor<Triad>, judged: &dyn Fn(usize) -> bool| {
            let first = problem.stretches().iter();
            let initial = first.map(|s| first_attitude(s, triads));
            let initial = initial.collect::<Result<_, _>>()?;
            let at = Linearisation::new(*triads, TermVector::zeros(), initial);
            residuals(problem, &at, judged)
        };
        let before = of(&nominal(Vec::new()).triads, &|_| true)?;
        let all = of(&self.estimate.triads, &|_| true)?;
        let dwells: Vec<&Dwell> = problem.dwells().collect();
        let held_out = match self.reference {
            Reference::Labels if run.recording.imu.continuous => {
                let of_others = of(&self.estimate.triads, &|k| !labelled(run, dwells[k]))?;
                // Every labelled turn was used.
                let turns = Vec::new();
                Some(Residuals { turns, ..of_others })
            }
            Reference::Labels => None,
            reference => {
                let half = every_other(problem);
                // Half of the positions may be too few.
                let half = half.and_then(|half| six_position_by(reference, &half).ok());
                let half = half.map(|half| of(&half.estimate.triads, &|k| k % 2 == 1));
                half.transpose()?
            }
        };
        Ok(Quality::new(
            all,
            held_out.filter(|of| !of.dwells.is_empty()),
            before,
        ))
    }
}

/// A nominal instrument, with these first attitudes.
fn nominal(initial_attitudes: Vec<Matrix3<f64>>) -> Linearisation {
    let triads = PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General));
    Linearisation::new(triads, TermVector::zeros(), initial_attitudes)
}

/// The problem with every other dwell, from the first on; `None` if fewer than two remain, or if a stretch
/// has none.
fn every_other<'a>(problem: &Problem<'a>) -> Option<Problem<'a>> {
    let half = problem.observed_in(|k| k % 2 == 0);
    let empty = half.stretches().iter().any(|of| of.dwells.is_empty());
    (!empty && half.dwells().count() >= 2).then_some(half)
}

fn labelled(run: &Run, Dwell { samples, .. }: &Dwell) -> bool {
    run.recording.segments.iter().any(|segment| {
        let of = &segment.samples;
        segment.motion.is_some() && of.start < samples.end && samples.start < of.end
    })
}

/// The table attitude in the first dwell of a stretch or, without a table, a levelled attitude.
fn first_attitude(
    stretch: &Stretch,
    triads: &PerSensor<Triad>,
) -> Result<Matrix3<f64>, CalibrationError> {
    let Some(first) = stretch.dwells.first() else {
        return Ok(Matrix3::identity());
    };
    if let Some(position) = &first.position {
        return Ok(position.attitude);
    }
    let correction = triads.accel.correction().ok_or_else(|| singular(triads))?;
    let output = first.mean(Sensor::Accel, stretch.run).output;
    let up = correction * (output - triads.accel.bias);
    Ok(level(&up.normalize()))
}

/// Residuals in the evaluated dwells and in the turns that end in them.
fn residuals(
    problem: &Problem,
    at: &Linearisation,
    judged: impl Fn(usize) -> bool,
) -> Result<Residuals, CalibrationError> {
    let (mut dwells, mut turns) = (Vec::new(), Vec::new());
    let mut number = 0;
    for (stretch, initial) in problem.stretches().iter().zip(&at.initial_attitudes) {
        let run = stretch.run;
        let has_gyros = run.recording.imu.has(Sensor::Gyro);
        let during = |samples: &Range<usize>| {
            at.instrument(&problem.model, (run, stretch.recording), samples)
        };
        let mut carried = *initial;
        let mut before: Option<&Dwell> = None;
        for dwell in &stretch.dwells {
            let judged = judged(number);
            number += 1;
            let position = dwell.position.as_ref();
            if let Some(before) = before {
                let turn = before.samples.end..dwell.samples.start;
                let start = before.position.as_ref().map_or(carried, |p| p.attitude);
                carried = navigate(run, (at, &during(&turn)), start, turn)?;
                if let Some(position) = position.filter(|_| judged) {
                    turns.push(log(&(carried * position.attitude.transpose())).norm());
                }
            }
            let force = force_at_rest(run, dwell, (at, &during(&dwell.samples)), &carried)?;
            let off = tilt(&(carried * force));
            if judged {
                dwells.push(DwellResidual {
                    number,
                    gravity: force.norm() - run.site.gravity,
                    direction: before.filter(|_| has_gyros).map(|_| off.norm()),
                });
            }
            carried = exp(off) * carried;
            before = Some(dwell);
        }
    }
    turns.extend(labelled_turns(problem, at, judged)?);
    Ok(Residuals { dwells, turns })
}

/// Gyro angle minus labelled angle, rad, for labelled turns that end in evaluated dwells.
fn labelled_turns(
    problem: &Problem,
    at: &Linearisation,
    judged: impl Fn(usize) -> bool,
) -> Result<Vec<f64>, CalibrationError> {
    let run = problem.run();
    let imu = &run.recording.imu;
    let dwells: Vec<&Dwell> = problem.dwells().collect();
    let turns = run.recording.segments.iter().filter_map(|segment| {
        let Some(LabelledMotion::Turns { axis, angle }) = segment.motion else {
            return None;
        };
        let samples = &segment.samples;
        let last = samples.end.saturating_sub(1);
        let ends = |dwell: &&Dwell| dwell.samples.contains(&last);
        let of_judged = dwells.iter().position(ends).is_none_or(&judged);
        (of_judged && !imu.is_lost(samples)).then_some((axis, angle, samples))
    });
    let each = turns.map(|(axis, angle, samples)| {
        let triads = at.instrument(&problem.model, (run, 0), samples);
        let correction = triads.gyro.correction().ok_or_else(|| singular(&triads))?;
        let bias = triads.gyro.bias * (samples.len() as f64 * imu.period);
        Ok(axis.dot(&(correction * (imu.gyro.sum(samples.clone()) - bias))) - angle)
    });
    each.collect()
}

/// Attitude after these samples, propagated from an attitude before them.
fn navigate(
    run: &Run,
    (at, triads): (&Linearisation, &PerSensor<Triad>),
    from: Matrix3<f64>,
    samples: Range<usize>,
) -> Result<Matrix3<f64>, CalibrationError> {
    let (imu, state) = (&run.recording.imu, State::at_rest(from));
    let navigator = Navigator::new(imu, &run.site, triads, state);
    let on = (0..at.terms.len()).filter(|&k| at.terms[k] != 0.0);
    let navigator = navigator.ok_or_else(|| singular(triads))?;
    let block = navigator
        .with_terms(on.collect(), at.terms)
        .advance(samples);
    Ok(block.state.attitude)
}

/// Iterations for the force: a term changes the force on which it depends by at most a hundredth, so the remaining
/// error is a millionth of the force.
const ROUNDS: usize = 3;

/// Mean specific force along body axes over a dwell, with an approximate attitude, m/s².
fn force_at_rest(
    run: &Run,
    dwell: &Dwell,
    (at, triads): (&Linearisation, &PerSensor<Triad>),
    attitude: &Matrix3<f64>,
) -> Result<Vector3<f64>, CalibrationError> {
    let triad = &triads.accel;
    let correction = triad.correction().ok_or_else(|| singular(triads))?;
    let of_triad = correction * (dwell.mean(Sensor::Accel, run).output - triad.bias);
    let mut sensed = Sensed {
        rate: attitude.tr_mul(&run.site.earth_rate_n()),
        rate_over_earth: Vector3::zeros(),
        angular_acceleration: Vector3::zeros(),
        force: of_triad,
    };
    for _ in 0..ROUNDS {
        sensed.force = of_triad - sensed.added(Sensor::Accel, &at.terms);
    }
    Ok(sensed.force)
}
