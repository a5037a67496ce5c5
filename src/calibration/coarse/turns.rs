//! Gyros and attitude from gravity's direction and the rates at rest.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::super::error::CalibrationError;
use super::super::linearisation::{Linearisation, singular};
use super::super::outcome::{from_vector, to_vector};
use super::equations::Equations;
use super::gravity::{add_size, input_errors};
use super::heading::{Gyrocompass, Rest, gyrocompass};
use crate::attitude::{exp, level, skew, tilt};
use crate::earth::ROTATION_RATE;
use crate::imu::{FurtherVector, PARAMETERS, PerSensor, Sensor, Triad};
use crate::navigation::{Block, Navigator, State};
use crate::run::{Dwell, MeanOutput, Run};

/// Attitudes, heading and gyros are found in turns, each from the others. Scale factors wrong by
/// percents need four rounds …
const ROUNDS_OF_GYROS: usize = 4;
/// … before the accelerometers may move, too.
const ROUNDS: usize = 8;

/// Both triads and attitude as gravity and the rates at rest show them.
pub(super) struct Turned {
    /// The triads, and the attitude at the first sample of the first dwell.
    pub at: Linearisation,
    /// 1σ of its heading, rad.
    pub heading_sigma: f64,
    /// What they are found from, made at them.
    pub equations: Equations,
}

/// The gyros and the attitude, and with them the accelerometers, whose installation the size of gravity
/// alone shows badly where every dwell has an axis nearly up or down.
///
/// Over a turn between two dwells the gyros must carry the direction of gravity from where the
/// accelerometers saw it before to where they see it after; at rest they must sense Earth rate.
///
/// Source: Tedaldi, Pretto, Menegatti 2014, "A robust and easy to implement method for IMU calibration
/// without external equipments", ICRA, §IV, for the turns.
pub(super) fn triads_and_attitude(
    run: &Run,
    dwells: &[Dwell],
    triads: &PerSensor<Triad>,
) -> Result<Turned, CalibrationError> {
    let up = gravity_directions(run, dwells, triads)?;
    let rests: Vec<MeanOutput> = dwells
        .iter()
        .map(|dwell| dwell.mean(Sensor::Gyro, run))
        .collect();
    let mut at = Linearisation {
        triads: *triads,
        further: FurtherVector::zeros(),
        initial_attitude: level(&up[0].direction),
    };
    // Within Earth rate the output at rest is the bias.
    let outputs: Vector3<f64> = rests.iter().map(|rest| rest.output).sum();
    at.triads.gyro.bias = outputs / rests.len() as f64;
    let mut round = 0;
    loop {
        let up = gravity_directions(run, dwells, &at.triads)?;
        at.initial_attitude =
            exp(tilt(&(at.initial_attitude * up[0].direction))) * at.initial_attitude;
        let mut chain = Chain::new(run, dwells, &at, &up)?;
        let compass = chain.gyrocompass(run, &at.triads, &rests)?;
        chain.turn(&compass.turn);
        at.initial_attitude = chain.attitudes[0];
        at.triads.gyro.bias += at.triads.gyro.sensitivity() * compass.bias;
        let equations = if round < ROUNDS_OF_GYROS {
            let mut equations = Equations::new(run, &at.triads, &[Sensor::Gyro]);
            chain.add(&mut equations, run, &at.triads, &rests, &compass)?;
            equations
        } else {
            let mut equations = Equations::new(run, &at.triads, &Sensor::ALL);
            add_size(&mut equations, run, dwells, &at.triads)?;
            chain.add(&mut equations, run, &at.triads, &rests, &compass)?;
            equations
        };
        if round == ROUNDS {
            return Ok(Turned {
                at,
                heading_sigma: compass.sigma,
                equations,
            });
        }
        let step = equations.solve();
        if !step.iter().all(|v| v.is_finite()) {
            return Err(singular(triads));
        }
        at.triads = from_vector(at.triads.gyro.form, &(to_vector(&at.triads) + step));
        round += 1;
    }
}

/// Direction of specific force along body axes in each dwell, and with it Up.
fn gravity_directions(
    run: &Run,
    dwells: &[Dwell],
    triads: &PerSensor<Triad>,
) -> Result<Vec<Up>, CalibrationError> {
    let triad = &triads.accel;
    let correction = triad.correction().ok_or_else(|| singular(triads))?;
    let direction = |dwell: &Dwell| {
        let output = dwell.mean(Sensor::Accel, run).output;
        let force = correction * (output - triad.bias);
        Up {
            direction: force.normalize(),
            error: input_errors(triad, &correction, &force) / force.norm(),
        }
    };
    Ok(dwells.iter().map(direction).collect())
}

/// Up, along body axes.
struct Up {
    direction: Vector3<f64>,
    /// Its error by the error of each accelerometer parameter; what is along it means nothing.
    error: SMatrix<f64, 3, PARAMETERS>,
}

/// Attitudes of all dwells, one carried to the next by the gyros and levelled there.
struct Chain {
    attitudes: Vec<Matrix3<f64>>,
    turns: Vec<Turn>,
}

struct Turn {
    block: Block,
    /// The tilt that the gyros are wrong by after it, `C_computed = (I − [φ×]) C_true`.
    tilt: Vector3<f64>,
    /// The tilt by the error of each accelerometer parameter, which tells Up before and after it.
    of_accel: SMatrix<f64, 3, PARAMETERS>,
    /// Variance of each of its two components.
    variance: f64,
}

impl Chain {
    fn new(
        run: &Run,
        dwells: &[Dwell],
        at: &Linearisation,
        up: &[Up],
    ) -> Result<Self, CalibrationError> {
        let walk = PerSensor::from_fn(|sensor| run.noise.get(sensor).random_walk);
        let mut attitudes = vec![at.initial_attitude];
        let mut turns = Vec::new();
        let of_gravity =
            |dwell: &Dwell| dwell.mean(Sensor::Accel, run).variance / run.site.gravity.powi(2);
        let legs = dwells.iter().zip(&dwells[1..]);
        for ((before, after), up) in legs.zip(up.iter().zip(&up[1..])) {
            let start = State::at_rest(attitudes[attitudes.len() - 1]);
            let block = Navigator::new(&run.imu, &run.site, walk, &at.triads, start)
                .ok_or_else(|| singular(&at.triads))?
                .advance(before.samples.end..after.samples.start);
            let tilt = tilt(&(block.state.attitude * up.1.direction));
            let attitude = exp(tilt) * block.state.attitude;
            let seen = attitude * up.1.error - start.attitude * up.0.error;
            attitudes.push(attitude);
            turns.push(Turn {
                tilt,
                of_accel: -skew(Vector3::z()) * seen,
                variance: walk.gyro.powi(2) * block.duration
                    + of_gravity(before)
                    + of_gravity(after),
                block,
            });
        }
        Ok(Self { attitudes, turns })
    }

    fn turn(&mut self, turn: &Matrix3<f64>) {
        for attitude in &mut self.attitudes {
            *attitude = turn * *attitude;
        }
        for Turn {
            block,
            tilt,
            of_accel,
            ..
        } in &mut self.turns
        {
            *tilt = turn * *tilt;
            *of_accel = turn * *of_accel;
            for mut column in block.parameters.gyro.column_iter_mut() {
                let turned = turn * column.fixed_rows::<3>(0);
                column.fixed_rows_mut::<3>(0).copy_from(&turned);
            }
        }
    }

    fn gyrocompass(
        &self,
        run: &Run,
        triads: &PerSensor<Triad>,
        rests: &[MeanOutput],
    ) -> Result<Gyrocompass, CalibrationError> {
        let correction = triads.gyro.correction().ok_or_else(|| singular(triads))?;
        let rests: Vec<Rest> = self
            .attitudes
            .iter()
            .zip(rests)
            .map(|(attitude, rest)| Rest {
                attitude: *attitude,
                rate: correction * (rest.output - triads.gyro.bias),
                variance: rest.variance,
            })
            .collect();
        Ok(gyrocompass(&rests, &run.site))
    }

    /// Adds what turns and rates at rest say.
    fn add(
        &self,
        equations: &mut Equations,
        run: &Run,
        triads: &PerSensor<Triad>,
        rests: &[MeanOutput],
        compass: &Gyrocompass,
    ) -> Result<(), CalibrationError> {
        let triad = &triads.gyro;
        let correction = triad.correction().ok_or_else(|| singular(triads))?;
        // As much of Earth rate as heading may be wrong by, all of it at most.
        let of_heading = (ROTATION_RATE * compass.sigma.clamp(1e-3, 1.0)).powi(2);
        for turn in &self.turns {
            let variance = turn.variance + of_heading * turn.block.duration.powi(2);
            for axis in 0..2 {
                let of_gyro = turn.block.parameters.gyro.row(axis).transpose();
                let of_accel = turn.of_accel.row(axis).transpose();
                let rows = [(Sensor::Gyro, of_gyro), (Sensor::Accel, of_accel)];
                equations.add(&rows, turn.tilt[axis], variance);
            }
        }
        for (attitude, rest) in self.attitudes.iter().zip(rests) {
            let rate = correction * (rest.output - triad.bias);
            let error = rate - attitude.tr_mul(&run.site.earth_rate_n());
            let errors = input_errors(triad, &correction, &rate);
            for axis in 0..3 {
                let row = errors.row(axis).transpose();
                let variance = rest.variance + of_heading;
                equations.add(&[(Sensor::Gyro, row)], error[axis], variance);
            }
        }
        Ok(())
    }
}
