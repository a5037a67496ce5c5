//! A plot as a value: panels with axes and series, or a matrix. It knows nothing of where it is drawn.

mod axis;

use std::ops::Range;

pub use axis::{Axis, Kind, Scale};

/// Abscissa and ordinate. A line is interrupted where one of them is not a number.
pub type Point = (f64, f64);

/// A figure with its file, heading and caption.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// Name of its file, such as `sigma.svg`.
    pub file: String,
    /// Its heading.
    pub heading: String,
    /// How to read it, a sentence or two.
    pub caption: String,
    /// What is drawn.
    pub body: Body,
}

/// What is drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Body {
    /// Panels row by row.
    Panels(Grid),
    /// A correlation matrix.
    Matrix(Matrix),
}

/// Panels of one size in rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Panels in a row.
    pub columns: usize,
    /// Height of a panel in pixels; the width of the figure is fixed.
    pub height: u32,
    /// The panels; a row may be closed by [`Panel::blank`].
    pub panels: Vec<Panel>,
}

/// Coefficients between −1 and 1, symmetric.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    /// A name for each row and column.
    pub names: Vec<String>,
    /// Rows before which a new group begins.
    pub groups: Vec<usize>,
    /// Row by row.
    pub values: Vec<Vec<f64>>,
    /// Coefficients of at least this magnitude are written out.
    pub written: f64,
}

/// Axes with a title, and what is drawn into them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// What is on the vertical axis, with its unit.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// From the back to the front.
    pub series: Vec<Series>,
    /// Stretches of the horizontal axis that are shaded.
    pub shading: Vec<Range<f64>>,
    /// Short texts above the curves where there is room for them.
    pub tags: Vec<(f64, String)>,
    /// In so many lines.
    pub tag_lines: usize,
    /// Lines of text in an upper corner.
    pub notes: Vec<String>,
    /// Whether they stand in the left corner instead of the right one.
    pub notes_left: bool,
    /// Whether both axes have the same length.
    pub square: bool,
    /// Whether only the title is drawn.
    pub blank: bool,
}

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
    /// Its upper right corner.
    BelowLeft,
    /// Its lower left corner.
    AboveRight,
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

impl Plot {
    /// Panels in rows of `columns`, each `height` pixels high.
    pub fn new(
        file: &str,
        heading: &str,
        (columns, height): (usize, u32),
        panels: impl IntoIterator<Item = Panel>,
    ) -> Self {
        let grid = Grid {
            columns: columns.max(1),
            height,
            panels: panels.into_iter().collect(),
        };
        Self::of(file, heading, Body::Panels(grid))
    }

    /// A matrix.
    pub fn matrix(file: &str, heading: &str, matrix: Matrix) -> Self {
        Self::of(file, heading, Body::Matrix(matrix))
    }

    fn of(file: &str, heading: &str, body: Body) -> Self {
        Self {
            file: file.to_owned(),
            heading: heading.to_owned(),
            caption: String::new(),
            body,
        }
    }

    /// How to read it.
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = caption.into();
        self
    }
}

impl Panel {
    /// Empty axes.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self {
            title: title.into(),
            x,
            y,
            ..Self::default()
        }
    }

    /// A title alone, in the place of a panel that has nothing to show.
    pub fn blank(title: impl Into<String>) -> Self {
        Self {
            blank: true,
            ..Self::new(title, Axis::default(), Axis::default())
        }
    }

    /// Draws one more series in front of the others.
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// The same for several.
    pub fn with_all(mut self, series: impl IntoIterator<Item = Series>) -> Self {
        self.series.extend(series);
        self
    }

    /// Shades stretches of the horizontal axis.
    pub fn shaded(mut self, stretches: &[Range<f64>]) -> Self {
        self.shading = stretches.to_vec();
        self
    }

    /// Short texts above the curves in up to so many lines.
    pub fn tagged(mut self, lines: usize, tags: impl IntoIterator<Item = (f64, String)>) -> Self {
        self.tag_lines = lines;
        self.tags = tags.into_iter().collect();
        self
    }

    /// Lines of text in the upper right corner.
    pub fn noted(mut self, notes: impl IntoIterator<Item = String>) -> Self {
        self.notes = notes.into_iter().collect();
        self
    }

    /// Ordinates of all that the vertical axis has to hold.
    pub(super) fn heights(&self) -> impl Iterator<Item = f64> {
        self.series
            .iter()
            .flat_map(|series| series.shape.extent().1)
    }

    /// The same for the horizontal axis.
    pub(super) fn widths(&self) -> impl Iterator<Item = f64> {
        self.series
            .iter()
            .flat_map(|series| series.shape.extent().0)
    }
}

impl Shape {
    /// Abscissae and ordinates that the axes have to hold.
    fn extent(&self) -> (Vec<f64>, Vec<f64>) {
        match self {
            Self::Line(points) | Self::Marks(_, points) => points.iter().copied().unzip(),
            Self::Band(lower, upper) => lower.iter().chain(upper).copied().unzip(),
            Self::Intervals(of) => of
                .iter()
                .flat_map(|&(x, low, high)| [(x, low), (x, high)])
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

    /// Points joined in order.
    pub fn line(points: impl IntoIterator<Item = Point>) -> Self {
        Self::new(Shape::Line(points.into_iter().collect()))
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
