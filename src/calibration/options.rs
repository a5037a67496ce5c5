//! Options for the estimation.

use crate::calibration::{ErrorTerm, NoisePolicy};
use crate::imu::InstallationForm;
use crate::run::Aiding;

/// Options for the estimation; the defaults suit most runs.
///
/// ```
/// use turncal::calibration::Options;
/// use turncal::imu::InstallationForm;
/// use turncal::run::Aiding;
///
/// let options = Options::default()
///     .installation(InstallationForm::SixAngle)
///     .aiding(Aiding::Velocity);
/// assert_eq!(options.aiding, Some(Aiding::Velocity));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Form of the misalignment matrix.
    pub form: InstallationForm,
    /// Observations at rest. `None` means table attitude if there is a table log, otherwise zero velocity.
    pub aiding: Option<Aiding>,
    /// Error terms to estimate in addition to those with a σ stated for instrument or table.
    pub terms: Vec<ErrorTerm>,
    /// Whether the estimate is averaged over the absence and the usual sizes of all other error terms.
    pub auto_terms: bool,
    /// Noise policy.
    pub noise: NoisePolicy,
    /// Convergence limit: the iterations end when no parameter changes by more than this limit, in σ.
    pub converged_sigma: f64,
    /// Maximum number of passes over the recording.
    pub passes: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            form: InstallationForm::General,
            aiding: None,
            terms: Vec::new(),
            auto_terms: true,
            noise: NoisePolicy::default(),
            converged_sigma: 0.02,
            passes: 20,
        }
    }
}

impl Options {
    /// Sets the misalignment form.
    pub fn installation(self, form: InstallationForm) -> Self {
        Self { form, ..self }
    }

    /// Sets the aiding.
    pub fn aiding(self, aiding: Aiding) -> Self {
        Self {
            aiding: Some(aiding),
            ..self
        }
    }

    /// Sets the noise policy.
    pub fn noise(self, noise: NoisePolicy) -> Self {
        Self { noise, ..self }
    }

    /// Restricts the error terms to those that are requested.
    pub fn no_auto_terms(self) -> Self {
        Self {
            auto_terms: false,
            ..self
        }
    }

    /// Adds this error term, which is then estimated regardless of the data; its σ is wide unless the instrument or the
    /// table states another σ.
    pub fn with(mut self, term: ErrorTerm) -> Self {
        self.terms.push(term);
        self
    }
}
