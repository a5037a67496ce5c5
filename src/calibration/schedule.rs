//! What is observed when: the record cut into stretches, each with what its end shows.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::CalibrationError;
use crate::attitude::{self, exp, tilt};
use crate::imu::{Sensor, Triad};
use crate::navigation::State;
use crate::run::{Dwell, Run, TableRecord, Tilts};

/// A stretch of samples that one block of the error model covers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Step {
    pub samples: Range<usize>,
    /// Set where the stretch lies within a dwell.
    pub standing: Option<Standing>,
}

/// What is known at the end of a stretch within a dwell.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Standing {
    /// Whether it is the dwell's first.
    pub first: bool,
    /// Mean of the table's readings during the whole dwell, `C_b_n`; none without a table.
    pub attitude: Option<Matrix3<f64>>,
    /// How the table's attitude turns with tilts of its axes, where its own errors are states.
    pub tilts: Option<Tilts>,
    /// Mean output of the accelerometers during the whole dwell.
    pub accel: Vector3<f64>,
    /// Mean of the table's readings during the stretch, and how many they were.
    pub reading: Option<(Matrix3<f64>, usize)>,
}

/// The whole record from its first dwell to the end of its last.
#[derive(Debug, Clone)]
pub(super) struct Schedule {
    pub steps: Vec<Step>,
}

/// Length of a stretch, s: covariance is propagated and observations are taken at 10 Hz.
const STRETCH: f64 = 0.1;

/// Number of samples in a stretch.
pub(super) fn stretch(period: f64) -> usize {
    ((STRETCH / period).round() as usize).max(1)
}

impl Schedule {
    pub fn new(run: &Run, dwells: &[Dwell]) -> Result<Self, CalibrationError> {
        let [start, _, ..] = dwells else {
            return Err(CalibrationError::TooFewDwells {
                found: dwells.len(),
                needed: 2,
            });
        };
        let mut steps = Vec::new();
        let mut at = start.samples.start;
        let stretch = stretch(run.imu.period);
        for (number, dwell) in dwells.iter().enumerate() {
            cut(at..dwell.samples.start, stretch, |samples| {
                steps.push(Step {
                    samples,
                    standing: None,
                });
            });
            let mut unread = dwell.position.as_ref().map(|p| p.readings.clone());
            // The first reading of all is the initial attitude.
            if let Some(unread) = unread.as_mut().filter(|_| number == 0) {
                unread.start += 1;
            }
            let accel = dwell.mean(Sensor::Accel, run).output;
            let tilts = run.table.as_ref().filter(|table| table.geometry.any());
            let tilts = tilts.zip(dwell.position.as_ref()).map(|(table, position)| {
                let of_reading = table.tilts.get(position.readings.start);
                of_reading.copied().unwrap_or_default()
            });
            let mut first = true;
            cut(dwell.samples.clone(), stretch, |samples| {
                let until = run.imu.time(samples.end) + 1e-3 * run.imu.period;
                let reading = run.table.as_ref().zip(unread.as_mut());
                let reading = reading.and_then(|(table, unread)| {
                    let readings = take_until(unread, table, until);
                    let mean = attitude::mean(&table.attitude[readings.clone()])?;
                    Some((mean, readings.len()))
                });
                steps.push(Step {
                    samples,
                    standing: Some(Standing {
                        first,
                        attitude: dwell.position.as_ref().map(|p| p.attitude),
                        accel,
                        tilts,
                        reading,
                    }),
                });
                first = false;
            });
            at = dwell.samples.end;
        }
        Ok(Self { steps })
    }
}

impl Standing {
    /// Where a held pass linearises while the table stands: at rest in the table's mean attitude, else
    /// in the computed one, levelled.
    ///
    /// Both are within arc seconds of the truth in every pass, so what noise adds up to over a long
    /// record never leaves the linear range; nor does a tilt that it makes change what a wrong heading
    /// does.
    pub fn tied(&self, computed: &State, accel: &Triad) -> State {
        State::at_rest(self.attitude.unwrap_or_else(|| {
            let up = accel.correction().unwrap_or_default() * (self.accel - accel.bias);
            exp(tilt(&(computed.attitude * up))) * computed.attitude
        }))
    }
}

/// The attitude that a table's first reading gives.
pub(super) fn first_reading(run: &Run, dwells: &[Dwell]) -> Option<Matrix3<f64>> {
    let position = dwells.first()?.position.as_ref()?;
    run.table
        .as_ref()?
        .attitude
        .get(position.readings.start)
        .copied()
}

/// Cuts a range into stretches of this length; the last may be shorter.
fn cut(range: Range<usize>, stretch: usize, mut each: impl FnMut(Range<usize>)) {
    let mut start = range.start;
    while start < range.end {
        let end = (start + stretch).min(range.end);
        each(start..end);
        start = end;
    }
}

/// Takes the readings up to a time off the front of those not yet used.
fn take_until(unread: &mut Range<usize>, table: &TableRecord, until: f64) -> Range<usize> {
    let taken = table.time[unread.clone()].partition_point(|&t| t <= until);
    let readings = unread.start..unread.start + taken;
    unread.start = readings.end;
    readings
}
