//! The axes of a file's body frame, brought to right-front-up.
//!
//! A reversed axis turns the sign of input and output alike: `N = K u + D` becomes
//! `−N = K (−u) − D`. So samples and bias means change sign, nominal scales and σ do not.

use nalgebra::Vector3;

use crate::imu::AxisOrder;

/// What x, y, z of a file are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum BodyAxes {
    /// Right, front, up.
    #[default]
    Rfu,
    /// Front, right, down.
    Frd,
    /// Front, left, up.
    Flu,
}

impl BodyAxes {
    /// The words for them in `run.toml`.
    pub const WORDS: [(&'static str, Self); 3] =
        [("rfu", Self::Rfu), ("frd", Self::Frd), ("flu", Self::Flu)];

    /// For right, front and up: the file's axis and its sign.
    fn sources(self) -> [(usize, f64); 3] {
        match self {
            Self::Rfu => [(0, 1.0), (1, 1.0), (2, 1.0)],
            Self::Frd => [(1, 1.0), (0, 1.0), (2, -1.0)],
            Self::Flu => [(1, -1.0), (0, 1.0), (2, 1.0)],
        }
    }

    /// From the file's axes to right-front-up.
    pub fn order(self) -> AxisOrder {
        let sources = self.sources();
        AxisOrder {
            source: sources.map(|(axis, _)| axis),
            reversed: sources.map(|(_, sign)| sign < 0.0),
        }
    }

    /// Right, front or up, whichever an axis of the file lies along.
    pub fn body_axis(self, of_file: usize) -> usize {
        let along = |(axis, _)| axis == of_file;
        self.sources()
            .into_iter()
            .position(along)
            .unwrap_or(of_file)
    }

    /// A vector along the file's axes, along right-front-up.
    pub fn vector(self, v: Vector3<f64>) -> Vector3<f64> {
        Vector3::from(self.sources().map(|(axis, sign)| sign * v[axis]))
    }

    /// One value of each axis, such as a σ, in the order right, front, up.
    pub fn each(self, v: Vector3<f64>) -> Vector3<f64> {
        Vector3::from(self.sources().map(|(axis, _)| v[axis]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_is_right_handed_and_names_its_axes() {
        for (word, axes) in BodyAxes::WORDS {
            let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()].map(|v| axes.vector(v));
            assert_eq!(x.cross(&y), z, "{word}");
            for (letter, axis) in word.chars().zip([x, y, z]) {
                let expected = match letter {
                    'r' => Vector3::x(),
                    'f' => Vector3::y(),
                    'u' => Vector3::z(),
                    'l' => -Vector3::x(),
                    _ => -Vector3::z(),
                };
                assert_eq!(axis, expected, "{word}: {letter}");
            }
        }
    }
}
