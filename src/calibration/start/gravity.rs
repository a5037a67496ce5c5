//! Equations from gravity without a table: its magnitude in every dwell, and its direction before and after every move.

use std::ops::Range;

use nalgebra::{Matrix3, SMatrix, SVector, Vector1, Vector2, Vector3};

use super::equations::{Common, Equations, Event, OfTriad, Rows, of, of_parameters};
use crate::attitude::{exp, skew, tilt};
use crate::calibration::linearisation::singular;
use crate::calibration::noise::BY_HAND;
use crate::calibration::problem::Stretch;
use crate::calibration::{CalibrationError, Model, Problem, Source};
use crate::earth::ROTATION_RATE;
use crate::imu::{Noise, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad};
use crate::navigation::{Navigator, ProcessNoise, State};
use crate::run::{Dwell, MeanOutput};

/// Minimum σ of a row, rad or m/s, for an instrument without noise.
pub const ROUNDING: f64 = 1e-9;

/// Columns of the biases among the parameters of a triad. Its mean noise has the same effect.
const BIAS: usize = PER_TRIAD - 3;

/// A dwell with its mean outputs.
#[derive(Debug, Clone)]
pub struct AtRest {
    /// Number of the dwell among the dwells of all stretches.
    pub number: usize,
    pub samples: Range<usize>,
    /// Start and end, s.
    pub times: [f64; 2],
    pub mean: PerSensor<MeanOutput>,
}

impl AtRest {
    /// The dwells of each stretch.
    pub fn all(problem: &Problem) -> Vec<Vec<Self>> {
        let mut numbers = 0..;
        let stretches = problem.stretches().iter();
        let of_stretch = stretches.map(|stretch| {
            let at_rest = |(dwell, number): (&Dwell, usize)| Self {
                number,
                samples: dwell.samples.clone(),
                times: dwell.times(stretch.run),
                mean: PerSensor::from_fn(|sensor| dwell.mean(sensor, stretch.run)),
            };
            stretch
                .dwells
                .iter()
                .zip(&mut numbers)
                .map(at_rest)
                .collect()
        });
        of_stretch.collect()
    }

    /// Duration of the dwell, s.
    pub fn duration(&self) -> f64 {
        self.times[1] - self.times[0]
    }

    /// Number of the event; each dwell follows the move before it.
    pub fn event(&self) -> usize {
        2 * self.number + 1
    }
}

/// Each dwell with the move that precedes it. The noise of a move consists only of the bias variation, because the
/// random walk of each row is independent.
pub fn events(problem: &Problem, dwells: &[Vec<AtRest>]) -> Vec<Event> {
    let mut events = Vec::new();
    for (stretch, dwells) in problem.stretches().iter().zip(dwells) {
        let noise = PerSensor::from_fn(|sensor| Noise {
            random_walk: 0.0,
            ..*stretch.run.instrument.noise.get(sensor)
        });
        let event = |times: [f64; 2], variance: &dyn Fn(Sensor) -> f64| Event {
            recording: stretch.recording,
            times,
            variance: PerSensor::from_fn(variance),
            noise,
        };
        let mut before = dwells.first().map_or(0.0, |first| first.times[0]);
        for dwell in dwells {
            let times = [before, dwell.times[0]];
            let of_move = |sensor| noise.get(sensor).covariance_of_means(times, times);
            events.push(event(times, &of_move));
            events.push(event(dwell.times, &|sensor| {
                dwell.mean.get(sensor).variance
            }));
            before = dwell.times[1];
        }
    }
    events
}

/// Error of the computed input of a triad (estimated − true) for a unit error of each of its parameters.
pub fn input_errors(triad: &Triad, correction: &Matrix3<f64>, input: &Vector3<f64>) -> OfTriad<3> {
    correction * of_parameters(triad, input)
}

/// Response of rows to the mean noise of a triad over an event; it equals the response to the biases.
pub fn of_noise<const N: usize>(
    sensor: Sensor,
    event: usize,
    partials: &OfTriad<N>,
) -> (Common, SMatrix<f64, N, 3>) {
    let of_biases = partials.fixed_columns::<3>(BIAS).into_owned();
    (Common::Noise(sensor, event), of_biases)
}

/// The mean specific force in a dwell.
pub struct Force {
    /// Magnitude, m/s²; not zero.
    pub size: f64,
    /// The upward direction, along body axes.
    pub up: Vector3<f64>,
    /// Error of the force for a unit error of each accelerometer parameter.
    pub error: OfTriad<3>,
}

impl Force {
    pub fn of(triads: &PerSensor<Triad>, dwell: &AtRest) -> Result<Self, CalibrationError> {
        let triad = &triads.accel;
        let correction = triad.correction().ok_or_else(|| singular(triads))?;
        let force = correction * (dwell.mean.accel.output - triad.bias);
        let sensor = Sensor::Accel;
        let size = Some(force.norm()).filter(|&size| size > 0.0);
        let size = size.ok_or(CalibrationError::Singular { sensor })?;
        Ok(Self {
            size,
            up: force / size,
            error: input_errors(triad, &correction, &force),
        })
    }
}

/// The upward direction in a dwell, along body axes.
pub fn up(triads: &PerSensor<Triad>, dwell: &AtRest) -> Result<Vector3<f64>, CalibrationError> {
    Ok(Force::of(triads, dwell)?.up)
}

/// Adds `|f| = g` in every dwell.
///
/// Source: Skog and Händel 2006, "Calibration of a MEMS inertial measurement unit", XVII IMEKO World
/// Congress, §3.
pub fn add_magnitude(
    equations: &mut Equations,
    problem: &Problem,
    dwells: &[Vec<AtRest>],
    triads: &PerSensor<Triad>,
) -> Result<(), CalibrationError> {
    for (stretch, dwells) in problem.stretches().iter().zip(dwells) {
        for dwell in dwells {
            let Force { size, up, error } = Force::of(triads, dwell)?;
            let partials = up.transpose() * error;
            let residual = Vector1::new(size - stretch.run.site.gravity);
            equations.add(&Rows {
                event: dwell.event(),
                weighted: Vector1::new(dwell.mean.accel.variance + ROUNDING.powi(2)),
                common: vec![of_noise(Sensor::Accel, dwell.event(), &partials)],
                ..Rows::new(of(Sensor::Accel, &partials), residual, ROUNDING.powi(2))
            });
        }
    }
    Ok(())
}

/// The heading common to all attitudes of a stretch.
#[derive(Debug, Clone, Copy)]
pub struct Heading {
    /// Number of the stretch.
    pub stretch: usize,
    /// Rotation about Up that aligns the attitudes with East-North-Up, rad.
    pub turn: Matrix3<f64>,
    /// 1σ of the heading, rad; a value above one means that the heading is unknown.
    pub sigma: f64,
}

impl Heading {
    /// The σ used, rad.
    pub fn known(&self) -> f64 {
        self.sigma.clamp(1e-3, 1.0)
    }

    /// Response of rows to the heading error, from their change per radian.
    pub fn error<const N: usize>(
        &self,
        by_angle: &SVector<f64, N>,
    ) -> (Common, SMatrix<f64, N, 3>) {
        let mut error = SMatrix::<f64, N, 3>::zeros();
        error.set_column(2, &(by_angle * self.known()));
        (Common::Unit(self.stretch), error)
    }
}

/// Attitudes of the dwells of a stretch. The gyros propagate each attitude to the next dwell, where the accelerometers
/// level it.
pub struct Chain {
    pub attitudes: Vec<Matrix3<f64>>,
    moves: Vec<Move>,
}

/// A move from one dwell to the next.
struct Move {
    /// Duration of the move, s.
    duration: f64,
    /// Tilt error of the gyros after the move, `C_computed = (I − [φ×]) C_true`.
    tilt: Vector3<f64>,
    /// Tilt error per error of each gyro parameter.
    of_gyro: OfTriad<3>,
    /// Tilt error per error of each accelerometer parameter, through Up before the move.
    of_before: OfTriad<3>,
    /// Tilt error per error of each accelerometer parameter, through Up after the move.
    of_after: OfTriad<3>,
    /// Variance of each tilt component due to noise and interpolation of the gyros.
    walk: f64,
    /// Variance due to each of [`BY_HAND`] for unit σ.
    by_hand: [f64; BY_HAND.len()],
    /// Variance due to the gyros and the noise of Up.
    variance: f64,
}

impl Chain {
    /// Starts from an attitude in the first dwell and levels this attitude.
    ///
    /// Source: Tedaldi, Pretto, Menegatti 2014, "A robust and easy to implement method for IMU calibration
    /// without external equipments", ICRA, §IV.
    pub fn new(
        model: &Model,
        stretch: &Stretch,
        dwells: &[AtRest],
        triads: &PerSensor<Triad>,
        first: &Matrix3<f64>,
    ) -> Result<Self, CalibrationError> {
        let forces = dwells.iter().map(|dwell| Force::of(triads, dwell));
        let forces = forces.collect::<Result<Vec<_>, _>>()?;
        let mut attitude = exp(tilt(&(first * forces[0].up))) * first;
        let (mut attitudes, mut moves) = (vec![attitude], Vec::new());
        for (dwells, forces) in dwells.windows(2).zip(forces.windows(2)) {
            let of;
            (of, attitude) = Move::new(model, stretch, triads, &attitude, dwells, forces)?;
            attitudes.push(attitude);
            moves.push(of);
        }
        Ok(Self { attitudes, moves })
    }

    /// Rotates the chain of attitudes to its heading and adds the moves between the dwells, through which the gyros
    /// propagate the upward direction.
    pub fn add(
        &self,
        equations: &mut Equations,
        (stretch, dwells): (&Stretch, &[AtRest]),
        heading: &Heading,
    ) {
        let earth_rate = stretch.run.site.earth_rate_n();
        // Change of Earth rate per radian of heading error.
        let turned = Vector3::z().cross(&earth_rate);
        for (turn, pair) in self.moves.iter().zip(dwells.windows(2)) {
            let level = |of: &OfTriad<3>| (heading.turn * of).fixed_rows::<2>(0).into_owned();
            let of_gyro = level(&turn.of_gyro);
            let [of_before, of_after] = [&turn.of_before, &turn.of_after].map(level);
            let [before, after] = [&pair[0], &pair[1]].map(AtRest::event);
            let event = after - 1;
            // The part of Earth rate that the heading uncertainty makes unknown, at most all of it.
            let of_heading = (ROTATION_RATE * heading.known() * turn.duration).powi(2);
            let of_accel = of(Sensor::Accel, &(of_before + of_after));
            let residual = (heading.turn * turn.tilt).xy();
            equations.add(&Rows {
                event,
                weighted: Vector2::repeat(turn.variance + of_heading + ROUNDING.powi(2)),
                common: vec![
                    of_noise(Sensor::Accel, before, &of_before),
                    of_noise(Sensor::Accel, after, &of_after),
                    of_noise(Sensor::Gyro, event, &of_gyro),
                    heading.error(&(turned * -turn.duration).xy()),
                ],
                by_hand: turn.by_hand,
                ..Rows::new(
                    of(Sensor::Gyro, &of_gyro) + of_accel,
                    residual,
                    turn.walk + ROUNDING.powi(2),
                )
            });
        }
    }
}

impl Move {
    /// The move from an attitude in the first of two dwells, and the attitude after it.
    fn new(
        model: &Model,
        stretch: &Stretch,
        triads: &PerSensor<Triad>,
        start: &Matrix3<f64>,
        dwells: &[AtRest],
        forces: &[Force],
    ) -> Result<(Self, Matrix3<f64>), CalibrationError> {
        let run = stretch.run;
        let [before, after] = [&dwells[0], &dwells[1]];
        let block = Navigator::new(
            &run.recording.imu,
            &run.site,
            triads,
            State::at_rest(*start),
        )
        .ok_or_else(|| singular(triads))?
        .advance(before.samples.end..after.samples.start);
        let tilt = tilt(&(block.state.attitude * forces[1].up));
        let attitude = exp(tilt) * block.state.attitude;
        let level = -skew(Vector3::z());
        // East and North are alike, except for interpolated samples.
        let level_variance = |noise: &PerSensor<ProcessNoise>| {
            let drifted = block.noise.covariance(noise);
            0.5 * (drifted[(0, 0)] + drifted[(1, 1)])
        };
        let interpolated = level_variance(&PerSensor::default());
        // Up is measured at the middle of a dwell; the gyros carry it from the end of the dwell.
        let held = (before.duration() + after.duration()) / 3.0;
        let walk = level_variance(&model.process_noise()) + model.turning_at_rest.powi(2) * held;
        let of_gravity = |dwell: &AtRest| dwell.mean.accel.variance / run.site.gravity.powi(2);
        let of = Self {
            duration: block.duration,
            tilt,
            of_gyro: block.parameters.gyro.fixed_rows::<3>(0).into_owned(),
            of_before: -level * start * (forces[0].error / forces[0].size),
            of_after: level * attitude * (forces[1].error / forces[1].size),
            walk,
            by_hand: BY_HAND.map(|source| match source {
                Source::RotationAtRest => held,
                _ => level_variance(&source.alone()) - interpolated,
            }),
            variance: walk + of_gravity(before) + of_gravity(after),
        };
        Ok((of, attitude))
    }
}
