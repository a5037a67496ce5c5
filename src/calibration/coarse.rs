//! The coarse start: least squares over dwells and turns with known attitude.

use faer::Mat;
use faer::linalg::solvers::SolveLstsq;
use nalgebra::{SVector, Vector3};

use super::error::CalibrationError;
use super::outcome::{from_vector, to_vector};
use super::pass::singular;
use super::states::{PARAMETERS, ParameterVector, parameter};
use crate::attitude::log;
use crate::imu::{InstallationForm, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad};
use crate::navigation::{Block, Navigator, State};
use crate::run::{Dwell, Run};

/// Steps of Gauss–Newton at most; scale factors wrong by percents need three.
const STEPS: usize = 6;
/// A step below this (1 ppm, 0.2″, and as much of rad/s or m/s²) is no step.
const SMALL: f64 = 1e-6;
/// An instrument without noise is still not better than this, rad or m/s: an equation needs a σ.
const ROUNDING: f64 = 1e-9;

/// Both triads from the table's attitude alone: over each dwell the velocity must stay zero and the
/// attitude must stay; over each turn between two dwells the gyros must turn by what the table says.
/// The prior ties down what these do not see.
///
/// It is where the filter starts, not what it knows: the filter's prior stays its own.
///
/// # Errors
/// [`CalibrationError::Singular`] if data and prior do not fit each other.
pub fn coarse_start(
    run: &Run,
    dwells: &[Dwell],
    form: InstallationForm,
) -> Result<PerSensor<Triad>, CalibrationError> {
    let mean = run.prior_mean(form);
    let mut triads = mean;
    for _ in 0..STEPS {
        let mut equations = Equations::new(run, form, &to_vector(&mean), &to_vector(&triads));
        equations.add_legs(run, dwells, &triads)?;
        let step = equations.solve();
        if !step.iter().all(|v| v.is_finite()) {
            return Err(singular(&mean));
        }
        triads = from_vector(form, &(to_vector(&triads) + step));
        if step.amax() < SMALL {
            break;
        }
    }
    Ok(triads)
}

/// Linear equations for the step δθ of the estimated parameters, each row divided by its σ.
struct Equations {
    /// Indices of the parameters to be estimated.
    unknown: Vec<usize>,
    rows: Vec<(ParameterVector, f64)>,
}

impl Equations {
    /// The prior's equations.
    fn new(
        run: &Run,
        form: InstallationForm,
        prior: &ParameterVector,
        at: &ParameterVector,
    ) -> Self {
        let mut equations = Self {
            unknown: Vec::new(),
            rows: Vec::new(),
        };
        for sensor in Sensor::ALL {
            let sigma = run.prior.get(sensor).sigma(form);
            for (of_triad, &sigma) in sigma.iter().enumerate() {
                let index = parameter(sensor, of_triad);
                if sigma > 0.0 {
                    let mut row = ParameterVector::zeros();
                    row[index] = 1.0 / sigma;
                    equations.unknown.push(index);
                    equations
                        .rows
                        .push((row, (prior[index] - at[index]) / sigma));
                }
            }
        }
        equations
    }

    fn add_legs(
        &mut self,
        run: &Run,
        dwells: &[Dwell],
        triads: &PerSensor<Triad>,
    ) -> Result<(), CalibrationError> {
        let walk = PerSensor::from_fn(|sensor| run.noise.get(sensor).random_walk);
        let table = run.table.as_ref().ok_or(CalibrationError::NoTable)?;
        let attitude_variance = table.position_sigma.powi(2) + run.imu.pulse.gyro.powi(2) / 12.0;
        let at_rest = |dwell: &Dwell| {
            let state = State::at_rest(dwell.attitude);
            Navigator::new(&run.imu, &run.site, walk, triads, state).ok_or_else(|| singular(triads))
        };
        let mut before: Option<&Dwell> = None;
        for dwell in dwells {
            if let Some(before) = before {
                let turn = at_rest(before)?.advance(before.samples.end..dwell.samples.start);
                let variance = 2.0 * attitude_variance + walk.gyro.powi(2) * turn.duration;
                self.add(&turn, 0, attitude_error(&turn, dwell), variance);
            }
            let stand = at_rest(dwell)?.advance_standing(dwell.samples.clone());
            let duration = stand.duration;
            let pulses = run.imu.pulse.gyro.powi(2) / 6.0;
            let variance = pulses + walk.gyro.powi(2) * duration;
            self.add(&stand, 0, attitude_error(&stand, dwell), variance);
            // A tilt of the table turns gravity into velocity.
            let variance = (run.site.gravity * duration).powi(2) * attitude_variance
                + walk.accel.powi(2) * duration
                + run.imu.pulse.accel.powi(2) / 6.0;
            self.add(&stand, 3, stand.state.velocity, variance);
            before = Some(dwell);
        }
        Ok(())
    }

    /// Three equations: `error = Φ δθ` with rows of the block from `first` on.
    fn add(&mut self, block: &Block, first: usize, error: Vector3<f64>, variance: f64) {
        let weight = 1.0 / (variance + ROUNDING.powi(2)).sqrt();
        for axis in 0..3 {
            let mut row = ParameterVector::zeros();
            for sensor in Sensor::ALL {
                let part: SVector<f64, PER_TRIAD> =
                    block.parameters.get(sensor).row(first + axis).transpose();
                row.fixed_rows_mut::<PER_TRIAD>(parameter(sensor, 0))
                    .copy_from(&(part * weight));
            }
            self.rows.push((row, error[axis] * weight));
        }
    }

    fn solve(&self) -> ParameterVector {
        let a = Mat::from_fn(self.rows.len(), self.unknown.len(), |i, j| {
            self.rows[i].0[self.unknown[j]]
        });
        let b = Mat::from_fn(self.rows.len(), 1, |i, _| self.rows[i].1);
        let solution = a.qr().solve_lstsq(&b);
        let mut step = SVector::<f64, PARAMETERS>::zeros();
        for (j, &index) in self.unknown.iter().enumerate() {
            step[index] = solution[(j, 0)];
        }
        step
    }
}

/// φ of the block's end against the dwell's attitude.
fn attitude_error(block: &Block, dwell: &Dwell) -> Vector3<f64> {
    -log(&(block.state.attitude * dwell.attitude.transpose()))
}
