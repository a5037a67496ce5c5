//! Where marks are drawn: plotters draws each, the canvas keeps them in order and says what hovering over them shows.
//!
//! Plotters rounds every coordinate to a whole pixel, so a mark is drawn [`FINE`] times larger and shown at its size.
//! Sizes here are in shown pixels.

use maud::{PreEscaped, html};
use plotters::element::{DashedPathElement, Drawable, PointCollection};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{INK, LETTER, rgb};
use crate::report::plot::{Dash, Pen, Point};

/// Drawn pixels in one shown pixel.
pub const FINE: f64 = 8.0;
/// What plotters divides a font's size by when it writes SVG.
const FONT_RATIO: f64 = 1.24;

/// How a text lies about its point: across, and the part of it that is at its height.
type Lie = (&'static str, Height);

/// Which part of a text is at the height of its point.
#[derive(Clone, Copy)]
pub enum Height {
    Head,
    Middle,
    Foot,
}

/// The inside of an SVG document in the making.
#[derive(Default)]
pub struct Canvas(String);

fn px(shown: f64) -> i32 {
    (shown * FINE).round() as i32
}

fn place((x, y): Point) -> (i32, i32) {
    (px(x), px(y))
}

impl Canvas {
    /// All marks, at their size.
    pub fn inside(&self) -> String {
        let shown = format!("scale({})", FINE.recip());
        html! { g transform=(shown) { (PreEscaped(&self.0)) } }.into_string()
    }

    fn put<E>(&mut self, element: E)
    where
        for<'e> &'e E: PointCollection<'e, (i32, i32)>,
        E: for<'b> Drawable<SVGBackend<'b>>,
    {
        let mut document = String::new();
        let area = SVGBackend::with_string(&mut document, (1, 1)).into_drawing_area();
        // Writing into a text does not fail.
        let _ = area.draw(&element);
        drop(area);
        let inside = document.split_once(">\n").map_or("", |(_, inside)| inside);
        self.0 += inside.trim_end().trim_end_matches("</svg>");
    }

    /// Draws what shows this text to who hovers over it.
    pub fn titled(&mut self, text: &str, drawn: impl FnOnce(&mut Self)) {
        let mut inside = Self::default();
        drawn(&mut inside);
        self.0 += &html! { g { title { (text) } (PreEscaped(inside.0)) } }.into_string();
    }

    /// Joins points.
    pub fn line(&mut self, points: &[Point], pen: Pen) {
        let (dash, gap) = match pen.dash {
            Dash::Solid => return self.stroke(points, rgb(pen.color), pen.width),
            Dash::Dashed => (6.0, 4.0),
            Dash::Dotted => (2.0, 2.5),
        };
        let style = rgb(pen.color).stroke_width(px(pen.width) as u32);
        let points: Vec<_> = points.iter().copied().map(place).collect();
        self.put(DashedPathElement::new(points, px(dash), px(gap), style));
    }

    /// The same without dashes in any colour.
    pub fn stroke(&mut self, points: &[Point], color: RGBColor, width: f64) {
        let points: Vec<_> = points.iter().copied().map(place).collect();
        self.put(PathElement::new(
            points,
            color.stroke_width(px(width) as u32),
        ));
    }

    /// Fills an outline.
    pub fn area(&mut self, outline: &[Point], color: RGBColor) {
        let outline: Vec<_> = outline.iter().copied().map(place).collect();
        self.put(Polygon::new(outline, color.filled()));
    }

    /// Fills a rectangle.
    pub fn rectangle(&mut self, corners: [Point; 2], color: RGBColor) {
        self.put(Rectangle::new(corners.map(place), color.filled()));
    }

    /// A circle, filled or open with a line of this width.
    pub fn circle(&mut self, at: Point, radius: f64, color: RGBColor, line: Option<f64>) {
        let style = line.map_or(color.filled(), |width| color.stroke_width(px(width) as u32));
        self.put(Circle::new(place(at), px(radius), style));
    }

    /// Writes text; `scale` 1 is the usual size.
    pub fn text(
        &mut self,
        text: &str,
        at: Point,
        (across, height): Lie,
        color: RGBColor,
        scale: f64,
    ) {
        let across = match across {
            "start" => HPos::Left,
            "middle" => HPos::Center,
            _ => HPos::Right,
        };
        let height = match height {
            Height::Head => VPos::Top,
            Height::Middle => VPos::Center,
            Height::Foot => VPos::Bottom,
        };
        let style = font(scale).color(&color).pos(Pos::new(across, height));
        self.put(Text::new(text.to_owned(), place(at), style));
    }

    /// Writes text upwards.
    pub fn upright(&mut self, text: &str, at: Point, scale: f64) {
        let style = font(scale).transform(FontTransform::Rotate270);
        let style = style.color(&INK).pos(Pos::new(HPos::Left, VPos::Center));
        self.put(Text::new(text.to_owned(), place(at), style));
    }
}

fn font(scale: f64) -> FontDesc<'static> {
    ("sans-serif", LETTER * FONT_RATIO * FINE * scale).into_font()
}
