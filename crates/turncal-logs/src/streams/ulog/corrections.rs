//! Topics corrected by PX4: `vehicle_imu`, `sensor_combined` and the topics of drivers before version 1.11, which have
//! `x_raw`; `sensor_accel` and `sensor_gyro` of later versions are raw.

use std::collections::BTreeMap;

use super::super::Column;
use super::super::bytes::{Broken, Kind, Slice};
use super::super::corrections::{Applied, Corrected, Undo};
use turncal_input::{PerSensor, Sensor};

/// Number of calibrations stored for each kind of sensor.
const CALIBRATIONS: usize = 4;

/// `P` messages, and the devices selected by PX4.
#[derive(Default)]
pub struct Parameters {
    values: BTreeMap<String, f64>,
    pub selected: PerSensor<Option<f64>>,
    /// Number of parameter changes.
    pub changes: u64,
}

impl Parameters {
    /// A state with these selected devices and, so far, no parameters.
    pub fn of(selected: PerSensor<Option<f64>>) -> Self {
        Self {
            selected,
            ..Self::default()
        }
    }

    /// Whether the selected gyros and accelerometers are known.
    pub fn have_selected(&self) -> bool {
        Sensor::ALL
            .into_iter()
            .all(|sensor| self.selected.get(sensor).is_some())
    }

    pub fn take(&mut self, content: &mut Slice) -> Result<(), Broken> {
        let key = content.measured_text(1, "a parameter name")?;
        let offset = content.offset();
        let (kind, name) = match key.split_once(' ') {
            Some(("float", name)) => (Kind::F32, name),
            Some(("int32_t", name)) => (Kind::I32, name),
            _ => {
                return Err(Broken::new(
                    offset,
                    format_args!("the parameter `{key}`"),
                    "`float NAME` or `int32_t NAME`",
                ));
            }
        };
        let value = kind.number(content.take(kind.size(), "a parameter")?, false);
        self.values
            .insert(name.to_owned(), value.unwrap_or(f64::NAN));
        self.changes += 1;
        Ok(())
    }

    pub fn select(&mut self, sensor: Sensor, device: f64) {
        let before = self.selected.get_mut(sensor).replace(device);
        self.changes += u64::from(before != Some(device));
    }

    fn value(&self, name: &str) -> Option<f64> {
        self.values.get(name).copied()
    }

    /// Corrections applied to the device with this number; if the number is unknown, to the selected or only device.
    pub fn applied(&self, sensor: Sensor, device: Option<f64>) -> Option<Applied> {
        let device = device.or(*self.selected.get(sensor));
        let (kind, temperature) = sensor.pick(("GYRO", "TC_G_ENABLE"), ("ACC", "TC_A_ENABLE"));
        let named = |number: usize| format!("CAL_{kind}{number}");
        let mut known = (0..CALIBRATIONS).filter(|&number| {
            let id = self.value(&format!("{}_ID", named(number)));
            id.is_some_and(|id| id != 0.0 && device.is_none_or(|device| device == id))
        });
        let (number, further) = (known.next()?, known.next());
        if device.is_none() && further.is_some() {
            return None;
        }
        let name = named(number);
        let axes = |what: &str, otherwise: f64| {
            let of = |axis| self.value(&format!("{name}_{axis}{what}"));
            ["X", "Y", "Z"].map(|axis| of(axis).unwrap_or(otherwise))
        };
        let is_on = |name: &str| self.value(name).is_some_and(|value| value > 0.0);
        Some(Applied {
            offset: axes("OFF", 0.0),
            scale: axes("SCALE", 1.0),
            is_more: is_on(&format!("{name}_ROT")) || is_on("SENS_BOARD_ROT") || is_on(temperature),
            name: format!("{name}_XOFF … {name}_ZSCALE"),
        })
    }
}

/// Columns of the selected devices in a topic; one topic is logged on change, the other at intervals.
pub fn selects(topic: &str, columns: &[Column]) -> PerSensor<Option<usize>> {
    PerSensor::from_fn(|sensor| {
        let name = match topic {
            "sensor_selection" => format!("{}_device_id", sensor.name()),
            "sensors_status_imu" => format!("{}_device_id_primary", sensor.name()),
            _ => return None,
        };
        columns.iter().position(|column| column.name == name)
    })
}

/// The corrections to be removed from the samples of a topic.
pub fn of_topic(topic: &str, columns: &[Column]) -> Undo {
    let place = |name: &str| columns.iter().position(|column| column.name == name);
    let corrected = PerSensor::from_fn(|sensor| {
        let [increments, interval, device, rates, of_driver] = match sensor {
            Sensor::Gyro => [
                "delta_angle",
                "delta_angle_dt",
                "gyro_device_id",
                "gyro_rad",
                "sensor_gyro",
            ],
            Sensor::Accel => [
                "delta_velocity",
                "delta_velocity_dt",
                "accel_device_id",
                "accelerometer_m_s2",
                "sensor_accel",
            ],
        };
        let triad = |stem: &str| {
            let names = [0, 1, 2].map(|k| format!("{stem}[{k}]"));
            Corrected::rates(columns, names.each_ref().map(|name| &**name))
        };
        match topic {
            "vehicle_imu" => Some(Corrected {
                // Before version 1.12, both triads shared one interval.
                interval: Some(place(interval).or_else(|| place("dt"))?),
                device: place(device),
                ..triad(increments)?
            }),
            "sensor_combined" => triad(rates),
            _ if topic == of_driver && place("x_raw").is_some() => Some(Corrected {
                device: place("device_id"),
                ..Corrected::rates(columns, ["x", "y", "z"])?
            }),
            _ => None,
        }
    });
    Undo::new("PX4", corrected)
}
