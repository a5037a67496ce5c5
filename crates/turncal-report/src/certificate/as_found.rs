//! As-found state of the instrument: its deviation from the earlier calibration.

use super::results::{Measured, Quantity, coverage, nominal};
use turncal::calibration::result::frame::{Canonical, free_parameters, in_common_form};
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
    /// Every parameter that both calibrations have.
    pub changes: Vec<Change>,
}

/// Change of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Value in the earlier calibration, with its uncertainty (zero if not stated).
    pub found: Measured,
    /// Value now.
    pub left: Measured,
}

impl Change {
    /// The present value minus the earlier value.
    pub fn difference(&self) -> f64 {
        self.left.value - self.found.value
    }

    /// Expanded uncertainty of the difference, assuming that both calibrations are from independent data; `None` if the
    /// earlier calibration states no uncertainty.
    pub fn expanded(&self) -> Option<f64> {
        let (found, left) = (self.found.expanded, self.left.expanded);
        (found > 0.0).then(|| found.hypot(left))
    }
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
    let measured = |of: &Canonical, record: &Calibration, i: usize| {
        let group = Group::of(i);
        let base = match group.kind() {
            ParameterKind::Scale => 1.0,
            _ => 0.0,
        };
        let name = parameter_name(InstallationForm::General, i).unwrap_or_default();
        let (coverage_factor, degrees_of_freedom) = coverage(record, &name);
        let sigma = of.sigma().map_or(0.0, |sigma| sigma[i]);
        Measured {
            name,
            quantity: Quantity::Parameters(group),
            value: of.vector()[i] - base,
            expanded: coverage_factor * sigma,
            coverage_factor,
            degrees_of_freedom,
        }
    };
    let changes = free_parameters(left.body_frame)
        .into_iter()
        .map(|i| Change {
            found: measured(&found, earlier, i),
            left: measured(&left, now, i),
        });
    Ok(AsFound {
        earlier: name.to_owned(),
        body_frame: left.body_frame,
        changes: changes.collect(),
    })
}
