//! What is drawn into a panel.

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
        /// Height at which they stand; `None` for the foot of the axis.
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

/// Abscissa and ordinate. A line is interrupted where one of them is not a number.
pub type Point = (f64, f64);

/// Points that a line keeps at most; a panel is a hundredth as wide in pixels.
const MOST: usize = 1 << 17;

/// A line thinned to the useful number of points: each group of consecutive points is replaced by its lowest and its
/// highest.
pub fn thinned(points: impl IntoIterator<Item = Point>) -> Vec<Point> {
    let mut line = Vec::new();
    // Of these, from this place of the line on, two will stay.
    let (mut together, mut begin, mut since) = (1, 0, 0);
    let mut most = MOST;
    for point in points {
        let is_gap = point.0.is_nan() || point.1.is_nan();
        line.push(point);
        since += 1;
        if together > 1 && (since == together || is_gap) {
            let end = line.len() - usize::from(is_gap);
            let ends = lowest_and_highest(&line[begin..end]);
            line.splice(begin..end, ends);
        }
        if since == together || is_gap {
            (begin, since) = (line.len(), 0);
        }
        if line.len() >= most && since == 0 {
            let pieces = line.chunk_by(|a, b| is_finite(a) == is_finite(b));
            let kept = pieces.flat_map(|piece| match is_finite(&piece[0]) {
                true => piece.chunks(4).flat_map(lowest_and_highest).collect(),
                false => piece[..1].to_vec(),
            });
            line = kept.collect();
            // Many gaps stay.
            most = MOST.max(2 * line.len());
            (begin, together) = (line.len(), (2 * together).max(4));
        }
    }
    line
}

fn is_finite(point: &Point) -> bool {
    !point.0.is_nan() && !point.1.is_nan()
}

/// Both in their order; one where there is no other.
fn lowest_and_highest(points: &[Point]) -> Vec<Point> {
    let by_height = |a: &(usize, &Point), b: &(usize, &Point)| a.1.1.total_cmp(&b.1.1);
    let lowest = points.iter().enumerate().min_by(by_height);
    let highest = points.iter().enumerate().max_by(by_height);
    let ends = lowest
        .zip(highest)
        .map(|(low, high)| match low.0.cmp(&high.0) {
            std::cmp::Ordering::Less => vec![*low.1, *high.1],
            std::cmp::Ordering::Equal => vec![*low.1],
            std::cmp::Ordering::Greater => vec![*high.1, *low.1],
        });
    ends.unwrap_or_default()
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
        let line = thinned((0..3_000_000).map(point));
        assert!(
            line.len() <= MOST && line.len() > MOST / 8,
            "{}",
            line.len()
        );
        assert!(line.is_sorted_by(|a, b| a.0 < b.0));
        for extreme in [700_001, 2_000_002] {
            assert!(line.contains(&point(extreme)), "{extreme}");
        }
        assert_eq!(line.iter().filter(|point| point.1.is_nan()).count(), 1);
        // The picture is the same all along: hardly a piece without its own swing.
        let swing =
            |piece: &[Point]| piece.iter().any(|p| p.1 > 0.9) && piece.iter().any(|p| p.1 < -0.9);
        assert!(line.chunks(64).all(swing));
    }

    #[test]
    fn a_short_line_stays_as_it_is() {
        let line: Vec<Point> = (0..1000)
            .map(|k| (f64::from(k), f64::from(k % 7)))
            .collect();
        assert_eq!(thinned(line.iter().copied()), line);
    }
}
