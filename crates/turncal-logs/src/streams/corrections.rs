//! Removal of a calibration that an autopilot has already applied.
//!
//! Both PX4 and ArduPilot compute `(raw − offset) ⊙ scale` for accelerometers and `raw − offset` for gyros, and then
//! rotate the axes.
//!
//! Source: PX4-Autopilot, `src/lib/sensor_calibration` and `src/modules/sensors/vehicle_imu`; ArduPilot,
//! `AP_InertialSensor_Backend::_rotate_and_correct_accel` and `_rotate_and_correct_gyro`.

use super::Column;
use turncal_input::{PerSensor, Sensor};

/// Correction applied to a triad.
#[derive(Debug, Clone, PartialEq)]
pub struct Applied {
    /// The parameters, in words.
    pub name: String,
    pub offset: [f64; 3],
    pub scale: [f64; 3],
    /// Whether the axes were then rotated, which mixes their values, or further corrections were applied.
    pub is_more: bool,
}

/// Columns of corrected values, of their integration time in µs, and of the device number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Corrected {
    pub values: [usize; 3],
    pub interval: Option<usize>,
    pub device: Option<usize>,
}

impl Corrected {
    /// Three named columns of rates.
    pub fn rates(columns: &[Column], names: [&str; 3]) -> Option<Self> {
        let place = |name: &str| columns.iter().position(|column| column.name == name);
        match names.map(place) {
            [Some(x), Some(y), Some(z)] => Some(Self {
                values: [x, y, z],
                interval: None,
                device: None,
            }),
            _ => None,
        }
    }
}

/// Correction applied at this parameter revision, and the device.
struct Known {
    changes: u64,
    device: Option<f64>,
    applied: Option<Applied>,
}

/// Corrections to remove from the samples of a stream.
pub struct Undo {
    /// Program that applied the correction.
    pub program: &'static str,
    pub corrected: PerSensor<Option<Corrected>>,
    /// Descriptions of the corrections so far.
    done: PerSensor<Vec<String>>,
    /// Applied correction, while parameters and device are unchanged.
    found: PerSensor<Option<Known>>,
}

impl Undo {
    pub fn new(program: &'static str, corrected: PerSensor<Option<Corrected>>) -> Self {
        Self {
            program,
            corrected,
            done: PerSensor::default(),
            found: PerSensor::default(),
        }
    }

    /// Restores the raw sensor output of a sample; `changes` is the number of parameter changes so far. Returns whether
    /// there are new remarks.
    pub fn undo(
        &mut self,
        row: &mut [f64],
        changes: u64,
        applied: impl Fn(Sensor, Option<f64>) -> Option<Applied>,
    ) -> bool {
        let mut is_news = false;
        for sensor in Sensor::ALL {
            let Some(of) = self.corrected.get(sensor) else {
                continue;
            };
            let device = of.device.map(|place| row[place]);
            let known = self.found.get_mut(sensor);
            if !known
                .as_ref()
                .is_some_and(|known| known.changes == changes && known.device == device)
            {
                let applied = applied(sensor, device);
                let words = words(self.program, sensor, applied.as_ref());
                let done = self.done.get_mut(sensor);
                if !done.contains(&words) {
                    done.push(words);
                    is_news = true;
                }
                *known = Some(Known {
                    changes,
                    device,
                    applied,
                });
            }
            let found = known.as_ref().and_then(|known| known.applied.as_ref());
            if let Some(applied) = found.filter(|applied| !applied.is_more) {
                let seconds = of.interval.map_or(1.0, |place| 1e-6 * row[place]);
                for (axis, &place) in of.values.iter().enumerate() {
                    row[place] = row[place] / applied.scale[axis] + applied.offset[axis] * seconds;
                }
            }
        }
        is_news
    }

    /// Remarks on the removed corrections, one sentence per triad and correction.
    pub fn remarks(&self) -> Vec<String> {
        let of_triad = |&sensor: &Sensor| {
            let done = self.done.get(sensor);
            let part = if done.len() > 1 {
                "For part of the samples: "
            } else {
                ""
            };
            done.iter().map(move |words| format!("{part}{words}"))
        };
        Sensor::ALL.iter().flat_map(of_triad).collect()
    }
}

fn words(program: &str, sensor: Sensor, applied: Option<&Applied>) -> String {
    let triad = sensor.pick("gyros", "accelerometers");
    match applied {
        Some(of) if of.is_more => format!(
            "{program} corrected its {triad} by {} and also rotated the axes or compensated for temperature. turncal \
             cannot undo these changes, so the calibration applies to the corrected data.",
            of.name
        ),
        Some(of) => format!(
            "{program} corrected its {triad} by {}. turncal undid this correction.",
            of.name
        ),
        None => format!(
            "{program} corrects its {triad}; the log does not state the corrections, so turncal used the values \
             unchanged."
        ),
    }
}
