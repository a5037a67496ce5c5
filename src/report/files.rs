//! A document as files: the page, every figure, and what else it holds.

use std::path::{Path, PathBuf};
use std::{fs, io};

use super::document::Document;
use super::{html, svg};

/// A report that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file could not be written.
    #[error("cannot write {path}: {source}; the directory must exist and be writable", path = path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A figure could not be drawn.
    #[error(transparent)]
    Draw(#[from] svg::DrawError),
}

/// The files of a document by name: `index.html`, which holds the figures and needs neither other files nor a
/// network, every figure as an SVG file of its own, and the document's further files.
///
/// # Errors
/// [`ReportError`] if a figure cannot be drawn.
pub fn files(document: &Document) -> Result<Vec<(String, String)>, ReportError> {
    let drawn = document.plots().map(svg::draw);
    let drawn = drawn.collect::<Result<Vec<_>, _>>()?;
    let page = html::page(document, &drawn);
    let figures = document.plots().map(|plot| plot.file.clone()).zip(drawn);
    let further = document.files.iter().cloned();
    Ok(figures
        .chain(further)
        .chain([("index.html".to_owned(), page)])
        .collect())
}

/// Writes the [`files`] of a document into an existing directory.
///
/// # Errors
/// [`ReportError`] if a figure cannot be drawn or a file not be written.
pub fn write(document: &Document, directory: &Path) -> Result<(), ReportError> {
    for (name, text) in files(document)? {
        let path = directory.join(name);
        fs::write(&path, text).map_err(|source| ReportError::Write { path, source })?;
    }
    Ok(())
}
