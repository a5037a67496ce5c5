//! White noise of a standing instrument.

use nalgebra::Vector3;

use crate::noise::allan::overlapping;

/// Cluster time at which white noise is most of what is seen, s.
const CLUSTER: f64 = 1.0;
/// Clusters below which nothing is said.
const FEWEST_CLUSTERS: usize = 8;

/// Random walk by the Allan deviation at one cluster time, RMS of the axes, in the samples' unit a second and
/// √Hz; `per_second` turns a row into a rate.
pub(super) fn white_level(samples: &[Vector3<f64>], period: f64, per_second: f64) -> Option<f64> {
    let longest = samples.len() / FEWEST_CLUSTERS;
    let size = ((CLUSTER / period).round() as usize).clamp(1, longest.max(1));
    let axes = (0..3).map(|axis| {
        let increments = samples
            .iter()
            .map(|sample| sample[axis] * per_second * period);
        let curve = overlapping(increments, period, &[size]);
        Some(curve.variance.first()? * curve.tau.first()?)
    });
    let squares: Vec<f64> = axes.collect::<Option<_>>()?;
    let mean = squares.iter().sum::<f64>() / 3.0;
    (longest > 0 && mean > 0.0).then(|| mean.sqrt())
}
