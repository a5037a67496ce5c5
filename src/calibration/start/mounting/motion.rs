//! Motion in a recording, along the axes of the columns: dwells, the moves between them, and labelled sections.

use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use crate::attitude::{exp, log, matrix};
use crate::calibration::problem::{Problem, Stretch};
use crate::calibration::start::equations::OfTriad;
use crate::calibration::start::labels::Section;
use crate::calibration::start::table::sensed;
use crate::earth::ROTATION_RATE;
use crate::imu::{PerSensor, Sensor};
use crate::recording::{LabelledMotion, TableLog};
use crate::run::{Dwell, Run};

/// Residual error of summed rotations due to coning and motion within a sample, rad. It represents all errors of a
/// noise-free recording.
const FLOOR: f64 = 1e-4;
/// A part of a move with a larger rotation, rad, is cut at the next table reading, because the direction of half a turn
/// is ambiguous.
const LEG: f64 = 1.0;

/// A vector that is measured in column axes and known in body axes.
#[derive(Debug, Clone)]
pub struct Sensed {
    /// Measured vector minus the prior bias, divided by gravity or Earth rate; or a measured rotation angle in rad.
    pub found: Vector3<f64>,
    pub known: Option<Vector3<f64>>,
    /// Variance of each component.
    pub variance: f64,
}

/// A move from one dwell to the next, or a part of it.
#[derive(Debug, Clone)]
pub struct Move {
    /// Number of the dwell before the move.
    pub from: usize,
    /// Rotation matrix from the body axes after the move to those before it, according to the table.
    pub known: Option<Matrix3<f64>>,
    /// Rotation from the gyros, with their signs unchanged and with all signs reversed.
    pub turns: [Turned; 2],
    /// Variance of the rotation about each axis, rad².
    pub variance: f64,
    /// Total rotation sensed by the gyros, in both directions, rad.
    pub way: f64,
}

/// A rotation measured by gyros.
#[derive(Debug, Clone)]
pub struct Turned {
    /// `C` from the axes after the rotation to the axes before it.
    pub rotation: Matrix3<f64>,
    /// Effect of the gyro sensitivity on the total rotation, about the axes before the rotation, rad. The gyro output
    /// at rest is used as the gyro zero.
    pub partials: OfTriad<3>,
}

/// Known motion of one recording.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Dwells, with the force divided by gravity and the rate divided by Earth rate. `known` is set if there is a table
    /// log.
    pub rests: Vec<PerSensor<Sensed>>,
    /// Moves. With a table, these are parts of moves from one reading to the next, because a whole move may end where
    /// it started.
    pub moves: Vec<Move>,
    /// Labelled sections, with the force divided by gravity or the rotation angle.
    pub labels: Vec<(Sensor, Sensed)>,
    /// Vertical component of Earth rate divided by the total, if the site is known.
    pub upward: Option<f64>,
}

impl Motion {
    /// Whether the angle of any turn from the gyros is wrong by more than this fraction.
    pub fn misses_a_turn(&self, part: f64) -> bool {
        self.moves.iter().any(|of| {
            let turned = &of.turns[0].rotation;
            let [before, after] = [0, 1].map(|next| self.rests.get(of.from + next));
            let missed = match (of.known, before.zip(after)) {
                (Some(known), _) => log(&(turned * known.transpose())).norm(),
                (None, Some((before, after))) => {
                    before.accel.found.angle(&(turned * after.accel.found))
                }
                (None, None) => 0.0,
            };
            missed > part * of.way.min(PI)
        })
    }

    /// Motion of the recording with this number.
    pub fn of(problem: &Problem, recording: usize, run: &Run) -> Self {
        let stretches = problem.stretches().iter();
        let stretches = stretches.filter(|stretch| stretch.recording == recording);
        let (mut rests, mut moves, mut dwells) = (Vec::new(), Vec::new(), Vec::new());
        for stretch in stretches {
            let of = &stretch.dwells;
            for pair in of.windows(2) {
                let legs = Legs {
                    run,
                    from: rests.len(),
                    zero: pair[0].mean(Sensor::Gyro, run).output * run.recording.imu.period,
                    position_sigma: problem.model.position_sigma,
                };
                moves.extend(legs.between(stretch, &pair[0], &pair[1]));
                rests.push(rest(run, &pair[0]));
            }
            rests.extend(of.last().map(|last| rest(run, last)));
            dwells.extend(of);
        }
        Self {
            labels: labelled(run, &dwells),
            rests,
            moves,
            upward: run
                .site
                .is_known
                .then(|| run.site.earth_rate_n().z / ROTATION_RATE),
        }
    }
}

/// Gravity or Earth rate in the navigation frame.
pub fn unit(run: &Run, sensor: Sensor) -> f64 {
    match sensor {
        Sensor::Gyro => ROTATION_RATE,
        Sensor::Accel => run.site.gravity,
    }
}

fn rest(run: &Run, dwell: &Dwell) -> PerSensor<Sensed> {
    PerSensor::from_fn(|sensor| {
        let wander = run.instrument.noise.get(sensor).gauss_markov;
        let wander = wander
            .filter(|_| sensor == Sensor::Gyro)
            .map_or(0.0, |of| of.sigma);
        let unit = unit(run, sensor);
        let mean = dwell.mean(sensor, run);
        let position = dwell.position.as_ref();
        Sensed {
            found: (mean.output - run.instrument.prior.get(sensor).bias) / unit,
            known: position.map(|of| of.attitude.tr_mul(&sensed(&run.site, sensor)) / unit),
            variance: (mean.variance + wander.powi(2)) / unit.powi(2) + FLOOR.powi(2),
        }
    })
}

/// Variance of a gyro angle with zero from a nearby dwell: noise, and Earth rate, which rotates relative to the gyros.
fn angle_variance(run: &Run, samples: &Range<usize>) -> f64 {
    let duration = samples.len() as f64 * run.recording.imu.period;
    run.instrument.noise.gyro.random_walk.powi(2) * duration
        + (ROTATION_RATE * duration).powi(2)
        + FLOOR.powi(2)
}

/// Splits a move into parts.
struct Legs<'a> {
    run: &'a Run,
    from: usize,
    /// Gyro increment per sample at rest, rad.
    zero: Vector3<f64>,
    position_sigma: f64,
}

impl Legs<'_> {
    fn between(&self, stretch: &Stretch, before: &Dwell, after: &Dwell) -> Vec<Move> {
        let samples = before.samples.end..after.samples.start;
        let (Some(table), Some(first), Some(last)) =
            (stretch.table, &before.position, &after.position)
        else {
            return vec![self.leg(samples, None, 0.0)];
        };
        let mut legs = Vec::new();
        let (mut begin, mut held) = (samples.start, first.attitude);
        let (mut way, mut fastest) = (0.0, 0.0f64);
        let (mut seen, mut edge_seen) = (held, begin);
        for (edge, attitude) in self.readings(table, first.readings.end..last.readings.start) {
            if edge <= edge_seen || edge >= samples.end {
                continue;
            }
            let angle = log(&seen.tr_mul(&attitude)).norm();
            way += angle;
            fastest = fastest.max(angle / (edge - edge_seen) as f64);
            (seen, edge_seen) = (attitude, edge);
            if way > LEG {
                legs.push(self.leg(begin..edge, Some(held.tr_mul(&attitude)), fastest));
                (begin, held) = (edge, attitude);
                (way, fastest) = (0.0, 0.0);
            }
        }
        let known = held.tr_mul(&last.attitude);
        fastest = fastest.max(log(&known).norm() / (samples.end - begin).max(1) as f64);
        legs.push(self.leg(begin..samples.end, Some(known), fastest));
        legs
    }

    /// The sample edge nearest to each reading, with its attitude.
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

    /// The rotation in each sample, rad.
    fn increments(&self, samples: Range<usize>) -> impl Iterator<Item = Vector3<f64>> {
        let increments = self.run.recording.imu.gyro.within(samples);
        increments.map(|increment| increment - self.zero)
    }

    /// `fastest` is the largest rate of the table, rad per sample.
    fn leg(&self, samples: Range<usize>, known: Option<Matrix3<f64>>, fastest: f64) -> Move {
        let turned = |sign: f64| {
            let mut rotation = Matrix3::identity();
            // Weighted by the component of the output.
            let mut turns = [Matrix3::zeros(); 3];
            for increment in self.increments(samples.clone()) {
                let angle = increment * sign;
                for (turn, component) in turns.iter_mut().zip(&angle) {
                    *turn += rotation * *component;
                }
                rotation *= exp(angle);
            }
            let mut partials = OfTriad::zeros();
            for (axis, component) in (0..3).flat_map(|axis| (0..3).map(move |of| (axis, of))) {
                partials.set_column(4 * axis + component, &turns[component].column(axis));
            }
            Turned { rotation, partials }
        };
        // A reading is between two samples.
        let of_table = self.position_sigma.powi(2) + fastest.powi(2);
        let increments = self.increments(samples.clone());
        Move {
            from: self.from,
            way: increments.map(|increment| increment.norm()).sum(),
            turns: [1.0, -1.0].map(turned),
            variance: angle_variance(self.run, &samples) + known.map_or(0.0, |_| 2.0 * of_table),
            known,
        }
    }
}

fn labelled(run: &Run, dwells: &[&Dwell]) -> Vec<(Sensor, Sensed)> {
    let prior = &run.instrument.prior;
    let set_by_hand = run.segment_sigma.powi(2);
    let segments = run.recording.segments.iter();
    let whole = segments.filter(|segment| !run.recording.imu.is_lost(&segment.samples));
    let labelled = whole.filter_map(|segment| {
        let samples = &segment.samples;
        let section = Section::new(run, samples.clone(), segment.motion?);
        let PerSensor { gyro, accel } = section.mean;
        Some(match section.motion {
            LabelledMotion::Stands { up } => {
                let sensed = Sensed {
                    found: (accel.output - prior.accel.bias) / run.site.gravity,
                    known: Some(up),
                    variance: accel.variance / run.site.gravity.powi(2) + set_by_hand,
                };
                (Sensor::Accel, sensed)
            }
            LabelledMotion::Turns { axis, angle } => {
                let apart = |dwell: &&&Dwell| {
                    let Range { start, end } = dwell.samples;
                    let before = samples.start.saturating_sub(end);
                    start.saturating_sub(samples.end).max(before)
                };
                let nearest = dwells.iter().min_by_key(apart);
                let at_rest = nearest.map(|rest| rest.mean(Sensor::Gyro, run).output);
                let zero = at_rest.unwrap_or(prior.gyro.bias);
                let sensed = Sensed {
                    found: (gyro.output - zero) * section.duration(),
                    known: Some(axis * angle),
                    variance: angle_variance(run, samples) + set_by_hand,
                };
                (Sensor::Gyro, sensed)
            }
        })
    });
    labelled.collect()
}
