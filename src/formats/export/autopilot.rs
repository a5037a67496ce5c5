//! Parameters of PX4 and ArduPilot: offsets, and scales of accelerometers.
//!
//! Both make `(n − offset) ⊙ scale` of accelerometers and `n − offset` of gyros, in sensor axes, and turn these to
//! body axes (`SENS_BOARD_ROT`, `AHRS_ORIENTATION`) behind that.
//!
//! Source: PX4-Autopilot, `src/lib/sensor_calibration/Accelerometer.hpp` and `Gyroscope.hpp`; ArduPilot,
//! `AP_InertialSensor_Backend.cpp`, `_rotate_and_correct_accel` and `_rotate_and_correct_gyro`.

use nalgebra::{Matrix3, Vector3};

use super::Exported;
use super::along::{Along, Remainder};
use super::source::{Document, Source};
use super::thermal;
use crate::imu::Sensor;

/// How a program names and writes its parameters.
struct Program {
    name: &'static str,
    /// Name of a parameter of a triad: offset or scale of an axis.
    parameter: fn(Sensor, What, &str) -> String,
    line: fn(&str, f32) -> String,
    /// What changes with temperature.
    thermal: fn(&Source, &mut Document),
    notes: &'static [&'static str],
}

#[derive(Clone, Copy)]
enum What {
    Offset,
    Scale,
}

const PX4: Program = Program {
    name: "PX4",
    parameter: |sensor, what, axis| {
        let kind = match sensor {
            Sensor::Gyro => "GYRO",
            Sensor::Accel => "ACC",
        };
        let what = match what {
            What::Offset => "OFF",
            What::Scale => "SCALE",
        };
        format!("CAL_{kind}0_{axis}{what}")
    },
    // Vehicle, component, name, value, type 9: a 32-bit number.
    line: |name, value| format!("1\t1\t{name}\t{value:?}\t9"),
    thermal: thermal::px4,
    notes: &[
        "which device it is: PX4 takes the parameters whose CAL_ACC0_ID and CAL_GYRO0_ID are the device's; where the \
         instrument is another than number 0, rename them",
    ],
};

const ARDUPILOT: Program = Program {
    name: "ArduPilot",
    parameter: |sensor, what, axis| {
        let kind = match sensor {
            Sensor::Gyro => "GYR",
            Sensor::Accel => "ACC",
        };
        let what = match what {
            What::Offset => "OFFS",
            What::Scale => "SCAL",
        };
        format!("INS_{kind}{what}_{axis}")
    },
    line: |name, value| format!("{name},{value:?}"),
    thermal: thermal::ardupilot,
    notes: &[
        "which instance it is: the second has INS_ACC2OFFS_X and so on",
        "gyro offsets for long: ArduPilot finds them anew when it starts, unless INS_GYR_CAL is 0",
    ],
};

pub(super) fn px4(source: &Source) -> Exported {
    write(source, &PX4)
}

pub(super) fn ardupilot(source: &Source) -> Exported {
    write(source, &ARDUPILOT)
}

/// What the program makes of a triad's output: `scale ⊙ (n − offset)`.
fn held(sensor: Sensor, along: &Along) -> (Vector3<f32>, Vector3<f32>) {
    let triad = along.triads.get(sensor);
    let scale = match sensor {
        Sensor::Gyro => Vector3::repeat(1.0),
        Sensor::Accel => triad.sensitivity.diagonal().map(|s| s.recip() as f32),
    };
    (triad.bias.map(|b| b as f32), scale)
}

fn write(source: &Source, program: &Program) -> Exported {
    let along = Along::front_right_down(source);
    let held = |sensor| held(sensor, &along);
    let remainder = |sensor| {
        let (offset, scale) = held(sensor);
        let matrix = Matrix3::from_diagonal(&scale.map(f64::from));
        Remainder::of(
            sensor,
            along.triads.get(sensor),
            &matrix,
            &offset.map(f64::from),
        )
    };
    let left = Sensor::ALL.map(remainder);
    let lost = [
        format!(
            "{}, and no scale of gyros nor any misalignment is corrected",
            left[0].words()
        ),
        left[1].words(),
        "sigma and covariance of the parameters; they are in calibration.json".to_owned(),
    ];
    let notes = lost
        .into_iter()
        .chain(program.notes.iter().map(|&note| note.to_owned()));
    let mut file = Document::holding(source, "#", notes, |_| false);
    let reads = format!("{} reads rad/s and m/s^2", program.name);
    along.introduce(&mut file, &reads);
    left.iter().for_each(|left| left.lines(&mut file));
    for sensor in Sensor::ALL {
        let (offset, scale) = held(sensor);
        for (axis, name) in ["X", "Y", "Z"].into_iter().enumerate() {
            let parameter = (program.parameter)(sensor, What::Offset, name);
            file.line(&(program.line)(&parameter, offset[axis]));
            if sensor == Sensor::Accel {
                let parameter = (program.parameter)(sensor, What::Scale, name);
                file.line(&(program.line)(&parameter, scale[axis]));
            }
        }
    }
    (program.thermal)(source, &mut file);
    file.finish()
}
