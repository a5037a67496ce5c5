//! Series in a panel.

/// A series of data, drawn with one pen.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Shape.
    pub shape: Shape,
    /// Pen.
    pub pen: Pen,
    /// The name is written at the right end of the panel.
    pub label: Option<String>,
    /// The name is written in the title line.
    pub key: Option<String>,
}

/// Abscissa and ordinate. A line is interrupted where a coordinate is not a number.
pub type Point = (f64, f64);

/// Abscissa, lower end and upper end.
pub type Upright = (f64, f64, f64);

/// Geometry of a series.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Points joined in order.
    Line(Vec<Point>),
    /// The area between two lines over the same abscissae.
    Band(Vec<Point>, Vec<Point>),
    /// A mark at each point, with a vertical error bar and caps if the ends of the bar differ.
    Marks(Mark, Vec<(Point, (f64, f64))>),
    /// Bars of this half width.
    Bars(f64, Vec<Upright>),
    /// A line across the panel at this height.
    Level(f64),
    /// Text next to a point.
    Words(Point, Anchor, String),
}

/// A mark at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A filled circle.
    Dot,
    /// An open circle.
    Ring,
    /// A cross.
    Cross,
}

/// Position of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The text is centred above its point.
    Above,
    /// The text is centred below its point.
    Below,
    /// The text is centred on its point.
    Middle,
}

/// Line style.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pen {
    /// Colour.
    pub color: Color,
    /// Width in pixels.
    pub width: f64,
    /// Whether the line is dashed.
    pub is_dashed: bool,
}

/// Colours that also differ in lightness.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Color {
    /// Colour of text.
    Ink,
    /// Colour of unobtrusive elements.
    Quiet,
    /// The n-th of six colours.
    Nth(usize),
}

impl Shape {
    /// Points that the axes must include.
    pub(crate) fn corners(&self) -> Vec<Point> {
        match self {
            Self::Line(points) => points.clone(),
            Self::Marks(_, points) => points
                .iter()
                .flat_map(|&((x, y), (low, high))| [(x, y), (x, low), (x, high)])
                .collect(),
            Self::Band(lower, upper) => [&lower[..], upper].concat(),
            Self::Bars(half, bars) => bars
                .iter()
                .flat_map(|&(x, low, high)| [(x - half, low), (x + half, high)])
                .collect(),
            Self::Level(_) | Self::Words(..) => Vec::new(),
        }
    }

    /// Right end.
    pub(crate) fn end(&self) -> Option<Point> {
        let is_known = |point: &Point| point.1.is_finite();
        match self {
            Self::Line(points) | Self::Band(_, points) => {
                points.iter().rev().copied().find(is_known)
            }
            Self::Marks(_, points) => points.iter().rev().map(|of| of.0).find(is_known),
            Self::Level(y) => Some((f64::INFINITY, *y)),
            _ => None,
        }
    }
}

impl Series {
    /// A series with this shape, drawn with a thin pen in the first colour.
    pub fn new(shape: Shape) -> Self {
        let pen = Pen {
            color: Color::Nth(0),
            width: 1.5,
            is_dashed: false,
        };
        Self {
            shape,
            pen,
            label: None,
            key: None,
        }
    }

    /// Points joined in order; if the data are dense, only the lowest and highest points of each interval are kept.
    pub fn line(points: impl IntoIterator<Item = Point>) -> Self {
        Self::new(Shape::Line(thinned(points, MOST)))
    }

    /// The area between two lines.
    pub fn band(lower: Vec<Point>, upper: Vec<Point>) -> Self {
        Self::new(Shape::Band(lower, upper)).color(Color::Quiet)
    }

    /// A line through values with their σ, and the band of ±σ behind it.
    pub fn curve(points: &[(f64, f64, f64)]) -> [Self; 2] {
        let edge = |factor: f64| points.iter().map(move |&(x, y, own)| (x, y + factor * own));
        let band = Self::band(edge(-1.0).collect(), edge(1.0).collect());
        [band, Self::line(edge(0.0))]
    }

    /// A mark at each point.
    pub fn marks(mark: Mark, points: impl IntoIterator<Item = Point>) -> Self {
        Self::whiskers(mark, points.into_iter().map(|at| (at, (at.1, at.1))))
    }

    /// Marks with an interval at each point.
    pub fn whiskers(mark: Mark, points: impl IntoIterator<Item = (Point, (f64, f64))>) -> Self {
        Self::new(Shape::Marks(mark, points.into_iter().collect()))
    }

    /// Points for values with σ, each with an interval of one standard deviation on either side.
    pub fn measured(mark: Mark, points: impl IntoIterator<Item = (f64, f64, f64)>) -> Self {
        let points = points.into_iter();
        Self::whiskers(mark, points.map(|(x, y, own)| ((x, y), (y - own, y + own))))
    }

    /// Bars of this half width.
    pub fn bars(half: f64, bars: impl IntoIterator<Item = Upright>) -> Self {
        Self::new(Shape::Bars(half, bars.into_iter().collect()))
    }

    /// A line across the panel.
    pub fn level(y: f64) -> Self {
        Self::new(Shape::Level(y)).color(Color::Ink).width(1.25)
    }

    /// The faint line at zero.
    pub fn zero() -> Self {
        Self::level(0.0).color(Color::Quiet).width(0.75)
    }

    /// Text next to a point.
    pub fn words(at: Point, anchor: Anchor, text: impl Into<String>) -> Self {
        Self::new(Shape::Words(at, anchor, text.into())).color(Color::Ink)
    }

    /// The colour.
    pub fn color(mut self, color: Color) -> Self {
        self.pen.color = color;
        self
    }

    /// The n-th colour.
    pub fn nth(self, n: usize) -> Self {
        self.color(Color::Nth(n))
    }

    /// Width of the pen.
    pub fn width(mut self, width: f64) -> Self {
        self.pen.width = width;
        self
    }

    /// Dashes the line.
    pub fn dashed(mut self) -> Self {
        self.pen.is_dashed = true;
        self
    }

    /// Writes the name of the series at the right end of the line.
    pub fn label(mut self, text: impl Into<String>) -> Self {
        self.label = Some(text.into());
        self
    }

    /// Names the series in the title line.
    pub fn key(mut self, text: impl Into<String>) -> Self {
        self.key = Some(text.into());
        self
    }
}

/// Maximum number of points of a line; no panel is wider in pixels.
const MOST: usize = 1200;

/// Reduces a line to about this many points: the lowest and highest points of each interval, every gap, and the end,
/// where the name of the line is written.
pub fn thinned(points: impl IntoIterator<Item = Point>, most: usize) -> Vec<Point> {
    let points = points.into_iter();
    let (least, greatest) = points.size_hint();
    let together = (2 * greatest.unwrap_or(least)).div_ceil(most);
    let (mut line, mut stretch) = (Vec::new(), Vec::new());
    for point in points {
        let is_gap = !(point.0.is_finite() && point.1.is_finite());
        if is_gap || stretch.len() >= together {
            line.extend(ends(&stretch));
            stretch.clear();
        }
        if is_gap {
            line.push(point);
        } else {
            stretch.push(point);
        }
    }
    line.extend(ends(&stretch));
    let last = stretch.last().filter(|last| line.last() != Some(last));
    line.extend(last.copied());
    line
}

/// All points if few; otherwise the lowest and the highest, in order.
fn ends(stretch: &[Point]) -> Vec<Point> {
    if stretch.len() <= 2 {
        return stretch.to_vec();
    }
    let by_height = |a: &&Point, b: &&Point| a.1.total_cmp(&b.1);
    let ends = [
        stretch.iter().min_by(by_height),
        stretch.iter().max_by(by_height),
    ];
    let mut ends: Vec<Point> = ends.into_iter().flatten().copied().collect();
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    ends.dedup();
    ends
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_line_keeps_its_extremes_its_gaps_and_its_order_in_few_points() {
        let point = |k: usize| {
            let height = match k {
                700_001 => 50.0,
                2_000_002 => -70.0,
                _ => (k as f64).sin(),
            };
            (k as f64, if k == 1_000_000 { f64::NAN } else { height })
        };
        let line = thinned((0..3_000_000).map(point), MOST);
        assert!(
            line.len() < MOST + 10 && line.len() > MOST / 2,
            "{}",
            line.len()
        );
        assert!(line.is_sorted_by(|a, b| a.0 < b.0));
        for extreme in [700_001, 2_000_002] {
            assert!(line.contains(&point(extreme)), "{extreme}");
        }
        assert_eq!(line.iter().filter(|point| point.1.is_nan()).count(), 1);
        // The picture is uniform: nearly every piece has its own oscillation.
        let swing =
            |piece: &[Point]| piece.iter().any(|p| p.1 > 0.9) && piece.iter().any(|p| p.1 < -0.9);
        assert!(line.chunks(64).all(swing));
    }

    #[test]
    fn a_short_line_stays_as_it_is() {
        let line: Vec<Point> = (0..1000)
            .map(|k| (f64::from(k), f64::from(k % 7)))
            .collect();
        assert_eq!(thinned(line.iter().copied(), MOST), line);
    }
}
