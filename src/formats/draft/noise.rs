//! The noise of an instrument at rest.

use nalgebra::Vector3;

use crate::imu::PerSensor;
use crate::noise::{Clusters, NoiseFigures, TriadNoise};

/// Fewer samples show no noise.
const FEWEST: usize = 64;

/// What `turncal allan` makes of the same samples, in their unit a second; `per_second` turns a row into a
/// rate.
pub(super) fn figures(
    samples: &PerSensor<&[Vector3<f64>]>,
    period: f64,
    per_second: f64,
) -> PerSensor<Option<NoiseFigures>> {
    let count = samples.gyro.len();
    let clusters = Clusters::new(count, period);
    PerSensor::from_fn(|sensor| {
        let rows = samples.get(sensor).iter();
        let increments: Vec<Vector3<f64>> = rows.map(|row| row * per_second * period).collect();
        (count >= FEWEST)
            .then(|| TriadNoise::new(&increments, period, &clusters).figures())
            .flatten()
    })
}
