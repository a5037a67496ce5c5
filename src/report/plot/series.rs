//! What is drawn into a panel.

use super::thinned::thinned;

pub use super::point::Point;

/// Something drawn with one pen.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// What.
    pub shape: Shape,
    /// How.
    pub pen: Pen,
    /// Name at the right end of the panel, with the point that it belongs to.
    pub label: Option<(Point, String)>,
    /// Name in the line of the title.
    pub key: Option<String>,
}

/// Geometry of a series.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Points joined in order.
    Line(Vec<Point>),
    /// The area between two lines over the same abscissae.
    Band(Vec<Point>, Vec<Point>),
    /// A mark at each point.
    Marks(Mark, Vec<Point>),
    /// Upright lines with caps: abscissa, lower and upper end.
    Intervals(Vec<(f64, f64, f64)>),
    /// Bars from a base, of this half width; filled or open.
    Bars {
        /// Middle and height of each.
        tops: Vec<Point>,
        /// Half the width of a bar.
        half: f64,
        /// Height at which they stand; none: the foot of the axis.
        base: Option<f64>,
        /// Whether they are shaded.
        filled: bool,
    },
    /// Filled rectangles of this half width: middle, lower and upper end of each.
    Blocks(f64, Vec<(f64, f64, f64)>),
    /// A line across the panel at this height.
    Level(f64),
    /// A line from bottom to top.
    Upright(f64),
    /// Words beside a point, moved by some pixels to the right and down.
    Words {
        /// The point.
        at: Point,
        /// Right and down.
        shift: (f64, f64),
        /// Which part of the words stands there.
        anchor: Anchor,
        /// The words.
        text: String,
    },
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

/// Which part of a text stands at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The middle of its foot: the text is above.
    Above,
    /// The middle of its head: the text is below.
    Below,
    /// Its lower right corner: the text is above, to the left.
    AboveLeft,
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pen {
    /// Colour.
    pub color: Color,
    /// Width in pixels.
    pub width: f64,
    /// Dashes.
    pub dash: Dash,
}

/// Colours are told apart by lightness, too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Color {
    /// Of text.
    Ink,
    /// Of what must not distract.
    Quiet,
    /// The n-th of six.
    Nth(usize),
}

/// Dashes of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dash {
    /// None.
    Solid,
    /// Long ones.
    Dashed,
    /// Short ones.
    Dotted,
}

impl Shape {
    /// Abscissae and ordinates that the axes have to hold.
    pub(super) fn extent(&self) -> (Vec<f64>, Vec<f64>) {
        match self {
            Self::Line(points) | Self::Marks(_, points) => points.iter().copied().unzip(),
            Self::Band(lower, upper) => lower.iter().chain(upper).copied().unzip(),
            Self::Intervals(of) => of
                .iter()
                .flat_map(|&(x, low, high)| [(x, low), (x, high)])
                .unzip(),
            Self::Blocks(half, of) => of
                .iter()
                .flat_map(|&(x, low, high)| [(x - half, low), (x + half, high)])
                .unzip(),
            Self::Bars {
                tops, half, base, ..
            } => tops
                .iter()
                .flat_map(|&(x, top)| [(x - half, top), (x + half, base.unwrap_or(top))])
                .unzip(),
            Self::Level(_) | Self::Upright(_) | Self::Words { .. } => Default::default(),
        }
    }

    /// Its right end.
    fn end(&self) -> Option<Point> {
        match self {
            Self::Line(points) | Self::Marks(_, points) | Self::Band(_, points) => points
                .iter()
                .rev()
                .copied()
                .find(|point| point.1.is_finite()),
            Self::Level(y) => Some((f64::INFINITY, *y)),
            _ => None,
        }
    }
}

impl Series {
    /// A shape with a thin pen of the first colour.
    pub fn new(shape: Shape) -> Self {
        let pen = Pen {
            color: Color::Nth(0),
            width: 1.5,
            dash: Dash::Solid,
        };
        Self {
            shape,
            pen,
            label: None,
            key: None,
        }
    }

    /// Points joined in order; of very many the lowest and highest.
    pub fn line(points: impl IntoIterator<Item = Point>) -> Self {
        Self::new(Shape::Line(thinned(points)))
    }

    /// The area between two lines.
    pub fn band(lower: Vec<Point>, upper: Vec<Point>) -> Self {
        Self::new(Shape::Band(lower, upper)).color(Color::Quiet)
    }

    /// A mark at each point.
    pub fn marks(mark: Mark, points: impl IntoIterator<Item = Point>) -> Self {
        Self::new(Shape::Marks(mark, points.into_iter().collect()))
    }

    /// A line across the panel.
    pub fn level(y: f64) -> Self {
        Self::new(Shape::Level(y)).color(Color::Ink).width(1.25)
    }

    /// The faint line at zero.
    pub fn zero() -> Self {
        Self::level(0.0).color(Color::Quiet).width(0.75)
    }

    /// Words beside a point.
    pub fn words(at: Point, shift: (f64, f64), anchor: Anchor, text: impl Into<String>) -> Self {
        let text = text.into();
        let shape = Shape::Words {
            at,
            shift,
            anchor,
            text,
        };
        Self::new(shape).color(Color::Ink)
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

    /// The pen of the n-th body axis: told apart by dashes, too.
    pub fn axis(self, n: usize) -> Self {
        let dash = [Dash::Solid, Dash::Dashed, Dash::Dotted][n % 3];
        self.nth(n).dash(dash)
    }

    /// Width of the pen.
    pub fn width(mut self, width: f64) -> Self {
        self.pen.width = width;
        self
    }

    /// Dashes.
    pub fn dash(mut self, dash: Dash) -> Self {
        self.pen.dash = dash;
        self
    }

    /// Long dashes.
    pub fn dashed(self) -> Self {
        self.dash(Dash::Dashed)
    }

    /// Names its right end.
    pub fn label(mut self, text: impl Into<String>) -> Self {
        self.label = self.shape.end().map(|end| (end, text.into()));
        self
    }

    /// Names a height alone.
    pub fn name(y: f64, text: impl Into<String>) -> Self {
        let mut series = Self::line([]).color(Color::Quiet);
        series.label = y.is_finite().then(|| ((f64::INFINITY, y), text.into()));
        series
    }

    /// Names it in the line of the title.
    pub fn key(mut self, text: impl Into<String>) -> Self {
        self.key = Some(text.into());
        self
    }
}
