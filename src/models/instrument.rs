//! Instruments and installations, which describe grades of uncalibrated instruments.

use nalgebra::{SVector, Vector3};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use super::terms::{TermFile, stated_terms};
use super::thermal::{ThermalFile, ThermalVariation, thermal_variation};
use super::{ModelError, Place, Room, text};
use crate::imu::{
    ANGLES, GaussMarkov, InstallationForm, Noise, PerSensor, Prior, Sensor, Term, TermVector,
};
use crate::units::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, DEGREE, MICRO_G, MICRO_G_PER_SQRT_HZ, PPM};
use turncal_input::{Finite, NonNegative, Positive};

/// A grade of instrument.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Instrument {
    /// Name.
    pub name: String,
    /// Size of one pulse, rad and m/s.
    pub pulse: PerSensor<f64>,
    /// Noise.
    pub noise: PerSensor<Noise>,
    /// Variation between instruments of the grade before calibration.
    pub variation: PerSensor<Variation>,
    /// 1σ of each parameter of an error term, with a mean of zero; 0 for terms that the instrument does not have.
    pub term_sigma: TermVector,
    /// Error terms that are stated to be absent.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub absent_terms: Vec<Term>,
    /// Temperature dependence of the grade; `None` if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thermal: Option<PerSensor<ThermalVariation>>,
}

/// Variation of a triad's scale factors and biases between instruments of a grade.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Variation {
    /// Scale factor − 1.
    pub scale: Spread,
    /// Bias, rad/s or m/s².
    pub bias: Spread,
}

/// 1σ tolerances of an instrument before calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Tolerances {
    /// Kind.
    pub of: String,
    /// Scale factor, relative.
    pub scale: PerSensor<f64>,
    /// Bias, rad/s and m/s².
    pub bias: PerSensor<f64>,
}

/// Distribution of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    mean: f64,
    shape: Shape,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Shape {
    /// Uniform within ± this.
    Uniform(f64),
    /// Normal with this 1σ.
    Normal(f64),
}

impl Spread {
    /// Mean.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Standard deviation; for a uniform distribution within ±a, a/√3.
    pub fn sigma(&self) -> f64 {
        match self.shape {
            Shape::Uniform(half_width) => half_width / 3f64.sqrt(),
            Shape::Normal(sigma) => sigma,
        }
    }

    /// One draw.
    pub fn draw(&self, rng: &mut impl Rng) -> f64 {
        self.mean
            + match self.shape {
                Shape::Uniform(half_width) => {
                    let unit: f64 = StandardUniform.sample(rng);
                    half_width * (2.0 * unit - 1.0)
                }
                Shape::Normal(sigma) => {
                    let unit: f64 = StandardNormal.sample(rng);
                    sigma * unit
                }
            }
    }
}

/// A misalignment form with the distribution of its angles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct InstallationModel {
    /// The form.
    pub form: InstallationForm,
    /// Distribution of each angle, rad.
    pub angles: Spread,
}

impl InstallationModel {
    /// Finds and reads an installation.
    ///
    /// # Errors
    /// Returns an error if the model does not exist or is malformed.
    pub fn load(name_or_path: &str, named_in: &Place) -> Result<Self, ModelError> {
        let file: InstallationFile = text(Room::Installation, name_or_path, named_in)?.parse()?;
        Ok(Self {
            form: file.form,
            angles: file.angles_deg.times(DEGREE),
        })
    }

    /// One random draw of the angles of the form.
    pub fn draw(&self, rng: &mut impl Rng) -> SVector<f64, ANGLES> {
        let mut angles = SVector::<f64, ANGLES>::zeros();
        for angle in angles.iter_mut().take(self.form.angle_names().len()) {
            *angle = self.angles.draw(rng);
        }
        angles
    }
}

impl Instrument {
    /// 1σ tolerances of such an instrument before calibration, for use with its log.
    pub fn tolerances(&self) -> Tolerances {
        Tolerances {
            scale: PerSensor::from_fn(|sensor| self.variation.get(sensor).scale.sigma()),
            bias: PerSensor::from_fn(|sensor| self.variation.get(sensor).bias.sigma()),
            of: self.name.clone(),
        }
    }

    /// Finds and reads an instrument.
    ///
    /// # Errors
    /// Returns an error if the model does not exist or is malformed.
    pub fn load(name_or_path: &str, named_in: &Place) -> Result<Self, ModelError> {
        let text = text(Room::Imu, name_or_path, named_in)?;
        let InstrumentFile { gyro, accel, terms } = text.parse()?;
        let warms = gyro.temperature.is_some() || accel.temperature.is_some();
        let thermal = PerSensor::try_from_fn(|sensor| {
            let stated = sensor.pick(&gyro.temperature, &accel.temperature);
            let stated = stated.as_ref().unwrap_or(const { &ThermalFile::new() });
            thermal_variation(text.document(), sensor, stated)
        })?;
        let (term_sigma, absent_terms) = stated_terms(text.document(), "terms", &terms)?;
        Ok(Self {
            name: text.name(),
            pulse: PerSensor {
                gyro: gyro.pulse_arcsec.0 * ARCSEC,
                accel: accel.pulse_um_per_s.0 * 1e-6,
            },
            noise: PerSensor {
                gyro: Noise {
                    random_walk: gyro.angle_random_walk_deg_per_sqrt_h.0 * DEG_PER_SQRT_H,
                    gauss_markov: gyro.gauss_markov.map(|i| GaussMarkov {
                        sigma: i.sigma_deg_per_h.0 * DEG_PER_H,
                        correlation_time: i.correlation_time_s.0,
                    }),
                },
                accel: Noise {
                    random_walk: accel.velocity_random_walk_ug_per_sqrt_hz.0 * MICRO_G_PER_SQRT_HZ,
                    gauss_markov: accel.gauss_markov.map(|i| GaussMarkov {
                        sigma: i.sigma_ug.0 * MICRO_G,
                        correlation_time: i.correlation_time_s.0,
                    }),
                },
            },
            variation: PerSensor {
                gyro: Variation {
                    scale: gyro.scale_ppm.times(PPM),
                    bias: gyro.bias_deg_per_h.times(DEG_PER_H),
                },
                accel: Variation {
                    scale: accel.scale_ppm.times(PPM),
                    bias: accel.bias_ug.times(MICRO_G),
                },
            },
            term_sigma,
            absent_terms,
            thermal: warms.then_some(thermal),
        })
    }

    /// Prior of a triad of this grade.
    pub fn prior(&self, sensor: Sensor, installation: &InstallationModel) -> Prior {
        let Variation { scale, bias } = self.variation.get(sensor);
        Prior {
            scale_sigma: Vector3::repeat(scale.sigma()),
            installation_sigma: Vector3::repeat(installation.angles.sigma()),
            bias: Vector3::repeat(bias.mean()),
            bias_sigma: Vector3::repeat(bias.sigma()),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InstallationFile {
    form: InstallationForm,
    angles_deg: SpreadFile,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InstrumentFile {
    gyro: GyroFile,
    accel: AccelFile,
    #[serde(default)]
    terms: BTreeMap<String, TermFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GyroFile {
    pulse_arcsec: Positive,
    angle_random_walk_deg_per_sqrt_h: NonNegative,
    #[serde(alias = "instability")]
    gauss_markov: Option<GyroGaussMarkovFile>,
    scale_ppm: SpreadFile,
    bias_deg_per_h: SpreadFile,
    temperature: Option<ThermalFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AccelFile {
    pulse_um_per_s: Positive,
    velocity_random_walk_ug_per_sqrt_hz: NonNegative,
    #[serde(alias = "instability")]
    gauss_markov: Option<AccelGaussMarkovFile>,
    scale_ppm: SpreadFile,
    bias_ug: SpreadFile,
    temperature: Option<ThermalFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GyroGaussMarkovFile {
    sigma_deg_per_h: NonNegative,
    correlation_time_s: Positive,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AccelGaussMarkovFile {
    sigma_ug: NonNegative,
    correlation_time_s: Positive,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(try_from = "SpreadFields")]
struct SpreadFile(Spread);

impl SpreadFile {
    fn times(self, unit: f64) -> Spread {
        let Spread { mean, shape } = self.0;
        Spread {
            mean: mean * unit,
            shape: match shape {
                Shape::Uniform(half_width) => Shape::Uniform(half_width * unit),
                Shape::Normal(sigma) => Shape::Normal(sigma * unit),
            },
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SpreadFields {
    mean: Option<Finite>,
    uniform: Option<Positive>,
    sigma: Option<Positive>,
}

impl TryFrom<SpreadFields> for SpreadFile {
    type Error = &'static str;

    fn try_from(fields: SpreadFields) -> Result<Self, Self::Error> {
        let shape = match (fields.uniform, fields.sigma) {
            (Some(half_width), None) => Shape::Uniform(half_width.0),
            (None, Some(sigma)) => Shape::Normal(sigma.0),
            _ => return Err("expected either uniform = (half width) or sigma = (1σ)"),
        };
        Ok(Self(Spread {
            mean: fields.mean.map_or(0.0, |mean| mean.0),
            shape,
        }))
    }
}
