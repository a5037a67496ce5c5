//! Where the table stands: dwells, found from its own readings.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::{Run, TableRecord};
use crate::attitude::{exp, log};
use crate::units::ARCSEC;

/// A stretch of samples during which the table stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Dwell {
    /// Samples that lie wholly within it.
    pub samples: Range<usize>,
    /// Readings of the table within it.
    pub readings: Range<usize>,
    /// Mean reading, `C_b_n`.
    pub attitude: Matrix3<f64>,
}

/// Shortest dwell worth a name, s.
const SHORTEST: f64 = 0.5;
/// What is cut off at both ends, s: a table that starts smoothly has moved before two readings show
/// it, and one that stops still rings.
const MARGIN: f64 = 0.2;
/// Readings of a standing table differ by less than this many σ of their noise …
const STANDING_SIGMAS: f64 = 6.0;
/// … or this much, whatever the noise.
const STANDING_ANGLE: f64 = 2.0 * ARCSEC;

impl Run {
    /// The dwells of the table's log, in order; none without a table.
    pub fn dwells(&self) -> Vec<Dwell> {
        let Some(table) = &self.table else {
            return Vec::new();
        };
        // Two readings of three components each.
        let limit = STANDING_ANGLE.max(STANDING_SIGMAS * table.reading_sigma * 6f64.sqrt());
        let mut dwells = Vec::new();
        let mut first = 0;
        for next in 1..=table.time.len() {
            let stands = next < table.time.len()
                && log(&(table.attitude[next] * table.attitude[next - 1].transpose())).norm()
                    < limit;
            if !stands {
                dwells.extend(self.dwell(table, first..next));
                first = next;
            }
        }
        dwells
    }

    fn dwell(&self, table: &TableRecord, standing: Range<usize>) -> Option<Dwell> {
        let (first, last) = (
            *table.time.get(standing.start)?,
            *table.time.get(standing.end - 1)?,
        );
        // At either end of the log the table is not known to move.
        let begin = if standing.start == 0 {
            first
        } else {
            first + MARGIN
        };
        let end = if standing.end == table.time.len() {
            last
        } else {
            last - MARGIN
        };
        let sample = |time: f64, up: bool| {
            let k = (time - self.imu.start) / self.imu.period;
            // A stamp that misses a sample's edge by rounding must not cost the sample.
            let k = if up {
                (k - 1e-3).ceil()
            } else {
                (k + 1e-3).floor()
            };
            k.clamp(0.0, self.imu.len() as f64) as usize
        };
        let samples = sample(begin, true)..sample(end, false);
        let readings = standing.start + table.time[standing.clone()].partition_point(|&t| t < begin)
            ..standing.start + table.time[standing].partition_point(|&t| t <= end);
        if samples.len() as f64 * self.imu.period < SHORTEST || readings.is_empty() {
            return None;
        }
        Some(Dwell {
            attitude: mean_attitude(&table.attitude[readings.clone()])?,
            samples,
            readings,
        })
    }
}

/// The mean of attitudes that lie close together; `None` of none.
pub(crate) fn mean_attitude(attitudes: &[Matrix3<f64>]) -> Option<Matrix3<f64>> {
    let first = attitudes.first()?;
    let sum: Vector3<f64> = attitudes
        .iter()
        .map(|attitude| log(&(attitude * first.transpose())))
        .sum();
    Some(exp(sum / attitudes.len() as f64) * first)
}
