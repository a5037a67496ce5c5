//! A fine canvas with its colours, pens and letters.
//!
//! Plotters rounds every coordinate to a whole pixel, so a figure is drawn [`FINE`] times larger and shown at
//! its size. Sizes here are in shown pixels.

use std::cell::RefCell;

use plotters::coord::Shift;
use plotters::element::{DashedPathElement, Drawable, PointCollection};
use plotters::prelude::*;
use plotters::style::Color as _;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::report::plot::{Color, Dash, Panel, Pen, Point, Scale};

/// Width of every figure.
pub const WIDTH: u32 = 1200;
/// Drawn pixels in one shown pixel.
const FINE: f64 = 8.0;
/// Size of the letters.
pub const LETTER: f64 = 14.0;
/// Of ticks, labels and notes.
pub const SMALL: f64 = 0.95;
/// What plotters divides a font's size by when it writes SVG.
const FONT_RATIO: f64 = 1.24;

/// Text and axes.
pub const INK: RGBColor = RGBColor(34, 34, 34);
/// What must not distract.
pub const QUIET: RGBColor = RGBColor(110, 110, 110);
/// Grid lines.
pub const GRID: RGBColor = RGBColor(218, 218, 214);
/// The time of a dwell.
pub const SHADE: RGBColor = RGBColor(243, 243, 238);
/// Bands and filled bars.
pub const BAND: RGBColor = RGBColor(196, 214, 228);

const COLORS: [RGBColor; 6] = [
    RGBColor(0, 84, 147),
    RGBColor(200, 80, 0),
    RGBColor(0, 128, 96),
    RGBColor(86, 160, 211),
    RGBColor(150, 60, 110),
    RGBColor(140, 120, 20),
];

/// What can go wrong while drawing.
pub type DrawError = DrawingAreaErrorKind<std::io::Error>;

/// The colour of a pen.
pub fn rgb(color: Color) -> RGBColor {
    match color {
        Color::Ink => INK,
        Color::Quiet => QUIET,
        Color::Nth(n) => COLORS[n % COLORS.len()],
    }
}

/// About how wide a text is in shown pixels; fonts differ, this is one of the wide ones.
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

fn px(shown: f64) -> i32 {
    (shown * FINE).round() as i32
}

fn place((x, y): Point) -> (i32, i32) {
    (px(x), px(y))
}

/// What a figure is drawn on.
pub struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
    /// The first error, which is that of the figure.
    failed: RefCell<Option<DrawError>>,
}

/// An SVG document of this size.
pub fn draw(
    (width, height): (u32, u32),
    content: impl FnOnce(&Canvas),
) -> Result<String, DrawError> {
    let (fine_width, fine_height) = (width * FINE as u32, height * FINE as u32);
    let mut text = String::new();
    {
        let backend = SVGBackend::with_string(&mut text, (fine_width, fine_height));
        let canvas = Canvas {
            area: backend.into_drawing_area(),
            failed: RefCell::default(),
        };
        canvas.area.fill(&WHITE)?;
        content(&canvas);
        canvas.area.present()?;
        if let Some(error) = canvas.failed.take() {
            return Err(error);
        }
    }
    Ok(text.replacen(
        &format!(r#"width="{fine_width}" height="{fine_height}" viewBox"#),
        &format!(r#"width="{width}" height="{height}" viewBox"#),
        1,
    ))
}

impl Canvas<'_> {
    fn put<E>(&self, element: E)
    where
        for<'e> &'e E: PointCollection<'e, (i32, i32)>,
        E: for<'b> Drawable<SVGBackend<'b>>,
    {
        if let Err(error) = self.area.draw(&element) {
            self.failed.borrow_mut().get_or_insert(error);
        }
    }

    /// Joins points.
    pub(super) fn line(&self, points: &[Point], pen: Pen) {
        let style = rgb(pen.color).stroke_width(px(pen.width) as u32);
        let (dash, gap) = match pen.dash {
            Dash::Solid => return self.stroke(points, rgb(pen.color), pen.width),
            Dash::Dashed => (6.0, 4.0),
            Dash::Dotted => (2.0, 2.5),
        };
        let points: Vec<_> = points.iter().copied().map(place).collect();
        let dashes = DashedPathElement::new(points, px(dash), px(gap), style);
        self.put(dashes);
    }

    /// The same without dashes in any colour.
    pub(super) fn stroke(&self, points: &[Point], color: RGBColor, width: f64) {
        let points: Vec<_> = points.iter().copied().map(place).collect();
        let style = color.stroke_width(px(width) as u32);
        self.put(PathElement::new(points, style));
    }

    /// Fills an outline.
    pub(super) fn area(&self, outline: &[Point], color: RGBColor) {
        let outline: Vec<_> = outline.iter().copied().map(place).collect();
        self.put(Polygon::new(outline, color.filled()));
    }

    /// Fills a rectangle.
    pub(super) fn rectangle(&self, corners: [Point; 2], color: RGBColor) {
        let rectangle = Rectangle::new(corners.map(place), color.filled());
        self.put(rectangle);
    }

    /// A circle, filled or open with a line of this width.
    pub(super) fn circle(&self, at: Point, radius: f64, color: RGBColor, line: Option<f64>) {
        let style = line.map_or(color.filled(), |width| color.stroke_width(px(width) as u32));
        self.put(Circle::new(place(at), px(radius), style));
    }

    /// Writes text; `scale` 1 is the usual size.
    pub(super) fn text(
        &self,
        text: &str,
        at: Point,
        (h, v): (HPos, VPos),
        color: RGBColor,
        scale: f64,
    ) {
        let style = font(scale).color(&color).pos(Pos::new(h, v));
        self.put(Text::new(text.to_owned(), place(at), style));
    }

    /// Writes text upwards.
    pub(super) fn upright(&self, text: &str, at: Point, scale: f64) {
        let style = font(scale).transform(FontTransform::Rotate270);
        let style = style.color(&INK).pos(Pos::new(HPos::Left, VPos::Center));
        self.put(Text::new(text.to_owned(), place(at), style));
    }
}

fn font(scale: f64) -> FontDesc<'static> {
    ("sans-serif", LETTER * FONT_RATIO * FINE * scale).into_font()
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
