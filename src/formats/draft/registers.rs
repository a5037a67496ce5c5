//! What rows of counts show of the registers they were read from: zero, scale, signs and order of axes.

use nalgebra::Vector3;

use super::axes::Axes;
use super::columns::Columns;
use super::gravity::Gravity;
use super::rests::{Rests, is_whole};
use crate::formats::Sheet;
use crate::imu::{PerSensor, Sensor};

/// Codes of a register of 16 bits.
const CODES: f64 = 65_536.0;
/// Rests of an accelerometer that is turned lie apart by this part at least of all it says …
const APART: f64 = 0.3;
/// … those of a gyro by less than this.
const TOGETHER: f64 = 0.1;
/// So many rests at least tell one from the other.
const FEWEST: usize = 4;

/// What counts show.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Registers {
    pub has_rests: bool,
    pub gravity: Option<Gravity>,
    pub axes: Option<Axes>,
    /// Whether what is called gyro is at rest where gravity is, and the other way round.
    pub swapped: bool,
}

impl Registers {
    /// Of samples above what registers are made to say at zero.
    pub fn find(samples: &PerSensor<Vec<Vector3<f64>>>, period: f64) -> Self {
        let Some(rests) = Rests::find(samples, period) else {
            return Self::default();
        };
        let swapped = rests.rows.len() >= FEWEST
            && rests.apart(Sensor::Gyro) > APART
            && rests.apart(Sensor::Accel) < TOGETHER;
        let gravity = Gravity::find(&rests.means.accel).filter(|_| !swapped);
        let axes = gravity
            .as_ref()
            .and_then(|gravity| Axes::find(samples, &rests, gravity, period));
        Self {
            has_rests: true,
            gravity,
            axes,
            swapped,
        }
    }

    /// Takes the zero from the samples where it is the register's own, and puts the gyros' columns into the
    /// order of the accelerometers'.
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
        if let Some(axes) = self.axes.as_ref().filter(|_| is_count.gyro) {
            for sample in &mut samples.gyro {
                *sample = Vector3::from(axes.columns.map(|k| sample[k]));
            }
            if let Some(triad) = &mut columns.triads.gyro {
                *triad = axes.columns.map(|k| triad[k]);
            }
        }
    }
}

/// Whether signed numbers of 16 bits were written as unsigned ones: small negative ones are then just below
/// 65536, and the record is smoother with them below zero.
fn is_wrapped(samples: &[Vector3<f64>]) -> bool {
    let mut values = samples.iter().flat_map(|sample| sample.iter());
    if !is_whole(samples) || !values.all(|value| (0.0..CODES).contains(value)) {
        return false;
    }
    let changes = |samples: &mut dyn Iterator<Item = Vector3<f64>>| {
        let mut before = None;
        let mut changes = 0.0;
        for sample in samples {
            changes += before.map_or(0.0, |before: Vector3<f64>| (sample - before).abs().sum());
            before = Some(sample);
        }
        changes
    };
    let plain = changes(&mut samples.iter().copied());
    let signed = changes(&mut samples.iter().map(signed));
    2.0 * signed < plain
}

/// Takes unsigned numbers for the signed ones that they were; of which triads.
pub(super) fn unwrap(samples: &mut PerSensor<Vec<Vector3<f64>>>) -> PerSensor<bool> {
    PerSensor::from_fn(|sensor| {
        let samples = samples.get_mut(sensor);
        let wrapped = is_wrapped(samples);
        if wrapped {
            samples
                .iter_mut()
                .for_each(|sample| *sample = signed(sample));
        }
        wrapped
    })
}

/// The signed number that an unsigned one of 16 bits was.
fn signed(sample: &Vector3<f64>) -> Vector3<f64> {
    sample.map(|value| value - if value >= 0.5 * CODES { CODES } else { 0.0 })
}

/// A column of a triad that says the same in all rows, though another of its triad does not.
fn constant(columns: &Columns, sheet: &Sheet) -> Option<usize> {
    let says_the_same = |k: &usize| {
        let values = sheet.columns[*k].iter().filter(|value| value.is_finite());
        let mut steps = values.clone().zip(values.skip(1));
        steps.all(|(one, next)| one == next)
    };
    Sensor::ALL.iter().find_map(|&sensor| {
        let triad = (*columns.triads.get(sensor))?;
        let constant = triad.iter().copied().find(says_the_same)?;
        (!triad.iter().all(says_the_same)).then_some(constant)
    })
}

/// Why columns of counts cannot be taken as they are.
pub(super) fn unfit(
    columns: &Columns,
    sheet: &Sheet,
    wrapped: &PerSensor<bool>,
    registers: &Registers,
) -> Vec<String> {
    let mut why = Vec::new();
    for sensor in Sensor::ALL {
        if *wrapped.get(sensor) {
            why.push(format!(
                "signed numbers of 16 bits are written as unsigned ones in those of {}: take 65536 from what is 32768 \
                 or more, and draft again",
                sensor.name()
            ));
        }
    }
    if let Some(column) = constant(columns, sheet) {
        why.push(format!(
            "{:?} says the same in all rows, so that no axis is read there",
            columns.names[column]
        ));
    }
    if registers.swapped {
        why.push(
            "gravity is in those of gyro, and those of accel are the same at every rest: their names are swapped"
                .to_owned(),
        );
    }
    why
}
