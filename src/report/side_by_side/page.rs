//! The page: the tables and the figure.

use maud::{DOCTYPE, PreEscaped, html};

use super::super::Figure;
use super::super::page::{STYLE, drawn};
use super::super::tables::table;
use super::{Table, summary, tables, warnings};
use crate::calibration::Comparison;

const TITLE: &str = "Comparison of calibrations";

pub(super) fn page(comparison: &Comparison, figure: &Figure) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (TITLE) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header { h1 { (TITLE) } p { (summary(comparison)) } }
                @for warning in warnings(comparison) { p.warnings { (warning) } }
                (drawn(figure))
                @for Table { title, headings, sections, notes } in tables(comparison) {
                    section { h2 { (title) } (table(&headings, sections)) p.note { (notes.join(" ")) } }
                }
                footer { "turncal " (env!("CARGO_PKG_VERSION")) }
            }
        }
    };
    page.into_string()
}
