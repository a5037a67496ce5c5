//! As-found state of the instrument: its deviation from the earlier calibration.

use super::results::{Quantity, nominal};
use turncal::calibration::result::frame::{free_parameters, in_common_form};
use turncal::calibration::result::{Calibration, Provenance};
use turncal::calibration::{ComparisonError, Group, Named, parameter_name};
use turncal::imu::{BodyFrame, InstallationForm, ParameterKind};

/// Comparison of an earlier calibration with this one.
#[derive(Debug, Clone, PartialEq)]
pub struct AsFound {
    /// Name of the earlier calibration.
    pub earlier: String,
    /// Common body frame.
    pub body_frame: BodyFrame,
    /// Every parameter that both have.
    pub changes: Vec<Change>,
}

/// Change of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Its name in the general form.
    pub name: String,
    /// Its quantity.
    pub quantity: Quantity,
    /// Earlier value, in SI; scale factors over their nominal value minus one.
    pub found: f64,
    /// Value now.
    pub left: f64,
    /// 1σ of the difference, as if both came from independent data; `None` if the earlier calibration states no σ.
    pub sigma: Option<f64>,
}

pub fn as_found(
    name: &str,
    earlier: &Calibration,
    now: &Calibration,
    provenance: &Provenance,
) -> Result<AsFound, ComparisonError> {
    let nominal = nominal(provenance);
    let [found, left] = in_common_form(
        Named {
            name,
            record: earlier,
        },
        Named {
            name: "this calibration",
            record: now,
        },
        &nominal,
    )?;
    let covariance = found.covariance.zip(left.covariance).map(|(a, b)| a + b);
    let (values_found, values_left) = (found.vector(), left.vector());
    let changes = free_parameters(left.body_frame).into_iter().map(|i| {
        let group = Group::of(i);
        let base = match group.kind() {
            ParameterKind::Scale => 1.0,
            _ => 0.0,
        };
        Change {
            name: parameter_name(InstallationForm::General, i).unwrap_or_default(),
            quantity: Quantity::Parameters(group),
            found: values_found[i] - base,
            left: values_left[i] - base,
            sigma: covariance.map(|p| p[(i, i)].max(0.0).sqrt()),
        }
    });
    Ok(AsFound {
        earlier: name.to_owned(),
        body_frame: left.body_frame,
        changes: changes.collect(),
    })
}
