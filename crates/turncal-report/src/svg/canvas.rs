//! The canvas for figures, with colours, pens and fonts. The crate plotters draws each mark, and the canvas stores the
//! marks in order with their hover texts.
//!
//! Plotters rounds every coordinate to a whole pixel, so each mark is drawn [`FINE`] times larger and is then displayed
//! at its real size. Sizes in this module are in displayed pixels.

use maud::{PreEscaped, html};
use plotters::element::{DashedPathElement, Drawable, PointCollection};
use plotters::prelude::*;
use plotters::style::Color as _;
use plotters::style::text_anchor::Pos;

use crate::plot::{Color, Panel, Pen, Point, Scale};

pub use plotters::style::text_anchor::{HPos, VPos};

/// Widths at which every figure is drawn, in pixels: for a screen, for a printed page or tablet, and for a telephone.
pub const WIDTHS: [u32; 3] = [1200, 720, 360];
/// Drawn pixels per displayed pixel.
pub const FINE: f64 = 8.0;
/// Width of the widest and height of the highest figure, in drawn pixels.
const MOST: u32 = 1 << 20;
/// Divisor that plotters applies to font sizes in SVG.
const FONT_RATIO: f64 = 1.24;
/// Font size.
pub const LETTER: f64 = 14.0;
/// Font size of ticks, labels and notes.
pub const SMALL: f64 = 0.95;

/// Background.
pub const PAPER: RGBColor = RGBColor(255, 255, 255);
/// Text and axes.
pub const INK: RGBColor = RGBColor(34, 34, 34);
/// Colour of unobtrusive elements.
pub const QUIET: RGBColor = RGBColor(110, 110, 110);
/// Grid lines.
pub const GRID: RGBColor = RGBColor(218, 218, 214);
/// Shading of dwells.
pub const SHADE: RGBColor = RGBColor(243, 243, 238);
/// Bands.
pub const BAND: RGBColor = RGBColor(196, 214, 228);
const COLORS: [RGBColor; 6] = [
    RGBColor(0, 84, 147),
    RGBColor(200, 80, 0),
    RGBColor(0, 128, 96),
    RGBColor(86, 160, 211),
    RGBColor(150, 60, 110),
    RGBColor(140, 120, 20),
];
/// The same colours on a dark screen, in the order of [`dark_style`].
const DARK: [&str; 12] = [
    "#1b1b1a", "#e6e6e3", "#a8a8a4", "#41413e", "#2a2a28", "#2f4a5e", "#6db3f2", "#ff9d5c",
    "#4fc9a4", "#a9d3f0", "#e08fc0", "#d6c04a",
];

/// A style sheet that replaces every colour by its counterpart on a dark screen; printed pages stay light.
pub fn dark_style() -> String {
    let light = [PAPER, INK, QUIET, GRID, SHADE, BAND].into_iter();
    let rule = |(RGBColor(r, g, b), dark): (RGBColor, &str)| {
        let light = format!("\"#{r:02X}{g:02X}{b:02X}\"");
        format!("[fill={light}]{{fill:{dark}}}[stroke={light}]{{stroke:{dark}}}")
    };
    let rules: String = light.chain(COLORS).zip(DARK).map(rule).collect();
    format!("@media screen and (prefers-color-scheme:dark){{{rules}}}")
}

/// The colour of a pen.
pub fn rgb(color: Color) -> RGBColor {
    match color {
        Color::Ink => INK,
        Color::Quiet => QUIET,
        Color::Nth(n) => COLORS[n % COLORS.len()],
    }
}

/// Approximate width of a text, in one of the wider fonts.
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

/// The text, cut to this width.
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

/// Content of an SVG document under construction.
#[derive(Default)]
pub struct Canvas {
    marks: String,
    /// Whether marks show their values when the pointer is over them; only wide screens are assumed to have a pointer.
    pub is_hovered: bool,
}

fn px(shown: f64) -> i32 {
    (shown * FINE).round() as i32
}

fn place((x, y): Point) -> (i32, i32) {
    (px(x), px(y))
}

impl Canvas {
    /// All marks, at the displayed size.
    pub fn inside(&self) -> String {
        let shown = format!("scale({})", FINE.recip());
        html! { g transform=(shown) { (PreEscaped(&self.marks)) } }.into_string()
    }

    fn put<E>(&mut self, element: E)
    where
        for<'e> &'e E: PointCollection<'e, (i32, i32)>,
        E: for<'b> Drawable<SVGBackend<'b>>,
    {
        let mut document = String::new();
        let area = SVGBackend::with_string(&mut document, (MOST, MOST)).into_drawing_area();
        // Writing into a text does not fail.
        let _ = area.draw(&element);
        drop(area);
        let inside = document.split_once(">\n").map_or("", |(_, inside)| inside);
        let inside = inside.trim_end().trim_end_matches("</svg>");
        // Plotters repeats for each mark the attributes that the document states once.
        let inside = inside.replace(" opacity=\"1\"", "");
        self.marks += &inside.replace(" font-family=\"sans-serif\"", "");
    }

    /// Draws a mark with this hover text.
    pub fn titled(&mut self, text: &str, drawn: impl FnOnce(&mut Self)) {
        if !self.is_hovered {
            return drawn(self);
        }
        let mut inside = Self::default();
        drawn(&mut inside);
        self.marks += &html! { g { title { (text) } (PreEscaped(inside.marks)) } }.into_string();
    }

    /// Joins points.
    pub fn line(&mut self, points: &[Point], pen: Pen) {
        if !pen.is_dashed {
            return self.stroke(points, rgb(pen.color), pen.width);
        }
        let style = rgb(pen.color).stroke_width(px(pen.width) as u32);
        let points: Vec<_> = points.iter().copied().map(place).collect();
        self.put(DashedPathElement::new(points, px(6.0), px(4.0), style));
    }

    /// Joins the points by a solid line in this colour.
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

    /// Writes text so that the point is at the given position within the text; a `scale` of 1 is the usual size.
    pub fn text(
        &mut self,
        text: &str,
        at: Point,
        (across, height): (HPos, VPos),
        color: RGBColor,
        scale: f64,
    ) {
        let style = font(scale).color(&color).pos(Pos::new(across, height));
        self.put(Text::new(text.to_owned(), place(at), style));
    }

    /// Writes text that reads upwards and ends at the point.
    pub fn upward(&mut self, text: &str, at: Point, color: RGBColor, scale: f64) {
        let font = font(scale).transform(FontTransform::Rotate270);
        let style = font.color(&color).pos(Pos::new(HPos::Right, VPos::Center));
        self.put(Text::new(text.to_owned(), place(at), style));
    }
}

fn font(scale: f64) -> FontDesc<'static> {
    ("sans-serif", LETTER * FONT_RATIO * FINE * scale).into_font()
}

/// Layout of a panel: positions of its axes.
pub struct Frame<'p> {
    /// The panel.
    pub panel: &'p Panel,
    /// Horizontal scale.
    pub x: Scale,
    /// Vertical scale.
    pub y: Scale,
    /// Positions of the left and right ends of the axes.
    pub across: (f64, f64),
    /// Positions of the upper and lower ends of the axes.
    pub down: (f64, f64),
    /// Positions of the left and right ends of the panel.
    pub ends: (f64, f64),
    /// Position of the upper end of the panel.
    pub top: f64,
}

impl Frame<'_> {
    /// Position of a point.
    pub fn at(&self, (x, y): Point) -> Point {
        (self.at_x(x), self.at_y(y))
    }

    /// Position of an abscissa.
    pub fn at_x(&self, x: f64) -> f64 {
        self.across.0 + self.x.part(x) * (self.across.1 - self.across.0)
    }

    /// Position of a height.
    pub fn at_y(&self, y: f64) -> f64 {
        self.down.1 - self.y.part(y) * (self.down.1 - self.down.0)
    }
}
