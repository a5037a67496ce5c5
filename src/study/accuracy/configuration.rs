//! The simulated scenario of the study, and the settings of the filter.

use serde::{Deserialize, Serialize};

use crate::calibration::{ErrorTerm, NoisePolicy};
use crate::imu::InstallationForm;
use crate::simulation::Scenario;

/// Configuration of the study.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct AccuracyStudy {
    /// The simulated scenario.
    pub scenario: Scenario,
    /// The misalignment form of the filter; the truth has the form of the scenario.
    pub form: InstallationForm,
    /// Error terms of the truth that the filter does not model.
    pub unmodelled: Vec<ErrorTerm>,
    /// Whether the filter averages over error terms that may be present.
    pub auto_terms: bool,
    /// Noise policy of the filter.
    pub noise: NoisePolicy,
    /// Number of runs.
    pub runs: u64,
    /// Seed; each run has its own random streams.
    pub seed: u64,
}
