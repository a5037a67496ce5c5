//! Comparison of navigation with the calibrations of several methods.

use rayon::prelude::*;

use super::{Mission, NavigationStudyError, Outlook};
use crate::calibration::Estimate;
use crate::earth::Site;
use crate::imu::{PerSensor, Triad};

/// The navigation errors of one calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodOutlook {
    /// Name that distinguishes the calibration from others, such as `EKF` or `closed form`.
    pub method: &'static str,
    /// The errors at the start and after each interval.
    pub outlook: Vec<Outlook>,
}

/// Navigates stationary and level at a site with the calibration of each method, for a duration that suits all
/// calibrations. The truth may be unknown.
///
/// # Errors
/// Returns [`NavigationStudyError`] if the site is at a pole or a calibration is singular.
pub fn navigate_with_each(
    site: &Site,
    methods: &[(&'static str, &Estimate)],
    truth: Option<&PerSensor<Triad>>,
) -> Result<Vec<MethodOutlook>, NavigationStudyError> {
    let estimates: Vec<&Estimate> = methods.iter().map(|(_, estimate)| *estimate).collect();
    let mission = Mission::suited(site, &estimates)?;
    let all = methods.par_iter().map(|&(method, estimate)| {
        let outlook = mission.outlook(estimate, truth)?;
        Ok(MethodOutlook { method, outlook })
    });
    all.collect()
}
