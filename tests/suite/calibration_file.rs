//! A made-up calibration and its file.

use std::path::{Path, PathBuf};

use turncal::calibration::result::Calibration;
use turncal::calibration::result::TriadRecord;
use turncal::imu::PerSensor;

pub const ALIGNED: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Aligned axes, equal scale factors, biases; no σ.
pub fn record() -> Calibration {
    let triad = |scale| TriadRecord {
        scale: [scale; 3],
        installation: ALIGNED,
        bias: [1.0, 2.0, 3.0],
    };
    Calibration {
        unit: Some(PerSensor::from_fn(|_| "count".to_owned())),
        ..Calibration::new(triad(2e6), triad(1e5))
    }
}

pub fn written(directory: &Path, name: &str, record: &Calibration) -> PathBuf {
    let path = directory.join(name);
    turncal_files::write_calibration(record, &path, false).unwrap();
    path
}
