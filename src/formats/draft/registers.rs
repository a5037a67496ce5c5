//! Registers behind the rows: zero, range, and unusable encodings.

use nalgebra::Vector3;

use super::columns::Columns;
use super::motion::{Motion, WINDOW, is_whole, mean};
use super::raw_run::{Gravity, RawRun, Turns};
use super::units::offset;
use crate::imu::{PerSensor, Sensor};

/// Codes of a register of 16 bits.
const CODES: f64 = 65_536.0;

/// Rows of both triads minus the nominal register zero.
pub struct Rows {
    pub triads: PerSensor<Vec<Vector3<f64>>>,
    /// Rows after a gap.
    pub breaks: Vec<usize>,
    /// s
    pub period: f64,
    /// Whether they are whole numbers.
    pub whole: PerSensor<bool>,
    /// Whether signed numbers of 16 bits were written as unsigned ones.
    wrapped: PerSensor<bool>,
    /// Nominal register zero.
    pub offset: PerSensor<f64>,
}

impl Rows {
    pub fn new(mut triads: PerSensor<Vec<Vector3<f64>>>, breaks: Vec<usize>, period: f64) -> Self {
        let wrapped = PerSensor::from_fn(|sensor| unwrap(triads.get_mut(sensor)));
        let whole = PerSensor::from_fn(|sensor| is_whole(triads.get(sensor)));
        let offset = PerSensor::from_fn(|sensor| {
            let samples = triads.get_mut(sensor);
            let zero = offset(samples).unwrap_or(0.0);
            samples
                .iter_mut()
                .for_each(|sample| sample.add_scalar_mut(-zero));
            zero
        });
        Self {
            triads,
            breaks,
            period,
            whole,
            wrapped,
            offset,
        }
    }

    pub fn motion(&self) -> Motion {
        Motion::find(&self.triads, &self.breaks, self.period)
    }

    /// The axis with mostly negative specific force in the first rows.
    pub fn points_down(&self) -> Option<usize> {
        let accel = &self.triads.accel;
        let rows = ((WINDOW / self.period).round() as usize).clamp(1, accel.len().max(1));
        let force = mean(accel.get(..rows)?);
        (0..3).find(|&axis| force[axis] < -0.9 * force.norm())
    }

    /// Reasons why count columns cannot be used unchanged.
    pub fn unfit(&self) -> Vec<String> {
        let wrapped = Sensor::ALL
            .into_iter()
            .filter(|&sensor| *self.wrapped.get(sensor));
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

/// Registers detected from counts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Registers {
    pub has_rests: bool,
    pub gravity: Option<Gravity>,
    pub turns: Option<Turns>,
}

impl Registers {
    /// From rows and their detected motion.
    pub fn find(rows: &Rows, motion: &Motion) -> Self {
        let found = |mut raw: RawRun| {
            let (has_rests, gravity) = (raw.rests() > 0, raw.gravity());
            Self {
                has_rests,
                turns: gravity.as_ref().and_then(|_| raw.turns()),
                gravity,
            }
        };
        let whole = found(RawRun::new(rows, &rows.breaks, motion));
        // Where gyros carry gravity from rest to rest no sections were laid end to end.
        if whole.turns.is_some() || motion.cuts.is_empty() {
            return whole;
        }
        let breaks = [&rows.breaks[..], &motion.cuts].concat();
        found(RawRun::new(rows, &breaks, motion).of_sections())
    }

    /// Subtracts the nominal register zero and reorders the gyro columns to match the accelerometers.
    pub fn apply(
        &self,
        samples: &mut PerSensor<Vec<Vector3<f64>>>,
        columns: &mut Columns,
        is_count: &PerSensor<bool>,
    ) {
        let zero = self.gravity.as_ref().and_then(|gravity| gravity.own_zero);
        if let Some(zero) = zero.filter(|_| is_count.accel) {
            samples.accel.iter_mut().for_each(|sample| *sample -= zero);
        }
        if let Some(turns) = self.turns.as_ref().filter(|_| is_count.gyro) {
            for sample in &mut samples.gyro {
                *sample = Vector3::from(turns.columns.map(|k| sample[k]));
            }
            if let Some(triad) = &mut columns.triads.gyro {
                *triad = turns.columns.map(|k| triad[k]);
            }
        }
    }
}

/// Whether signed 16-bit numbers were written as unsigned, which is corrected: small negative numbers then appear just
/// below 65536, and the signal is smoother with them below zero.
fn unwrap(samples: &mut [Vector3<f64>]) -> bool {
    let mut values = samples.iter().flat_map(|sample| sample.iter());
    if !is_whole(samples) || !values.all(|value| (0.0..CODES).contains(value)) {
        return false;
    }
    let changes = |of: fn(&Vector3<f64>) -> Vector3<f64>| -> f64 {
        let pairs = samples.windows(2);
        pairs
            .map(|pair| (of(&pair[1]) - of(&pair[0])).abs().sum())
            .sum()
    };
    let signed = |sample: &Vector3<f64>| {
        sample.map(|value| value - if value >= 0.5 * CODES { CODES } else { 0.0 })
    };
    let wrapped = 2.0 * changes(signed) < changes(|sample| *sample);
    if wrapped {
        samples
            .iter_mut()
            .for_each(|sample| *sample = signed(sample));
    }
    wrapped
}
