//! The sources of noise: their names, and the place of their σ in the model.

use serde::{Deserialize, Serialize};

use crate::calibration::{Model, Problem};
use crate::imu::{GaussMarkov, PerSensor, Sensor};
use crate::navigation::ProcessNoise;
use crate::units::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, DEGREE, MICRO_G, MICRO_G_PER_SQRT_HZ};

/// A source of noise with one σ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// Angle random walk.
    AngleRandomWalk,
    /// Velocity random walk.
    VelocityRandomWalk,
    /// Attitude noise of moves that grows with their speed.
    GyroMotion,
    /// Velocity noise of moves that grows with their speed.
    AccelMotion,
    /// Attitude noise of moves that grows with their duration.
    GyroMoving,
    /// Velocity noise of moves that grows with their duration.
    AccelMoving,
    /// White velocity at standstill.
    Velocity,
    /// White attitude at standstill, without a table.
    Attitude,
    /// Unwanted rotation at rest, without a table.
    #[serde(rename = "turning")]
    RotationAtRest,
    /// Position error of the table.
    TablePosition,
    /// Reading of the table.
    TableReading,
    /// Gauss–Markov bias of the gyros.
    GyroGaussMarkov,
    /// Gauss–Markov bias of the accelerometers.
    AccelGaussMarkov,
}

impl Source {
    /// All sources.
    pub const ALL: [Self; 13] = [
        Self::AngleRandomWalk,
        Self::VelocityRandomWalk,
        Self::GyroMotion,
        Self::AccelMotion,
        Self::GyroMoving,
        Self::AccelMoving,
        Self::Velocity,
        Self::Attitude,
        Self::RotationAtRest,
        Self::TablePosition,
        Self::TableReading,
        Self::GyroGaussMarkov,
        Self::AccelGaussMarkov,
    ];

    /// Its name for reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::AngleRandomWalk => "angle random walk",
            Self::VelocityRandomWalk => "velocity random walk",
            Self::GyroMotion => "attitude noise of moves by rate",
            Self::AccelMotion => "velocity noise of moves by acceleration",
            Self::GyroMoving => "attitude noise of moves by time",
            Self::AccelMoving => "velocity noise of moves by time",
            Self::Velocity => "velocity at standstill",
            Self::Attitude => "attitude at standstill",
            Self::RotationAtRest => "turning at standstill",
            Self::TablePosition => "table position",
            Self::TableReading => "table reading",
            Self::GyroGaussMarkov => "Gauss-Markov bias of the gyros",
            Self::AccelGaussMarkov => "Gauss-Markov bias of the accelerometers",
        }
    }

    /// The unit in which its σ is shown, and that unit in SI and radians.
    pub fn unit(self) -> (&'static str, f64) {
        match self {
            Self::AngleRandomWalk => ("deg/sqrt(h)", DEG_PER_SQRT_H),
            Self::VelocityRandomWalk => ("ug/sqrt(Hz)", MICRO_G_PER_SQRT_HZ),
            // Over the root of ∫|ω|² dt in rad²/s or ∫|a|² dt in m²/s³.
            Self::GyroMotion | Self::AccelMotion => ("sqrt(s)", 1.0),
            Self::GyroMoving | Self::RotationAtRest => ("deg/sqrt(s)", DEGREE),
            Self::AccelMoving => ("mm/s/sqrt(s)", 1e-3),
            Self::Velocity => ("mm/s", 1e-3),
            Self::Attitude | Self::TablePosition | Self::TableReading => ("arcsec", ARCSEC),
            Self::GyroGaussMarkov => ("deg/h", DEG_PER_H),
            Self::AccelGaussMarkov => ("ug", MICRO_G),
        }
    }

    /// Process noise of this source alone with unit σ in SI and radians, if it is gyro noise in moves.
    pub(in crate::calibration) fn alone(self) -> PerSensor<ProcessNoise> {
        let mut noise = PerSensor::<ProcessNoise>::default();
        match self {
            Self::GyroMotion => noise.gyro.by_motion = 1.0,
            Self::GyroMoving => noise.gyro.by_duration = 1.0,
            _ => {}
        }
        noise
    }

    /// Its triad, or the triad whose random walk is its reference.
    pub(in crate::calibration) fn triad(self) -> Sensor {
        match self {
            Self::VelocityRandomWalk
            | Self::AccelMotion
            | Self::AccelMoving
            | Self::Velocity
            | Self::AccelGaussMarkov => Sensor::Accel,
            _ => Sensor::Gyro,
        }
    }

    /// Whether the run states a nonzero figure for it.
    pub(in crate::calibration) fn stated(self, problem: &Problem) -> bool {
        let of_dwells = problem.run().standstill.sigma.get(self.triad());
        let seen = matches!(self, Self::Velocity | Self::Attitude) && of_dwells.is_none();
        !seen && self.sigma(problem) > 0.0
    }

    /// Its σ in the model of a problem, in SI and radians; the floor of the standstill noise counts
    /// as zero.
    pub(in crate::calibration) fn sigma(self, problem: &Problem) -> f64 {
        let (model, sensor) = (&problem.model, self.triad());
        let (noise, of_moves) = (model.noise.get(sensor), model.motion_noise.get(sensor));
        match self {
            Self::AngleRandomWalk | Self::VelocityRandomWalk => noise.random_walk,
            Self::GyroMotion | Self::AccelMotion => of_moves.by_motion,
            Self::GyroMoving | Self::AccelMoving => of_moves.by_duration,
            Self::Velocity | Self::Attitude => problem.standstill_variance(sensor).sqrt(),
            Self::RotationAtRest => model.turning_at_rest,
            Self::TablePosition => model.position_sigma,
            Self::TableReading => model.reading_sigma,
            Self::GyroGaussMarkov | Self::AccelGaussMarkov => {
                noise.gauss_markov.map_or(0.0, |bias| bias.sigma)
            }
        }
    }

    /// Sets its σ, in SI and radians. A bias without stated variation gets the given correlation time.
    pub(in crate::calibration) fn set(self, model: &mut Model, sigma: f64, correlation_time: f64) {
        let sensor = self.triad();
        let of_moves = model.motion_noise.get_mut(sensor);
        let noise = model.noise.get_mut(sensor);
        match self {
            Self::AngleRandomWalk | Self::VelocityRandomWalk => noise.random_walk = sigma,
            Self::GyroMotion | Self::AccelMotion => of_moves.by_motion = sigma,
            Self::GyroMoving | Self::AccelMoving => of_moves.by_duration = sigma,
            Self::Velocity | Self::Attitude => {
                model.set_standstill_variance(sensor, sigma.powi(2));
            }
            Self::RotationAtRest => model.turning_at_rest = sigma,
            Self::TablePosition => model.position_sigma = sigma,
            Self::TableReading => model.reading_sigma = sigma,
            Self::GyroGaussMarkov | Self::AccelGaussMarkov => {
                let stated = noise.gauss_markov;
                let correlation_time = stated.map_or(correlation_time, |g| g.correlation_time);
                noise.gauss_markov = (sigma > 0.0).then_some(GaussMarkov {
                    sigma,
                    correlation_time,
                });
            }
        }
    }
}
