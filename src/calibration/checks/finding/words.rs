//! Findings in the words of terminal, page and export.

use std::fmt;

use super::{Finding, RecordingDifference};
use crate::calibration::checks::innovation::Inconsistency;
use crate::calibration::checks::prior_cause::PriorCause;
use crate::calibration::noise::SourceFigures;
use crate::run::motion::ContradictedLabel;
use crate::units::{ARCSEC, DEGREE};

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
                "NIS (of the closed form χ² over its degrees of freedom) of {nis:.4e} is no calibration: stated noise \
                 is hardly ever so wrong that it goes beyond {limit:.0}. The largest is at {worst:.1} s: look there for rows that are lost, repeated or \
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
}
