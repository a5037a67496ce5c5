//! What a result says, and how it is shown.
//!
//! A result fills a [`Document`]: facts, tables, plots, findings, and its figures by name. Three renderers turn
//! any document into text ([`terminal`]), a page with figures ([`write()`]) or JSON ([`json`]); they know nothing of
//! calibration. A plot is a value, too ([`plot`]), and one renderer draws them all ([`svg`]).
//!
//! Nothing is estimated here. What is worked out is what showing needs: differences, units, extremes.
//!
//! A figure is added to a result by handing its document one more plot:
//!
//! ```
//! use turncal::report::plot::{Axis, Panel, Plot, Series};
//! use turncal::report::{Document, svg};
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
pub mod campaign;
#[cfg(feature = "certificate")]
pub mod certificate;
pub mod check;
pub mod comparison;
pub mod conversion;
pub mod experiment;
mod group;
pub mod lot;
pub mod navigation;
pub mod path;
mod prelude;
pub mod session;
pub mod table1;
mod terms;
#[cfg(test)]
mod tests;

pub use document::{Document, Facts};
pub use html::{ReportError, files, write};

/// The figures of a document by name as JSON.
pub fn json(document: &Document) -> String {
    format!("{:#}\n", document.data)
}
