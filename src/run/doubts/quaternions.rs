//! Quaternions of the table in another order, or of the inverse rotation.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::attitude::{matrix, quaternion};
use crate::imu::AxisOrder;
use crate::run::Run;
use crate::run::motion::rests;
use crate::statistics::FALSE_ALARM;

/// The attitude that a reading means, from the one that it was taken for.
type Reading = fn(&Matrix3<f64>) -> Matrix3<f64>;

/// Quaternions that hold gravity where the accelerometers do only if their columns are in another order, or
/// if they take East-North-Up to the body.
///
/// Specific force at rest is up along body axes, except for errors within the prior σ. The likelihoods of two
/// hypotheses differ by their sums of squared residuals, from which the variance is taken. The order as
/// it is stated has the accelerometers' axes swapped and reversed in any way on its side, because these are
/// stated, too, and another check tests them.
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
            "are in the order x, y, z, w: in [turntable] name the last of the four columns first",
            w_last,
        ),
        (
            "take East-North-Up to the body, not the body to East-North-Up: reverse the signs of x, y and z",
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
            "the table's quaternions {words} (the accelerometers' gravity in {} dwells is 10^{:.0} times more \
             likely so)",
            rests.len(),
            log_ratio / std::f64::consts::LN_10
        )
    })
}

/// The attitude if the columns taken for w, x, y, z are x, y, z, w.
fn w_last(attitude: &Matrix3<f64>) -> Matrix3<f64> {
    let q = quaternion(attitude);
    let columns = Quaternion::new(q.k, q.w, q.i, q.j);
    matrix(&UnitQuaternion::from_quaternion(columns))
}
