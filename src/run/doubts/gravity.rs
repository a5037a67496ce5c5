//! Stated gravity that does not fit the site.

use crate::earth::{ANOMALY_SIGMA, normal_gravity};
use crate::run::Run;
use crate::statistics::{FALSE_ALARM, chi_square_limit};
use crate::units::{DEGREE, MILLIGAL};

/// Reports gravity that differs from normal gravity by more than anomalies and its σ explain.
pub fn anomaly(run: &Run) -> Option<String> {
    let site = &run.site;
    let off = site.gravity - normal_gravity(site.latitude, site.height);
    let sigma = ANOMALY_SIGMA.hypot(site.gravity_sigma);
    let limit = chi_square_limit(1.0, FALSE_ALARM).sqrt() * sigma;
    (site.is_known && off.abs() > limit).then(|| {
        format!(
            "gravity_m_s2 = {} is {:.0} mGal {} normal gravity at latitude {:.4}°, height {:.0} m (limit {:.0} mGal, \
             false-alarm rate 0.1 %). Accelerometer scale factors follow gravity. Check gravity_m_s2, latitude_deg and \
             height_m.",
            site.gravity,
            off.abs() / MILLIGAL,
            if off > 0.0 { "above" } else { "below" },
            site.latitude / DEGREE,
            site.height,
            limit / MILLIGAL
        )
    })
}
