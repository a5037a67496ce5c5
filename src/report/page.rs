//! The page: what a reader must know first, then figures, tables and the run.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{Figure, Report, blocks, facts, navigation, number, tables};

/// The style of every page.
const STYLE: &str = include_str!("style.css");

/// The whole page as HTML.
pub(super) fn page(report: &Report, figures: &[Figure]) -> String {
    let body = html! {
        header { h1 { (report.title) } p { (summary(report)) } }
        (notices(report))
        section {
            h2 { "Accuracy of each group" }
            (tables::groups(report))
            p.note {
                "RMS σ is the root mean square of the 1σ that the method claims in the group. "
                @if report.truth.is_some() { "Errors are estimate less truth. " }
                @if let Some(closed) = report.closed_form { "Closed form: " (closed.note) "." }
            }
        }
        @if let Some(estimate) = report.estimate() {
            section { h2 { "Parameters" } (tables::estimates(report, estimate)) }
        }
        @if let Some(left) = report.quality_table() { (tables::section(&left)) }
        @if let Some(outcome) = report.outcome {
            section { h2 { "Consistency" } (tables::consistency(outcome))
                p.note {
                    "A NIS within its interval and a correlation near zero say that the innovations \
                    are as large and as white as the filter claims."
                }
            }
            section { h2 { "Passes" } (tables::passes(outcome)) }
            @for of_blocks in blocks::tables(report.effects) {
                section {
                    h2 { (of_blocks.title) }
                    (tables::table(&of_blocks.headings, of_blocks.sections))
                    p.note { (of_blocks.notes.join(" ")) }
                }
            }
        }
        (navigation::outlook::section(report.navigation))
        @for figure in figures { (drawn(figure)) }
        @if let Some(outcome) = report.outcome {
            section { h2 { "What the path saw least" } (tables::weakest(outcome))
                p.note {
                    "Combinations of parameters, each in units of its prior σ, that the run saw \
                    independently of each other; the ratio is posterior to prior σ. " i { "With" }
                    " joins errors of the same sign, " i { "against" } " errors of opposite sign."
                }
            }
        }
        section { h2 { "Model and method" } (facts::model(report)) }
        section { h2 { "Run" } (facts::run(report.run, report.aiding)) }
    };
    document(report.title, &body)
}

/// A page as HTML that needs nothing else.
pub(super) fn document(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { (body) footer { "turncal " (env!("CARGO_PKG_VERSION")) } }
        }
    };
    page.into_string()
}

/// One sentence: what ran on what.
fn summary(report: &Report) -> String {
    let mut text = format!(
        "Run {}, {} s. ",
        report.run.recording.name,
        number::value(report.run.recording.imu.duration(), 10.0)
    );
    if let Some(outcome) = report.outcome {
        let state = if outcome.converged {
            "converged"
        } else {
            "NOT converged"
        };
        text.push_str(&format!(
            "EKF {state} after {} passes. ",
            outcome.passes.len()
        ));
    }
    text.push_str(match (report.truth, report.closed_form) {
        (Some(_), Some(_)) => "Compared with the closed form and the truth.",
        (Some(_), None) => "Compared with the truth.",
        (None, Some(_)) if report.outcome.is_some() => "Compared with the closed form.",
        (None, _) => "",
    });
    text.trim_end().to_owned()
}

/// Warnings and what was not observed, before any figure.
fn notices(report: &Report) -> Markup {
    let notices = report.warnings();
    html! {
        @if notices.is_empty() {
            @if report.outcome.is_some() { p.quiet { "No warnings." } }
        } @else {
            section.warnings {
                h2 { "Warnings" }
                ul { @for notice in notices { li { (notice) } } }
            }
        }
    }
}

/// A figure within a page.
pub(super) fn drawn(figure: &Figure) -> Markup {
    // The namespace is needed in a file of its own only.
    let svg = figure
        .svg
        .replacen(r#" xmlns="http://www.w3.org/2000/svg""#, "", 1);
    html! {
        figure {
            h2 { (figure.title) }
            div role="img" aria-label=(figure.title) { (PreEscaped(svg)) }
            figcaption { (figure.caption) " (" code { (figure.file) } ")" }
        }
    }
}
