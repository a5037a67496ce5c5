//! Parameters for PX4, ArduPilot, Betaflight and INAV: offsets, and scales of the accelerometers.
//!
//! PX4 and ArduPilot compute `(n − offset) ⊙ scale` for accelerometers and `n − offset` for gyros, in sensor axes, and
//! then rotate to body axes (`SENS_BOARD_ROT`, `AHRS_ORIENTATION`). INAV and Betaflight do the same in whole counts.
//!
//! Magnetometers: PX4 multiplies by a symmetric matrix and then turns to body axes, ArduPilot does the reverse and adds its
//! offsets; INAV computes `(counts − magzero) 1024 / maggain` before it turns; Betaflight turns and only subtracts
//! `mag_calibration`.
//!
//! Source: PX4-Autopilot, `src/lib/sensor_calibration` and `src/modules/temperature_compensation`; ArduPilot,
//! `AP_InertialSensor_Backend.cpp`, `_rotate_and_correct_accel`, and `AP_InertialSensor_tempcal.cpp`, `correct_sensor`;
//! Betaflight, `acceleration.c`, `applyAccelerationTrims`; INAV, `acceleration.c`, `applyAccelerationZero`, and
//! `gyro.c`, `gyro_zero_x`. PX4 skips thermal parameters whose `TC_G0_ID` or `TC_A0_ID` is not the identity of the
//! device: `TemperatureCompensation::set_sensor_id`. Magnetometers: PX4-Autopilot, `sensor_calibration/Magnetometer.hpp`;
//! ArduPilot, `AP_Compass_Backend.cpp`, `correct_field`; INAV and Betaflight, `compass.c`, `compassUpdate`.

use nalgebra::{Matrix3, Vector3};

use super::affine::Affine;
use super::compass::{Compass, Reads, compass};
use super::remarks::{Exported, Remarks};
use super::values::Values;
use turncal::imu::{AXES, PerSensor, Sensor};
use turncal::units::{DEGREE, STANDARD_GRAVITY};

const UPPER: [&str; 3] = ["X", "Y", "Z"];
const UNCORRECTED: &str = "gyro scale factors, and all misalignments";
/// Reference temperature of ArduPilot, °C, and the factor of its coefficients.
const ARDUPILOT_REFERENCE: f64 = 35.0;
const ARDUPILOT_FACTOR: f64 = 1e6;
/// Counts per g of a 16-bit sensor with ±16 g, the setting of Betaflight and INAV …
const COUNTS_PER_G: f64 = 2048.0;
/// … and per rad/s with ±2000 °/s.
const COUNTS_PER_RAD_S: f64 = 16.4 / DEGREE;
/// Unit gain in INAV.
const INAV_ONE: f64 = 4096.0;

/// What the programs correct of a magnetometer: PX4 gauss, ArduPilot milligauss, Betaflight and INAV counts.
pub const PX4: Reads = Reads {
    per_tesla: Some(1e4),
    of_chip: true,
};
pub const ARDUPILOT: Reads = Reads {
    per_tesla: Some(1e7),
    of_chip: false,
};
pub const INAV: Reads = Reads {
    per_tesla: None,
    of_chip: true,
};
pub const BETAFLIGHT: Reads = Reads {
    per_tesla: None,
    of_chip: false,
};
/// Unit gain of a magnetometer in INAV.
const INAV_COMPASS: f64 = 1024.0;

/// Names with values.
type Parameters = Vec<(String, f64)>;

/// Offsets of both triads, and scales of the accelerometers, as represented by 32-bit numbers.
fn single(values: &Values) -> PerSensor<Affine> {
    let rounded = |v: Vector3<f64>| v.map(|value| f64::from(value as f32));
    let PerSensor { gyro, accel } = &values.triads;
    let scale = accel.sensitivity.diagonal().map(f64::recip);
    PerSensor {
        gyro: Affine::offset(rounded(gyro.bias)),
        accel: Affine::diagonal(rounded(scale), rounded(accel.bias)),
    }
}

/// Parameters whose names have `#` in place of the axis: offsets of the gyros, offsets and scales of the accelerometers.
fn parameters(
    values: &Values,
    program: &PerSensor<Affine>,
    [gyro, offset, scale]: [&str; 3],
) -> Parameters {
    if values.record.is_of_magnetometer() {
        return Parameters::new();
    }
    let PerSensor { gyro: g, accel: a } = program;
    let of_axis = |name: &str, k: usize, value: f64| (name.replace('#', UPPER[k]), value);
    let gyros = (0..3).map(|k| of_axis(gyro, k, g.offset[k]));
    let offset = |k| of_axis(offset, k, a.offset[k]);
    let scale = |k| of_axis(scale, k, a.matrix[(k, k)]);
    let accel = (0..3).flat_map(|k| [offset(k), scale(k)]);
    gyros.chain(accel).collect()
}

/// Parameters of the magnetometer: offsets times `sign`, diagonal and other entries of its matrix; and what they omit.
fn of_compass(
    values: &Values,
    (reads, sign): (Reads, f64),
    [offset, scale, off_diagonal]: [&str; 3],
) -> (Parameters, Option<String>) {
    let found = match compass(values, reads) {
        None => return (Vec::new(), None),
        Some(Err(why)) => return (Vec::new(), Some(format!("magnetometer: {why}"))),
        Some(Ok(found)) => found,
    };
    let all = [
        (offset, found.offset * sign),
        (scale, found.matrix.diagonal()),
        (off_diagonal, found.off_diagonal()),
    ];
    let axes = |(name, values): (&str, Vector3<f64>)| {
        [0, 1, 2].map(|k| (name.replace('#', UPPER[k]), values[k]))
    };
    let parameters = all.into_iter().flat_map(axes).collect();
    (parameters, Some(found.residual(&found.matrix)))
}

/// Vehicle, component, name, value, type (9: 32-bit floating point, 6: integer).
fn px4_lines(parameters: Parameters) -> String {
    let line = |(name, value): (String, f64)| format!("1\t1\t{name}\t{:?}\t9\n", value as f32);
    parameters.into_iter().map(line).collect()
}

/// Temperature correction of PX4: `n − (X0 + X1 d + X2 d² + X3 d³)`, d = T − TREF, before `CAL_*` are applied.
pub fn px4(values: &Values) -> Exported {
    let program = single(values);
    let names = ["CAL_GYRO0_#OFF", "CAL_ACC0_#OFF", "CAL_ACC0_#SCALE"];
    let mut text = px4_lines(parameters(values, &program, names));
    let names = ["CAL_MAG0_#OFF", "CAL_MAG0_#SCALE", "CAL_MAG0_#ODIAG"];
    let (compass, of_compass) = of_compass(values, (PX4, 1.0), names);
    let id = "CAL_MAG0_ID: set it to the device_id that `listener sensor_mag` shows";
    let of_id = (!compass.is_empty()).then(|| id.to_owned());
    text += &px4_lines(compass);
    // PX4 compares the identities with those of its drivers, which no log of samples holds.
    let thermal = values.record.temperature.iter();
    let ids = match &values.record.temperature {
        None => "CAL_GYRO0_ID and CAL_ACC0_ID: set both to the device_id",
        Some(_) => "CAL_GYRO0_ID = TC_G0_ID and CAL_ACC0_ID = TC_A0_ID: set them to the device_id",
    };
    let ids = format!(
        "{ids} that `listener sensor_gyro` and `listener sensor_accel` show; without it, PX4 ignores the other \
         parameters"
    );
    for (thermal, sensor) in thermal.flat_map(|thermal| Sensor::ALL.map(|sensor| (thermal, sensor)))
    {
        let range = thermal.range.get(sensor);
        let all = sensor.pick("TC_G", "TC_A");
        let mut parameters = vec![
            (format!("{all}0_TREF"), range.reference),
            (format!("{all}0_TMIN"), range.lowest),
            (format!("{all}0_TMAX"), range.highest),
        ];
        let powers = values.triads.get(sensor).bias_powers;
        for (axis, [a, b, c]) in powers.into_iter().enumerate() {
            // The constant part is in CAL_*.
            let powers = [0.0, a, b, c].into_iter().enumerate();
            parameters.extend(powers.map(|(k, power)| (format!("{all}0_X{k}_{axis}"), power)));
        }
        text += &px4_lines(parameters);
        text += &format!("1\t1\t{all}_ENABLE\t1\t6\n");
    }
    let reads = ("#", "PX4 reads rad/s and m/s^2");
    Remarks::of_program(values, reads, &program, &[UNCORRECTED, &ids])
        .omitting(of_compass.into_iter().chain(of_id))
        .above(&text)
}

/// Temperature correction of ArduPilot: `n − p(T) + p(T_cal)` before the offsets are subtracted, with `p(T) = (c₁ d +
/// c₂ d² + c₃ d³) 10⁻⁶`, d = T − 35 °C.
pub fn ardupilot(values: &Values) -> Exported {
    let program = single(values);
    let notes = [
        UNCORRECTED,
        "instance number: for the second instance, use INS_ACC2OFFS_X and so on",
        "permanent gyro offsets: ArduPilot re-estimates them at every start unless INS_GYR_CAL is 0",
    ];
    let lines = |parameters: Parameters| -> String {
        let line = |(name, value): (String, f64)| format!("{name},{:?}\n", value as f32);
        parameters.into_iter().map(line).collect()
    };
    let names = ["INS_GYROFFS_#", "INS_ACCOFFS_#", "INS_ACCSCAL_#"];
    let mut text = lines(parameters(values, &program, names));
    let names = ["COMPASS_OFS_#", "COMPASS_DIA_#", "COMPASS_ODI_#"];
    let (compass, of_compass) = of_compass(values, (ARDUPILOT, -1.0), names);
    text += &lines(compass);
    if let Some(thermal) = &values.record.temperature {
        let range = thermal.range.gyro;
        let mut parameters = vec![
            ("INS_TCAL1_TMIN".to_owned(), range.lowest),
            ("INS_TCAL1_TMAX".to_owned(), range.highest),
        ];
        for (sensor, kind) in [(Sensor::Accel, "ACC"), (Sensor::Gyro, "GYR")] {
            let reference = thermal.range.get(sensor).reference;
            for (axis, [a, b, c]) in UPPER.iter().zip(values.triads.get(sensor).bias_powers) {
                // Converts a polynomial about the reference to one about 35 °C, except for a constant.
                let s = ARDUPILOT_REFERENCE - reference;
                let about = [a + 2.0 * b * s + 3.0 * c * s * s, b + 3.0 * c * s, c];
                let name = |k: usize| format!("INS_TCAL1_{kind}{k}_{axis}");
                let about = about.map(|power| power * ARDUPILOT_FACTOR);
                parameters.extend((1..).map(name).zip(about));
            }
            parameters.push((format!("INS_{kind}1_CALTEMP"), reference));
        }
        text += "INS_TCAL1_ENABLE,1\n";
        text += &lines(parameters);
    }
    let reads = ("#", "ArduPilot reads rad/s and m/s^2");
    Remarks::of_program(values, reads, &program, &notes)
        .omitting(of_compass)
        .above(&text)
}

/// A vector rounded to whole counts.
fn counts(v: &Vector3<f64>, per_unit: f64) -> Vector3<f64> {
    v.map(|value| (value * per_unit).round())
}

fn of_counts(what: &str, counts: f64, unit: &str) -> String {
    format!(
        "the counts are for {what} with {counts:.0} counts per {unit}; if yours has n counts per {unit}, multiply the \
         values by n / {counts:.0}"
    )
}

/// Betaflight subtracts `acc_calibration` from the counts of each axis and zeroes the gyros at every start.
pub fn betaflight(values: &Values) -> Exported {
    let per_unit = COUNTS_PER_G / STANDARD_GRAVITY;
    let zero = counts(&values.triads.accel.bias, per_unit);
    let program = PerSensor {
        gyro: Affine::offset(Vector3::zeros()),
        accel: Affine::offset(zero / per_unit),
    };
    let notes = ["all gyro parameters, because Betaflight zeroes the gyros at every start"];
    let reads = (
        "#",
        "commands for the Betaflight command line, computed from rad/s and m/s^2",
    );
    let line = |key: &str, zero: Vector3<f64>, end: &str| {
        let [x, y, z] = [zero.x, zero.y, zero.z].map(|count| count as i64);
        format!("set {key} = {x},{y},{z}{end}\n")
    };
    let (compass, of_compass) = counted_compass(values, BETAFLIGHT);
    let compass = compass.map(|of| (of.offset.map(f64::round), of.residual(&Matrix3::identity())));
    let (compass, residual) = compass.unzip();
    let compass = compass.map(|zero| line("mag_calibration", zero, ""));
    let compass = compass.unwrap_or_default() + "save\n";
    let remarks =
        Remarks::of_program(values, reads, &program, &notes).omitting(of_compass.or(residual));
    if values.record.is_of_magnetometer() {
        return remarks.above(&compass);
    }
    remarks
        .defines([
            of_counts("an accelerometer", COUNTS_PER_G, "g"),
            "these values are for a log recorded with acc_calibration = 0,0,0,0, because Betaflight subtracts \
             acc_calibration before logging".to_owned(),
        ])
        .above(&(line("acc_calibration", zero, ",1") + &compass))
}

/// The magnetometer of a program that reads counts; or the reason why there is none.
fn counted_compass(values: &Values, reads: Reads) -> (Option<Compass>, Option<String>) {
    match compass(values, reads) {
        None => (None, None),
        Some(Err(why)) => (None, Some(format!("magnetometer: {why}"))),
        Some(Ok(found)) => (Some(found), None),
    }
}

/// INAV computes `(counts − acczero) accgain / 4096` for accelerometers; INAV uses the gyro zeros unless it estimates
/// them itself.
pub fn inav(values: &Values) -> Exported {
    let PerSensor { gyro, accel } = &values.triads;
    let per_unit = COUNTS_PER_G / STANDARD_GRAVITY;
    let zero = counts(&accel.bias, per_unit);
    let gain = counts(&accel.sensitivity.diagonal().map(f64::recip), INAV_ONE);
    let gyro_zero = counts(&gyro.bias, COUNTS_PER_RAD_S);
    let program = PerSensor {
        gyro: Affine::offset(gyro_zero / COUNTS_PER_RAD_S),
        accel: Affine::diagonal(gain / INAV_ONE, zero / per_unit),
    };
    let set = |name: &str, values: &Vector3<f64>| -> String {
        let line = |(axis, value)| format!("set {name}_{axis} = {value:.0}\n");
        AXES.iter().zip(values).map(line).collect()
    };
    let all = [
        ("acczero", &zero),
        ("accgain", &gain),
        ("gyro_zero", &gyro_zero),
    ];
    let mut text = String::new();
    let (compass, of_compass) = counted_compass(values, INAV);
    let compass = compass.map(|of| {
        let gain = of
            .matrix
            .diagonal()
            .map(|factor| (INAV_COMPASS / factor).round());
        text += &set("magzero", &of.offset.map(f64::round));
        text += &set("maggain", &gain);
        of.residual(&Matrix3::from_diagonal(
            &gain.map(|gain| INAV_COMPASS / gain),
        ))
    });
    let reads = (
        "#",
        "commands for the INAV command line, computed from rad/s and m/s^2",
    );
    let remarks = Remarks::of_program(values, reads, &program, &[UNCORRECTED]);
    let remarks = remarks.omitting(of_compass.or(compass));
    if values.record.is_of_magnetometer() {
        return remarks.above(&(text + "save\n"));
    }
    let triads = all.map(|(name, values)| set(name, values)).concat();
    remarks
        .defines([
            of_counts("an accelerometer", COUNTS_PER_G, "g"),
            of_counts("gyros", COUNTS_PER_RAD_S, "rad/s"),
            "these values are for a log recorded with acczero and gyro_zero = 0, accgain = 4096 and init_gyro_cal = \
             OFF, because INAV applies its own values before logging"
                .to_owned(),
        ])
        .above(&(triads + &text + "set init_gyro_cal = OFF\nsave\n"))
}
