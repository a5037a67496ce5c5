//! An SVG document in the making, with its colours, pens and letters. Sizes are in pixels.

use maud::{Markup, PreEscaped, Render, html};

use crate::report::plot::{Color, Dash, Panel, Pen, Point, Scale};

/// Width of every figure in pixels.
pub const WIDTH: u32 = 1200;
/// Size of the letters.
pub const LETTER: f64 = 14.0;
/// Of ticks, labels and notes.
pub const SMALL: f64 = 0.95;

/// Text and axes.
pub const INK: &str = "#222222";
/// What must not distract.
pub const QUIET: &str = "#6e6e6e";
const COLORS: [&str; 6] = [
    "#005493", "#c85000", "#008060", "#56a0d3", "#963c6e", "#8c7814",
];

/// The colour of a pen.
pub fn rgb(color: Color) -> &'static str {
    match color {
        Color::Ink => INK,
        Color::Quiet => QUIET,
        Color::Nth(n) => COLORS[n % COLORS.len()],
    }
}

/// About how wide a text is; fonts differ, this is one of the wide ones.
pub fn width(text: &str, scale: f64) -> f64 {
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
pub fn shortened(text: &str, room: f64) -> String {
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
pub type Lie = (&'static str, Height);

/// Which part of a text is at the height of its point.
#[derive(Clone, Copy)]
pub enum Height {
    Head,
    Middle,
    Foot,
}

/// The inside of an SVG document in the making.
#[derive(Default)]
pub struct Canvas(pub(super) String);

impl Canvas {
    fn put(&mut self, element: Markup) {
        element.render_to(&mut self.0);
        self.0.push('\n');
    }

    /// Draws what shows this text to who hovers over it.
    pub(super) fn titled(&mut self, text: &str, drawn: impl FnOnce(&mut Self)) {
        let mut inside = Self::default();
        drawn(&mut inside);
        self.put(html! { g { title { (text) } (PreEscaped(inside.0.trim_end())) } })
    }

    /// Joins points.
    pub(super) fn line(&mut self, points: &[Point], pen: Pen) {
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
    pub(super) fn stroke(&mut self, points: &[Point], color: &str, width: f64) {
        self.put(html! { polyline points=(list(points)) fill="none" stroke=(color) stroke-width=(width) {} })
    }

    /// Fills an outline.
    pub(super) fn area(&mut self, outline: &[Point], color: &str) {
        self.put(html! { polygon points=(list(outline)) fill=(color) {} })
    }

    /// Fills a rectangle.
    pub(super) fn rectangle(&mut self, [(left, top), (right, bottom)]: [Point; 2], color: &str) {
        self.area(
            &[(left, top), (right, top), (right, bottom), (left, bottom)],
            color,
        )
    }

    /// A circle, filled or open with a line of this width.
    pub(super) fn circle(&mut self, (x, y): Point, radius: f64, color: &str, line: Option<f64>) {
        let (fill, stroke) = match line {
            Some(_) => ("none", Some(color)),
            None => (color, None),
        };
        self.put(html! {
            circle cx=(fine(x)) cy=(fine(y)) r=(radius) fill=(fill) stroke=[stroke] stroke-width=[line] {}
        })
    }

    /// Writes text; `scale` 1 is the usual size.
    pub(super) fn text(
        &mut self,
        text: &str,
        (x, y): Point,
        (across, height): Lie,
        color: &str,
        scale: f64,
    ) {
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
    pub(super) fn upright(&mut self, text: &str, (x, y): Point, scale: f64) {
        let turned = format!("rotate(270 {} {})", fine(x), fine(y));
        self.put(html! {
            text x=(fine(x)) y=(fine(y)) dy="0.5ex" font-size=(fine(LETTER * scale)) fill=(INK)
                transform=(turned) { (text) }
        })
    }
}

/// A panel laid out: where its axes are.
pub struct Frame<'p> {
    /// The panel.
    pub(super) panel: &'p Panel,
    /// Horizontal scale.
    pub(super) x: Scale,
    /// Vertical scale.
    pub(super) y: Scale,
    /// Left and right end of the axes.
    pub(super) across: (f64, f64),
    /// Upper and lower end.
    pub(super) down: (f64, f64),
    /// Right end of the panel.
    pub(super) end: f64,
}

impl Frame<'_> {
    /// Where a point is drawn.
    pub(super) fn at(&self, (x, y): Point) -> Point {
        (self.at_x(x), self.at_y(y))
    }

    /// Where an abscissa is drawn.
    pub(super) fn at_x(&self, x: f64) -> f64 {
        self.across.0 + self.x.part(x) * (self.across.1 - self.across.0)
    }

    /// Where a height is drawn.
    pub(super) fn at_y(&self, y: f64) -> f64 {
        self.down.1 - self.y.part(y) * (self.down.1 - self.down.0)
    }
}
