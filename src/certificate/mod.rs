//! A calibration certificate: what ISO/IEC 17025:2017, 7.8.2 and 7.8.4, asks for, from a calibration and what
//! the laboratory states. It claims no accreditation.

mod as_found;
mod conformity;
pub mod dcc;
mod laboratory;
mod results;

use crate::calibration::FindingKind;
use crate::calibration::result::{Calibration, Provenance};
use crate::calibration::{ComparisonError, Correction, CorrectionError};
use crate::imu::BodyFrame;
use crate::lot::Specification;

pub use as_found::{AsFound, Change};
pub use conformity::{Conformity, Decided, Decision};
pub use laboratory::{Condition, Contact, Day, DecisionRule, Equipment, Laboratory, Place};
pub use results::{Measured, Quantity, temperature_words, to_twelve_digits};

/// Why there can be no certificate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CertificateError {
    /// The calibration may not be used.
    #[error(
        "the calibration {reason}, expected one that may be used; a certificate of it would be wrong. Look at its \
         findings."
    )]
    NotUsable {
        /// Why not.
        reason: &'static str,
    },
    /// Something that a certificate needs is not in the file.
    #[error("no `{field}` in the calibration, expected a file of this version; calibrate again")]
    Missing {
        /// Which field.
        field: &'static str,
    },
    /// Nothing says how conformity is decided.
    #[error(
        "no `decision.rule` in lab.toml, expected \"guard-band\" or \"simple-acceptance\"; ISO/IEC 17025, 7.8.6, \
         asks for it where conformity is stated. Add it."
    )]
    NoRule,
    /// The calibrations cannot be compared, or not with limits.
    #[error(transparent)]
    Comparison(#[from] ComparisonError),
    /// A calibration that corrects nothing.
    #[error(transparent)]
    Correction(#[from] CorrectionError),
}

/// What a certificate says.
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// What the laboratory states.
    pub laboratory: Laboratory,
    /// The calibration.
    pub calibration: Calibration,
    /// What it was made of.
    pub provenance: Provenance,
    /// SHA-256 of the calibration's file.
    pub sha256: String,
    /// Every parameter with its expanded uncertainty.
    pub results: Vec<Measured>,
    /// Every parameter of the instrument's error terms with its expanded uncertainty.
    pub terms: Vec<Measured>,
    /// Covariance of the estimated parameters, in the order of the results, in SI.
    pub covariance: Vec<Vec<f64>>,
    /// Whether limits are kept, if any are given.
    pub conformity: Option<Conformity>,
    /// How the instrument was found, if an earlier calibration is given.
    pub as_found: Option<AsFound>,
}

impl Certificate {
    /// The certificate of a calibration whose file has this SHA-256.
    ///
    /// # Errors
    /// [`CertificateError`] if the calibration may not be used, or something is missing.
    pub fn new(
        calibration: Calibration,
        sha256: String,
        laboratory: Laboratory,
        specification: Option<&Specification>,
        earlier: Option<(&str, &Calibration)>,
    ) -> Result<Self, CertificateError> {
        let not_usable = |reason| Err(CertificateError::NotUsable { reason });
        if calibration.converged == Some(false) {
            return not_usable("did not converge");
        }
        if calibration
            .findings
            .iter()
            .any(|f| f.is(FindingKind::Unexplained))
        {
            return not_usable("leaves more than noise explains");
        }
        Correction::of_record(&calibration)?;
        let missing = |field| CertificateError::Missing { field };
        let provenance = calibration.provenance.clone();
        let provenance = provenance.ok_or(missing("provenance"))?;
        let (results, covariance) =
            results::results(&calibration, &provenance).ok_or(missing("covariance"))?;
        let conformity = match specification {
            Some(specification) => {
                let rule = laboratory.rule.ok_or(CertificateError::NoRule)?;
                Some(conformity::conformity(
                    &calibration,
                    &provenance,
                    specification,
                    rule,
                )?)
            }
            None => None,
        };
        let as_found = earlier
            .map(|(name, earlier)| as_found::as_found(name, earlier, &calibration, &provenance))
            .transpose()?;
        Ok(Self {
            laboratory,
            provenance,
            sha256,
            terms: results::terms(&calibration),
            results,
            covariance,
            conformity,
            as_found,
            calibration,
        })
    }

    /// What fixes the body axes.
    pub fn body_frame(&self) -> BodyFrame {
        self.calibration.body_frame
    }
}

#[cfg(test)]
pub(crate) mod tests;
