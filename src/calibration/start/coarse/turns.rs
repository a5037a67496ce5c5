//! Gyros and attitudes from gravity's direction and the rates at rest.

use std::sync::Arc;

use nalgebra::{DMatrix, Matrix3, SMatrix, Vector3};

use super::equations::{Equations, ErrorOf};
use super::gravity::{add_magnitude, input_errors, size_of_force};
use super::heading::{Heading, Rest, gyro_bias_at_rest, gyrocompass};
use super::shared_noise::{SharedNoise, along, of_biases};
use crate::attitude::{exp, level, skew, tilt};
use crate::calibration::error::CalibrationError;
use crate::calibration::linearisation::{Linearisation, singular};
use crate::calibration::model::Model;
use crate::calibration::noise::{BY_HAND, Source};
use crate::calibration::parameters::{from_vector, to_vector};
use crate::calibration::problem::{Problem, Stretch};
use crate::earth::ROTATION_RATE;
use crate::imu::{PARAMETERS, PerSensor, Sensor, TermVector, Triad};
use crate::navigation::{Block, Navigator, ProcessNoise, State};
use crate::run::{Dwell, MeanOutput};

/// Attitudes, heading and gyros are found in turns, each from the others. Scale factors wrong by
/// percents need four rounds …
const ROUNDS_OF_GYROS: usize = 4;
/// … before the accelerometers may move, too.
const ROUNDS: usize = 8;

/// Both triads and attitudes as gravity and the rates at rest show them.
pub struct Turned {
    /// The triads, and the attitude at the first sample of each stretch.
    pub at: Linearisation,
    /// 1σ of each heading, rad.
    pub heading_sigma: Vec<f64>,
    /// What they are found from, made at them.
    pub equations: Equations,
}

impl Turned {
    /// Covariance of what the errors of the equations share.
    pub fn shared(&self, problem: &Problem) -> DMatrix<f64> {
        let headings: Vec<f64> = self
            .heading_sigma
            .iter()
            .copied()
            .map(known_heading)
            .collect();
        SharedNoise::of(problem).covariance(problem, &headings)
    }
}

/// The gyros and the attitudes, and with them the accelerometers, whose installation the magnitude of
/// gravity alone shows badly where every dwell has an axis nearly up or down.
///
/// Over a move between two dwells the gyros must carry the direction of gravity from where the
/// accelerometers observed it before to where they observe it after; at rest they must sense Earth rate.
///
/// Source: Tedaldi, Pretto, Menegatti 2014, "A robust and easy to implement method for IMU calibration
/// without external equipments", ICRA, §IV, for the moves.
pub fn triads_and_attitudes(
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
    let initial = directions(triads)?;
    let initial = initial.iter().map(|up| level(&up[0].direction)).collect();
    let mut at = Linearisation::new(*triads, TermVector::zeros(), initial);
    at.triads.gyro.bias = gyro_bias_at_rest(problem);
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
        let compass = gyrocompass(&compass).ok_or_else(|| singular(&at.triads))?;
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
        let mut place = Place {
            shared: SharedNoise::of(problem),
            first: 0,
            stretch: 0,
        };
        let parts = chains.iter().zip(stretches).zip(&rests);
        for (((chain, stretch), rests), heading) in parts.zip(&compass.headings) {
            chain.add(&mut equations, stretch, &at.triads, rests, heading, &place)?;
            place.first += rests.len();
            place.stretch += 1;
        }
        if round == ROUNDS {
            let heading_sigma: Vec<f64> = compass.headings.iter().map(|h| h.sigma).collect();
            return Ok(Turned {
                at,
                heading_sigma,
                equations,
            });
        }
        let step = equations.solve()?;
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
        let size = size_of_force(&force)?;
        Ok(Up {
            direction: force / size,
            error: input_errors(triad, &correction, &force) / size,
        })
    };
    stretch.dwells.iter().map(direction).collect()
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
    /// How long each dwell lasts, s.
    durations: Vec<f64>,
    /// Variance by which a hand turns the body in a second of a dwell, rad²/s.
    turning: f64,
}

struct Turn {
    block: Block,
    /// The tilt that the gyros are wrong by after it, `C_computed = (I − [φ×]) C_true`.
    tilt: Vector3<f64>,
    /// The tilt by the error of each accelerometer parameter, which tells Up before …
    of_before: SMatrix<f64, 3, PARAMETERS>,
    /// … and after it.
    of_after: SMatrix<f64, 3, PARAMETERS>,
    /// Variance of each of its two components, by noise and interpolation of the gyros …
    walk: f64,
    /// … by each of [`BY_HAND`] where that is one …
    by_hand: [f64; BY_HAND.len()],
    /// … and the first with that of Up.
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
        let noise = model.process_noise();
        let turning = model.turning_at_rest.powi(2);
        let duration = |dwell: &Dwell| {
            let [begin, end] = dwell.times(run);
            end - begin
        };
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
            let level = -skew(Vector3::z());
            // East and North: alike but for what is interpolated.
            let level_variance = |noise: &PerSensor<ProcessNoise>| {
                let drifted = block.noise.covariance(noise);
                0.5 * (drifted[(0, 0)] + drifted[(1, 1)])
            };
            let walk = level_variance(&noise);
            let interpolated = level_variance(&PerSensor::default());
            // Up is that of the middle of a dwell, from whose end the gyros carry it.
            let held = (duration(before) + duration(after)) / 3.0;
            let by_hand = BY_HAND.map(|source| match source {
                Source::Turning => held,
                _ => level_variance(&source.alone()) - interpolated,
            });
            let walk = walk + turning * held;
            attitudes.push(attitude);
            turns.push(Turn {
                tilt,
                of_before: -level * start.attitude * up.0.error,
                of_after: level * attitude * up.1.error,
                walk,
                by_hand,
                variance: walk + of_gravity(before) + of_gravity(after),
                block,
            });
        }
        Ok(Self {
            attitudes,
            turns,
            durations: dwells.iter().map(duration).collect(),
            turning,
        })
    }

    fn turn(&mut self, turn: &Matrix3<f64>) {
        for attitude in &mut self.attitudes {
            *attitude = turn * *attitude;
        }
        for Turn {
            block,
            tilt,
            of_before,
            of_after,
            ..
        } in &mut self.turns
        {
            *tilt = turn * *tilt;
            *of_before = turn * *of_before;
            *of_after = turn * *of_after;
            let parameters = Arc::make_mut(&mut block.parameters);
            for mut column in parameters.gyro.column_iter_mut() {
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
        let pairs = self.attitudes.iter().zip(rests).zip(&self.durations);
        let rest = |((attitude, rest), duration): ((&Matrix3<f64>, &MeanOutput), &f64)| Rest {
            attitude: *attitude,
            rate: correction * (rest.output - bias),
            variance: rest.variance + self.turning / duration,
        };
        pairs.map(rest).collect()
    }

    /// Adds what moves and rates at rest say; `place` numbers what their errors share.
    fn add(
        &self,
        equations: &mut Equations,
        stretch: &Stretch,
        triads: &PerSensor<Triad>,
        rests: &[MeanOutput],
        heading: &Heading,
        place: &Place,
    ) -> Result<(), CalibrationError> {
        let triad = &triads.gyro;
        let correction = triad.correction().ok_or_else(|| singular(triads))?;
        let earth_rate = stretch.run.site.earth_rate_n();
        // What a heading that is wrong by an angle of one makes of Earth rate.
        let turned = Vector3::z().cross(&earth_rate);
        let Place {
            shared,
            first,
            stretch: number,
        } = *place;
        // As much of Earth rate as heading may be wrong by, all of it at most.
        let of_heading = (ROTATION_RATE * known_heading(heading.sigma)).powi(2);
        for (before, turn) in self.turns.iter().enumerate() {
            let variance = turn.variance + of_heading * turn.block.duration.powi(2);
            let (before, after) = (first + before, first + before + 1);
            for axis in 0..2 {
                let row = |of: &SMatrix<f64, 3, PARAMETERS>| of.row(axis).transpose();
                let of_gyro = turn.block.parameters.gyro.row(axis).transpose();
                let (of_before, of_after) = (row(&turn.of_before), row(&turn.of_after));
                let at_rest = |dwell| shared.at_rest(Sensor::Accel, dwell);
                let mut parts = along(at_rest(before), &of_biases(&of_before));
                parts.extend(along(at_rest(after), &of_biases(&of_after)));
                parts.extend(along(shared.before(after), &of_biases(&of_gyro)));
                let by_heading = -turned[axis] * turn.block.duration;
                parts.push((shared.heading(number), by_heading));
                let made_of = ErrorOf {
                    own: turn.walk,
                    shared: parts,
                    by_hand: turn.by_hand,
                };
                let rows = [
                    (Sensor::Gyro, of_gyro),
                    (Sensor::Accel, of_before + of_after),
                ];
                equations.add(&rows, turn.tilt[axis], variance, made_of);
            }
        }
        for (dwell, (attitude, rest)) in self.attitudes.iter().zip(rests).enumerate() {
            let by_turning = 1.0 / self.durations[dwell];
            let rate = correction * (rest.output - triad.bias);
            let error = rate - attitude.tr_mul(&earth_rate);
            let by_heading = attitude.tr_mul(&turned);
            let errors = input_errors(triad, &correction, &rate);
            for axis in 0..3 {
                let row = errors.row(axis).transpose();
                let at_rest = shared.at_rest(Sensor::Gyro, first + dwell);
                let mut parts = along(at_rest, &of_biases(&row));
                parts.push((shared.heading(number), by_heading[axis]));
                let made_of = ErrorOf {
                    own: self.turning * by_turning,
                    shared: parts,
                    by_hand: BY_HAND.map(|source| match source {
                        Source::Turning => by_turning,
                        _ => 0.0,
                    }),
                };
                let variance = rest.variance + self.turning * by_turning + of_heading;
                equations.add(&[(Sensor::Gyro, row)], error[axis], variance, made_of);
            }
        }
        Ok(())
    }
}

/// Where a stretch has its share of what errors have in common.
struct Place {
    shared: SharedNoise,
    /// Place of its first dwell among those of all stretches.
    first: usize,
    /// Its own place.
    stretch: usize,
}

/// σ of a heading as it is used, rad: beyond a radian nothing is known of it.
fn known_heading(sigma: f64) -> f64 {
    sigma.clamp(1e-3, 1.0)
}

/// The equations of each dwell and of each move, in the order in which they are added, with begin and end
/// of each in s.
pub fn dwells_and_moves(problem: &Problem) -> (Vec<Vec<usize>>, Vec<[f64; 2]>) {
    let (mut groups, mut times) = (Vec::new(), Vec::new());
    // First the magnitude of gravity in every dwell.
    let mut next = problem.dwells().count();
    let mut number = 0;
    for stretch in problem.stretches() {
        for pair in stretch.dwells.windows(2) {
            let [before, after] = [&pair[0], &pair[1]].map(|dwell| dwell.times(stretch.run));
            groups.push((next..next + 2).collect());
            times.push([before[1], after[0]]);
            next += 2;
        }
        for dwell in &stretch.dwells {
            groups.push(std::iter::once(number).chain(next..next + 3).collect());
            times.push(dwell.times(stretch.run));
            next += 3;
            number += 1;
        }
    }
    (groups, times)
}
