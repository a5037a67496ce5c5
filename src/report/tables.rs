//! The tables of the page.

use maud::{Markup, html};

use super::Report;
use super::further;
use super::group::Group;
use super::number::{self, count, sigma, three_digits, value};
use super::side_by_side::Table;
use crate::calibration::{Estimate, OBSERVED_BELOW, Outcome, parameter_name};
use crate::imu::ParameterKind;

/// Rows that belong together.
pub(super) type Section = Vec<Vec<String>>;

/// How many of the directions that were observed are shown.
const WEAKEST: usize = 3;

/// A table whose first column names the row.
pub(super) fn table<H: AsRef<str>>(
    headings: &[H],
    sections: impl IntoIterator<Item = Section>,
) -> Markup {
    html! {
        table {
            thead { tr { @for heading in headings { th scope="col" { (heading.as_ref()) } } } }
            @for section in sections {
                tbody {
                    @for row in &section {
                        tr {
                            @for (n, cell) in row.iter().enumerate() {
                                @if n == 0 { th scope="row" { (cell) } } @else { td { (cell) } }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A table with its title and notes.
pub(super) fn section(of: &Table) -> Markup {
    html! {
        section {
            h2 { (of.title) }
            (table(&of.headings, of.sections.iter().cloned()))
            @if !of.notes.is_empty() { p.note { (of.notes.join(" ")) } }
        }
    }
}

/// Largest error and σ of each group for each method: the answer at a glance.
pub(super) fn groups(report: &Report) -> Markup {
    let methods = report.methods();
    let truth = report.truth_vector();
    let mut headings = vec!["".to_owned(), "unit".to_owned()];
    for (name, _) in &methods {
        headings.push(format!("{name}: RMS\u{a0}σ"));
        if truth.is_some() {
            headings.push(format!("{name}: RMS\u{a0}error"));
            headings.push(format!("{name}: largest\u{a0}error"));
        }
    }
    let difference = match methods.as_slice() {
        &[(_, closed), (_, filter)] if truth.is_none() => {
            headings.push("closed form less EKF, RMS".to_owned());
            Some(closed.vector() - filter.vector())
        }
        _ => None,
    };
    let rows = Group::all().map(|group| {
        let mut row = vec![group.title(), group.unit().to_owned()];
        for (_, estimate) in &methods {
            let indices = group.estimated(estimate);
            let claimed = group.spread(&estimate.sigma(), &indices);
            row.push(claimed.map_or("–".to_owned(), |(_, rms)| sigma(rms)));
            if let Some(truth) = &truth {
                let error = group.spread(&(estimate.vector() - truth), &indices);
                row.extend(
                    error.map_or(["–".to_owned(), "–".to_owned()], |(largest, rms)| {
                        [three_digits(rms), three_digits(largest)]
                    }),
                );
            }
        }
        if let (Some(difference), Some((_, first))) = (&difference, methods.first()) {
            let spread = group.spread(difference, &group.parameters(first.form()));
            row.push(spread.map_or("–".to_owned(), |(_, rms)| three_digits(rms)));
        }
        row
    });
    let rows: Section = rows.collect();
    table(
        &headings,
        rows.chunks(ParameterKind::ALL.len()).map(<[_]>::to_vec),
    )
}

/// Every parameter with its accuracy, and its error where the truth is known.
pub(super) fn estimates(report: &Report, estimate: &Estimate) -> Markup {
    let prior = report.outcome.map(|outcome| outcome.prior_sigma);
    let truth = report.truth_vector();
    let (form, posterior, values) = (estimate.form(), estimate.sigma(), estimate.vector());
    let mut headings = vec!["parameter", "value ± 1σ", "unit"];
    if prior.is_some() {
        headings.extend(["prior σ", "posterior σ", "ratio"]);
    }
    if truth.is_some() {
        headings.extend(["error", "error / σ"]);
    }
    let row = |group: Group, i: usize| {
        let (unit, fixed) = (group.unit_value(), posterior[i] <= 0.0);
        let s = posterior[i] / unit;
        let shown = value(group.shown(values[i]), s);
        let mut row = vec![
            parameter_name(form, i)?,
            if fixed {
                format!("{shown} (fixed)")
            } else {
                format!("{shown} ± {}", sigma(s))
            },
            group.unit().to_owned(),
        ];
        if let Some(prior) = &prior {
            row.extend(if fixed {
                ["–", "–", "–"].map(str::to_owned)
            } else {
                let prior = (three_digits(prior[i] / unit), ratio(posterior[i], prior[i]));
                [prior.0, sigma(s), prior.1]
            });
        }
        if let Some(truth) = &truth {
            let error = (values[i] - truth[i]) / unit;
            row.push(value(error, s));
            row.push(if fixed {
                "–".to_owned()
            } else {
                value(error / s, 0.1)
            });
        }
        Some(row)
    };
    let sections = Group::all().map(|group| {
        let rows = group.parameters(form).into_iter();
        rows.filter_map(|i| row(group, i)).collect()
    });
    let of_terms = report.outcome.map_or_else(Vec::new, |outcome| {
        further::rows(&outcome.auxiliary, report.true_terms)
            .into_iter()
            .map(|row| {
                let shown = format!("{} ± {}", row.value, row.sigma);
                let mut cells = vec![
                    row.name,
                    shown,
                    row.unit.to_owned(),
                    row.prior,
                    row.sigma,
                    ratio(row.remaining, 1.0),
                ];
                if truth.is_some() {
                    cells.extend(row.error.unwrap_or(["–", "–"].map(str::to_owned)));
                }
                cells
            })
            .collect()
    });
    let sections = sections.chain((!of_terms.is_empty()).then_some(of_terms));
    table(&headings, sections)
}

/// Posterior over prior σ, with words where the path did not observe it.
fn ratio(posterior: f64, prior: f64) -> String {
    let ratio = posterior / prior;
    if !ratio.is_finite() {
        "–".to_owned()
    } else if ratio > OBSERVED_BELOW {
        format!("{ratio:.2}, not observed")
    } else {
        format!("1 : {}", three_digits(1.0 / ratio))
    }
}

/// The directions that the run observed least: all that it did not observe, and some that it did.
pub(super) fn weakest(outcome: &Outcome) -> Markup {
    let form = outcome.estimate.form();
    let observability = &outcome.observability;
    let shown = observability.unobserved().count() + WEAKEST;
    let rows = observability.directions.iter().take(shown);
    let rows = rows.map(|direction| vec![direction.words(form), ratio(direction.remaining, 1.0)]);
    table(&["direction", "ratio"], [rows.collect()])
}

/// The passes of the filter.
pub(super) fn passes(outcome: &Outcome) -> Markup {
    let rows = outcome.passes.iter().enumerate().map(|(n, pass)| {
        vec![
            (n + 1).to_string(),
            if pass.feedback { "live, fed back" } else { "held" }.to_owned(),
            three_digits(pass.largest_step),
            number::whole(pass.cost),
            count(pass.observations),
            three_digits(pass.cost / pass.observations as f64),
            count(pass.rejected),
        ]
    });
    table(
        &[
            "pass",
            "kind",
            "largest step, σ",
            "merit",
            "scalars",
            "merit / scalars",
            "rejected",
        ],
        [rows.collect()],
    )
}

/// How the innovations agree with their covariance.
pub(super) fn consistency(outcome: &Outcome) -> Markup {
    let rows = [
        ("zero velocity", outcome.consistency.velocity),
        ("table attitude", outcome.consistency.table),
    ]
    .into_iter()
    .filter(|(_, nis)| nis.count > 0)
    .map(|(name, nis)| {
        let (low, high) = nis.interval;
        let verdict = if nis.mean < low {
            ", below"
        } else if nis.mean > high {
            ", above"
        } else {
            ""
        };
        vec![
            name.to_owned(),
            format!("{}{verdict}", value(nis.mean, 0.01)),
            format!("{} … {}", value(low, 0.01), value(high, 0.01)),
            value(nis.lag_one, 0.01),
            count(nis.count),
        ]
    });
    table(
        &[
            "observation",
            "NIS per scalar",
            "95 % interval",
            "lag-one correlation",
            "scalars",
        ],
        [rows.collect()],
    )
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::synthetic;
    use super::*;
    use crate::calibration::{from_vector, to_vector};
    use crate::imu::InstallationForm;
    use crate::units::PPM;

    #[test]
    fn an_error_is_estimate_less_truth_in_ppm_and_in_sigma() {
        let mut made_up = synthetic(InstallationForm::General);
        let mut truth = to_vector(&made_up.outcome.estimate.triads);
        truth[0] += 3.0 * PPM;
        made_up.truth = from_vector(InstallationForm::General, &truth);
        made_up.outcome.estimate.covariance[(0, 0)] = (1.5 * PPM).powi(2);
        let report = made_up.report();
        let parameters = estimates(&report, &made_up.outcome.estimate).into_string();
        assert!(
            parameters.contains("<td>−3.0</td><td>−2.00</td>"),
            "{parameters}"
        );
        let summary = groups(&report).into_string();
        // The other two scale factors have no error: RMS 3/√3.
        assert!(summary.contains("<td>1.73</td><td>3.00</td>"), "{summary}");
    }

    #[test]
    fn a_nis_outside_its_interval_is_called_so() {
        let made_up = synthetic(InstallationForm::General);
        let shown = consistency(&made_up.outcome).into_string();
        assert!(shown.contains("1.051, above"));
        assert!(!shown.contains("1.002,"));
    }
}
