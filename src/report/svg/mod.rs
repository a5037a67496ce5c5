//! Draws any plot as an SVG document: margins from the widths of labels, names at the ends of lines that never
//! overlap, ticks that leave each other room. Who hovers over a mark is shown its numbers.

mod canvas;
mod grid;
mod matrix;
mod series;
#[cfg(test)]
mod tests;

use canvas::{Canvas, Height};
use maud::{PreEscaped, html};
use plotters::style::RGBColor;

use super::plot::{Body, Color, Plot};

#[cfg(test)]
pub(super) use tests::{assert_sound, drawn};

/// Width of every figure in pixels.
const WIDTH: u32 = 1200;
/// Size of the letters.
const LETTER: f64 = 14.0;
/// Of ticks, labels and notes.
const SMALL: f64 = 0.95;

/// Text and axes.
const INK: RGBColor = RGBColor(34, 34, 34);
/// What must not distract.
const QUIET: RGBColor = RGBColor(110, 110, 110);
const COLORS: [RGBColor; 6] = [
    RGBColor(0, 84, 147),
    RGBColor(200, 80, 0),
    RGBColor(0, 128, 96),
    RGBColor(86, 160, 211),
    RGBColor(150, 60, 110),
    RGBColor(140, 120, 20),
];

/// The SVG document of a plot.
pub fn draw(plot: &Plot) -> String {
    let mut on = Canvas::default();
    let height = match &plot.body {
        Body::Panels(grid) => grid::draw(&mut on, grid),
        Body::Matrix(matrix) => matrix::draw(&mut on, matrix),
    };
    let document = html! {
        svg width=(WIDTH) height=(height) viewBox={ "0 0 " (WIDTH) " " (height) } font-family="sans-serif"
            xmlns="http://www.w3.org/2000/svg" {
            rect width="100%" height="100%" fill="#ffffff" {}
            (PreEscaped(on.inside()))
        }
    };
    document.into_string() + "\n"
}

/// The colour of a pen.
fn rgb(color: Color) -> RGBColor {
    match color {
        Color::Ink => INK,
        Color::Quiet => QUIET,
        Color::Nth(n) => COLORS[n % COLORS.len()],
    }
}

/// About how wide a text is; fonts differ, this is one of the wide ones.
fn width(text: &str, scale: f64) -> f64 {
    let of = |letter: char| match letter {
        'i' | 'j' | 'l' | '\'' | '|' | 'I' => 0.29,
        ' ' | '.' | ',' | ':' | ';' | '\u{202f}' => 0.32,
        'f' | 't' | 'r' | '(' | ')' | '-' | '/' | '″' | '′' => 0.4,
        's' | 'c' | 'z' | '°' => 0.54,
        'm' | 'w' | 'W' | 'M' | '−' | '±' | '+' | '=' | '<' | '>' | '%' | '…' => 0.88,
        letter if letter.is_uppercase() => 0.72,
        _ => 0.63,
    };
    text.chars().map(of).sum::<f64>() * LETTER * scale
}

/// A text cut to a width.
fn shortened(text: &str, room: f64) -> String {
    if width(text, SMALL) <= room {
        return text.to_owned();
    }
    let mut short = text.to_owned();
    while !short.is_empty() && width(&short, SMALL) + 0.9 * LETTER > room {
        short.pop();
    }
    short + "…"
}
