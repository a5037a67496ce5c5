//! The calibration memory of a RealSense D400 camera, which corrects its output itself.
//!
//! Source: librealsense, `tools/rs-imu-calibration/rs-imu-calibration.py`; `src/ds/ds-calib-parsers.cpp`,
//! `dm_v2_imu_calib_parser::get_intrinsic`.

use super::affine::Affine;
use super::remarks::{Exported, Remarks};
use super::values::Values;
use turncal::imu::PerSensor;
use turncal::units::DEGREE;

/// A table with its header: version, kind, size, and checksum of the content.
fn table([major, minor]: [u8; 2], kind: u16, content: &[u8]) -> Vec<u8> {
    let mut sum = flate2::Crc::new();
    sum.update(content);
    let (length, sum) = (content.len() as u32, sum.sum());
    let [kind_low, kind_high] = kind.to_le_bytes();
    let start = [major, minor, kind_low, kind_high];
    let words = [start, length.to_le_bytes(), [0xff; 4], sum.to_le_bytes()];
    [words.as_flattened(), content].concat()
}

/// The 520 bytes of the memory of the motion module, as `rs-imu-calibration` writes them.
///
/// librealsense computes `matrix n − bias`, with matrices column by column and the gyro bias of the table in °/s. Unused
/// bytes are 0xff.
pub fn write(values: &Values) -> Exported {
    let program = PerSensor::from_fn(|sensor| Affine::complete(values.triads.get(sensor)));
    let notes = [
        "the rotation and translation relative to the depth sensor, which keep their design values",
        "the serial number that follows the table, which is left empty",
    ];
    let mut imu = vec![0xff; 37 * 4 + 96];
    // Intrinsics are set, extrinsics are not.
    imu[..4].copy_from_slice(&(1u32 << 8).to_le_bytes());
    let of_triad = |triad: &Affine, unit: f64| {
        let bias = triad.corrected_bias() / unit;
        [triad.matrix.as_slice(), bias.as_slice()].concat()
    };
    let numbers = [
        of_triad(&program.accel, 1.0),
        of_triad(&program.gyro, DEGREE),
    ]
    .concat();
    for (place, value) in imu[13 * 4..].chunks_exact_mut(4).zip(numbers) {
        place.copy_from_slice(&(value as f32).to_le_bytes());
    }
    let mut tables = table([2, 1], 0x20, &imu);
    tables.extend([0xff; 32]);
    let mut memory = table([2, 0], 0x20, &tables);
    memory.resize(520 - 16, 0xff);
    let memory = table([1, 1], 0x09, &memory);
    Remarks::of_program(values, ("#", "in memory"), &program, &notes).of_file(memory)
}
