//! Units for input and output: the value of each named unit in SI units or radians.
//!
//! Inside the crate, all values are in SI units and radians. Input is converted by `x * UNIT` and output by `x / UNIT`;
//! there are no other conversions.

use std::f64::consts::PI;

/// One degree in radians.
pub const DEGREE: f64 = PI / 180.0;
/// One second of arc in radians.
pub const ARCSEC: f64 = DEGREE / 3600.0;
/// One degree per hour in rad/s.
pub const DEG_PER_H: f64 = DEGREE / 3600.0;
/// One degree per root hour (angle random walk) in rad/√s.
pub const DEG_PER_SQRT_H: f64 = DEGREE / 60.0;
/// One part per million.
pub const PPM: f64 = 1e-6;
/// Standard gravity in m/s², the unit `g` of data sheets (exact by definition).
pub const STANDARD_GRAVITY: f64 = 9.80665;
/// One micro-g in m/s².
pub const MICRO_G: f64 = 1e-6 * STANDARD_GRAVITY;
/// One milli-g in m/s².
pub const MILLI_G: f64 = 1e-3 * STANDARD_GRAVITY;
/// One milligal, the unit of gravimetry, in m/s².
pub const MILLIGAL: f64 = 1e-5;
/// One micro-g per root hertz (velocity random walk) in (m/s)/√s.
pub const MICRO_G_PER_SQRT_HZ: f64 = MICRO_G;
/// One hour in seconds.
pub const HOUR: f64 = 3600.0;
/// One minute in seconds.
pub const MINUTE: f64 = 60.0;
/// One millisecond in seconds.
pub const MILLISECOND: f64 = 1e-3;
/// One international nautical mile in metres (exact by definition).
pub const NAUTICAL_MILE: f64 = 1852.0;

/// A time rounded to 1 ns, so that few digits are printed.
pub fn nanoseconds(time: f64) -> f64 {
    (time * 1e9).round() / 1e9
}
