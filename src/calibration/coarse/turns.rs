//! Gyros and attitude from gravity's direction and the rates at rest.

use nalgebra::{Matrix3, Vector3};

use super::super::error::CalibrationError;
use super::super::linearisation::{Linearisation, singular};
use super::super::outcome::{from_vector, to_vector};
use super::equations::Equations;
use super::heading::{Gyrocompass, Rest, gyrocompass};
use crate::attitude::{exp, tilt};
use crate::earth::ROTATION_RATE;
use crate::imu::{FurtherVector, PerSensor, Sensor, Triad, TriadVector};
use crate::navigation::{Block, Navigator, State};
use crate::run::{Dwell, MeanOutput, Run};

/// Attitudes, heading and gyros are found in turns, each from the others. Scale factors wrong by
/// percents need four rounds.
const ROUNDS: usize = 6;

/// Gyros and attitude as gravity and the rates at rest show them.
pub(super) struct Gyros {
    /// The triads, and the attitude at the first sample of the first dwell.
    pub at: Linearisation,
    /// 1σ of its heading, rad.
    pub heading_sigma: f64,
    /// What they are found from, made at them.
    pub equations: Equations,
}

/// The gyros and the attitude.
///
/// Over a turn between two dwells the gyros must carry the direction of gravity from where the
/// accelerometers saw it before to where they see it after; at rest they must sense Earth rate.
///
/// Source: Tedaldi, Pretto, Menegatti 2014, "A robust and easy to implement method for IMU calibration
/// without external equipments", ICRA, §IV, for the turns.
pub(super) fn gyros_and_attitude(
    run: &Run,
    dwells: &[Dwell],
    triads: &PerSensor<Triad>,
) -> Result<Gyros, CalibrationError> {
    let up = gravity_directions(run, dwells, triads)?;
    let rests: Vec<MeanOutput> = dwells
        .iter()
        .map(|dwell| dwell.mean(Sensor::Gyro, run))
        .collect();
    let mut at = Linearisation {
        triads: *triads,
        further: FurtherVector::zeros(),
        initial_attitude: level(&up[0]),
    };
    // Within Earth rate the output at rest is the bias.
    let outputs: Vector3<f64> = rests.iter().map(|rest| rest.output).sum();
    at.triads.gyro.bias = outputs / rests.len() as f64;
    let mut round = 0;
    loop {
        let mut chain = Chain::new(run, dwells, &at, &up)?;
        let compass = chain.gyrocompass(run, &at.triads, &rests)?;
        chain.turn(&compass.turn);
        at.initial_attitude = chain.attitudes[0];
        at.triads.gyro.bias += at.triads.gyro.sensitivity() * compass.bias;
        let equations = chain.equations(run, &at.triads, &rests, &compass)?;
        if round == ROUNDS {
            return Ok(Gyros {
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
) -> Result<Vec<Vector3<f64>>, CalibrationError> {
    let triad = &triads.accel;
    let correction = triad.correction().ok_or_else(|| singular(triads))?;
    let direction = |dwell: &Dwell| {
        let output = dwell.mean(Sensor::Accel, run).output;
        (correction * (output - triad.bias)).normalize()
    };
    Ok(dwells.iter().map(direction).collect())
}

/// Some attitude in which this direction along body axes is up.
fn level(up: &Vector3<f64>) -> Matrix3<f64> {
    let across = Vector3::ith(up.iamin(), 1.0);
    let east = across.cross(up).normalize();
    Matrix3::from_rows(&[
        east.transpose(),
        up.cross(&east).transpose(),
        up.transpose(),
    ])
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
    /// Variance of each of its two components.
    variance: f64,
}

impl Chain {
    fn new(
        run: &Run,
        dwells: &[Dwell],
        at: &Linearisation,
        up: &[Vector3<f64>],
    ) -> Result<Self, CalibrationError> {
        let walk = PerSensor::from_fn(|sensor| run.noise.get(sensor).random_walk);
        let mut attitudes = vec![at.initial_attitude];
        let mut turns = Vec::new();
        let of_gravity =
            |dwell: &Dwell| dwell.mean(Sensor::Accel, run).variance / run.site.gravity.powi(2);
        for ((before, after), up) in dwells.iter().zip(&dwells[1..]).zip(&up[1..]) {
            let start = State::at_rest(attitudes[attitudes.len() - 1]);
            let block = Navigator::new(&run.imu, &run.site, walk, &at.triads, start)
                .ok_or_else(|| singular(&at.triads))?
                .advance(before.samples.end..after.samples.start);
            let tilt = tilt(&(block.state.attitude * up));
            attitudes.push(exp(tilt) * block.state.attitude);
            turns.push(Turn {
                tilt,
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
        for Turn { block, tilt, .. } in &mut self.turns {
            *tilt = turn * *tilt;
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

    fn equations(
        &self,
        run: &Run,
        triads: &PerSensor<Triad>,
        rests: &[MeanOutput],
        compass: &Gyrocompass,
    ) -> Result<Equations, CalibrationError> {
        let mut equations = Equations::new(run, triads, &[Sensor::Gyro]);
        let triad = &triads.gyro;
        let correction = triad.correction().ok_or_else(|| singular(triads))?;
        let response = triad.response();
        // As much of Earth rate as heading may be wrong by, all of it at most.
        let of_heading = (ROTATION_RATE * compass.sigma.clamp(1e-3, 1.0)).powi(2);
        for turn in &self.turns {
            let variance = turn.variance + of_heading * turn.block.duration.powi(2);
            for axis in 0..2 {
                let row: TriadVector = turn.block.parameters.gyro.row(axis).transpose();
                equations.add(Sensor::Gyro, &row, turn.tilt[axis], variance);
            }
        }
        for (attitude, rest) in self.attitudes.iter().zip(rests) {
            let rate = correction * (rest.output - triad.bias);
            let error = rate - attitude.tr_mul(&run.site.earth_rate_n());
            for axis in 0..3 {
                let row = TriadVector::from_fn(|p, _| {
                    (correction * (response[p] * rate.push(1.0)))[axis]
                });
                let variance = rest.variance + of_heading;
                equations.add(Sensor::Gyro, &row, error[axis], variance);
            }
        }
        Ok(equations)
    }
}
