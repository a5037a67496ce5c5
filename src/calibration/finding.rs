//! What a calibration engineer must know before using the figures: values here, and their words.

use std::fmt;

use serde::Serialize;

use super::innovation::Inconsistency;
use super::noise::SourceFigures;
use super::prior_cause::PriorCause;
use crate::imu::InstallationForm;
use crate::run::motion::ContradictedLabel;
use crate::units::{ARCSEC, DEGREE};

/// A finding with its figures; [`fmt::Display`] words it.
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
    /// Innovations that no noise figure explains.
    Unexplained {
        /// NIS of all observations …
        nis: f64,
        /// … and what it stays below unless stated noise is more wrong than figures are.
        limit: f64,
        /// When an innovation was the largest, s.
        worst: f64,
    },
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Recording { note } => f.write_str(note),
            Self::NotConverged {
                passes,
                largest_step_sigma,
            } => write!(
                f,
                "Not converged: the last of {passes} passes still moved a parameter by \
                 {largest_step_sigma:.2} σ. Neither values nor σ may be used."
            ),
            Self::NotObserved { by, parameters } => write!(
                f,
                "Not observed by {by}, σ not even halved: {}.",
                listed(parameters)
            ),
            Self::TemperatureNotSeen { parameters } => write!(
                f,
                "How these change with temperature is not observed: {}. Their σ holds at the temperatures of the \
                 recordings only; turn the instrument at more of them.",
                listed(parameters)
            ),
            Self::RecordingsDiffer { differences } => {
                let lines = differences.iter().map(|of| {
                    let RecordingDifference {
                        key, stated, found, ..
                    } = of;
                    format!("{key} = {found:.2e} (stated {stated})")
                });
                let lines: Vec<String> = lines.collect();
                write!(
                    f,
                    "Recordings differ by more than their σ and what [day_to_day] states: as by {}. That is used and in \
                     all σ. Biases differ from one switch-on to the next, installation where the instrument was mounted \
                     anew (mounting_arcsec), all where its temperature is not that of its sensor.",
                    lines.join(", ")
                )
            }
            Self::CombinationsNotObserved { combinations } => write!(
                f,
                "Not observed by this path though each parameter alone was: {}.",
                combinations.join("; ")
            ),
            Self::HeadingNotObserved { sigma_rad } => write!(
                f,
                "The heading is not observed: its σ is {:.1}° after the run. Earth rate is too little \
                 for the noise of the gyros, or their biases hide it; parameters are found \
                 nevertheless.",
                sigma_rad / DEGREE
            ),
            Self::EvenTermsInseparable => f.write_str(
                "Second order and asymmetry of the accelerometers are one and the same in dwells with \
                 an axis up or down. Add dwells between them, at 45° and the like, or leave one of \
                 the two off.",
            ),
            Self::FormRejected {
                form,
                angles,
                gain,
                limit,
            } => write!(
                f,
                "The data reject the {} installation form: {angles} more angles, as the general form \
                 has them, lower the cost by {gain:.4e}, where a right form leaves less than \
                 {limit:.1} in 999 runs of 1000. Use the general form.",
                form.name()
            ),
            Self::Outliers {
                rejected,
                observations,
            } => write!(
                f,
                "{rejected} of {observations} observations were rejected as outliers."
            ),
            Self::Inconsistent { looks } => {
                let one = |look: &Inconsistency| {
                    let Inconsistency {
                        observation,
                        look,
                        nis,
                        limits: (low, high),
                        ..
                    } = look;
                    let (name, words) = (observation.name(), look.words());
                    format!("{name}{words} {nis:.2} ({low:.2} to {high:.2})")
                };
                let looks: Vec<String> = looks.iter().map(one).collect();
                write!(
                    f,
                    "Innovations are not as large as their σ says. NIS, with what it stays within in 999 \
                     runs of 1000 if noise figures and model are right: {}. After moves it is what grows \
                     with a move (table position, scale, timing), over dwells what lasts (bias), \
                     everywhere the white noise.",
                    looks.join("; ")
                )
            }
            Self::DwellsScatter {
                mean,
                limit,
                growth,
            } => write!(
                f,
                "What one dwell says of the parameters differs from what the others say by more than σ \
                 allow: squared and over its variance {mean:.2}, where right σ stay below {limit:.2}. The \
                 covariance is that of this scatter where it is the larger, and σ are up to {growth:.1} \
                 times as large as noise alone makes them. What is not modelled shows itself so."
            ),
            Self::NoiseLearnt {
                ratio,
                limit,
                sources,
            } => {
                let sources = sources.iter().filter(|figures| figures.counts());
                let sources: Vec<String> = sources.map(SourceFigures::to_string).collect();
                write!(
                    f,
                    "The data contradict the stated noise: −2 ln of its likelihood is {ratio:.1} above \
                     that of the noise learnt from them, where right figures stay below {limit:.1} or \
                     within the limit of each factor alone. Used and in all σ: {}. The lines of run.toml \
                     that state it are `noise.run_toml` in calibration.json.",
                    sources.join("; ")
                )
            }
            Self::BiasesMayVary { growth } => write!(
                f,
                "[imu.noise] states no variation of biases, and this record is too short to show one. σ include a \
                 variation of the usual size, and are up to {growth:.1} times as large for it. `turncal allan` on a \
                 longer record at rest gives the figures that [imu.noise] wants."
            ),
            Self::ErrorTermSignificant {
                term,
                alternatives,
                further,
                nis_without,
                nis_with,
                growth,
                ..
            } => {
                write!(
                    f,
                    "The data show errors that are not modelled. Of the error terms that are off, {term} \
                     would explain most (NIS {nis_without:.2} → {nis_with:.2}): use --with {term}, then \
                     look again."
                )?;
                if !alternatives.is_empty() {
                    write!(
                        f,
                        " Cannot be told apart from it on this path: {}.",
                        alternatives.join(", ")
                    )?;
                }
                if !further.is_empty() {
                    write!(f, " Significant beside it: {}.", further.join(", "))?;
                }
                match growth {
                    Some(growth) => write!(
                        f,
                        " σ hold what leaving that off does to the parameters, and are up to {growth:.2} times \
                         as large for it."
                    ),
                    None => Ok(()),
                }
            }
            Self::FarFromPrior {
                sigmas,
                parameters,
                distances,
                causes,
            } => {
                let each = parameters.iter().zip(distances);
                let each: Vec<String> = each
                    .map(|(name, distance)| format!("{name} by {distance:+.0} σ"))
                    .collect();
                let causes: Vec<String> = causes.iter().map(PriorCause::to_string).collect();
                write!(
                    f,
                    "More than {sigmas} σ of [imu.prior] away from it: {}. Likely: {}.",
                    each.join(", "),
                    causes.join("; ")
                )
            }
            Self::SectionsLost { labels } => write!(
                f,
                "Not used, for a part of it is lost: section {}.",
                labels.join(", ")
            ),
            Self::ScatterAtRest {
                of,
                figure,
                found,
                stated,
                limits: (low, high),
            } => write!(
                f,
                "At rest the rows of the {of} scatter by {:.3} times what is stated: as by {figure} = \
                 {found:.4}, where noise and pulses as stated make {stated:.4}, within {low:.3} to {high:.3} \
                 of it in 999 runs of 1000. It is seen over a tenth of a second, so a mount that shakes is \
                 in it; `turncal allan` tells more.",
                found / stated
            ),
            Self::Rounded {
                of,
                step,
                unit,
                growth,
            } => write!(
                f,
                "Rows of the {of} are rounded to steps of {step:.3e} {unit}, and their noise at rest does not reach \
                 over one: no mean over a dwell tells where within a step it lies. σ hold that and are up to \
                 {growth:.1} times as large for it. Log more digits."
            ),
            Self::LabelsContradicted { contradicted } => {
                let each: Vec<String> =
                    contradicted.iter().map(ContradictedLabel::to_string).collect();
                write!(f, "Labels and record disagree. Section {}.", each.join("; section "))
            }
            Self::ChangesInTime {
                of,
                parameters,
                unit,
                changes,
                times: [first, last],
                fall,
                limit,
            } => {
                let each = changes.iter().map(|(axis, by)| format!("{axis} by {by:+.4}"));
                write!(
                    f,
                    "The {of} {parameters} drifts: residuals follow time as if from {first:.1} s to {last:.1} s it \
                     changed along {} {unit}, by which χ² falls by {fall:.4e}, where without a drift it falls by less \
                     than {limit:.1}. Look for a warm-up or a change of temperature, a step, or a bias instability \
                     that [imu.noise] does not state; σ hold for parameters that stay.",
                    each.collect::<Vec<_>>().join(", ")
                )
            }
            Self::Unexplained { nis, limit, worst } => write!(
                f,
                "NIS of {nis:.4e} is no calibration: stated noise is hardly ever so wrong that it goes beyond \
                 {limit:.0}. The largest innovation is at {worst:.1} s: look there for rows that are lost, repeated or \
                 wrapped, for a bump and for another table position, and at what is said of the files. Where it is \
                 noise after all, use --noise auto."
            ),
            Self::ResidualsLarge {
                of,
                chi_square,
                degrees,
                limit,
                growth,
                worst,
                without,
                base,
            } => {
                let times = |[begin, end]: &[f64; 2]| format!("{begin:.1} s to {end:.1} s");
                let worst: Vec<String> = worst.iter().map(times).collect();
                write!(
                    f,
                    "Residuals of {of} are larger than stated: χ² {chi_square:.4e} with {degrees} degrees of \
                     freedom, where true σ stay below {limit:.1}. σ hold them now and are up to {growth:.2} times as large. What \
                     fits the others least is at {}; without it χ² is {without:.4e}. If that is little, look \
                     there: a bump, a wrong label or attitude; if not, at what all have in common: stated \
                     noise, level and north, gravity's direction, a hand that is not still.",
                    worst.join(" or ")
                )?;
                let Some(base) = base else { return Ok(()) };
                write!(
                    f,
                    " A table base off level and north by {:.1}″ (1σ) explains all of it, and σ include that: state \
                     level_sigma_arcsec and north_sigma_arcsec in [turntable].",
                    base / ARCSEC
                )
            }
        }
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

/// Parameters by sensor and kind, such as `gyro scale x, y; accel bias z`.
fn listed(names: &[String]) -> String {
    let mut text = String::new();
    let mut last = "";
    for name in names {
        let (group, axis) = name.rsplit_once('.').unwrap_or((name, ""));
        if group == last {
            text.push_str(", ");
        } else {
            if !last.is_empty() {
                text.push_str("; ");
            }
            text.push_str(&group.replace('.', " "));
            text.push(' ');
            last = group;
        }
        text.push_str(axis);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_listed_by_sensor_and_kind() {
        let names = ["gyro.scale.x", "gyro.scale.y", "accel.bias.z"].map(str::to_owned);
        assert_eq!(listed(&names), "gyro scale x, y; accel bias z");
    }

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
