//! Draws any plot as an SVG document with a given width, in the colours of paper or of a dark screen. The margins
//! follow from the widths of the labels, names at the ends of lines do not overlap, and ticks keep a distance from each
//! other. Hovering over a mark shows its values.

mod canvas;
mod grid;
mod series;
#[cfg(test)]
mod tests;
mod words;

use canvas::{Canvas, dark_style};
use maud::{PreEscaped, html};

use super::plot::Plot;

pub use canvas::WIDTHS;

#[cfg(test)]
pub use tests::{assert_sound, drawn};

/// The SVG document of a plot for a wide screen.
pub fn draw(plot: &Plot) -> String {
    draw_at(plot, WIDTHS[0])
}

/// The SVG document of a plot with this width; a narrower plot has fewer panels side by side.
pub fn draw_at(plot: &Plot, width: u32) -> String {
    let mut on = Canvas::default();
    on.is_hovered = width == WIDTHS[0];
    let height = grid::draw(&mut on, plot, width);
    let document = html! {
        svg width=(width) height=(height) viewBox={ "0 0 " (width) " " (height) } font-family="sans-serif"
            xmlns="http://www.w3.org/2000/svg" {
            style { (PreEscaped(dark_style())) }
            rect width="100%" height="100%" fill="#FFFFFF" {}
            (PreEscaped(on.inside()))
        }
    };
    document.into_string() + "\n"
}
