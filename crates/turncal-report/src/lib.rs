//! Reports on results, and their presentation.
//!
//! A result fills a [`Document`]: facts, tables, plots, findings, and figures by name. Three renderers turn any
//! document into text ([`terminal`]), a page with figures ([`write()`]) or JSON ([`json`]); they do not depend on
//! calibration. A plot is also a value ([`plot`]), and one renderer draws all plots ([`svg`]).
//!
//! This crate estimates nothing except quantities for display, such as differences, units and extremes.
//!
//! To add a figure to a result, add a plot to its document:
//!
//! ```
//! use turncal_report::plot::{Axis, Panel, Plot, Series};
//! use turncal_report::{Document, svg};
//!
//! let roots = (0..50).map(|k| (f64::from(k), f64::from(k).sqrt()));
//! let panel = Panel::new("square root", Axis::linear("number"), Axis::linear(""))
//!     .with(Series::line(roots).label("√"));
//! let plot = Plot::new("roots.svg", "Square roots", (1, 240), [panel]).caption("How roots grow.");
//! assert!(svg::draw(&plot).contains("number"));
//! let mut document = Document::new("Roots");
//! document.page(plot);
//! ```

pub mod document;
mod html;
#[cfg(feature = "certificate")]
pub mod pdf;
pub mod plot;
pub mod svg;
pub mod terminal;

pub mod accuracy;
pub mod allan;
pub mod at_rest;
pub mod calibration;
#[cfg(feature = "certificate")]
pub mod certificate;
pub mod check;
pub mod conversion;
pub mod experiment;
mod group;
mod ieee;
pub mod lot;
pub mod navigation;
pub mod path;
mod prelude;
pub mod record;
pub mod session;
pub mod table1;
mod terms;
#[cfg(test)]
mod tests;
pub mod values;

pub use document::{Document, Facts};
pub use html::{ReportError, files, write};

/// The named values of a document as JSON.
pub fn json(document: &Document) -> String {
    format!("{:#}\n", document.data)
}
