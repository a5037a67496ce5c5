//! What changes with temperature: biases for autopilots, everything for C.

use std::fmt::Write;

use super::source::{Document, Source};
use crate::calibration::ThermalRecord;
use crate::imu::{AXES, InstallationForm, Sensor};

/// Orders that PX4 and ArduPilot have.
const AUTOPILOT_ORDERS: usize = 3;
/// Temperature from which ArduPilot counts, °C, and the factor of its coefficients.
const ARDUPILOT_REFERENCE: f64 = 35.0;
const ARDUPILOT_FACTOR: f64 = 1e6;

/// An autopilot's front, right and down in right, front, up: axis and sign.
const FRONT_RIGHT_DOWN: [(usize, f64); 3] = [(1, 1.0), (0, 1.0), (2, -1.0)];

/// What formats that hold a calibration at one temperature leave off, if it changes.
pub(super) fn note(source: &Source) -> Option<String> {
    let thermal = source.record.temperature.as_ref()?;
    Some(format!(
        "change with temperature; this is the calibration at {} °C, another temperature is written with \
         --temperature-degc",
        thermal.range.gyro.reference
    ))
}

/// What autopilots leave off of it.
pub(super) fn autopilot_note(source: &Source) -> Option<String> {
    source.record.temperature.as_ref()?;
    Some(
        "change of scale factors and installation with temperature, of biases with its rate and of orders above three; \
         biases are those of the sensor's own temperature"
            .to_owned(),
    )
}

/// Powers of a bias about its reference, in rad/s or m/s² along an axis of right, front, up.
fn bias_powers(
    source: &Source,
    thermal: &ThermalRecord,
    sensor: Sensor,
    axis: usize,
) -> [f64; AUTOPILOT_ORDERS] {
    let name = format!("{}.bias.{}", sensor.name(), AXES[axis]);
    let nominal = source.normalised(sensor).nominal[axis];
    let powers = thermal.powers.get(&name);
    std::array::from_fn(|k| powers.and_then(|p| p.get(k)).copied().unwrap_or(0.0) / nominal)
}

/// PX4: `n − (X0 + X1 d + X2 d² + X3 d³)`, d = T − TREF, before `CAL_*` are applied.
///
/// Source: PX4-Autopilot, `src/modules/temperature_compensation/TemperatureCompensation.cpp`.
pub(super) fn px4(source: &Source, file: &mut Document) {
    let Some(thermal) = &source.record.temperature else {
        return;
    };
    let line = |file: &mut Document, name: &str, value: f64| {
        file.line(&format!("1\t1\t{name}\t{:?}\t9", value as f32));
    };
    for (sensor, letter) in [(Sensor::Gyro, 'G'), (Sensor::Accel, 'A')] {
        file.line(&format!("1\t1\tTC_{letter}_ENABLE\t1\t6"));
        let range = thermal.range.get(sensor);
        line(file, &format!("TC_{letter}0_TREF"), range.reference);
        line(file, &format!("TC_{letter}0_TMIN"), range.lowest);
        line(file, &format!("TC_{letter}0_TMAX"), range.highest);
        for (place, (axis, sign)) in FRONT_RIGHT_DOWN.into_iter().enumerate() {
            let powers = bias_powers(source, thermal, sensor, axis);
            // What does not change is in CAL_*.
            line(file, &format!("TC_{letter}0_X0_{place}"), 0.0);
            for (k, power) in powers.into_iter().enumerate() {
                let name = format!("TC_{letter}0_X{}_{place}", k + 1);
                line(file, &name, sign * power);
            }
        }
    }
}

/// ArduPilot: `n − p(T) + p(T_cal)` before the offsets are taken off, with `p(T) = (c₁ d + c₂ d² + c₃ d³) 10⁻⁶`,
/// d = T − 35 °C.
///
/// Source: ArduPilot, `AP_InertialSensor_tempcal.cpp`, `correct_sensor`.
pub(super) fn ardupilot(source: &Source, file: &mut Document) {
    let Some(thermal) = &source.record.temperature else {
        return;
    };
    let range = thermal.range.gyro;
    file.line("INS_TCAL1_ENABLE,1");
    file.line(&format!("INS_TCAL1_TMIN,{:?}", range.lowest as f32));
    file.line(&format!("INS_TCAL1_TMAX,{:?}", range.highest as f32));
    for (sensor, kind) in [(Sensor::Accel, "ACC"), (Sensor::Gyro, "GYR")] {
        let reference = thermal.range.get(sensor).reference;
        for (place, (axis, sign)) in FRONT_RIGHT_DOWN.into_iter().enumerate() {
            let name = ["X", "Y", "Z"][place];
            // Of a polynomial about the reference the same about 35 °C, but for a constant.
            let [a, b, c] = bias_powers(source, thermal, sensor, axis);
            let s = ARDUPILOT_REFERENCE - reference;
            let about = [a + 2.0 * b * s + 3.0 * c * s * s, b + 3.0 * c * s, c];
            for (k, power) in about.into_iter().enumerate() {
                let value = (sign * power * ARDUPILOT_FACTOR) as f32;
                file.line(&format!("INS_TCAL1_{kind}{}_{name},{value:?}", k + 1));
            }
        }
        file.line(&format!(
            "INS_{}1_CALTEMP,{:?}",
            if sensor == Sensor::Accel {
                "ACC"
            } else {
                "GYR"
            },
            reference as f32
        ));
    }
}

/// A function for C that calibrates at a temperature.
pub(super) fn c(source: &Source, file: &mut Document) {
    let Some(thermal) = &source.record.temperature else {
        return;
    };
    let form = source.record.installation_form.unwrap_or_default();
    if form != InstallationForm::General {
        return;
    }
    for sensor in Sensor::ALL {
        let (name, range) = (sensor.name(), thermal.range.get(sensor));
        let triad = match sensor {
            Sensor::Gyro => &source.record.gyro,
            Sensor::Accel => &source.record.accel,
        };
        let powers = |parameter: &str| -> Vec<f64> {
            let known = thermal.powers.get(&format!("{name}.{parameter}"));
            let of = |k: usize| known.and_then(|p| p.get(k)).copied().unwrap_or(0.0);
            (0..5).map(of).collect()
        };
        let row = |value: f64, parameter: &str| {
            let mut text = format!("{{{value:e}");
            for power in powers(parameter) {
                let _ = write!(text, ", {power:e}");
            }
            text + "}"
        };
        file.comment(&format!(
            "{name}: value at {} degC and coefficients of powers of T - {} from the first on; hold from {} to {} degC",
            range.reference, range.reference, range.lowest, range.highest
        ));
        file.line(&format!(
            "static const double turncal_{name}_reference_degc = {:e};",
            range.reference
        ));
        for (kind, values) in [("scale", triad.scale), ("bias", triad.bias)] {
            let rows = (0..3).map(|axis| row(values[axis], &format!("{kind}.{}", AXES[axis])));
            file.line(&format!(
                "static const double turncal_{name}_{kind}_of_t[3][6] = {{\n    {}\n}};",
                rows.collect::<Vec<_>>().join(",\n    ")
            ));
        }
        let entries = (0..9).map(|k| {
            let (i, j) = (k / 3, k % 3);
            row(
                triad.installation[i][j],
                &format!("installation.{}{}", AXES[i], AXES[j]),
            )
        });
        file.line(&format!(
            "static const double turncal_{name}_installation_of_t[9][6] = {{\n    {}\n}};\n",
            entries.collect::<Vec<_>>().join(",\n    ")
        ));
    }
    file.comment("the same at a temperature in degC that does not change; include <math.h> before");
    file.line(FUNCTION);
}

const FUNCTION: &str = "\
static inline double turncal_of_t(const double c[6], double d)
{
    return c[0] + d * (c[1] + d * (c[2] + d * (c[3] + d * (c[4] + d * c[5]))));
}

static inline void turncal_triad_at(const double scale[3][6], const double installation[9][6],
                                    const double bias[3][6], double d, const double *raw, double *calibrated)
{
    double a[3][3], n[3];
    for (int i = 0; i < 3; i++) {
        double k = turncal_of_t(scale[i], d), squares = 0.0;
        for (int j = 0; j < 3; j++) {
            a[i][j] = turncal_of_t(installation[3 * i + j], d);
            squares += i == j ? 0.0 : a[i][j] * a[i][j];
        }
        a[i][i] = sqrt(1.0 - squares);
        for (int j = 0; j < 3; j++)
            a[i][j] *= k;
        n[i] = raw[i] - turncal_of_t(bias[i], d);
    }
    double c[3][3], determinant = 0.0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int p = (i + 1) % 3, q = (i + 2) % 3, r = (j + 1) % 3, s = (j + 2) % 3;
            c[j][i] = a[p][r] * a[q][s] - a[p][s] * a[q][r];
        }
    for (int j = 0; j < 3; j++)
        determinant += a[0][j] * c[j][0];
    for (int i = 0; i < 3; i++)
        calibrated[i] = (c[i][0] * n[0] + c[i][1] * n[1] + c[i][2] * n[2]) / determinant;
}

static inline void turncal_calibrate_at(const double raw[6], double temperature_degc, double calibrated[6])
{
    double copy[6];
    for (int i = 0; i < 6; i++)
        copy[i] = raw[i];
    turncal_triad_at(turncal_gyro_scale_of_t, turncal_gyro_installation_of_t, turncal_gyro_bias_of_t,
                     temperature_degc - turncal_gyro_reference_degc, copy, calibrated);
    turncal_triad_at(turncal_accel_scale_of_t, turncal_accel_installation_of_t, turncal_accel_bias_of_t,
                     temperature_degc - turncal_accel_reference_degc, copy + 3, calibrated + 3);
}
";
