//! A panel laid out.

use super::super::plot::{Panel, Point, Scale};

/// A panel laid out: where its axes are.
pub(super) struct Frame<'p> {
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
