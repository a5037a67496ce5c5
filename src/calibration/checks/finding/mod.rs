//! What a calibration engineer must know before using the figures.

mod words;

use serde::Serialize;

use super::innovation::Inconsistency;
use super::prior_cause::PriorCause;
use crate::calibration::noise::SourceFigures;
use crate::imu::InstallationForm;
use crate::run::motion::ContradictedLabel;

/// A finding with its figures; [`Display`](std::fmt::Display) words it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", content = "figures", rename_all = "kebab-case")]
pub enum Finding {
    /// What the reader of the files found and mended, or what they say without effect.
    Recording {
        /// In words.
        note: String,
    },
    /// The iterations did not converge.
    NotConverged {
        /// Passes made.
        passes: usize,
        /// Step of the last pass of the parameter that it moved most, in its σ.
        largest_step_sigma: f64,
    },
    /// Parameters that kept more than half of their prior σ.
    NotObserved {
        /// What did not observe them, such as `this path`.
        by: &'static str,
        /// Their names.
        parameters: Vec<String>,
    },
    /// Combinations of parameters that were not observed though each of them was.
    CombinationsNotObserved {
        /// In words, such as `gyro scale z with gyro bias z`.
        combinations: Vec<String>,
    },
    /// The heading was not observed.
    HeadingNotObserved {
        /// Its 1σ after the run, rad.
        sigma_rad: f64,
    },
    /// Parameters whose change with temperature the recordings do not show.
    TemperatureNotSeen {
        /// Their names.
        parameters: Vec<String>,
    },
    /// Recordings that differ by more than is stated.
    RecordingsDiffer {
        /// Of each group that does.
        differences: Vec<RecordingDifference>,
    },
    /// Second order and asymmetry of the accelerometers cannot be told apart.
    EvenTermsInseparable,
    /// The data reject the installation form.
    FormRejected {
        /// The form.
        form: InstallationForm,
        /// Angles that the general form has more.
        angles: usize,
        /// By how much these lower the cost.
        gain: f64,
        /// What the gain stays below in 999 runs of 1000 if the form is right.
        limit: f64,
    },
    /// Observations that the gate rejected.
    Outliers {
        /// Rejected.
        rejected: usize,
        /// Of so many.
        observations: usize,
    },
    /// Innovations that are not as large as their covariance says.
    Inconsistent {
        /// Where that shows.
        looks: Vec<Inconsistency>,
    },
    /// Dwells scatter by more than the covariance says, which was widened.
    DwellsScatter {
        /// Mean of squared scores of dwells, each over its σ …
        mean: f64,
        /// … and what it stays below in 999 runs of 1000 if σ are true.
        limit: f64,
        /// By how much the largest σ grew.
        growth: f64,
    },
    /// The data contradict the stated noise, and another was learnt from them.
    NoiseLearnt {
        /// −2 ln of the likelihood ratio of stated to learnt noise …
        ratio: f64,
        /// … and what it stays below in 1,999 runs of 2,000 if what is stated is right.
        limit: f64,
        /// What was learnt, with what is stated.
        sources: Vec<SourceFigures>,
    },
    /// Biases that may vary though the noise learnt from the record does not hold that; σ do.
    BiasesMayVary {
        /// By how much the largest σ grew.
        growth: f64,
    },
    /// An error term that the data show and that is not estimated.
    ErrorTermSignificant {
        /// The name by which it is switched on.
        term: &'static str,
        /// Others that explain the data as well, so that this run cannot tell them apart.
        alternatives: Vec<&'static str>,
        /// Others that the data show, too, where it is on.
        further: Vec<&'static str>,
        /// By how much it lowers the cost.
        gain: f64,
        /// What the gain stays below if its errors are not there, but for its share of one false alarm in
        /// a thousand runs.
        limit: f64,
        /// NIS of all observations without it …
        nis_without: f64,
        /// … and with it.
        nis_with: f64,
        /// By how much σ grow at most for what leaving them off does; none where σ are without.
        growth: Option<f64>,
    },
    /// Parameters that the prior does not allow.
    FarFromPrior {
        /// By more than this many of its σ.
        sigmas: f64,
        /// Their names.
        parameters: Vec<String>,
        /// Of each, its distance from the prior's mean in the prior's σ.
        distances: Vec<f64>,
        /// What most likely made it.
        causes: Vec<PriorCause>,
    },
    /// Labelled sections that were not used, for a part of them is lost.
    SectionsLost {
        /// Their labels.
        labels: Vec<String>,
    },
    /// Sections whose labels the record contradicts.
    LabelsContradicted {
        /// Each of them.
        contradicted: Vec<ContradictedLabel>,
    },
    /// Rows at rest that scatter by more or less than the stated noise.
    ScatterAtRest {
        /// `gyro` or `accel`.
        of: &'static str,
        /// The key in `[imu.noise]` of the next two, in its unit.
        figure: &'static str,
        /// What the rows scatter by over a tenth of a second, as random walk.
        found: f64,
        /// The same as stated, with a bias and pulses.
        stated: f64,
        /// What their ratio stays within, for both triads at once, in 999 runs of 1000 if that is right.
        limits: (f64, f64),
    },
    /// Rates that are rounded to steps wider than their noise; σ hold what that leaves open.
    Rounded {
        /// `gyro` or `accel`.
        of: &'static str,
        /// The widest step …
        step: f64,
        /// … in this unit.
        unit: &'static str,
        /// By how much the σ grew that grew most.
        growth: f64,
    },
    /// Residuals of the closed form that are larger than chance makes them; its σ were widened.
    ResidualsLarge {
        /// `gyro`, `accel` or `both triads`.
        of: &'static str,
        /// Sum of their squares, each over its variance …
        chi_square: f64,
        /// … with so many degrees of freedom …
        degrees: usize,
        /// … and what it stays below in 999 runs of 1000, for both triads at once, if σ are true.
        limit: f64,
        /// By how much the largest σ grew.
        growth: f64,
        /// Begin and end in s of the dwells or moves that fit the others least; several if nothing tells
        /// them apart.
        worst: Vec<[f64; 2]>,
        /// χ² without any one of these.
        without: f64,
        /// 1σ of the table's level and north, rad, if that explains all.
        base: Option<f64>,
    },
    /// Parameters whose even change in time explains residuals of the closed form.
    ChangesInTime {
        /// `gyro` or `accel`.
        of: &'static str,
        /// `bias` or `scale factor`.
        parameters: &'static str,
        /// The unit of what follows.
        unit: &'static str,
        /// Axes with how far each has changed between the first and the last position.
        changes: Vec<(char, f64)>,
        /// These two, s.
        times: [f64; 2],
        /// By how much χ² falls with such a change …
        fall: f64,
        /// … and by how much at most in 999 runs of 1000 without, for both triads and both kinds at once.
        limit: f64,
    },
    /// Innovations, or residuals of the closed form, that no noise figure explains.
    Unexplained {
        /// NIS of all observations; of the closed form χ² over its degrees of freedom, without the worst
        /// position …
        nis: f64,
        /// … and what it stays below unless stated noise is more wrong than figures are.
        limit: f64,
        /// When an innovation was the largest, or the worst position begins, s.
        worst: f64,
    },
}

impl Finding {
    /// Whether it says that no noise explains what a calibration leaves, so that it is none.
    pub fn is_unexplained(&self) -> bool {
        matches!(self, Self::Unexplained { .. })
    }
}

/// By how much recordings differ in a group of parameters.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordingDifference {
    /// The key of `[day_to_day]`.
    pub key: String,
    /// What it states, in its unit.
    pub stated: f64,
    /// 1σ that the recordings show, in its unit.
    pub found: f64,
    /// −2 ln of the likelihood ratio of stated to found …
    pub ratio: f64,
    /// … and what it stays below but for this group's share of one false alarm in a thousand campaigns.
    pub limit: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_is_a_kind_and_figures_in_json() {
        let finding = Finding::Outliers {
            rejected: 2,
            observations: 9,
        };
        let json = serde_json::to_value(&finding).unwrap();
        assert_eq!(json["kind"], "outliers");
        assert_eq!(json["figures"]["rejected"], 2);
    }
}
