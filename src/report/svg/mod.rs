//! Draws any plot as an SVG document: margins from the widths of labels, names at the ends of lines that never
//! overlap, ticks that leave each other room. Who hovers over a mark is shown its numbers.

mod grid;
mod matrix;
mod series;
#[cfg(test)]
mod tests;

use maud::{Markup, PreEscaped, Render, html};

use super::plot::{Body, Color, Dash, Pen, Plot, Point};

#[cfg(test)]
pub(super) use tests::{assert_sound, drawn};

/// Width of every figure in pixels.
const WIDTH: u32 = 1200;
/// Size of the letters.
const LETTER: f64 = 14.0;
/// Of ticks, labels and notes.
const SMALL: f64 = 0.95;

/// Text and axes.
const INK: &str = "#222222";
/// What must not distract.
const QUIET: &str = "#6e6e6e";
const COLORS: [&str; 6] = [
    "#005493", "#c85000", "#008060", "#56a0d3", "#963c6e", "#8c7814",
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
            (PreEscaped(on.0))
        }
    };
    document.into_string() + "\n"
}

/// The colour of a pen.
fn rgb(color: Color) -> &'static str {
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

/// A length to a tenth of a pixel.
fn fine(length: f64) -> f64 {
    (10.0 * length).round() / 10.0
}

fn list(points: &[Point]) -> String {
    let points = points
        .iter()
        .map(|&(x, y)| format!("{},{}", fine(x), fine(y)));
    points.collect::<Vec<_>>().join(" ")
}

/// How a text lies about its point: `start`, `middle` or `end` across, and the part of it that is at its height.
type Lie = (&'static str, Height);

/// Which part of a text is at the height of its point.
#[derive(Clone, Copy)]
enum Height {
    Head,
    Middle,
    Foot,
}

/// The inside of an SVG document in the making.
#[derive(Default)]
struct Canvas(String);

impl Canvas {
    fn put(&mut self, element: Markup) {
        element.render_to(&mut self.0);
        self.0.push('\n');
    }

    /// Draws what shows this text to who hovers over it.
    fn titled(&mut self, text: &str, drawn: impl FnOnce(&mut Self)) {
        let mut inside = Self::default();
        drawn(&mut inside);
        self.put(html! { g { title { (text) } (PreEscaped(inside.0.trim_end())) } })
    }

    /// Joins points.
    fn line(&mut self, points: &[Point], pen: Pen) {
        let dashes = match pen.dash {
            Dash::Solid => None,
            Dash::Dashed => Some("6 4"),
            Dash::Dotted => Some("2 2.5"),
        };
        self.put(html! {
            polyline points=(list(points)) fill="none" stroke=(rgb(pen.color)) stroke-width=(pen.width)
                stroke-dasharray=[dashes] {}
        })
    }

    /// The same without dashes in any colour.
    fn stroke(&mut self, points: &[Point], color: &str, width: f64) {
        self.put(html! { polyline points=(list(points)) fill="none" stroke=(color) stroke-width=(width) {} })
    }

    /// Fills an outline.
    fn area(&mut self, outline: &[Point], color: &str) {
        self.put(html! { polygon points=(list(outline)) fill=(color) {} })
    }

    /// Fills a rectangle.
    fn rectangle(&mut self, [(left, top), (right, bottom)]: [Point; 2], color: &str) {
        self.area(
            &[(left, top), (right, top), (right, bottom), (left, bottom)],
            color,
        )
    }

    /// A circle, filled or open with a line of this width.
    fn circle(&mut self, (x, y): Point, radius: f64, color: &str, line: Option<f64>) {
        let (fill, stroke) = match line {
            Some(_) => ("none", Some(color)),
            None => (color, None),
        };
        self.put(html! {
            circle cx=(fine(x)) cy=(fine(y)) r=(radius) fill=(fill) stroke=[stroke] stroke-width=[line] {}
        })
    }

    /// Writes text; `scale` 1 is the usual size.
    fn text(&mut self, text: &str, (x, y): Point, (across, height): Lie, color: &str, scale: f64) {
        let down = match height {
            Height::Head => "0.76em",
            Height::Middle => "0.5ex",
            Height::Foot => "-0.5ex",
        };
        self.put(html! {
            text x=(fine(x)) y=(fine(y)) dy=(down) text-anchor=(across) font-size=(fine(LETTER * scale))
                fill=(color) { (text) }
        })
    }

    /// Writes text upwards.
    fn upright(&mut self, text: &str, (x, y): Point, scale: f64) {
        let turned = format!("rotate(270 {} {})", fine(x), fine(y));
        self.put(html! {
            text x=(fine(x)) y=(fine(y)) dy="0.5ex" font-size=(fine(LETTER * scale)) fill=(INK)
                transform=(turned) { (text) }
        })
    }
}
