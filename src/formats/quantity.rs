//! Units of a file's rows, and the nominal scale that follows from each.

use crate::imu::{Output, Sensor};
use crate::units::{ARCSEC, DEG_PER_H, DEGREE, STANDARD_GRAVITY};

/// The words for what a row holds.
pub(super) const OUTPUTS: [(&str, Output); 3] = [
    ("pulse", Output::Pulse),
    ("increment", Output::Increment),
    ("rate", Output::Rate),
];

/// Units of a triad's rows: the file's quantity per second for one rad/s or m/s². A count has no
/// nominal scale of its own.
pub(super) fn units(sensor: Sensor, output: Output) -> &'static [(&'static str, Option<f64>)] {
    match (output, sensor) {
        (Output::Pulse, _) => &[("count", None)],
        (Output::Increment, Sensor::Gyro) => &[
            ("count", None),
            ("rad", Some(1.0)),
            ("deg", Some(1.0 / DEGREE)),
            ("arcsec", Some(1.0 / ARCSEC)),
        ],
        (Output::Increment, Sensor::Accel) => &[
            ("count", None),
            ("m/s", Some(1.0)),
            ("g*s", Some(1.0 / STANDARD_GRAVITY)),
        ],
        (Output::Rate, Sensor::Gyro) => &[
            ("count", None),
            ("rad/s", Some(1.0)),
            ("deg/s", Some(1.0 / DEGREE)),
            ("deg/h", Some(1.0 / DEG_PER_H)),
            ("mdps", Some(1e3 / DEGREE)),
        ],
        (Output::Rate, Sensor::Accel) => &[
            ("count", None),
            ("m/s^2", Some(1.0)),
            ("g", Some(1.0 / STANDARD_GRAVITY)),
            ("mg", Some(1e3 / STANDARD_GRAVITY)),
        ],
    }
}

/// What a unit of rows says of the nominal scale of a triad: the file's quantity per second for one
/// rad/s or m/s²; none for counts and for what is no unit.
pub(crate) fn unit_scale(sensor: Sensor, unit: &str) -> Option<f64> {
    let all = OUTPUTS
        .iter()
        .flat_map(|&(_, output)| units(sensor, output));
    let (_, scale) = all.into_iter().find(|&&(name, _)| name == unit)?;
    *scale
}
