//! Gravity and rotation of the Earth at the site of an instrument.
//!
//! WGS-84 (NIMA TR8350.2, 3rd ed., tables 3.1 and 3.4): ellipsoid, rotation rate and normal gravity
//! (Somigliana's closed form, continued in height by TR8350.2 Eq. 4-3).

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_4;

pub use turncal_input::{GRAVITIES, HEIGHTS};

use crate::units::MILLIGAL;

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

/// Derivatives of [`normal_gravity`] with respect to latitude, m/s² per rad, and height, m/s² per m.
pub fn normal_gravity_gradient(latitude: f64, height: f64) -> (f64, f64) {
    let (s, c) = latitude.sin_cos();
    let s2 = s * s;
    let surface = normal_gravity(latitude, 0.0);
    let h = height / SEMI_MAJOR_AXIS;
    let fall = 2.0 * (1.0 + FLATTENING + CENTRIFUGAL_RATIO - 2.0 * FLATTENING * s2);
    let of_surface = surface
        * (SOMIGLIANA / (1.0 + SOMIGLIANA * s2)
            + 0.5 * ECCENTRICITY_SQUARED / (1.0 - ECCENTRICITY_SQUARED * s2));
    let by_s2 = of_surface * (1.0 - h * fall + 3.0 * h * h) + surface * 4.0 * FLATTENING * h;
    (
        by_s2 * 2.0 * s * c,
        surface * (6.0 * h - fall) / SEMI_MAJOR_AXIS,
    )
}

/// Earth rotation `ω_ie` in East-North-Up, rad/s.
#[inline]
pub fn earth_rate_n(latitude: f64) -> Vector3<f64> {
    let (s, c) = latitude.sin_cos();
    Vector3::new(0.0, ROTATION_RATE * c, ROTATION_RATE * s)
}

/// Radii of curvature of the ellipsoid in m. (Eq. 13 of the paper calls the radii polar and equatorial, but it means
/// the radii of the meridian and of the prime vertical.)
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curvature {
    /// Radius of curvature of the meridian, `R_M`, for motion north and south.
    pub meridian: f64,
    /// Radius of curvature of the prime vertical, `R_N`, for motion east and west.
    pub prime_vertical: f64,
}

impl Curvature {
    /// The radii at a geodetic latitude in radians (Groves, *Principles of GNSS, Inertial, and
    /// Multisensor Integrated Navigation Systems*, 2nd ed., Eqs. 2.105 and 2.106).
    #[inline]
    pub fn at(latitude: f64) -> Self {
        let w2 = 1.0 - ECCENTRICITY_SQUARED * latitude.sin().powi(2);
        let prime_vertical = SEMI_MAJOR_AXIS / w2.sqrt();
        Self {
            meridian: prime_vertical * (1.0 - ECCENTRICITY_SQUARED) / w2,
            prime_vertical,
        }
    }

    /// Derivatives of the radii with respect to latitude, m per rad.
    pub fn slope(latitude: f64) -> Self {
        let (s, c) = latitude.sin_cos();
        let at = Self::at(latitude);
        let relative = ECCENTRICITY_SQUARED * s * c / (1.0 - ECCENTRICITY_SQUARED * s * s);
        Self {
            meridian: 3.0 * at.meridian * relative,
            prime_vertical: at.prime_vertical * relative,
        }
    }
}

/// Site of a turntable.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Site {
    /// Geodetic latitude in radians, north positive.
    pub latitude: f64,
    /// Longitude in radians, east positive. The longitude has no effect at rest.
    pub longitude: f64,
    /// Height above the ellipsoid in m.
    pub height: f64,
    /// Magnitude of gravity in m/s², including the centrifugal part.
    pub gravity: f64,
    /// 1σ in m/s². 1σ of gravity, m/s². The scale factors of all three accelerometers share the error of gravity.
    pub gravity_sigma: f64,
    /// Whether the site is known. If the site is not known, Earth rotation is zero with the σ given by
    /// [`Site::earth_rate_sigma`].
    #[serde(default = "known")]
    pub is_known: bool,
}

fn known() -> bool {
    true
}

/// 1σ of the deviation of gravity from normal gravity, m/s²: 30 mGal. Free-air anomalies have an
/// RMS of 30 to 40 mGal over the Earth (Torge, *Gravimetry*, §2.1).
pub const ANOMALY_SIGMA: f64 = 30.0 * MILLIGAL;

/// 1σ of an unknown height, m.
const USUAL_HEIGHT: f64 = 500.0;
/// Decrease of gravity with height, (m/s²)/m.
const FREE_AIR: f64 = 0.3086 * MILLIGAL;

/// Mean gravity at the surface and its 1σ from place to place, m/s²: normal gravity is 9.780 at the equator and 9.832
/// at the poles.
const ANYWHERE: (f64, f64) = (9.806, 0.015);

impl Site {
    /// An unknown site on the Earth. Where a latitude is needed, the latitude at which gravity has its mean value is
    /// used.
    pub fn unknown() -> Self {
        let (gravity, gravity_sigma) = ANYWHERE;
        Self {
            latitude: FRAC_PI_4,
            longitude: 0.0,
            height: 0.0,
            gravity,
            gravity_sigma,
            is_known: false,
        }
    }

    /// A site with normal gravity, whose σ is the usual gravity anomaly.
    pub fn with_normal_gravity(latitude: f64, longitude: f64, height: f64) -> Self {
        Self {
            latitude,
            longitude,
            height,
            gravity: normal_gravity(latitude, height),
            gravity_sigma: ANOMALY_SIGMA,
            is_known: true,
        }
    }

    /// A site whose latitude or height, or both, may be unknown; gravity then has a larger σ.
    pub fn of_knowledge(latitude: Option<f64>, longitude: f64, height: Option<f64>) -> Self {
        let mut site = match latitude {
            Some(latitude) => Self::with_normal_gravity(latitude, longitude, height.unwrap_or(0.0)),
            None => Self::unknown(),
        };
        if height.is_none() {
            site.gravity_sigma = site.gravity_sigma.hypot(FREE_AIR * USUAL_HEIGHT);
        }
        site
    }

    /// A copy of the site with a measured gravity and its 1σ, m/s².
    pub fn with_gravity(self, gravity: f64, sigma: f64) -> Self {
        Self {
            gravity,
            gravity_sigma: sigma,
            ..self
        }
    }

    /// Gravity in East-North-Up, m/s². Gravity points down, and a body at rest senses its negative.
    pub fn gravity_n(&self) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, -self.gravity)
    }

    /// Earth rotation `ω_ie` in East-North-Up, rad/s; zero if the site is unknown.
    pub fn earth_rate_n(&self) -> Vector3<f64> {
        if self.is_known {
            earth_rate_n(self.latitude)
        } else {
            Vector3::zeros()
        }
    }

    /// 1σ of each component of Earth rotation, rad/s; if the site is unknown, the direction of the rotation is
    /// arbitrary.
    pub fn earth_rate_sigma(&self) -> f64 {
        if self.is_known {
            0.0
        } else {
            ROTATION_RATE / 3f64.sqrt()
        }
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

    #[test]
    fn radii_of_curvature_meet_the_axes_of_the_ellipsoid() {
        // b²/a and a at the equator, a²/b at the pole (TR8350.2, table 3.3: b and c).
        let equator = Curvature::at(0.0);
        assert_abs_diff_eq!(equator.meridian, 6_335_439.327_3, epsilon = 1e-4);
        assert_abs_diff_eq!(equator.prime_vertical, SEMI_MAJOR_AXIS);
        let pole = Curvature::at(90.0 * DEGREE);
        assert_abs_diff_eq!(pole.meridian, 6_399_593.625_8, epsilon = 1e-4);
        assert_abs_diff_eq!(pole.prime_vertical, 6_399_593.625_8, epsilon = 1e-4);
    }

    #[test]
    fn gradients_are_the_derivatives_of_gravity_and_radii() {
        let (latitude, height, step) = (-0.6, 9000.0, 1e-4);
        let by_latitude =
            |f: &dyn Fn(f64) -> f64| (f(latitude + step) - f(latitude - step)) / (2.0 * step);
        let (north, up) = normal_gravity_gradient(latitude, height);
        assert_abs_diff_eq!(
            north,
            by_latitude(&|l| normal_gravity(l, height)),
            epsilon = 1e-9
        );
        let rise = normal_gravity(latitude, height + 1.0) - normal_gravity(latitude, height - 1.0);
        assert_abs_diff_eq!(up, 0.5 * rise, epsilon = 1e-14);
        let slope = Curvature::slope(latitude);
        assert_abs_diff_eq!(
            slope.meridian,
            by_latitude(&|l| Curvature::at(l).meridian),
            epsilon = 1e-2
        );
        assert_abs_diff_eq!(
            slope.prime_vertical,
            by_latitude(&|l| Curvature::at(l).prime_vertical),
            epsilon = 1e-2
        );
    }
}
