//! Labelled sections of a recording.

use std::ops::Range;

use nalgebra::Vector3;

use crate::imu::AxisOrder;
use crate::units::DEGREE;

/// A labelled section of the recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Time stamp of the first row of the section, s.
    pub start: f64,
    /// The first time stamp after the last row of the section, s.
    pub end: f64,
    /// The samples of the section, at least one.
    pub samples: Range<usize>,
    /// `x_up` … `z_down`, `rot_x+360` and the like, or any other text.
    pub label: String,
    /// The motion stated by the label, if any.
    pub motion: Option<LabelledMotion>,
}

/// Motion of a section according to its label.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LabelledMotion {
    /// `z_down`: the instrument is at rest, and this direction, given in right-front-up axes, points up.
    Stands {
        /// Unit vector.
        up: Vector3<f64>,
    },
    /// `rot_x-360`: the instrument is at rest, turns about this direction, given in right-front-up axes, and is at rest
    /// again.
    Turns {
        /// Unit vector.
        axis: Vector3<f64>,
        /// Angle, right-handed, rad.
        angle: f64,
    },
}

impl LabelledMotion {
    /// The motion stated by a label, in axes of this order; `None` for any other text.
    pub fn of_label(label: &str, axes: AxisOrder) -> Option<Self> {
        let axis = |name: &str| {
            let index = ["x", "y", "z"].into_iter().position(|axis| axis == name)?;
            Some(axes.apply(&Vector3::ith(index, 1.0)))
        };
        if let Some(turn) = label.strip_prefix("rot_") {
            let (name, angle) = turn.split_at_checked(1)?;
            let angle: f64 = angle.parse().ok()?;
            let turns = angle.is_finite() && angle != 0.0;
            return turns.then_some(Self::Turns {
                axis: axis(name)?,
                angle: angle * DEGREE,
            });
        }
        let (name, way) = label.split_once('_')?;
        let up = match way {
            "up" => axis(name)?,
            "down" => -axis(name)?,
            _ => return None,
        };
        Some(Self::Stands { up })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_name_axes_of_the_file() {
        let frd = AxisOrder::FRONT_RIGHT_DOWN;
        let of = |label| LabelledMotion::of_label(label, frd);
        let up = |up| Some(LabelledMotion::Stands { up });
        assert_eq!(of("x_up"), up(Vector3::y()));
        assert_eq!(of("z_down"), up(Vector3::z()));
        let Some(LabelledMotion::Turns { axis, angle }) = of("rot_z-360") else {
            panic!("no turn");
        };
        assert_eq!(axis * angle, Vector3::z() * (360.0 * DEGREE));
        for other in [
            "still",
            "x_left",
            "w_up",
            "rot_",
            "rot_x",
            "rot_é+90",
            "rot_x+NaN",
            "_up",
        ] {
            assert_eq!(of(other), None, "{other}");
        }
    }
}
