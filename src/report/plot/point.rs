//! A point of a line.

/// Abscissa and ordinate. A line is interrupted where one of them is not a number.
pub type Point = (f64, f64);
