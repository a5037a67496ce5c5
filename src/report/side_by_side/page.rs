//! The page: the tables and the figure.

use maud::html;

use super::super::Figure;
use super::super::page::{document, drawn};
use super::super::tables::table;
use super::{Table, summary, tables, warnings};
use crate::calibration::Comparison;

const TITLE: &str = "Comparison of calibrations";

pub(super) fn page(comparison: &Comparison, figure: &Figure) -> String {
    let body = html! {
        header { h1 { (TITLE) } p { (summary(comparison)) } }
        @for warning in warnings(comparison) { p.warnings { (warning) } }
        (drawn(figure))
        @for Table { title, headings, sections, notes } in tables(comparison) {
            section { h2 { (title) } (table(&headings, sections)) p.note { (notes.join(" ")) } }
        }
    };
    document(TITLE, &body)
}
