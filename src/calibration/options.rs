//! What is to be estimated, and how.

use crate::calibration::{ErrorTerm, NoisePolicy};
use crate::imu::InstallationForm;
use crate::run::Aiding;
use crate::statistics::FALSE_ALARM;

/// What is to be estimated, and how; the default is right for most runs.
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
    /// How installation angles make the installation matrix.
    pub form: InstallationForm,
    /// What is observed at rest; none: the table's attitude where there is its log, else velocity.
    pub aiding: Option<Aiding>,
    /// Error terms to be estimated beside those that the instrument and the table state a σ for.
    pub terms: Vec<ErrorTerm>,
    /// Whether error terms that the data call for are estimated, too.
    pub auto_terms: bool,
    /// Which noise is used.
    pub noise: NoisePolicy,
    /// Chance that the gate rejects any observation of a record without outliers.
    pub false_rejection: f64,
    /// Converged when no parameter moves by more than this many of its σ.
    pub converged_sigma: f64,
    /// Passes over the record at most.
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
            false_rejection: FALSE_ALARM,
            converged_sigma: 0.02,
            passes: 20,
        }
    }
}

impl Options {
    /// With this installation form.
    pub fn installation(self, form: InstallationForm) -> Self {
        Self { form, ..self }
    }

    /// With this aiding.
    pub fn aiding(self, aiding: Aiding) -> Self {
        Self {
            aiding: Some(aiding),
            ..self
        }
    }

    /// With this noise.
    pub fn noise(self, noise: NoisePolicy) -> Self {
        Self { noise, ..self }
    }

    /// With the error terms that are asked for and no others.
    pub fn no_auto_terms(self) -> Self {
        Self {
            auto_terms: false,
            ..self
        }
    }

    /// With this error term, its σ being the usual one unless instrument or table state another.
    pub fn with(mut self, term: ErrorTerm) -> Self {
        self.terms.push(term);
        self
    }
}
