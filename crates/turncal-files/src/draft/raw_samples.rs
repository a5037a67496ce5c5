//! Rows of both triads as signed numbers, relative to the nominal zero of their registers.

use std::cell::OnceCell;

use nalgebra::Vector3;

use super::motion::{Motion, WINDOW, is_whole, mean};
use turncal::imu::{PerSensor, Sensor};

/// Codes of a register of 16 bits.
const CODES: f64 = 65_536.0;

/// Rows of both triads after subtraction of the nominal register zero.
pub struct RawSamples {
    pub triads: PerSensor<Vec<Vector3<f64>>>,
    /// Indices of the rows that follow a gap.
    pub breaks: Vec<usize>,
    /// Sample period, s.
    pub period: f64,
    /// Whether the rows are whole numbers.
    pub whole: PerSensor<bool>,
    /// Whether signed numbers of 16 bits were written as unsigned ones.
    wrapped: PerSensor<bool>,
    /// Nominal register zero.
    pub offset: PerSensor<f64>,
    motion: OnceCell<Motion>,
}

impl RawSamples {
    pub fn new(mut triads: PerSensor<Vec<Vector3<f64>>>, breaks: Vec<usize>, period: f64) -> Self {
        let wrapped = PerSensor::from_fn(|sensor| unwrap(triads.get_mut(sensor)));
        let whole = PerSensor::from_fn(|sensor| is_whole(triads.get(sensor)));
        let offset = PerSensor::from_fn(|sensor| {
            let samples = triads.get_mut(sensor);
            let zero = offset(samples).unwrap_or(0.0);
            samples.iter_mut().for_each(|of| of.add_scalar_mut(-zero));
            zero
        });
        Self {
            triads,
            breaks,
            period,
            whole,
            wrapped,
            offset,
            motion: OnceCell::new(),
        }
    }

    pub fn motion(&self) -> &Motion {
        let find = || Motion::find(&self.triads, &self.breaks, self.period);
        self.motion.get_or_init(find)
    }

    /// The motion that would result if the two triads were swapped.
    pub fn exchanged(&self) -> Motion {
        let PerSensor { gyro, accel } = &self.triads;
        let triads = PerSensor {
            gyro: accel.clone(),
            accel: gyro.clone(),
        };
        Motion::find(&triads, &self.breaks, self.period)
    }

    /// The axis whose specific force is negative in most of the first rows.
    pub fn points_down(&self) -> Option<usize> {
        let accel = &self.triads.accel;
        let rows = ((WINDOW / self.period).round() as usize).clamp(1, accel.len().max(1));
        let force = mean(accel.get(..rows)?);
        (0..3).find(|&axis| force[axis] < -0.9 * force.norm())
    }

    /// Reasons why columns of counts cannot be used unchanged.
    pub fn unfit(&self) -> Vec<String> {
        let wrapped = Sensor::ALL.into_iter().filter(|&of| *self.wrapped.get(of));
        let why = |sensor: Sensor| {
            format!(
                "the columns of {} contain signed 16-bit values written as unsigned: subtract 65536 from values of \
                 32768 and above, then run init again",
                sensor.name()
            )
        };
        wrapped.map(why).collect()
    }
}

/// Half the range of an integer register whose zero is in the middle of the range, if all values are near this middle.
pub fn offset(samples: &[Vector3<f64>]) -> Option<f64> {
    let values = || samples.iter().flat_map(|sample| sample.iter().copied());
    if values().any(|value| value.fract() != 0.0) {
        return None;
    }
    let (low, high) = (
        values().fold(f64::INFINITY, f64::min),
        values().fold(0.0, f64::max),
    );
    // Register sizes are 12, 14, 16, 20, 24 and 32 bits.
    let halves = [11, 13, 15, 19, 23, 31].map(|bits| 2f64.powi(bits));
    let lies_about = |half: &f64| low >= 0.0 && low < *half && high > *half && high < 2.0 * half;
    let half = halves.into_iter().find(lies_about)?;
    let mean = values().sum::<f64>() / (3 * samples.len()) as f64;
    ((mean / half - 1.0).abs() < 0.5).then_some(half)
}

/// Whether signed 16-bit numbers were written as unsigned; this is corrected. Small negative numbers then appear just
/// below 65536, and the signal is smoother with them below zero.
fn unwrap(samples: &mut [Vector3<f64>]) -> bool {
    let mut values = samples.iter().flat_map(|sample| sample.iter());
    if !is_whole(samples) || !values.all(|value| (0.0..CODES).contains(value)) {
        return false;
    }
    let changes = |of: fn(&Vector3<f64>) -> Vector3<f64>| -> f64 {
        let change = |pair: &[Vector3<f64>]| (of(&pair[1]) - of(&pair[0])).abs().sum();
        samples.windows(2).map(change).sum()
    };
    let signed = |sample: &Vector3<f64>| {
        sample.map(|value| value - if value >= 0.5 * CODES { CODES } else { 0.0 })
    };
    let wrapped = 2.0 * changes(signed) < changes(|sample| *sample);
    if wrapped {
        samples.iter_mut().for_each(|of| *of = signed(of));
    }
    wrapped
}
