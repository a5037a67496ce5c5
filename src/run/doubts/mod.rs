//! Checks of a run when it is read, which report unusual but possible facts.

pub mod clock;
mod columns;
mod quaternions;

use super::Run;
use crate::earth::{ANOMALY_SIGMA, normal_gravity};
use crate::number::value;
use crate::recording::nanoseconds;
use crate::statistics::{FALSE_ALARM, chi_square_limit};
use crate::units::{DEGREE, MILLIGAL};

impl Run {
    /// The reports of all checks, a few sentences each, in display order.
    pub fn doubts(&self) -> Vec<String> {
        let checks: [fn(&Self) -> Option<String>; 5] = [
            gravity,
            columns::copied,
            columns::dead,
            coverage,
            clock::clock,
        ];
        checks.iter().filter_map(|check| check(self)).collect()
    }

    /// A sentence that states the true order or direction of the table quaternions, if gravity contradicts the stated
    /// one.
    pub fn table_quaternions(&self) -> Option<String> {
        quaternions::order(self)
    }
}

/// Reports gravity that differs from normal gravity by more than anomalies and its σ explain.
fn gravity(run: &Run) -> Option<String> {
    let site = &run.site;
    let off = site.gravity - normal_gravity(site.latitude, site.height);
    let sigma = ANOMALY_SIGMA.hypot(site.gravity_sigma);
    let limit = chi_square_limit(1.0, FALSE_ALARM).sqrt() * sigma;
    (site.is_known && off.abs() > limit).then(|| {
        format!(
            "gravity_m_s2 = {} is {:.0} mGal {} normal gravity at a latitude of {}° and a height of {:.0} m (limit \
             {:.0} mGal, false-alarm rate 0.1 %). The accelerometer scale factors change in the same proportion. \
             Check gravity_m_s2, latitude_deg and height_m.",
            value(site.gravity, 1e-4),
            off.abs() / MILLIGAL,
            if off > 0.0 { "above" } else { "below" },
            value(site.latitude / DEGREE, 0.1),
            site.height,
            limit / MILLIGAL
        )
    })
}

/// Reports a table log that starts after the IMU log, or ends before it, by more than its longest pause. Outside the
/// table log, the table may have moved unobserved.
fn coverage(run: &Run) -> Option<String> {
    let table = run.recording.table.as_ref()?;
    let (first, last) = (*table.time.first()?, *table.time.last()?);
    let pauses = table.time.windows(2).map(|pair| pair[1] - pair[0]);
    let longest = pauses.fold(0.0, f64::max) + run.recording.imu.period;
    let (start, end) = (run.recording.imu.start(), run.recording.imu.end());
    let late = (first - start > longest).then(|| format!("begins {:.1} s after", first - start));
    let early = (end - last > longest).then(|| format!("ends {:.1} s before", end - last));
    let off: Vec<String> = [late, early].into_iter().flatten().collect();
    let [first, last, start, end] = [first, last, start, end].map(nanoseconds);
    (!off.is_empty()).then(|| {
        format!(
            "The table log ({first}–{last} s) {} the IMU log ({start}–{end} s). The other parts of the IMU log cannot \
             be used. Check that both logs come from the same run and use the same clock.",
            off.join(" and ")
        )
    })
}
