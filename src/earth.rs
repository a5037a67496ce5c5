//! The Earth as seen by a laboratory that stands still on it.
//!
//! WGS-84 (NIMA TR8350.2, 3rd ed., tables 3.1 and 3.4): ellipsoid, rotation rate and normal gravity
//! (Somigliana's closed form, continued in height by TR8350.2 Eq. 4-3).

use nalgebra::Vector3;

/// Semi-major axis in m.
pub const SEMI_MAJOR_AXIS: f64 = 6_378_137.0;
/// Flattening.
pub const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// First eccentricity squared.
pub const ECCENTRICITY_SQUARED: f64 = FLATTENING * (2.0 - FLATTENING);
/// Rotation rate in rad/s.
pub const ROTATION_RATE: f64 = 7.292_115e-5;

const GRAVITY_EQUATOR: f64 = 9.780_325_335_9;
const SOMIGLIANA: f64 = 1.931_852_652_41e-3;
/// `ω² a² b / GM`.
const CENTRIFUGAL_RATIO: f64 = 3.449_786_506_84e-3;

/// Normal gravity in m/s² at a geodetic latitude in radians and a height in m above the ellipsoid.
pub fn normal_gravity(latitude: f64, height: f64) -> f64 {
    let s2 = latitude.sin().powi(2);
    let surface =
        GRAVITY_EQUATOR * (1.0 + SOMIGLIANA * s2) / (1.0 - ECCENTRICITY_SQUARED * s2).sqrt();
    let h = height / SEMI_MAJOR_AXIS;
    surface
        * (1.0 - 2.0 * h * (1.0 + FLATTENING + CENTRIFUGAL_RATIO - 2.0 * FLATTENING * s2)
            + 3.0 * h * h)
}

/// A place on the Earth where a turntable stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Geodetic latitude in radians, north positive.
    pub latitude: f64,
    /// Longitude in radians, east positive. Nothing that stands still depends on it.
    pub longitude: f64,
    /// Height above the ellipsoid in m.
    pub height: f64,
    /// Magnitude of gravity in m/s², plumb-line gravity with its centrifugal part.
    pub gravity: f64,
}

impl Site {
    /// A site with normal gravity.
    pub fn with_normal_gravity(latitude: f64, longitude: f64, height: f64) -> Self {
        Self {
            latitude,
            longitude,
            height,
            gravity: normal_gravity(latitude, height),
        }
    }

    /// Gravity in East-North-Up, m/s². It points down, so a body at rest senses minus this.
    pub fn gravity_n(&self) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, -self.gravity)
    }

    /// Earth rotation `ω_ie` in East-North-Up, rad/s.
    pub fn earth_rate_n(&self) -> Vector3<f64> {
        let (s, c) = self.latitude.sin_cos();
        Vector3::new(0.0, ROTATION_RATE * c, ROTATION_RATE * s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::DEGREE;
    use approx::assert_abs_diff_eq;

    #[test]
    fn normal_gravity_meets_the_defined_values_at_equator_and_pole() {
        // NIMA TR8350.2, table 3.4: 9.7803253359 and 9.8321849378 m/s².
        assert_abs_diff_eq!(normal_gravity(0.0, 0.0), 9.780_325_335_9, epsilon = 1e-10);
        assert_abs_diff_eq!(
            normal_gravity(90.0 * DEGREE, 0.0),
            9.832_184_937_8,
            epsilon = 1e-10
        );
    }

    #[test]
    fn gravity_falls_by_the_free_air_gradient() {
        // 0.3086 mGal/m, Torge, Geodesy, 4th ed., §4.2.1.
        let fall = normal_gravity(45.0 * DEGREE, 0.0) - normal_gravity(45.0 * DEGREE, 100.0);
        assert_abs_diff_eq!(fall, 30.86e-5, epsilon = 0.02e-5);
    }
}
