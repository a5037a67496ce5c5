//! What is possible in a run, and so out of the ordinary that it is said.

mod clock;
mod columns;

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use super::{Aiding, Run};
use crate::earth::normal_gravity;
use crate::imu::{AxisOrder, Sensor};
use crate::recording::{TableLog, nanoseconds};
use crate::units::{DEGREE, MILLIGAL};

/// Gravity where a laboratory stands departs from normal gravity by less, m/s²: this is more than ten
/// [`crate::earth::ANOMALY_SIGMA`].
const ANOMALY: f64 = 500.0 * MILLIGAL;
/// Part of sound records for which another order of quaternions, or a dead axis, is named.
const FALSE_ALARMS: f64 = 1e-6;

/// The attitude that a reading means, from the one that it was taken for.
type Reading = fn(&Matrix3<f64>) -> Matrix3<f64>;

impl Run {
    /// What is possible in it, and so out of the ordinary that it is said: a sentence for each.
    pub(crate) fn doubts(&self) -> Vec<String> {
        let table = self.recording.table.as_ref();
        let of_table = table.map(|table| {
            [
                coverage(self, table),
                order(self, table),
                clock::clock(self, table),
            ]
        });
        let of_columns = [columns::columns(self), columns::still(self)];
        let all = [gravity(self)]
            .into_iter()
            .chain(of_columns)
            .chain(of_table.into_iter().flatten());
        all.flatten().collect()
    }
}

/// Stated gravity that is not that of the place.
fn gravity(run: &Run) -> Option<String> {
    let site = &run.site;
    let off = site.gravity - normal_gravity(site.latitude, site.height);
    (off.abs() > ANOMALY).then(|| {
        format!(
            "gravity_m_s2 = {} is {:.0} mGal {} normal gravity at latitude {:.4}°, height {:.0} m; anomalies are \
             below {:.0} mGal: check gravity, latitude and height. Accelerometer scale factors follow gravity.",
            site.gravity,
            off.abs() / MILLIGAL,
            if off > 0.0 { "above" } else { "below" },
            site.latitude / DEGREE,
            site.height,
            ANOMALY / MILLIGAL
        )
    })
}

/// A table log that does not reach over the instrument's record. Beyond its longest pause the table may have
/// moved unseen.
fn coverage(run: &Run, table: &TableLog) -> Option<String> {
    let (first, last) = (*table.time.first()?, *table.time.last()?);
    let pauses = table.time.windows(2).map(|pair| pair[1] - pair[0]);
    let longest = pauses.fold(0.0, f64::max) + run.recording.imu.period;
    let (start, end) = (run.recording.imu.start(), run.recording.imu.end());
    let late = (first - start > longest).then(|| format!("begins {:.1} s after", first - start));
    let early = (end - last > longest).then(|| format!("ends {:.1} s before", end - last));
    let what: Vec<String> = [late, early].into_iter().flatten().collect();
    (!what.is_empty()).then(|| {
        format!(
            "The table's log, {} s to {} s, {} the IMU's record, {} s to {} s: nothing is known of the table in \
             between, and no dwell is found there. Are both of one run, and of one clock?",
            nanoseconds(first),
            nanoseconds(last),
            what.join(" and "),
            nanoseconds(start),
            nanoseconds(end)
        )
    })
}

/// Quaternions that hold gravity where the accelerometers do only if their columns are in another order, or
/// if they take East-North-Up to the body.
///
/// Specific force at rest is up along body axes, but for errors that prior σ tell. The likelihoods of two
/// hypotheses differ by the sum of squares that each leaves, its variance being taken from them. The order as
/// it is stated has the accelerometers' axes swapped and reversed in any way on its side, for these are
/// stated, too, and are looked into elsewhere.
fn order(run: &Run, table: &TableLog) -> Option<String> {
    if !table.axes.is_empty() {
        return None;
    }
    let prior = &run.instrument.prior.accel;
    let expected = prior.scale_sigma.norm_squared()
        + prior.installation_sigma.norm_squared()
        + (prior.bias_sigma / run.site.gravity).norm_squared()
        + 3.0 * run.table.position_sigma.powi(2);
    let dwells = run.dwells(Aiding::Table);
    let ups: Vec<(Vector3<f64>, Matrix3<f64>)> = dwells
        .iter()
        .filter_map(|dwell| {
            let force = dwell.mean(Sensor::Accel, run).output - prior.bias;
            Some((force.normalize(), dwell.position.as_ref()?.attitude))
        })
        .collect();
    let left = |axes: &AxisOrder, reordered: Reading| {
        let squares = ups.iter().map(|(force, attitude)| {
            let up = reordered(attitude).tr_mul(&Vector3::z());
            (axes.apply(force) - up).norm_squared()
        });
        squares.sum::<f64>() + expected * ups.len() as f64
    };
    let as_stated = AxisOrder::all().map(|axes| left(&axes, |attitude| *attitude));
    let as_stated = as_stated.fold(f64::INFINITY, f64::min);
    let others: [(&str, Reading); 2] = [
        (
            "are in the order x, y, z, w: in [turntable] name the last of the four columns first",
            w_last,
        ),
        (
            "take East-North-Up to the body, not the body to East-North-Up: turn the signs of x, y and z",
            |attitude| attitude.transpose(),
        ),
    ];
    let log_ratios = others.map(|(words, order)| {
        let ratio = as_stated / left(&AxisOrder::IDENTITY, order);
        (1.5 * ups.len() as f64 * ratio.ln(), words)
    });
    let (log_ratio, words) = log_ratios.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    (log_ratio > -FALSE_ALARMS.ln()).then(|| {
        format!(
            "The accelerometers observe gravity in {} dwells as if the table's quaternions {words} (10^{:.0} \
             times as likely as the stated order).",
            ups.len(),
            log_ratio / std::f64::consts::LN_10
        )
    })
}

/// The attitude if the columns taken for w, x, y, z are x, y, z, w.
fn w_last(attitude: &Matrix3<f64>) -> Matrix3<f64> {
    let rotation = Rotation3::from_matrix_unchecked(*attitude);
    let q = UnitQuaternion::from_rotation_matrix(&rotation);
    let columns = Quaternion::new(q.k, q.w, q.i, q.j);
    UnitQuaternion::from_quaternion(columns)
        .to_rotation_matrix()
        .into_inner()
}
