//! Draws any plot as an SVG document: margins from the widths of labels, non-overlapping names at the ends of lines,
//! and spaced ticks. Hovering over a mark shows its values.

mod canvas;
mod grid;
mod series;
#[cfg(test)]
mod tests;

use canvas::{Canvas, WIDTH};
use maud::{PreEscaped, html};

use super::plot::Plot;

#[cfg(test)]
pub use tests::{assert_sound, drawn};

/// The SVG document of a plot.
pub fn draw(plot: &Plot) -> String {
    let mut on = Canvas::default();
    let height = grid::draw(&mut on, plot);
    let document = html! {
        svg width=(WIDTH) height=(height) viewBox={ "0 0 " (WIDTH) " " (height) } font-family="sans-serif"
            xmlns="http://www.w3.org/2000/svg" {
            rect width="100%" height="100%" fill="#ffffff" {}
            (PreEscaped(on.inside()))
        }
    };
    document.into_string() + "\n"
}
