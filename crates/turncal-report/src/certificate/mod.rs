//! A calibration certificate according to ISO/IEC 17025:2017, 7.8.2 and 7.8.4, from a calibration and the statements of
//! the laboratory. The certificate claims no accreditation.

mod as_found;
mod conformity;
pub mod dcc;
pub mod document;
mod remarks;
mod results;

use turncal::calibration::result::{Calibration, Provenance};
use turncal::calibration::{ComparisonError, Correction, CorrectionError};
use turncal::laboratory::Laboratory;
use turncal::lot::Specification;

pub use as_found::{AsFound, Change};
pub use conformity::{Conformity, Decided, Decision};
pub use results::{Measured, Quantity, in_words, temperature_words};

/// Errors of a certificate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CertificateError {
    /// The calibration must not be used.
    #[error("the calibration {reason}, so it cannot be certified. See its findings.")]
    NotUsable {
        /// The reason.
        reason: &'static str,
    },
    /// The earlier calibration must not be used.
    #[error(
        "the verdict of the earlier calibration, {name}, is FAILED, so it does not show the state as found. Give the \
         last valid calibration, or none."
    )]
    Earlier {
        /// Its name.
        name: String,
    },
    /// A required field is missing from the file.
    #[error("the calibration has no `{field}` because it is from another version. Calibrate again")]
    Missing {
        /// The field.
        field: &'static str,
    },
    /// The decision rule for conformity is missing.
    #[error(
        "lab.toml has no `decision.rule`, which ISO/IEC 17025, 7.8.6, requires for statements of conformity. Set it \
         to \"guard-band\" or \"simple-acceptance\"."
    )]
    NoRule,
    /// The calibrations cannot be compared with each other or with limits.
    #[error(transparent)]
    Comparison(#[from] ComparisonError),
    /// A calibration that cannot be applied.
    #[error(transparent)]
    Correction(#[from] CorrectionError),
}

/// Content of a certificate.
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// Statements of the laboratory.
    pub laboratory: Laboratory,
    /// The calibration.
    pub calibration: Calibration,
    /// Origin of the calibration.
    pub provenance: Provenance,
    /// SHA-256 of the calibration file.
    pub sha256: String,
    /// Every parameter with its expanded uncertainty.
    pub results: Vec<Measured>,
    /// Every parameter of the instrument's error terms with its expanded uncertainty.
    pub terms: Vec<Measured>,
    /// Covariance of the estimated parameters in SI units, in the order of the results.
    pub covariance: Vec<Vec<f64>>,
    /// Conformity with limits, if any are given.
    pub conformity: Option<Conformity>,
    /// As-found state of the instrument, if an earlier calibration is given.
    pub as_found: Option<AsFound>,
}

impl Certificate {
    /// The certificate of a calibration; the SHA-256 is that of the calibration file.
    ///
    /// # Errors
    /// Returns [`CertificateError`] if the calibration must not be used, or a field is missing.
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
        if calibration.is_failed() {
            return not_usable("failed its checks");
        }
        Correction::of_record(&calibration)?;
        let missing = |field| CertificateError::Missing { field };
        let provenance = calibration.provenance.clone();
        let provenance = provenance.ok_or(missing("provenance"))?;
        let (results, covariance) =
            results::results(&calibration, &provenance).ok_or(missing("covariance"))?;
        let conformity = match specification {
            Some(specification) => {
                let rule = laboratory.decision.rule.ok_or(CertificateError::NoRule)?;
                Some(conformity::conformity(
                    &calibration,
                    &provenance,
                    specification,
                    rule,
                )?)
            }
            None => None,
        };
        if let Some((name, _)) = earlier.filter(|(_, earlier)| earlier.is_failed()) {
            let name = name.to_owned();
            return Err(CertificateError::Earlier { name });
        }
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

    /// Remarks for the customer: scope of the certificate, remarks of the laboratory, and findings of the evaluation.
    pub fn remarks(&self) -> Vec<String> {
        let general = [
            "The results relate only to the item named above, in the stated condition of the item and under the \
             stated measurement conditions.",
            "This certificate may not be reproduced except in full without approval of the laboratory.",
        ];
        let general = general.into_iter().map(str::to_owned);
        let magnetometer = self.calibration.mag.as_ref();
        let magnetometer = magnetometer
            .map(|_| "This certificate does not cover the magnetometer of the item.".to_owned());
        let of_laboratory = self.laboratory.remarks.clone();
        let findings = remarks::sentences(&self.calibration.findings);
        let own = general.chain(magnetometer).chain(of_laboratory);
        own.chain(findings).collect()
    }
}

#[cfg(test)]
pub(crate) mod tests;
