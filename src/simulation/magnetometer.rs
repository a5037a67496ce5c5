//! A simulated magnetometer in the field of a site.

use nalgebra::{Matrix3, Vector2, Vector3};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::draw::normal;
use crate::earth::Site;
use crate::magnetic::{LocalField, MagneticTriad};
use crate::recording::Magnetometer;
use crate::turntable::Motion;
use turncal_input::{Finite, NonNegative, Positive};

/// Microtesla and nanotesla in tesla.
const MICRO: f64 = 1e-6;
const NANO: f64 = 1e-9;

/// A magnetometer with the distribution of its errors, and the field at the site.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MagnetometerModel {
    /// Samples per second.
    pub rate: f64,
    /// White 1σ of a sample on each axis, T.
    pub noise: f64,
    /// 1σ of the bias on each axis, T.
    pub hard_iron: f64,
    /// 1σ of each entry of the matrix.
    pub soft_iron: f64,
    /// Nominal matrix, for axes other than those of the body.
    pub axes: Matrix3<f64>,
    /// 1σ of the disturbance of the field per axis, new in each dwell, T.
    pub disturbance: f64,
    /// Mean and 1σ of magnitude in T, declination and inclination in rad.
    pub field: [Vector3<f64>; 2],
    /// Year, month and day, if the calibration knows them, and so the distribution of the field.
    pub date: Option<(i32, u8, u8)>,
}

/// `[magnetometer]` of a scenario.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MagnetometerFile {
    #[serde(default = "ten_hertz")]
    rate_hz: Positive,
    #[serde(default)]
    noise_nt: NonNegative,
    #[serde(default)]
    hard_iron_ut: NonNegative,
    #[serde(default)]
    soft_iron: NonNegative,
    axes: Option<[[Finite; 3]; 3]>,
    #[serde(default)]
    disturbance_nt: NonNegative,
    /// East, North, Up.
    field_ut: Option<[Finite; 3]>,
    /// Year, month and day of the World Magnetic Model.
    date: Option<(i32, u8, u8)>,
}

fn ten_hertz() -> Positive {
    Positive(10.0)
}

impl MagnetometerFile {
    pub fn in_si(self, site: &Site) -> Result<MagnetometerModel, String> {
        let of_model = self.date.and_then(|date| {
            LocalField::of_model(site.latitude, site.longitude, site.height, date)
        });
        let stated = self.field_ut.map(|field| {
            let [east, north, up] = field.map(|of| of.0 * MICRO);
            let level = east.hypot(north);
            let mean = Vector3::new(level.hypot(up), east.atan2(north), (-up).atan2(level));
            let sigma = Vector3::zeros();
            LocalField { mean, sigma }
        });
        let field = stated.or(of_model).ok_or(
            "magnetometer: expected field_ut (East, North, Up), or a date [year, month, day] from 2020 to 2029",
        )?;
        let axes = self.axes.map(|rows| Matrix3::from_fn(|i, j| rows[i][j].0));
        Ok(MagnetometerModel {
            rate: self.rate_hz.0,
            noise: self.noise_nt.0 * NANO,
            hard_iron: self.hard_iron_ut.0 * MICRO,
            soft_iron: self.soft_iron.0,
            axes: axes.unwrap_or_else(Matrix3::identity),
            disturbance: self.disturbance_nt.0 * NANO,
            date: self.date.filter(|_| field.is_known()),
            field: [field.mean, field.sigma],
        })
    }
}

impl MagnetometerModel {
    /// The true magnetometer, and the magnitude of the field in T.
    pub fn draw(&self, rng: &mut ChaCha8Rng) -> (MagneticTriad, f64) {
        let soft = Matrix3::from_columns(&[(); 3].map(|()| normal(rng)));
        let bias = normal(rng) * self.hard_iron;
        let field = self.field[0] + self.field[1].component_mul(&normal(rng));
        let triad = MagneticTriad {
            matrix: (self.axes + soft * self.soft_iron) * field.x,
            bias,
            angles: Vector2::new(field.y, field.z),
        };
        (triad, field.x)
    }

    /// The recorded output of a magnetometer in a motion.
    pub fn recorded(
        &self,
        (truth, magnitude): &(MagneticTriad, f64),
        motion: &Motion,
        rng: &mut ChaCha8Rng,
    ) -> Magnetometer {
        let mut series = Magnetometer::new("uT", 1.0 / MICRO);
        let [mean, sigma] = self.field;
        series.field = self.date.map(|_| LocalField { mean, sigma });
        let (mut position, mut disturbance) = (0, normal(rng) * self.disturbance);
        for k in 0..(motion.duration() * self.rate) as usize {
            let time = (k as f64 + 0.5) / self.rate;
            while position < motion.position(time) {
                position += 1;
                disturbance = normal(rng) * self.disturbance;
            }
            let response = truth.response(&motion.at(time).attitude);
            let noise = normal(rng) * self.noise;
            let output = response.output + response.by_field * disturbance / *magnitude + noise;
            series.push(time, output / MICRO);
        }
        series
    }
}
