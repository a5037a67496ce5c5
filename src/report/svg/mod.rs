//! Draws any plot as an SVG document: margins from the widths of labels, names at the ends of lines that never
//! overlap, ticks that leave each other room.

mod canvas;
mod grid;
mod matrix;
mod series;
#[cfg(test)]
mod tests;

use super::plot::{Body, Plot};

#[cfg(test)]
pub(super) use tests::{assert_sound, drawn};

/// A plot that could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("cannot draw the figure {file}: {reason}")]
pub struct DrawError {
    /// The figure's file name.
    pub file: String,
    /// What the drawing library said.
    pub reason: String,
}

/// The SVG document of a plot.
///
/// # Errors
/// [`DrawError`] if the drawing library fails.
pub fn draw(plot: &Plot) -> Result<String, DrawError> {
    let drawn = match &plot.body {
        Body::Panels(grid) => canvas::draw((canvas::WIDTH, grid::height(grid)), |on| {
            grid::draw(on, grid)
        }),
        Body::Matrix(of) => canvas::draw((canvas::WIDTH, matrix::height(of)), |on| {
            matrix::draw(on, of)
        }),
    };
    drawn.map_err(|error| DrawError {
        file: plot.file.clone(),
        reason: error.to_string(),
    })
}
