//! Gyros and attitudes from gravity's direction and the rates at rest.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::super::error::CalibrationError;
use super::super::linearisation::{Linearisation, singular};
use super::super::model::Model;
use super::super::parameters::{from_vector, to_vector};
use super::super::problem::{Problem, Stretch};
use super::equations::Equations;
use super::gravity::{add_magnitude, input_errors};
use super::heading::{Heading, Rest, gyrocompass};
use crate::attitude::{exp, level, skew, tilt};
use crate::earth::ROTATION_RATE;
use crate::imu::{PARAMETERS, PerSensor, Sensor, TermVector, Triad};
use crate::navigation::{Block, Navigator, State};
use crate::run::{Dwell, MeanOutput};

/// Attitudes, heading and gyros are found in turns, each from the others. Scale factors wrong by
/// percents need four rounds …
const ROUNDS_OF_GYROS: usize = 4;
/// … before the accelerometers may move, too.
const ROUNDS: usize = 8;

/// Both triads and attitudes as gravity and the rates at rest show them.
pub(super) struct Turned {
    /// The triads, and the attitude at the first sample of each stretch.
    pub at: Linearisation,
    /// 1σ of each heading, rad.
    pub heading_sigma: Vec<f64>,
    /// What they are found from, made at them.
    pub equations: Equations,
}

/// The gyros and the attitudes, and with them the accelerometers, whose installation the magnitude of
/// gravity alone shows badly where every dwell has an axis nearly up or down.
///
/// Over a move between two dwells the gyros must carry the direction of gravity from where the
/// accelerometers observed it before to where they observe it after; at rest they must sense Earth rate.
///
/// Source: Tedaldi, Pretto, Menegatti 2014, "A robust and easy to implement method for IMU calibration
/// without external equipments", ICRA, §IV, for the moves.
pub(super) fn triads_and_attitudes(
    problem: &Problem,
    triads: &PerSensor<Triad>,
) -> Result<Turned, CalibrationError> {
    let model = &problem.model;
    let stretches = problem.stretches();
    let directions = |triads: &PerSensor<Triad>| -> Result<Vec<Vec<Up>>, CalibrationError> {
        let stretches = stretches.iter();
        stretches.map(|s| gravity_directions(s, triads)).collect()
    };
    let rests = |stretch: &Stretch| -> Vec<MeanOutput> {
        let dwells = stretch.dwells.iter();
        dwells.map(|d| d.mean(Sensor::Gyro, stretch.run)).collect()
    };
    let rests: Vec<Vec<MeanOutput>> = stretches.iter().map(rests).collect();
    let mut at = Linearisation {
        triads: *triads,
        terms: TermVector::zeros(),
        initial_attitudes: directions(triads)?
            .iter()
            .map(|up| level(&up[0].direction))
            .collect(),
    };
    // Within Earth rate the output at rest is the bias.
    let outputs: Vector3<f64> = rests.iter().flatten().map(|rest| rest.output).sum();
    at.triads.gyro.bias = outputs / rests.iter().map(Vec::len).sum::<usize>() as f64;
    let mut round = 0;
    loop {
        let mut chains = Vec::new();
        let parts = stretches.iter().zip(directions(&at.triads)?);
        for ((stretch, up), attitude) in parts.zip(&mut at.initial_attitudes) {
            *attitude = exp(tilt(&(*attitude * up[0].direction))) * *attitude;
            chains.push(Chain::new(model, stretch, &at.triads, attitude, &up)?);
        }
        let correction = at.triads.gyro.correction();
        let correction = correction.ok_or_else(|| singular(&at.triads))?;
        let bias = at.triads.gyro.bias;
        let of_chains = chains.iter().zip(&rests).zip(stretches);
        let compass: Vec<_> = of_chains
            .map(|((chain, rests), s)| (s.run.site, chain.rests(&correction, &bias, rests)))
            .collect();
        let compass = gyrocompass(&compass);
        for ((chain, heading), attitude) in chains
            .iter_mut()
            .zip(&compass.headings)
            .zip(&mut at.initial_attitudes)
        {
            chain.turn(&heading.turn);
            *attitude = chain.attitudes[0];
        }
        at.triads.gyro.bias += at.triads.gyro.sensitivity() * compass.bias;
        let sensors = match round < ROUNDS_OF_GYROS {
            true => &[Sensor::Gyro][..],
            false => &Sensor::ALL,
        };
        let mut equations = Equations::new(model, &at.triads, sensors);
        if sensors.contains(&Sensor::Accel) {
            add_magnitude(&mut equations, problem, &at.triads)?;
        }
        let parts = chains.iter().zip(stretches).zip(&rests);
        for (((chain, stretch), rests), heading) in parts.zip(&compass.headings) {
            chain.add(&mut equations, stretch, &at.triads, rests, heading)?;
        }
        if round == ROUNDS {
            return Ok(Turned {
                at,
                heading_sigma: compass.headings.iter().map(|h| h.sigma).collect(),
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
    stretch: &Stretch,
    triads: &PerSensor<Triad>,
) -> Result<Vec<Up>, CalibrationError> {
    let triad = &triads.accel;
    let correction = triad.correction().ok_or_else(|| singular(triads))?;
    let direction = |dwell: &Dwell| {
        let output = dwell.mean(Sensor::Accel, stretch.run).output;
        let force = correction * (output - triad.bias);
        Up {
            direction: force.normalize(),
            error: input_errors(triad, &correction, &force) / force.norm(),
        }
    };
    Ok(stretch.dwells.iter().map(direction).collect())
}

/// Up, along body axes.
struct Up {
    direction: Vector3<f64>,
    /// Its error by the error of each accelerometer parameter; what is along it means nothing.
    error: SMatrix<f64, 3, PARAMETERS>,
}

/// Attitudes of all dwells of a stretch, one carried to the next by the gyros and levelled there.
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
        model: &Model,
        stretch: &Stretch,
        triads: &PerSensor<Triad>,
        attitude: &Matrix3<f64>,
        up: &[Up],
    ) -> Result<Self, CalibrationError> {
        let (run, dwells) = (stretch.run, &stretch.dwells);
        let walk = PerSensor::from_fn(|sensor| model.noise.get(sensor).random_walk);
        let mut attitudes = vec![*attitude];
        let mut turns = Vec::new();
        let of_gravity =
            |dwell: &Dwell| dwell.mean(Sensor::Accel, run).variance / run.site.gravity.powi(2);
        let legs = dwells.iter().zip(&dwells[1..]);
        for ((before, after), up) in legs.zip(up.iter().zip(&up[1..])) {
            let start = State::at_rest(attitudes[attitudes.len() - 1]);
            let block = Navigator::new(&run.recording.imu, &run.site, triads, start)
                .ok_or_else(|| singular(triads))?
                .advance(before.samples.end..after.samples.start);
            let tilt = tilt(&(block.state.attitude * up.1.direction));
            let attitude = exp(tilt) * block.state.attitude;
            let observed = attitude * up.1.error - start.attitude * up.0.error;
            attitudes.push(attitude);
            turns.push(Turn {
                tilt,
                of_accel: -skew(Vector3::z()) * observed,
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

    /// What the gyros say at rest in each dwell, corrected.
    fn rests(
        &self,
        correction: &Matrix3<f64>,
        bias: &Vector3<f64>,
        rests: &[MeanOutput],
    ) -> Vec<Rest> {
        let pairs = self.attitudes.iter().zip(rests);
        let rest = |(attitude, rest): (&Matrix3<f64>, &MeanOutput)| Rest {
            attitude: *attitude,
            rate: correction * (rest.output - bias),
            variance: rest.variance,
        };
        pairs.map(rest).collect()
    }

    /// Adds what moves and rates at rest say.
    fn add(
        &self,
        equations: &mut Equations,
        stretch: &Stretch,
        triads: &PerSensor<Triad>,
        rests: &[MeanOutput],
        heading: &Heading,
    ) -> Result<(), CalibrationError> {
        let triad = &triads.gyro;
        let correction = triad.correction().ok_or_else(|| singular(triads))?;
        // As much of Earth rate as heading may be wrong by, all of it at most.
        let of_heading = (ROTATION_RATE * heading.sigma.clamp(1e-3, 1.0)).powi(2);
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
            let error = rate - attitude.tr_mul(&stretch.run.site.earth_rate_n());
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
