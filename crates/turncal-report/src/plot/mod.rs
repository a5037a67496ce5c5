//! The description of a plot: panels with axes and series, independent of the renderer.

mod axis;
mod series;

use std::ops::Range;

pub use axis::{Axis, Kind, Scale, positive_range};
pub(crate) use series::thinned;
pub use series::{Anchor, Color, Mark, Pen, Point, Series, Shape, Upright};

/// A figure with its file, heading and caption.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// Name of the figure's file, such as `sigma.svg`.
    pub file: String,
    /// Heading.
    pub heading: String,
    /// Caption that says how to read the figure, in one or two sentences.
    pub caption: String,
    /// Panels in a row.
    pub columns: usize,
    /// Height of a panel in pixels; the width of the figure is fixed.
    pub height: u32,
    /// The panels, row by row.
    pub panels: Vec<Panel>,
}

/// Axes with a title and series.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// Quantity on the vertical axis, with unit.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Series in drawing order, from back to front.
    pub series: Vec<Series>,
    /// Shaded intervals of the horizontal axis.
    pub shading: Vec<Range<f64>>,
    /// Short texts above the curves, where space permits.
    pub tags: Vec<(f64, String)>,
    /// Lines of text in the upper right corner.
    pub notes: Vec<String>,
    /// Whether both axes have the same length.
    pub square: bool,
}

impl Plot {
    /// Panels in rows of `columns`, each `height` pixels high.
    pub fn new(
        file: &str,
        heading: &str,
        (columns, height): (usize, u32),
        panels: impl IntoIterator<Item = Panel>,
    ) -> Self {
        Self {
            file: file.to_owned(),
            heading: heading.to_owned(),
            caption: String::new(),
            columns: columns.max(1),
            height,
            panels: panels.into_iter().collect(),
        }
    }

    /// Sets the caption, which says how to read the figure.
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

    /// Adds a series in front of the others.
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Adds several series.
    pub fn with_all(mut self, series: impl IntoIterator<Item = Series>) -> Self {
        self.series.extend(series);
        self
    }

    /// Shades intervals of the horizontal axis.
    pub fn shaded(mut self, stretches: &[Range<f64>]) -> Self {
        self.shading = stretches.to_vec();
        self
    }

    /// Adds short texts above the curves.
    pub fn tagged(mut self, tags: impl IntoIterator<Item = (f64, String)>) -> Self {
        self.tags = tags.into_iter().collect();
        self
    }

    /// Lines of text in the upper right corner.
    pub fn noted(mut self, notes: impl IntoIterator<Item = String>) -> Self {
        self.notes = notes.into_iter().collect();
        self
    }

    /// The scales of both axes.
    pub fn scales(&self) -> (Scale, Scale) {
        let corners = self.series.iter().flat_map(|of| of.shape.corners());
        let (across, up): (Vec<f64>, Vec<f64>) = corners.unzip();
        (self.x.scale(across), self.y.scale(up))
    }
}

/// Offset of the n-th of several items from the centre of their common position; together, the items use this fraction
/// of the width of the position.
pub fn beside(n: usize, count: usize, part: f64) -> f64 {
    part * ((n as f64 + 0.5) / count.max(1) as f64 - 0.5)
}

/// Equally spaced numbers, including both ends.
pub fn steps(low: f64, high: f64, count: usize) -> impl Iterator<Item = f64> + Clone {
    let last = count.saturating_sub(1).max(1) as f64;
    (0..count).map(move |k| low + (high - low) * k as f64 / last)
}
