//! Labelled sections of a record.

use std::ops::Range;

use nalgebra::Vector3;

/// A labelled section of the record.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Stamp of its first row, s.
    pub start: f64,
    /// The first stamp after its last row, s.
    pub end: f64,
    /// Its samples, at least one.
    pub samples: Range<usize>,
    /// `x_up` … `z_down`, `rot_x+360` and the like, or any other text.
    pub label: String,
    /// What the label says of the motion, if anything.
    pub motion: Option<LabelledMotion>,
}

/// What a label says of a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LabelledMotion {
    /// `z_down`: it stands, and this direction along right-front-up is up.
    Stands {
        /// Unit vector.
        up: Vector3<f64>,
    },
    /// `rot_x-360`: it stands, turns about this direction along right-front-up, and stands again.
    Turns {
        /// Unit vector.
        axis: Vector3<f64>,
        /// rad, right-handed.
        angle: f64,
    },
}
