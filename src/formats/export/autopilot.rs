//! Parameters of PX4, ArduPilot, Betaflight and INAV: offsets, and scales of accelerometers.
//!
//! PX4 and ArduPilot compute `(n − offset) ⊙ scale` for accelerometers and `n − offset` for gyros, in sensor axes, and
//! then rotate to body axes (`SENS_BOARD_ROT`, `AHRS_ORIENTATION`). INAV and Betaflight do the same in whole counts.
//!
//! Source: PX4-Autopilot, `src/lib/sensor_calibration` and `src/modules/temperature_compensation`; ArduPilot,
//! `AP_InertialSensor_Backend.cpp`, `_rotate_and_correct_accel`, and `AP_InertialSensor_tempcal.cpp`, `correct_sensor`;
//! Betaflight, `acceleration.c`, `applyAccelerationTrims`; INAV, `acceleration.c`, `applyAccelerationZero`, and
//! `gyro.c`, `gyro_zero_x`.

use nalgebra::{Matrix3, Vector3};

use super::Exported;
use super::document::Document;
use super::source::{Axes, Held, Source};
use crate::imu::{AXES, PerSensor, Sensor};
use crate::units::{DEGREE, STANDARD_GRAVITY};

const UPPER: [&str; 3] = ["X", "Y", "Z"];
const UNCORRECTED: &str = "gyro scale factors and all misalignments";
/// Polynomial orders in temperature supported by PX4 and ArduPilot.
const ORDERS: usize = 3;
/// Reference temperature of ArduPilot, °C, and the factor of its coefficients.
const ARDUPILOT_REFERENCE: f64 = 35.0;
const ARDUPILOT_FACTOR: f64 = 1e6;
/// Counts per g of a 16-bit sensor with ±16 g, the setting of Betaflight and INAV …
const COUNTS_PER_G: f64 = 2048.0;
/// … and per rad/s with ±2000 °/s.
const COUNTS_PER_RAD_S: f64 = 16.4 / DEGREE;
/// Temperature dependence that autopilots cannot represent.
const OF_TEMPERATURE: &str = "change of scale factors and misalignments with temperature, change of biases with \
    temperature rate, and orders above three; biases refer to the temperature of the sensor";
/// Unit gain in INAV.
const INAV_ONE: f64 = 4096.0;

/// Offsets of both triads, and scales of the accelerometers, as far as numbers of 32 bits hold them.
fn held(axes: &Axes) -> PerSensor<Held> {
    PerSensor::from_fn(|sensor| {
        let triad = axes.triads.get(sensor);
        let scale = sensor.pick(
            Vector3::repeat(1.0),
            triad.sensitivity.diagonal().map(f64::recip),
        );
        let rounded = |v: Vector3<f64>| v.map(|value| f64::from(value as f32));
        Held {
            matrix: Matrix3::from_diagonal(&rounded(scale)),
            offset: rounded(triad.bias),
        }
    })
}

/// Parameters with the names of a program for offset and scale of an axis.
fn parameters(
    file: &mut Document,
    held: &PerSensor<Held>,
    offset: impl Fn(Sensor, &str) -> String,
    scale: impl Fn(&str) -> String,
    line: fn(&str, f32) -> String,
) {
    for sensor in Sensor::ALL {
        let held = held.get(sensor);
        for (k, axis) in UPPER.into_iter().enumerate() {
            file.line(&line(&offset(sensor, axis), held.offset[k] as f32));
            if sensor == Sensor::Accel {
                file.line(&line(&scale(axis), held.matrix[(k, k)] as f32));
            }
        }
    }
}

/// Powers of the biases of a triad about its reference, axis by axis along front, right, down, in rad/s or m/s².
fn bias_powers(source: &Source, axes: &Axes, sensor: Sensor) -> [[f64; ORDERS]; 3] {
    // Of front, right and down only down has another sign than the axis of the record.
    std::array::from_fn(|axis| {
        let sign = if axis == 2 { -1.0 } else { 1.0 };
        let name = AXES[axes.axis_of_record(axis)];
        let name = format!("{}.bias.{name}", sensor.name());
        let nominal = axes.triads.get(sensor).nominal[axis];
        let thermal = source.record.temperature.as_ref();
        let powers = thermal.and_then(|thermal| thermal.powers.get(&name));
        let power = |k: usize| powers.and_then(|p| p.get(k)).copied().unwrap_or(0.0);
        std::array::from_fn(|k| sign * power(k) / nominal)
    })
}

/// Vehicle, component, name, value, type: 9 is a number of 32 bits.
fn px4_line(name: &str, value: f32) -> String {
    format!("1\t1\t{name}\t{value:?}\t9")
}

/// PX4's temperature: `n − (X0 + X1 d + X2 d² + X3 d³)`, d = T − TREF, before `CAL_*` are applied.
pub fn px4(source: &Source) -> Exported {
    let axes = Axes::front_right_down(source);
    let held = held(&axes);
    let id = "device identity: PX4 uses the parameters whose CAL_ACC0_ID and CAL_GYRO0_ID match the device; rename \
        them for an instrument other than number 0";
    let reads = ("#", "PX4 reads rad/s and m/s^2");
    let mut file = Document::correcting(source, &axes, reads, &held, &[UNCORRECTED, id]);
    let kind = |sensor: Sensor| sensor.pick("GYRO", "ACC");
    let offset = |sensor, axis: &str| format!("CAL_{}0_{axis}OFF", kind(sensor));
    let scale = |axis: &str| format!("CAL_ACC0_{axis}SCALE");
    parameters(&mut file, &held, offset, scale, px4_line);
    let Some(thermal) = &source.record.temperature else {
        return file.finish();
    };
    for (sensor, letter) in [(Sensor::Gyro, 'G'), (Sensor::Accel, 'A')] {
        let mut set = |name: String, value: f64| {
            file.line(&px4_line(&format!("TC_{letter}{name}"), value as f32));
        };
        let range = thermal.range.get(sensor);
        set("0_TREF".to_owned(), range.reference);
        set("0_TMIN".to_owned(), range.lowest);
        set("0_TMAX".to_owned(), range.highest);
        for (place, powers) in bias_powers(source, &axes, sensor).into_iter().enumerate() {
            // What does not change is in CAL_*.
            set(format!("0_X0_{place}"), 0.0);
            for (k, power) in powers.into_iter().enumerate() {
                set(format!("0_X{}_{place}", k + 1), power);
            }
        }
        file.line(&format!("1\t1\tTC_{letter}_ENABLE\t1\t6"));
    }
    file.finish().without(OF_TEMPERATURE)
}

/// ArduPilot's temperature: `n − p(T) + p(T_cal)` before the offsets are subtracted, with `p(T) = (c₁ d + c₂ d² + c₃
/// d³) 10⁻⁶`, d = T − 35 °C.
pub fn ardupilot(source: &Source) -> Exported {
    let axes = Axes::front_right_down(source);
    let held = held(&axes);
    let notes = [
        UNCORRECTED,
        "instance number: the second instance uses INS_ACC2OFFS_X and so on",
        "permanent gyro offsets: ArduPilot re-estimates them at every start unless INS_GYR_CAL is 0",
    ];
    let reads = ("#", "ArduPilot reads rad/s and m/s^2");
    let mut file = Document::correcting(source, &axes, reads, &held, &notes);
    let kind = |sensor: Sensor| sensor.pick("GYR", "ACC");
    let line = |name: &str, value: f32| format!("{name},{value:?}");
    let offset = |sensor, axis: &str| format!("INS_{}OFFS_{axis}", kind(sensor));
    let scale = |axis: &str| format!("INS_ACCSCAL_{axis}");
    parameters(&mut file, &held, offset, scale, line);
    let Some(thermal) = &source.record.temperature else {
        return file.finish();
    };
    let range = thermal.range.gyro;
    file.line("INS_TCAL1_ENABLE,1");
    file.line(&line("INS_TCAL1_TMIN", range.lowest as f32));
    file.line(&line("INS_TCAL1_TMAX", range.highest as f32));
    for sensor in [Sensor::Accel, Sensor::Gyro] {
        let reference = thermal.range.get(sensor).reference;
        let powers = bias_powers(source, &axes, sensor);
        for (name, [a, b, c]) in UPPER.into_iter().zip(powers) {
            // Of a polynomial about the reference the same about 35 °C, except for a constant.
            let s = ARDUPILOT_REFERENCE - reference;
            let about = [a + 2.0 * b * s + 3.0 * c * s * s, b + 3.0 * c * s, c];
            for (k, power) in about.into_iter().enumerate() {
                let name = format!("INS_TCAL1_{}{}_{name}", kind(sensor), k + 1);
                file.line(&line(&name, (power * ARDUPILOT_FACTOR) as f32));
            }
        }
        let name = format!("INS_{}1_CALTEMP", kind(sensor));
        file.line(&line(&name, reference as f32));
    }
    file.finish().without(OF_TEMPERATURE)
}

/// Offsets of accelerometers in whole counts.
fn counts(v: &Vector3<f64>, per_unit: f64) -> Vector3<f64> {
    v.map(|value| (value * per_unit).round())
}

fn of_counts(what: &str, counts: f64, unit: &str) -> String {
    format!(
        "counts are for {what} with {counts:.0} counts per {unit}; for n counts per {unit}, multiply by n / {counts:.0}"
    )
}

/// Betaflight subtracts `acc_calibration` from the counts of each axis and zeroes the gyros at every start.
pub fn betaflight(source: &Source) -> Exported {
    let axes = Axes::log(source);
    let per_unit = COUNTS_PER_G / STANDARD_GRAVITY;
    let zero = counts(&axes.triads.accel.bias, per_unit);
    let held = PerSensor {
        gyro: Held::offset(Vector3::zeros()),
        accel: Held::offset(zero / per_unit),
    };
    let notes = ["all gyro parameters, because it zeroes the gyros at every start"];
    let reads = ("#", "commands for its command line,");
    let mut file = Document::correcting(source, &axes, reads, &held, &notes);
    file.comment(&of_counts("an accelerometer", COUNTS_PER_G, "g"));
    let [x, y, z] = [zero.x, zero.y, zero.z].map(|count| count as i64);
    file.line(&format!("set acc_calibration = {x},{y},{z},1\nsave"));
    file.finish()
}

/// INAV computes `(counts − acczero) accgain / 4096` for accelerometers; gyro zeros are used if it does not estimate
/// them.
pub fn inav(source: &Source) -> Exported {
    let axes = Axes::log(source);
    let PerSensor { gyro, accel } = &axes.triads;
    let per_unit = COUNTS_PER_G / STANDARD_GRAVITY;
    let zero = counts(&accel.bias, per_unit);
    let gain = counts(&accel.sensitivity.diagonal().map(f64::recip), INAV_ONE);
    let gyro_zero = counts(&gyro.bias, COUNTS_PER_RAD_S);
    let held = PerSensor {
        gyro: Held::offset(gyro_zero / COUNTS_PER_RAD_S),
        accel: Held {
            matrix: Matrix3::from_diagonal(&(gain / INAV_ONE)),
            offset: zero / per_unit,
        },
    };
    let reads = ("#", "commands for its command line,");
    let mut file = Document::correcting(source, &axes, reads, &held, &[UNCORRECTED]);
    file.comment(&of_counts("an accelerometer", COUNTS_PER_G, "g"));
    file.comment(&of_counts("gyros", COUNTS_PER_RAD_S, "rad/s"));
    for (name, values) in [
        ("acczero", zero),
        ("accgain", gain),
        ("gyro_zero", gyro_zero),
    ] {
        for (axis, value) in AXES.iter().zip(&values) {
            file.line(&format!("set {name}_{axis} = {value:.0}"));
        }
    }
    file.line("set init_gyro_cal = OFF\nsave");
    file.finish()
}
