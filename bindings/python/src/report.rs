//! Reports of results.

use std::path::PathBuf;

use pyo3::prelude::*;
use turncal_report::document::Block;
use turncal_report::{Document, json, terminal, write};

use crate::errors::{in_python, raise};

/// Width of text in characters.
const WIDTH: usize = 100;
/// The frame of a page in a notebook, as high as the page.
const FRAME: &str = "style=\"width: 100%; height: 40em; border: 0\" onload=\"const page = this.contentDocument.body; new \
                     ResizeObserver(() => this.style.height = `${page.offsetHeight + 2}px`).observe(page)\"";

/// Figures, tables and a page about a result.
///
/// `print(report)` shows it as text, a notebook as a page.
#[pyclass(frozen, module = "turncal")]
pub struct Report(pub Document);

#[pymethods]
impl Report {
    /// Figures by name, with the unit in the name, as the command prints them with ``--json``.
    #[getter]
    fn data<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (json(&self.0),))
    }

    /// The same as text, byte for byte as the command prints it with ``--json``.
    fn to_json(&self) -> String {
        json(&self.0)
    }

    /// Writes ``index.html``, its figures as SVG files and further files into a directory, which is created if needed.
    fn write(&self, directory: PathBuf) -> PyResult<()> {
        std::fs::create_dir_all(&directory)?;
        write(&self.0, &directory).map_err(raise)
    }

    fn __str__(&self) -> String {
        in_python(&terminal::text(&self.0, Some(WIDTH)))
    }

    fn __repr__(&self) -> String {
        format!("<turncal.Report: {}>", self.0.title)
    }

    fn _repr_html_(&self) -> String {
        framed(&self.0)
    }
}

/// The page of a document in a frame, so that its style does not touch that of the notebook.
pub fn framed(document: &Document) -> String {
    let files = turncal_report::files(document);
    let page = files.into_iter().find(|(name, _)| name == "index.html");
    let page = page.map_or_else(String::new, |(_, page)| page);
    // Names in a style are no options.
    let page = match page.split_once("</style>") {
        Some((head, body)) => format!("{head}</style>{}", in_python(body)),
        None => page,
    };
    let page = page.replace('&', "&amp;").replace('"', "&quot;");
    format!("<iframe srcdoc=\"{page}\" {FRAME}></iframe>")
}

/// A document with its summary and its first figure only.
pub fn brief(document: &Document) -> Document {
    let is_plot = |(_, block): &&(bool, Block)| matches!(block, Block::Plot(_));
    Document {
        blocks: document
            .blocks
            .iter()
            .find(is_plot)
            .cloned()
            .into_iter()
            .collect(),
        ..document.clone()
    }
}
