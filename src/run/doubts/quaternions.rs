//! Detection of table quaternions that are in a different order or describe the inverse rotation.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::attitude::{matrix, quaternion};
use crate::imu::AxisOrder;
use crate::run::Run;
use crate::run::motion::rests;
use crate::statistics::FALSE_ALARM;

/// Maps the attitude as read to the attitude under another order of the columns.
type Reading = fn(&Matrix3<f64>) -> Matrix3<f64>;

/// Reports quaternions that agree with the accelerometers' gravity only if their columns are in another order, or
/// if they rotate East-North-Up to the body.
///
/// Specific force at rest points up, apart from errors within the prior σ. The likelihood ratio of two hypotheses
/// follows from their sums of squared residuals, with the variance estimated from each sum. For the stated order, the
/// best of all 48 axis orders of the accelerometers is used, because that order is also only stated and is tested by
/// another check.
pub fn order(run: &Run) -> Option<String> {
    let table = run.recording.table.as_ref()?;
    if !table.axes.is_empty() {
        return None;
    }
    let prior = &run.instrument.prior.accel;
    let expected = prior.scale_sigma.norm_squared()
        + prior.installation_sigma.norm_squared()
        + (prior.bias_sigma / run.site.gravity).norm_squared()
        + 3.0 * run.table.position_sigma.powi(2);
    let mut rests = rests(run);
    rests.retain(|rest| rest.dwell.position.is_some());
    let left = |axes: &AxisOrder, reordered: Reading| {
        let squares = rests.iter().filter_map(|rest| {
            let up = reordered(&rest.dwell.position.as_ref()?.attitude).tr_mul(&Vector3::z());
            Some((axes.apply(&rest.force.normalize()) - up).norm_squared())
        });
        squares.sum::<f64>() + expected * rests.len() as f64
    };
    let as_stated = AxisOrder::all().map(|axes| left(&axes, |attitude| *attitude));
    let as_stated = as_stated.fold(f64::INFINITY, f64::min);
    let others: [(&str, Reading); 2] = [
        (
            "are in the order x, y, z, w. In [turntable], name the last of the four columns first",
            w_last,
        ),
        (
            "are rotations from East-North-Up to body, not from body to East-North-Up. Reverse the signs of x, y and z",
            |attitude| attitude.transpose(),
        ),
    ];
    let likelier = others.map(|(words, order)| {
        let ratio = as_stated / left(&AxisOrder::IDENTITY, order);
        (1.5 * rests.len() as f64 * ratio.ln(), words)
    });
    let limit = (others.len() as f64 / FALSE_ALARM).ln();
    let (log_ratio, words) = likelier.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    (log_ratio > limit).then(|| {
        format!(
            "the table quaternions {words} (with this change, the measured gravity in {} dwells is 10^{:.0} times \
             more likely)",
            rests.len(),
            log_ratio / std::f64::consts::LN_10
        )
    })
}

/// The attitude if the columns read as w, x, y, z are x, y, z, w.
fn w_last(attitude: &Matrix3<f64>) -> Matrix3<f64> {
    let q = quaternion(attitude);
    let columns = Quaternion::new(q.k, q.w, q.i, q.j);
    matrix(&UnitQuaternion::from_quaternion(columns))
}
