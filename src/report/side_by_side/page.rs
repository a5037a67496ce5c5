//! The page: the tables and the figure.

use maud::html;

use super::super::Figure;
use super::super::page::{document, drawn};
use super::super::tables::section;
use super::{summary, tables, warnings};
use crate::calibration::Comparison;

const TITLE: &str = "Comparison of calibrations";

pub(super) fn page(comparison: &Comparison, figure: &Figure) -> String {
    let body = html! {
        header { h1 { (TITLE) } p { (summary(comparison)) } }
        @for warning in warnings(comparison) { p.warnings { (warning) } }
        (drawn(figure))
        @for table in tables(comparison) { (section(&table)) }
    };
    document(TITLE, &body)
}
