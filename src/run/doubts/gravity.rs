//! Stated gravity that is not that of the place.

use crate::earth::normal_gravity;
use crate::run::Run;
use crate::units::{DEGREE, MILLIGAL};

/// Gravity where a laboratory stands departs from normal gravity by less, m/s²: this is more than ten
/// [`crate::earth::ANOMALY_SIGMA`].
const ANOMALY: f64 = 500.0 * MILLIGAL;

/// Gravity further from normal gravity than any anomaly.
pub fn anomaly(run: &Run) -> Option<String> {
    let site = &run.site;
    let off = site.gravity - normal_gravity(site.latitude, site.height);
    (off.abs() > ANOMALY).then(|| {
        format!(
            "gravity_m_s2 = {} is {:.0} mGal {} normal gravity at latitude {:.4}°, height {:.0} m; anomalies are \
             below {:.0} mGal. Accelerometer scale factors follow gravity. Check gravity_m_s2, latitude and height.",
            site.gravity,
            off.abs() / MILLIGAL,
            if off > 0.0 { "above" } else { "below" },
            site.latitude / DEGREE,
            site.height,
            ANOMALY / MILLIGAL
        )
    })
}
