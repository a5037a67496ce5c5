//! Where an instrument of unknown scale and zero stands.

use std::f64::consts::FRAC_1_SQRT_2;
use std::ops::Range;

use nalgebra::Vector3;

use super::motion::{PART, SIGMAS, WINDOW, mean, means, stretches};
use crate::imu::{PerSensor, Sensor};
use crate::statistics::median;

/// This part of the record at least is at rest, or it holds no rest …
const AT_REST: f64 = 0.1;
/// … and the part of normal deviates that lies within this of zero, σ.
const WITHIN: f64 = 0.125_661;
/// Rests are told if what they hide is below this part of what moves: what data sheets allow a scale.
pub(super) const TOLERANCE: f64 = 0.03;

/// Stretches during which both triads say the same.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rests {
    pub rows: Vec<Range<usize>>,
    /// Of each of them.
    pub means: PerSensor<Vec<Vector3<f64>>>,
    /// Half of what window means cover on the axis where they cover most.
    pub extent: PerSensor<f64>,
}

impl Rests {
    /// By how windows differ from their neighbours, held against how most alike ones do: no scale and no zero
    /// is needed. None where nothing is at rest.
    pub fn find(samples: &PerSensor<Vec<Vector3<f64>>>, period: f64) -> Option<Self> {
        let length = ((WINDOW / period).round() as usize).clamp(1, samples.gyro.len().div_ceil(8));
        let windows = PerSensor::from_fn(|sensor| means(samples.get(sensor), length));
        let extent = PerSensor::from_fn(|sensor| extent(windows.get(sensor)));
        let mut at_rest = vec![true; windows.gyro.len()];
        for sensor in Sensor::ALL {
            let windows = windows.get(sensor);
            let hidden = SIGMAS * floor(windows);
            // Gyros that never turn say nothing but their noise, accelerometers always gravity: with one attitude
            // alone its size is left to hold noise against.
            let size = extent.get(sensor).max(usual(windows));
            if sensor == Sensor::Accel && hidden > TOLERANCE * size {
                return None;
            }
            let step = if is_whole(samples.get(sensor)) {
                1.0
            } else {
                0.0
            };
            let limit = hidden + PART * extent.get(sensor) + step;
            let near = |k: usize, other: Option<&Vector3<f64>>| {
                other.is_none_or(|other| (other - windows[k]).norm() < limit)
            };
            for (k, at_rest) in at_rest.iter_mut().enumerate() {
                let before = k.checked_sub(1).and_then(|k| windows.get(k));
                *at_rest &= near(k, before) && near(k, windows.get(k + 1));
            }
        }
        // At its ends a rest is already or still a motion.
        let rows: Vec<Range<usize>> = stretches(&at_rest)
            .into_iter()
            .filter(|stretch| stretch.len() > 3)
            .map(|stretch| (stretch.start + 1) * length..(stretch.end - 1) * length)
            .collect();
        let means = PerSensor::from_fn(|sensor| {
            let of = |rows: &Range<usize>| mean(&samples.get(sensor)[rows.clone()]);
            rows.iter().map(of).collect()
        });
        (!rows.is_empty()).then_some(Self {
            rows,
            means,
            extent,
        })
    }

    /// How far the rests of a triad lie apart, as a part of all it says: an accelerometer's much, for gravity
    /// lies otherwise in each, a gyro's little.
    pub fn apart(&self, sensor: Sensor) -> f64 {
        extent(self.means.get(sensor)) / self.extent.get(sensor)
    }
}

pub(super) fn is_whole(samples: &[Vector3<f64>]) -> bool {
    let mut values = samples.iter().flat_map(|sample| sample.iter());
    values.all(|value| value.fract() == 0.0)
}

fn usual(means: &[Vector3<f64>]) -> f64 {
    let mut sizes: Vec<f64> = means.iter().map(Vector3::norm).collect();
    median(&mut sizes).unwrap_or(0.0)
}

fn extent(means: &[Vector3<f64>]) -> f64 {
    let of = |axis: usize| {
        let values = means.iter().map(|mean| mean[axis]);
        let low = values.clone().fold(f64::INFINITY, f64::min);
        values.fold(f64::NEG_INFINITY, f64::max) - low
    };
    0.5 * (0..3).map(of).fold(0.0, f64::max)
}

/// 1σ of the noise of means of windows on the axis where it is most, by those least different from the next: with
/// less than half of a record at rest the others move.
fn floor(means: &[Vector3<f64>]) -> f64 {
    let of = |axis: usize| {
        let differences = means.windows(2).map(|pair| pair[1][axis] - pair[0][axis]);
        let mut changes: Vec<f64> = differences.map(f64::abs).collect();
        changes.sort_by(f64::total_cmp);
        let least = changes.get((AT_REST * changes.len() as f64) as usize);
        least.map_or(0.0, |least| FRAC_1_SQRT_2 * least / WITHIN)
    };
    (0..3).map(of).fold(0.0, f64::max)
}
