//! Labelled sections of a recording.

use std::ops::Range;

use nalgebra::Vector3;

/// A labelled section of the recording.
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
    /// The motion that the label states, if any.
    pub motion: Option<LabelledMotion>,
}

/// Motion of a section according to its label.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LabelledMotion {
    /// `z_down`: the instrument is at rest, and this direction along right-front-up points up.
    Stands {
        /// Unit vector.
        up: Vector3<f64>,
    },
    /// `rot_x-360`: the instrument is at rest, turns about this direction along right-front-up, and is at rest again.
    Turns {
        /// Unit vector.
        axis: Vector3<f64>,
        /// Angle, right-handed, rad.
        angle: f64,
    },
}
