//! Cameras with an IMU: the memory of a RealSense D400, and DepthAI's `ImuCalibrationParams`.
//!
//! Source: librealsense, `tools/rs-imu-calibration/rs-imu-calibration.py`; depthai-core,
//! `include/depthai/common/ImuParameters.hpp`.

use serde_json::{Value, json};

use super::Exported;
use super::document::Document;
use super::source::{Axes, Held, Source};
use crate::imu::{PerSensor, Sensor};

/// Both triads whole.
fn held(axes: &Axes) -> PerSensor<Held> {
    PerSensor::from_fn(|sensor| Held::all(axes.triads.get(sensor)))
}

/// A table with its header: version, kind, size, and checksum of the content.
fn table([major, minor]: [u8; 2], kind: u16, content: &[u8]) -> Vec<u8> {
    let mut sum = flate2::Crc::new();
    sum.update(content);
    let mut table = vec![major, minor];
    table.extend(kind.to_le_bytes());
    table.extend((content.len() as u32).to_le_bytes());
    table.extend([0xff; 4]);
    table.extend(sum.sum().to_le_bytes());
    table.extend(content);
    table
}

/// The 520 bytes of the memory of the motion module, as `rs-imu-calibration` writes them.
///
/// librealsense computes `matrix n − bias`, with matrices column by column. Unused bytes are 0xff.
pub fn realsense(source: &Source) -> Exported {
    let axes = Axes::log(source);
    let held = held(&axes);
    let notes = [
        "rotation and translation to the depth sensor, which keep their design values",
        "the serial number after the table, which stays empty",
    ];
    let document = Document::correcting(source, &axes, ("#", "in memory"), &held, &notes);
    let mut imu = vec![0xff; 37 * 4 + 96];
    // Intrinsics are used, extrinsics are not.
    imu[..4].copy_from_slice(&(1u32 << 8).to_le_bytes());
    let of_triad = |sensor| {
        let Held { matrix, offset } = held.get(sensor);
        let bias = matrix * offset;
        matrix.iter().chain(&bias).copied().collect::<Vec<f64>>()
    };
    let values = [of_triad(Sensor::Accel), of_triad(Sensor::Gyro)].concat();
    for (place, value) in imu[13 * 4..].chunks_exact_mut(4).zip(values) {
        place.copy_from_slice(&(value as f32).to_le_bytes());
    }
    let mut tables = table([2, 1], 0x20, &imu);
    tables.extend([0xff; 32]);
    let mut memory = table([2, 0], 0x20, &tables);
    memory.resize(520 - 16, 0xff);
    Exported {
        bytes: table([1, 1], 0x09, &memory),
        ..document.finish()
    }
}

/// For `CalibrationHandler`: `u = matrix (n, 1)`, three rows of four, and noise.
pub fn depthai(source: &Source) -> Exported {
    let axes = Axes::log(source);
    let held = held(&axes);
    let document = Document::correcting(source, &axes, ("#", "DepthAI"), &held, &[]);
    let rows = |sensor| -> Value {
        let Held { matrix, offset } = held.get(sensor);
        let bias = matrix * offset;
        let row = |i: usize| json!([matrix[(i, 0)], matrix[(i, 1)], matrix[(i, 2)], -bias[i]]);
        [0, 1, 2].map(row).into()
    };
    let noise = |sensor| -> Value {
        let varying = source.varying(sensor);
        let axis = json!({
            "noiseDensity": source.noise(sensor).map_or(0.0, |noise| noise.random_walk),
            "randomWalk": varying.map_or(0.0, |of| of.walk()),
            "biasStability": varying.map_or(0.0, |of| of.sigma),
        });
        json!({ "x": axis, "y": axis, "z": axis })
    };
    let content = json!({
        "noise": {
            "name": source.record.meta.get("instrument"),
            "accelerometer": noise(Sensor::Accel),
            "gyroscope": noise(Sensor::Gyro),
        },
        "accelerometer": rows(Sensor::Accel),
        "gyroscope": rows(Sensor::Gyro),
    });
    // JSON has no comments: what is not held is in the notes alone.
    Exported {
        bytes: format!("{content:#}\n").into_bytes(),
        ..document.finish()
    }
}
