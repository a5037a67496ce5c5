//! How well a calibration explains what is known without a truth: gravity, and turns.

use nalgebra::{Matrix3, Vector3};

use super::closed_form::{ClosedForm, Reference, six_position_by};
use super::error::CalibrationError;
use super::linearisation::{Linearisation, singular};
use super::outcome::Outcome;
use super::pass::{Gate, Mode, pass};
use super::problem::Problem;
use super::schedule::Schedule;
use crate::attitude::{exp, level, log, tilt};
use crate::imu::{FurtherVector, PerSensor, Sensed, Sensor, Triad};
use crate::navigation::{FurtherTerms, Navigator, State};
use crate::run::{Dwell, LabelledMotion, Run};

/// What a calibration leaves of gravity and of turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Over the whole record.
    pub all: Measures,
    /// By a calibration that did without every other dwell, over those dwells and the turns that end in
    /// them; none where the rest does not give a calibration.
    pub held_out: Option<Measures>,
}

/// Departures from what is known of a body that stands and turns.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Measures {
    /// Size of the mean specific force in each dwell less gravity, m/s².
    pub gravity: Spread,
    /// Angle in each dwell between gravity as the accelerometers see it and as the gyros carry it there
    /// from the dwell before, rad.
    pub direction: Spread,
    /// What the gyros are wrong by over a turn between two readings of the table, or about the axis of a
    /// labelled turn, rad.
    pub turns: Spread,
}

/// Several departures of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spread {
    /// How many.
    pub count: usize,
    /// Their root mean square.
    pub rms: f64,
    /// The largest, whatever its sign.
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
    /// The quality of this calibration of a run.
    ///
    /// What is held out is judged by one pass more, without the observations of every other dwell. It
    /// linearises where the last pass did; nothing else of that pass is in it.
    ///
    /// # Errors
    /// [`CalibrationError`] where the run is not the one of the outcome.
    pub fn quality(&self, run: &Run) -> Result<Quality, CalibrationError> {
        let dwells = run.dwells();
        let estimate = Linearisation {
            triads: self.estimate.triads,
            further: self.further.terms(),
            initial_attitude: self.linearised_at.initial_attitude,
        };
        let held_out = match every_other(&dwells) {
            None => None,
            Some(used) => {
                let schedule = Schedule::new(run, &used)?;
                let form = self.estimate.form();
                let velocity = self.velocity_sigma;
                let problem = Problem::new(run, schedule, form, self.prior_attitude, velocity);
                let mode = Mode::Held(Gate::Innovations);
                match pass(&problem, &self.linearised_at, mode) {
                    Ok(half) => Some(measures(run, &dwells, &half.estimate, |k| k % 2 == 1)?),
                    // Half the dwells may be too few.
                    Err(_) => None,
                }
            }
        };
        Ok(Quality {
            all: measures(run, &dwells, &estimate, |_| true)?,
            held_out,
        })
    }
}

impl ClosedForm {
    /// The quality of this calibration of a run.
    ///
    /// From labels, what is held out are dwells without a label; else every other dwell, as in
    /// [`Outcome::quality`].
    ///
    /// # Errors
    /// [`CalibrationError`] where the run is not the one of the closed form.
    pub fn quality(&self, run: &Run) -> Result<Quality, CalibrationError> {
        let dwells = run.rests();
        let of = |triads: &PerSensor<Triad>, judged: &dyn Fn(usize) -> bool| {
            let at = Linearisation {
                triads: *triads,
                further: FurtherVector::zeros(),
                initial_attitude: first_attitude(run, &dwells, triads)?,
            };
            measures(run, &dwells, &at, judged)
        };
        let all = of(&self.estimate.triads, &|_| true)?;
        let held_out = match self.reference {
            Reference::Labels if run.imu.continuous => {
                let unlabelled = |k: usize| !labelled(run, &dwells[k]);
                let measures = of(&self.estimate.triads, &unlabelled)?;
                // Every labelled turn was used.
                let turns = Spread::default();
                Some(Measures { turns, ..measures })
            }
            Reference::Labels => None,
            reference => {
                let form = self.estimate.form();
                let half = every_other(&dwells);
                let half = half.map(|used| six_position_by(reference, run, &used, form));
                match half {
                    Some(Ok(half)) => Some(of(&half.estimate.triads, &|k| k % 2 == 1)?),
                    // Half the positions may be too few.
                    Some(Err(_)) | None => None,
                }
            }
        };
        Ok(Quality {
            all,
            held_out: held_out.filter(|measures| measures.gravity.count > 0),
        })
    }
}

/// The dwells from the first on, leaving out every other; none if that leaves less than two.
fn every_other(dwells: &[Dwell]) -> Option<Vec<Dwell>> {
    let used: Vec<Dwell> = dwells.iter().step_by(2).cloned().collect();
    (used.len() >= 2).then_some(used)
}

fn labelled(run: &Run, dwell: &Dwell) -> bool {
    let Dwell { samples, .. } = dwell;
    run.segments.iter().any(|segment| {
        segment.motion.is_some()
            && segment.samples.start < samples.end
            && samples.start < segment.samples.end
    })
}

/// The table's attitude in the first dwell, or one of those in which it is level.
fn first_attitude(
    run: &Run,
    dwells: &[Dwell],
    triads: &PerSensor<Triad>,
) -> Result<Matrix3<f64>, CalibrationError> {
    let Some(first) = dwells.first() else {
        return Ok(Matrix3::identity());
    };
    if let Some(position) = &first.position {
        return Ok(position.attitude);
    }
    let correction = triads.accel.correction().ok_or_else(|| singular(triads))?;
    let output = first.mean(Sensor::Accel, run).output;
    let up = correction * (output - triads.accel.bias);
    Ok(level(&up.normalize()))
}

/// What a calibration leaves in the judged dwells and in the turns that end in them.
fn measures(
    run: &Run,
    dwells: &[Dwell],
    at: &Linearisation,
    judged: impl Fn(usize) -> bool,
) -> Result<Measures, CalibrationError> {
    let navigate = |attitude: Matrix3<f64>, samples| {
        let state = State::at_rest(attitude);
        let navigator =
            Navigator::new(&run.imu, &run.site, PerSensor::default(), &at.triads, state);
        let further = FurtherTerms {
            on: (0..at.further.len())
                .filter(|&k| at.further[k] != 0.0)
                .collect(),
            values: at.further,
        };
        let navigator = navigator.ok_or_else(|| singular(&at.triads))?;
        let block = navigator.with_further(further).advance(samples);
        Ok::<_, CalibrationError>(block.state.attitude)
    };
    let (mut gravity, mut direction, mut turns) = (Vec::new(), Vec::new(), Vec::new());
    let mut carried = at.initial_attitude;
    let mut before: Option<&Dwell> = None;
    for (k, dwell) in dwells.iter().enumerate() {
        let position = dwell.position.as_ref();
        if let Some(before) = before.filter(|_| run.imu.continuous) {
            let turn = before.samples.end..dwell.samples.start;
            let start = before.position.as_ref().map_or(carried, |p| p.attitude);
            carried = navigate(start, turn)?;
            if let Some(position) = position.filter(|_| judged(k)) {
                turns.push(log(&(carried * position.attitude.transpose())).norm());
            }
        }
        let force = force_at_rest(run, dwell, at, &carried)?;
        let off = tilt(&(carried * force));
        if judged(k) {
            gravity.push(force.norm() - run.site.gravity);
            if before.is_some() && run.imu.continuous {
                direction.push(off.norm());
            }
        }
        carried = exp(off) * carried;
        before = Some(dwell);
    }
    for segment in &run.segments {
        let ends = |dwell: &Dwell| {
            dwell
                .samples
                .contains(&segment.samples.end.saturating_sub(1))
        };
        let of_judged = dwells.iter().position(ends).is_none_or(&judged);
        if let Some(LabelledMotion::Turns { axis, angle }) = segment.motion
            && of_judged
            && !run.imu.is_lost(&segment.samples)
        {
            let triad = &at.triads.gyro;
            let correction = triad.correction().ok_or_else(|| singular(&at.triads))?;
            let sum: Vector3<f64> = run.imu.gyro[segment.samples.clone()].iter().sum();
            let duration = segment.samples.len() as f64 * run.imu.period;
            turns.push(axis.dot(&(correction * (sum - triad.bias * duration))) - angle);
        }
    }
    Ok(Measures {
        gravity: gravity.into_iter().collect(),
        direction: direction.into_iter().collect(),
        turns: turns.into_iter().collect(),
    })
}

/// A term changes the force that it responds to by a hundredth at most, so three rounds leave a millionth
/// of it.
const ROUNDS: usize = 3;

/// Mean specific force along body axes over a dwell at about this attitude, m/s².
fn force_at_rest(
    run: &Run,
    dwell: &Dwell,
    at: &Linearisation,
    attitude: &Matrix3<f64>,
) -> Result<Vector3<f64>, CalibrationError> {
    let triad = &at.triads.accel;
    let correction = triad.correction().ok_or_else(|| singular(&at.triads))?;
    let of_triad = correction * (dwell.mean(Sensor::Accel, run).output - triad.bias);
    let mut sensed = Sensed {
        rate: attitude.tr_mul(&run.site.earth_rate_n()),
        rate_over_earth: Vector3::zeros(),
        angular_acceleration: Vector3::zeros(),
        force: of_triad,
    };
    for _ in 0..ROUNDS {
        sensed.force = of_triad - sensed.added(Sensor::Accel, &at.further);
    }
    Ok(sensed.force)
}
