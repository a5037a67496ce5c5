//! The sources of noise: what each is called, and where its σ is in the model.

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
    /// Attitude noise of moves by how fast they are.
    GyroMotion,
    /// Velocity noise of moves by how fast they are.
    AccelMotion,
    /// Attitude noise of moves by how long they take.
    GyroMoving,
    /// Velocity noise of moves by how long they take.
    AccelMoving,
    /// White velocity at standstill.
    Velocity,
    /// White attitude at standstill, without a table.
    Attitude,
    /// Turning where the body should stand still, without a table.
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
    /// All of them.
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

    /// What an engineer calls it.
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

    /// White noise of it alone, one in SI and radians, where it is one of the gyros' in moves.
    pub(in crate::calibration) fn alone(self) -> PerSensor<ProcessNoise> {
        let mut noise = PerSensor::<ProcessNoise>::default();
        match self {
            Self::GyroMotion => noise.gyro.by_motion = 1.0,
            Self::GyroMoving => noise.gyro.by_duration = 1.0,
            _ => {}
        }
        noise
    }

    /// Whether the run states a figure of it that is not zero.
    pub(in crate::calibration) fn stated(self, problem: &Problem) -> bool {
        match self {
            Self::Velocity | Self::Attitude => {
                let sensor = match self {
                    Self::Velocity => Sensor::Accel,
                    _ => Sensor::Gyro,
                };
                let stated = problem.run().standstill.sigma.get(sensor);
                stated.is_some_and(|_| self.sigma(problem) > 0.0)
            }
            _ => self.sigma(problem) > 0.0,
        }
    }

    /// Its σ in the model of a problem, in SI and radians; the smallest unrest that is ever taken counts
    /// as none.
    pub(in crate::calibration) fn sigma(self, problem: &Problem) -> f64 {
        let model = &problem.model;
        let gauss_markov = |sensor| {
            model
                .noise
                .get(sensor)
                .gauss_markov
                .map_or(0.0, |g| g.sigma)
        };
        match self {
            Self::AngleRandomWalk => model.noise.gyro.random_walk,
            Self::VelocityRandomWalk => model.noise.accel.random_walk,
            Self::GyroMotion => model.motion_noise.gyro.by_motion,
            Self::AccelMotion => model.motion_noise.accel.by_motion,
            Self::GyroMoving => model.motion_noise.gyro.by_duration,
            Self::AccelMoving => model.motion_noise.accel.by_duration,
            Self::Velocity => problem.standstill_variance(Sensor::Accel).sqrt(),
            Self::Attitude => problem.standstill_variance(Sensor::Gyro).sqrt(),
            Self::RotationAtRest => model.turning_at_rest,
            Self::TablePosition => model.position_sigma,
            Self::TableReading => model.reading_sigma,
            Self::GyroGaussMarkov => gauss_markov(Sensor::Gyro),
            Self::AccelGaussMarkov => gauss_markov(Sensor::Accel),
        }
    }

    /// Sets its σ, in SI and radians. A bias that is not stated to vary gets the given correlation time.
    pub(in crate::calibration) fn set(self, model: &mut Model, sigma: f64, correlation_time: f64) {
        match self {
            Self::AngleRandomWalk => model.noise.gyro.random_walk = sigma,
            Self::VelocityRandomWalk => model.noise.accel.random_walk = sigma,
            Self::GyroMotion => model.motion_noise.gyro.by_motion = sigma,
            Self::AccelMotion => model.motion_noise.accel.by_motion = sigma,
            Self::GyroMoving => model.motion_noise.gyro.by_duration = sigma,
            Self::AccelMoving => model.motion_noise.accel.by_duration = sigma,
            Self::Velocity => model.set_standstill_variance(Sensor::Accel, sigma.powi(2)),
            Self::Attitude => model.set_standstill_variance(Sensor::Gyro, sigma.powi(2)),
            Self::RotationAtRest => model.turning_at_rest = sigma,
            Self::TablePosition => model.position_sigma = sigma,
            Self::TableReading => model.reading_sigma = sigma,
            Self::GyroGaussMarkov | Self::AccelGaussMarkov => {
                let sensor = match self {
                    Self::GyroGaussMarkov => Sensor::Gyro,
                    _ => Sensor::Accel,
                };
                let stated = &mut model.noise.get_mut(sensor).gauss_markov;
                let correlation_time = stated.map_or(correlation_time, |g| g.correlation_time);
                *stated = (sigma > 0.0).then_some(GaussMarkov {
                    sigma,
                    correlation_time,
                });
            }
        }
    }
}
