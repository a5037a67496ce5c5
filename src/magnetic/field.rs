//! The magnetic field at a site.

use nalgebra::Vector3;
use world_magnetic_model::GeomagneticField;
use world_magnetic_model::time::{Date, Month};
use world_magnetic_model::uom::si::angle::{degree, radian};
use world_magnetic_model::uom::si::f32::{Angle, Length};
use world_magnetic_model::uom::si::length::meter;
use world_magnetic_model::uom::si::magnetic_flux_density::tesla;

use crate::units::DEGREE;

/// Magnitude that stands for "the local field" if it is unknown, T: about the mean over the Earth.
const CONVENTION: f64 = 50e-6;
/// 1σ of an unknown declination, rad: its RMS between 60° south and 60° north (WMM2025), rounded up.
const DECLINATION: f64 = 20.0 * DEGREE;
/// 1σ of an unknown inclination, rad.
const INCLINATION: f64 = 1.0;
/// 1σ of the field of a building or of the crust per axis, T.
const SURROUNDINGS: f64 = 1e-6;

/// Prior of the field at a site: magnitude in T, declination and inclination in rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalField {
    /// Magnitude, declination from North towards East, inclination below the horizon.
    pub mean: Vector3<f64>,
    /// 1σ of each; zero for a magnitude by convention.
    pub sigma: Vector3<f64>,
}

impl LocalField {
    /// An unknown field, of a magnitude by convention.
    pub fn unknown() -> Self {
        Self {
            mean: Vector3::new(CONVENTION, 0.0, 0.0),
            sigma: Vector3::new(0.0, DECLINATION, INCLINATION),
        }
    }

    /// Whether the magnitude is known; otherwise it is a convention.
    pub fn is_known(&self) -> bool {
        self.sigma.x > 0.0
    }

    /// The field of the World Magnetic Model at a latitude and longitude in rad and a height in m, on a date (year,
    /// month, day). `None` outside the years of the model.
    ///
    /// σ is that of the model's error model (WMM2025 Technical Report, §3.4: 138 nT for the magnitude, 0.2° for the
    /// inclination, `√(0.26² + (5417 nT/H)²)`° for the declination), with the surroundings added.
    pub fn of_model(
        latitude: f64,
        longitude: f64,
        height: f64,
        (year, month, day): (i32, u8, u8),
    ) -> Option<Self> {
        let month = Month::try_from(month).ok()?;
        let date = Date::from_calendar_date(year, month, day).ok()?;
        let angle = |value: f64| Angle::new::<degree>((value / DEGREE) as f32);
        let height = Length::new::<meter>(height as f32);
        let field = GeomagneticField::new(height, angle(latitude), angle(longitude), date).ok()?;
        let rad = |angle: Angle| f64::from(angle.get::<radian>());
        let magnitude = f64::from(field.f().get::<tesla>());
        let level = f64::from(field.h().get::<tesla>());
        let of_model = [
            f64::from(field.f_uncertainty().get::<tesla>()),
            rad(field.declination_uncertainty()),
            rad(field.inclination_uncertainty()),
        ];
        let around = [SURROUNDINGS, SURROUNDINGS / level, SURROUNDINGS / magnitude];
        Some(Self {
            mean: Vector3::new(
                magnitude,
                rad(field.declination()),
                rad(field.inclination()),
            ),
            sigma: Vector3::from_fn(|k, _| of_model[k].hypot(around[k])),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// WMM2025 Technical Report, table of test values: 2025.0, 0 km, 80°N 0°E: X 6521.6, Y 145.9, Z 54791.5 nT.
    #[test]
    fn the_field_is_that_of_the_test_values_of_the_model() {
        let field = LocalField::of_model(80.0 * DEGREE, 0.0, 0.0, (2025, 1, 1)).unwrap();
        let level = 6521.6f64.hypot(145.9);
        assert_relative_eq!(field.mean.x, level.hypot(54791.5) * 1e-9, epsilon = 2e-10);
        assert_relative_eq!(field.mean.y, (145.9f64).atan2(6521.6), epsilon = 1e-4);
        assert_relative_eq!(field.mean.z, (54791.5f64).atan2(level), epsilon = 1e-5);
        assert!(field.is_known() && !LocalField::unknown().is_known());
        assert_eq!(LocalField::of_model(0.0, 0.0, 0.0, (2035, 1, 1)), None);
        assert_eq!(LocalField::of_model(0.0, 0.0, 0.0, (2026, 2, 30)), None);
    }
}
