//! Schedule of observations: a stretch of a recording cut into steps, each with the observations at its end.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use crate::attitude::{self, exp, tilt};
use crate::imu::{Sensor, Triad};
use crate::navigation::{State, Sums, samples_of};
use crate::recording::TableLog;
use crate::run::{Dwell, Run};
use crate::turntable::{AxisResponse, axis_response};

/// A move, or a part of a dwell that ends with an observation.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    pub samples: Range<usize>,
    /// Data of a step within a dwell; `None` in a move.
    pub at_rest: Option<AtRest>,
}

/// Data at the end of a step within a dwell.
#[derive(Debug, Clone, PartialEq)]
pub struct AtRest {
    /// Whether this is the first step of the dwell.
    pub first: bool,
    /// Sums of the samples in the step.
    pub sums: Sums,
    /// Mean of the table's readings during the step, and their number.
    pub reading: Option<(Matrix3<f64>, usize)>,
    /// Data of the whole dwell.
    pub dwell: Arc<WholeDwell>,
}

/// Data of a whole dwell.
#[derive(Debug, Clone, PartialEq)]
pub struct WholeDwell {
    /// Mean of the table's readings, `C_b_n`; `None` without a table.
    pub attitude: Option<Matrix3<f64>>,
    /// Rotation of the table attitude for a unit error of each axis, if the angles are known.
    pub axes: Option<Arc<AxisResponse>>,
    /// Mean output of the accelerometers.
    pub accel: Vector3<f64>,
}

/// Length of a step, s: covariance is propagated and observations are taken at 10 Hz.
const STEP: f64 = 0.1;
/// Longest step of a packed recording, as a multiple of the usual step, after a dwell of equal length: by then,
/// observations are limited by random walk, not by their own noise.
const STEPS_OF_PACKED: usize = 10;

/// The steps from the start of the first dwell to the end of the last, without a gap.
pub fn steps(run: &Run, table: Option<&TableLog>, dwells: &[Dwell]) -> Vec<Step> {
    let imu = &run.recording.imu;
    let length = step_length(imu.period);
    let longest = if imu.is_packed() {
        STEPS_OF_PACKED * length
    } else {
        length
    };
    let of_dwell = |dwell: &Dwell| growing(dwell.samples.clone(), (length, longest));
    // Exact capacity: there may be too many steps for a vector that doubles.
    let count = dwells.iter().map(|dwell| 1 + of_dwell(dwell).count());
    let mut steps = Vec::with_capacity(count.sum());
    let mut at = dwells.first().map_or(0, |dwell| dwell.samples.start);
    for (number, dwell) in dwells.iter().enumerate() {
        let samples = at..dwell.samples.start;
        if !samples.is_empty() {
            steps.push(Step {
                samples,
                at_rest: None,
            });
        }
        at = dwell.samples.end;
        let position = dwell.position.as_ref();
        let readings = table
            .zip(position)
            .map(|(table, p)| (table, p.readings.clone()));
        let axes = readings
            .as_ref()
            .and_then(|(table, of)| table.axes.get(of.start));
        let whole = Arc::new(WholeDwell {
            attitude: position.map(|p| p.attitude),
            axes: axes.map(|angles| Arc::new(axis_response(angles))),
            accel: dwell.mean(Sensor::Accel, run).output,
        });
        // The very first reading is the initial attitude.
        let first = usize::from(number == 0);
        let mut unread = readings.map(|(table, of)| (table, of.start + first..of.end));
        let of_steps = of_dwell(dwell).enumerate().map(|(number, samples)| {
            let until = imu.time(samples.end) + 1e-3 * imu.period;
            let reading = unread.as_mut().and_then(|(table, unread)| {
                let begin = unread.start;
                unread.start += table.time[unread.clone()].partition_point(|&t| t <= until);
                let mean = attitude::mean(&table.attitude[begin..unread.start])?;
                Some((mean, unread.start - begin))
            });
            Step {
                at_rest: Some(AtRest {
                    first: number == 0,
                    sums: Sums::new(imu, samples.clone()),
                    reading,
                    dwell: whole.clone(),
                }),
                samples,
            }
        });
        steps.extend(of_steps);
    }
    steps
}

impl AtRest {
    /// Linearisation point at rest. With a table, this is the attitude from the previous pass or, in the first pass,
    /// the mean reading; without a table, it is the computed attitude after levelling.
    ///
    /// In every pass, both attitudes are within arc seconds of the truth, so the noise accumulated over a long
    /// recording never leaves the linear range, and a tilt caused by noise does not change the effect of a wrong
    /// heading.
    pub fn tied(&self, computed: &State, accel: &Triad, known: Option<&Matrix3<f64>>) -> State {
        let of_table = self
            .dwell
            .attitude
            .map(|read| known.copied().unwrap_or(read));
        State::at_rest(of_table.unwrap_or_else(|| {
            let up = accel.correction().unwrap_or_default() * (self.dwell.accel - accel.bias);
            exp(tilt(&(computed.attitude * up))) * computed.attitude
        }))
    }
}

/// The attitude of a table's first reading.
pub fn first_reading(table: Option<&TableLog>, dwells: &[Dwell]) -> Option<Matrix3<f64>> {
    let position = dwells.first()?.position.as_ref()?;
    table?
        .attitude
        .get(position.readings.start)
        .map(attitude::matrix)
}

/// Number of samples in a step of a dwell.
pub fn step_length(period: f64) -> usize {
    samples_of(STEP, period)
}

/// Cuts a range into parts of the first length, then into increasing ones, each as long as all previous parts together,
/// up to the second length.
fn growing(
    range: Range<usize>,
    (length, longest): (usize, usize),
) -> impl Iterator<Item = Range<usize>> {
    let begin = range.start;
    let mut at = begin;
    std::iter::from_fn(move || {
        let from = at;
        let length = (at - begin).clamp(length.max(1), longest.max(1));
        at = (at + length).min(range.end);
        (at > from).then_some(from..at)
    })
}
