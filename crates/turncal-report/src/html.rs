//! The files of a document: a self-contained page, every figure, and further files.

use std::path::{Path, PathBuf};
use std::{fs, io};

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::document::{Block, Document, Facts, List, PageOnly, Table};
use super::plot::Plot;
use super::svg;
use turncal::calibration::{Finding, FindingKind as Kind};

/// The style of every page.
const STYLE: &str = include_str!("style.css");

/// Letters of the longest number with σ and unit.
const LONGEST: usize = 20;

/// Error for a file of a report that could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {path}: {source}. The directory must exist and be writable", path = path.display())]
pub struct ReportError {
    /// The file.
    pub path: PathBuf,
    /// The system error.
    pub source: io::Error,
}

/// The files of a document by name: `index.html`, which contains all figures and needs neither other files nor a
/// network; every figure as a separate SVG file; and the further files of the document.
pub fn files(document: &Document) -> Vec<(String, String)> {
    let page = ("index.html".to_owned(), page(document));
    let figures = document
        .plots()
        .map(|plot| (plot.file.clone(), svg::draw(plot)));
    let further = document.files.iter().cloned();
    figures.chain(further).chain([page]).collect()
}

/// Writes the [`files`] of a document into an existing directory.
///
/// # Errors
/// Returns [`ReportError`] if a file cannot be written.
pub fn write(document: &Document, directory: &Path) -> Result<(), ReportError> {
    for (name, text) in files(document) {
        let path = directory.join(name);
        fs::write(&path, text).map_err(|source| ReportError { path, source })?;
    }
    Ok(())
}

/// The page, with warnings first, then conclusions, then the other parts in order.
pub fn page(document: &Document) -> String {
    let parts = document
        .blocks
        .chunk_by(|_, (_, next)| !matches!(next, Block::Fold(_)));
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (document.title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { (document.title) }
                    @if let Some((word, of_it)) = &document.verdict {
                        p.verdict { strong class=(word.class()) { (word) } " " (of_it) }
                    }
                    @for p in &document.lead { p { (p) } }
                }
                @if !document.findings.is_empty() {
                    section.findings {
                        h2 { "What to look at" }
                        @for finding in &document.findings { (of_finding(finding)) }
                    }
                }
                @for block in &document.brief { (of_block(block)) }
                @if !document.warnings.items.is_empty() {
                    section.warnings { (list(&document.warnings)) }
                }
                @if !document.conclusions.items.is_empty() {
                    section { (list(&document.conclusions)) }
                }
                @for part in parts { (of_part(part)) }
                footer { "turncal " (env!("CARGO_PKG_VERSION")) }
            }
        }
    };
    page.into_string()
}

/// A text without parentheses and sentences about command-line options, because the reader may not have the command.
fn without_options(text: &str) -> String {
    let is_of_command = |part: &str| part.contains("--") || part.contains('`');
    let parts = text
        .split_inclusive(')')
        .map(|part| match part.rfind(" (") {
            Some(open) if is_of_command(&part[open..]) => &part[..open],
            _ => part,
        });
    let text = parts.collect::<String>();
    let sentences = text.split_inclusive(". ");
    let kept = sentences.filter(|sentence| !is_of_command(sentence));
    kept.collect::<String>().trim_end().to_owned()
}

/// Problem and remedy, with details collapsed.
fn of_finding(finding: &Finding) -> Markup {
    let mut finding = finding.clone();
    finding.text = without_options(&finding.text);
    let explanation = Kind::named(&finding.kind).map(|kind| without_options(kind.explanation()));
    let (what, next) = finding.headline();
    html! {
        details {
            summary {
                code { (finding.code) } " " (what)
                @if let Some(next) = next { span.next { "→ " (next) } }
            }
            p { (finding) }
            @if let Some(explanation) = explanation { p.note { (explanation) } }
        }
    }
}

/// Blocks below the heading of a collapsed section; those before the first have none.
fn of_part(part: &[(PageOnly, Block)]) -> Markup {
    let blocks = html! { @for (_, block) in part { (of_block(block)) } };
    match part {
        [(_, Block::Fold(_))] => html! {},
        [(_, Block::Fold(heading)), ..] => html! { details { summary { (heading) } (blocks) } },
        _ => blocks,
    }
}

fn of_block(block: &Block) -> Markup {
    match block {
        Block::Facts(of) => html! {
            section { @if !of.heading.is_empty() { h2 { (of.heading) } } (facts(of)) }
        },
        Block::Table(of) => table(of),
        Block::List(of) => html! { section { (list(of)) } },
        Block::Plot(of) => plot(of),
        Block::Text(heading, text) => html! {
            section { @if !heading.is_empty() { h2 { (heading) } } p.note { (text) } }
        },
        Block::Code(heading, code) => html! { section { h2 { (heading) } pre { (code) } } },
        Block::Fold(_) => html! {},
    }
}

fn list(of: &List) -> Markup {
    html! { h2 { (of.heading) } ul { @for item in &of.items { li { (item) } } } }
}

fn facts(of: &Facts) -> Markup {
    html! { dl { @for (name, value) in &of.rows { div { dt { (name) } dd { (value) } } } } }
}

fn table(of: &Table) -> Markup {
    html! {
        section {
            h2 { (of.heading) }
            div.wide {
                table {
                    thead { tr { @for heading in &of.columns { th scope="col" { (heading) } } } }
                    @for section in &of.sections {
                        tbody { @for row in section { (row_of(row)) } }
                    }
                }
            }
            @if !of.notes.is_empty() { p.note { (of.notes.join(" ")) } }
        }
    }
}

fn row_of(row: &[String]) -> Markup {
    html! {
        tr {
            @for (place, cell) in row.iter().enumerate() {
                @if place == 0 { th scope="row" { (cell) } } @else { td { (unbroken(cell)) } }
            }
        }
    }
}

/// A number with its σ and unit on one line, any other text as it is.
fn unbroken(cell: &str) -> String {
    let is_number = cell.starts_with(|first: char| first.is_ascii_digit() || first == '−');
    if is_number && cell.chars().count() <= LONGEST {
        cell.replace(' ', "\u{a0}")
    } else {
        cell.to_owned()
    }
}

/// The figure in every width; the style shows one of them.
fn plot(of: &Plot) -> Markup {
    // The namespace is needed only in a separate file.
    let drawn =
        |width| svg::draw_at(of, width).replacen(r#" xmlns="http://www.w3.org/2000/svg""#, "", 1);
    html! {
        figure {
            h2 { (of.heading) }
            @for width in svg::WIDTHS {
                div class={ "w" (width) } role="img" aria-label=(of.heading) { (PreEscaped(drawn(width))) }
            }
            figcaption { (of.caption) " (" code { (of.file) } ")" }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_speaks_of_no_option() {
        let text = "The form is too narrow (χ² 40). Look at drift (add --temperature if warm); else widen σ. Rerun \
                    with --installation general.";
        assert_eq!(
            without_options(text),
            "The form is too narrow (χ² 40). Look at drift; else widen σ."
        );
    }
}
