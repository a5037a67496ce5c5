//! What a record shows of its motion, as the columns stand: dwells, moves between them, labelled sections.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use crate::attitude::{exp, matrix};
use crate::calibration::problem::{Problem, Stretch};
use crate::earth::ROTATION_RATE;
use crate::imu::{PerSensor, Sensor};
use crate::recording::{LabelledMotion, TableLog};
use crate::run::{Dwell, Run};

/// What a sum of rotations by whole samples leaves of coning and of turns within a sample, rad. It stands
/// for all that a noiseless record is off by.
const FLOOR: f64 = 1e-4;
/// A part of a move that turns by more is cut at the next reading of the table, rad: half a turn has no
/// sense.
const LEG: f64 = 1.0;

/// A dwell.
#[derive(Debug, Clone)]
pub struct Rest {
    /// Specific force over gravity, without the bias of the prior.
    pub force: Vector3<f64>,
    /// Variance of each of its components.
    pub force_variance: f64,
    /// Rate over Earth rate, without the bias of the prior.
    pub rate: Vector3<f64>,
    /// Variance of each of its components, Gauss–Markov bias included.
    pub rate_variance: f64,
    /// Up, and Earth rate over its magnitude, along body axes as the table holds them.
    pub known: Option<PerSensor<Vector3<f64>>>,
}

impl Rest {
    /// What a triad senses, and the variance of each component.
    pub fn sensed(&self, sensor: Sensor) -> (&Vector3<f64>, f64) {
        match sensor {
            Sensor::Gyro => (&self.rate, self.rate_variance),
            Sensor::Accel => (&self.force, self.force_variance),
        }
    }
}

/// A move from one dwell to the next, or a part of it.
#[derive(Debug, Clone)]
pub struct Move {
    /// The dwell before it, by number.
    pub from: usize,
    /// `C` from the body axes after it to those before, by the table.
    pub known: Option<Matrix3<f64>>,
    /// The turn that the gyros make as they are, and the one with all of them reversed.
    pub turns: [Turned; 2],
    /// Variance of the turn about each axis, rad².
    pub variance: f64,
}

/// A turn as gyros make it.
#[derive(Debug, Clone)]
pub struct Turned {
    /// `C` from the axes after it to those before.
    pub rotation: Matrix3<f64>,
    /// For each component of the output: how its coupling into each axis (column) turns the whole about the
    /// axes before (row), rad.
    pub by_output: [Matrix3<f64>; 3],
}

/// A labelled section.
#[derive(Debug, Clone)]
pub struct Labelled {
    pub sensor: Sensor,
    /// Mean force over gravity, or the angle turned, by the columns as they stand.
    pub found: Vector3<f64>,
    /// The same along body axes as the label has it.
    pub said: Vector3<f64>,
    pub variance: f64,
}

/// All that is known of the motion of one recording.
#[derive(Debug, Clone)]
pub struct Motion {
    pub rests: Vec<Rest>,
    /// With a table in parts from reading to reading, for a whole move may end as it began.
    pub moves: Vec<Move>,
    pub labels: Vec<Labelled>,
    /// Upward part of Earth rate over the whole.
    pub upward: f64,
}

impl Motion {
    /// That of the recording with this number.
    pub fn of(problem: &Problem, recording: usize, run: &Run) -> Self {
        let stretches = problem.stretches().iter();
        let stretches = stretches.filter(|stretch| stretch.recording == recording);
        let (mut rests, mut moves, mut dwells) = (Vec::new(), Vec::new(), Vec::new());
        for stretch in stretches {
            let of = &stretch.dwells;
            for pair in of.windows(2) {
                let from = rests.len();
                rests.push(rest(run, &pair[0]));
                let legs = Legs {
                    run,
                    from,
                    zero: pair[0].mean(Sensor::Gyro, run).output * run.recording.imu.period,
                    position_sigma: problem.model.position_sigma,
                };
                moves.extend(legs.between(stretch, &pair[0], &pair[1]));
            }
            rests.extend(of.last().map(|last| rest(run, last)));
            dwells.extend(of);
        }
        Self {
            labels: labelled(run, &dwells),
            rests,
            moves,
            upward: run.site.earth_rate_n().z / ROTATION_RATE,
        }
    }
}

fn rest(run: &Run, dwell: &Dwell) -> Rest {
    let prior = &run.instrument.prior;
    let [rate, force] = Sensor::ALL.map(|sensor| dwell.mean(sensor, run));
    let wander = run.instrument.noise.gyro.gauss_markov;
    let wander = wander.map_or(0.0, |wander| wander.sigma);
    Rest {
        force: (force.output - prior.accel.bias) / run.site.gravity,
        force_variance: force.variance / run.site.gravity.powi(2) + FLOOR.powi(2),
        rate: (rate.output - prior.gyro.bias) / ROTATION_RATE,
        rate_variance: (rate.variance + wander.powi(2)) / ROTATION_RATE.powi(2) + FLOOR.powi(2),
        known: dwell.position.as_ref().map(|position| PerSensor {
            gyro: position.attitude.tr_mul(&run.site.earth_rate_n()) / ROTATION_RATE,
            accel: position.attitude.tr_mul(&Vector3::z()),
        }),
    }
}

/// Variance of an angle by gyros whose zero is that at rest nearby: noise, and Earth rate, which turns
/// with them.
fn angle_variance(run: &Run, samples: &Range<usize>) -> f64 {
    let duration = samples.len() as f64 * run.recording.imu.period;
    run.instrument.noise.gyro.random_walk.powi(2) * duration
        + (ROTATION_RATE * duration).powi(2)
        + FLOOR.powi(2)
}

/// Makes the parts of a move.
struct Legs<'a> {
    run: &'a Run,
    from: usize,
    /// What the gyros sum up in a sample at rest, rad.
    zero: Vector3<f64>,
    position_sigma: f64,
}

impl Legs<'_> {
    fn between(&self, stretch: &Stretch, before: &Dwell, after: &Dwell) -> Vec<Move> {
        let samples = before.samples.end..after.samples.start;
        let (Some(table), Some(first), Some(last)) =
            (stretch.table, &before.position, &after.position)
        else {
            return vec![self.leg(samples, None)];
        };
        let mut legs = Vec::new();
        let (mut begin, mut held) = (samples.start, first.attitude);
        let (mut way, mut measured) = (0.0, begin);
        for (edge, attitude) in self.readings(table, first.readings.end..last.readings.start) {
            if edge <= begin || edge >= samples.end {
                continue;
            }
            way += self.way(measured..edge.max(measured));
            measured = edge;
            if way > LEG {
                legs.push(self.leg(begin..edge, Some(held.tr_mul(&attitude))));
                (begin, held, way) = (edge, attitude, 0.0);
            }
        }
        legs.push(self.leg(begin..samples.end, Some(held.tr_mul(&last.attitude))));
        legs
    }

    /// The sample edge nearest to each of some readings, with its attitude.
    fn readings(
        &self,
        table: &TableLog,
        readings: Range<usize>,
    ) -> impl Iterator<Item = (usize, Matrix3<f64>)> {
        let attitudes = &table.attitude[readings.clone()];
        let times = table.time[readings].iter().zip(attitudes);
        times.map(|(&time, attitude)| {
            let edge = self.run.recording.imu.edge(time).round().max(0.0);
            (edge as usize, matrix(attitude))
        })
    }

    /// How far it turns in all, one way and the other, rad.
    fn way(&self, samples: Range<usize>) -> f64 {
        let increments = self.run.recording.imu.gyro.within(samples);
        increments
            .map(|increment| (increment - self.zero).norm())
            .sum()
    }

    fn leg(&self, samples: Range<usize>, known: Option<Matrix3<f64>>) -> Move {
        let increments = || {
            let of = self.run.recording.imu.gyro.within(samples.clone());
            of.map(|increment| increment - self.zero)
        };
        let turned = |sign: f64| {
            let mut turned = Turned {
                rotation: Matrix3::identity(),
                by_output: [Matrix3::zeros(); 3],
            };
            for increment in increments() {
                let angle = increment * sign;
                for (of_component, component) in turned.by_output.iter_mut().zip(&angle) {
                    *of_component += turned.rotation * *component;
                }
                turned.rotation *= exp(angle);
            }
            turned
        };
        // A reading is between two samples.
        let of_edge = increments()
            .map(|increment| increment.norm())
            .fold(0.0, f64::max);
        let of_table = self.position_sigma.powi(2) + of_edge.powi(2);
        Move {
            from: self.from,
            turns: [1.0, -1.0].map(turned),
            variance: angle_variance(self.run, &samples) + known.map_or(0.0, |_| 2.0 * of_table),
            known,
        }
    }
}

fn labelled(run: &Run, dwells: &[&Dwell]) -> Vec<Labelled> {
    let period = run.recording.imu.period;
    let prior = &run.instrument.prior;
    let set_by_hand = run.segment_sigma.powi(2);
    let whole = |samples: &Range<usize>| !run.recording.imu.is_lost(samples);
    let segments = run.recording.segments.iter();
    let of = segments.filter(|segment| whole(&segment.samples));
    let labelled = of.filter_map(|segment| {
        let section = Dwell::of(segment.samples.clone());
        match segment.motion? {
            LabelledMotion::Stands { up } => {
                let force = section.mean(Sensor::Accel, run);
                Some(Labelled {
                    sensor: Sensor::Accel,
                    found: (force.output - prior.accel.bias) / run.site.gravity,
                    said: up,
                    variance: force.variance / run.site.gravity.powi(2) + set_by_hand,
                })
            }
            LabelledMotion::Turns { axis, angle } => {
                let samples = &segment.samples;
                let apart = |dwell: &&&Dwell| {
                    let Range { start, end } = dwell.samples;
                    let before = samples.start.saturating_sub(end);
                    start.saturating_sub(samples.end).max(before)
                };
                let zero = match dwells.iter().min_by_key(apart) {
                    Some(rest) => rest.mean(Sensor::Gyro, run).output,
                    None => prior.gyro.bias,
                };
                let duration = samples.len() as f64 * period;
                let output = section.mean(Sensor::Gyro, run).output;
                Some(Labelled {
                    sensor: Sensor::Gyro,
                    found: (output - zero) * duration,
                    said: axis * angle,
                    variance: angle_variance(run, samples) + set_by_hand,
                })
            }
        }
    });
    labelled.collect()
}
