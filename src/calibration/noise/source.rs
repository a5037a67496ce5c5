//! The sources of noise, one row per source, with the position of its σ in the model.

use serde::{Deserialize, Serialize};

use crate::calibration::budget::source::BudgetSource;
use crate::calibration::{Model, Problem};
use crate::imu::{GaussMarkov, NoiseKeys, PerSensor, Sensor};
use crate::navigation::ProcessNoise;
use crate::units::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, DEGREE, MICRO_G, MICRO_G_PER_SQRT_HZ};

const GYRO: NoiseKeys = NoiseKeys::of(Sensor::Gyro);
const ACCEL: NoiseKeys = NoiseKeys::of(Sensor::Accel);

macro_rules! sources {
    ($($(#[$attribute:meta])* $variant:ident, $triad:ident, $name:literal in $unit:literal = $value:expr,
        $table:literal $line:expr, part of $part:ident $(($of:ident))?;)*) => {
        /// A source of noise with one σ.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum Source {
            $($(#[$attribute])* #[doc = $name] $variant,)*
        }

        impl Source {
            /// All sources.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$variant),*];

            /// Name for reports.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// The unit in which σ is shown, and the size of this unit in SI units and radians.
            pub fn unit(self) -> (&'static str, f64) {
                match self { $(Self::$variant => ($unit, $value),)* }
            }

            /// The triad of the source, or the triad whose random walk is its reference.
            pub fn triad(self) -> Sensor {
                match self { $(Self::$variant => Sensor::$triad,)* }
            }

            /// The table of `run.toml` that states the source, the key in this table, and the unit in SI units and
            /// radians.
            pub fn stated_in(self) -> (&'static str, (&'static str, f64)) {
                match self { $(Self::$variant => ($table, $line),)* }
            }

            /// Source in the uncertainty budget.
            pub fn in_budget(self) -> BudgetSource {
                match self { $(Self::$variant => BudgetSource::$part $((Sensor::$of))?,)* }
            }
        }
    };
}

// Noise of moves by speed is divided by the root of ∫|ω|² dt in rad²/s or ∫|a|² dt in m²/s³.
sources! {
    AngleRandomWalk, Gyro, "angle random walk" in "deg/sqrt(h)" = DEG_PER_SQRT_H,
        "imu.noise" GYRO.random_walk, part of White(Gyro);
    VelocityRandomWalk, Accel, "velocity random walk" in "ug/sqrt(Hz)" = MICRO_G_PER_SQRT_HZ,
        "imu.noise" ACCEL.random_walk, part of White(Accel);
    GyroMotion, Gyro, "attitude noise of moves, proportional to rate" in "sqrt(s)" = 1.0,
        "imu.noise" (GYRO.by_motion, 1.0), part of Moves(Gyro);
    AccelMotion, Accel, "velocity noise in moves, by acceleration" in "sqrt(s)" = 1.0,
        "imu.noise" (ACCEL.by_motion, 1.0), part of Moves(Accel);
    GyroMoving, Gyro, "attitude noise in moves, by time" in "deg/sqrt(s)" = DEGREE,
        "imu.noise" GYRO.by_duration, part of Moves(Gyro);
    AccelMoving, Accel, "velocity noise in moves, by time" in "mm/s/sqrt(s)" = 1e-3,
        "imu.noise" ACCEL.by_duration, part of Moves(Accel);
    Velocity, Accel, "velocity at standstill" in "mm/s" = 1e-3,
        "standstill" ("velocity_sigma_m_s", 1.0), part of VelocityAtRest;
    Attitude, Gyro, "attitude at standstill" in "arcsec" = ARCSEC,
        "standstill" ("attitude_sigma_arcsec", ARCSEC), part of AttitudeAtRest;
    #[serde(rename = "turning")]
    RotationAtRest, Gyro, "turning at standstill" in "deg/sqrt(s)" = DEGREE,
        "standstill" ("turning_deg_per_sqrt_s", DEGREE), part of RotationAtRest;
    TablePosition, Gyro, "table position" in "arcsec" = ARCSEC,
        "turntable" ("position_sigma_arcsec", ARCSEC), part of TablePosition;
    TableReading, Gyro, "table reading" in "arcsec" = ARCSEC,
        "turntable" ("reading_sigma_arcsec", ARCSEC), part of TableReading;
    Settling, Gyro, "settling of the table" in "arcsec" = ARCSEC,
        "turntable" ("settling_sigma_arcsec", ARCSEC), part of Settling;
    GyroGaussMarkov, Gyro, "Gauss-Markov bias of the gyros" in "deg/h" = DEG_PER_H,
        "imu.noise" GYRO.gauss_markov, part of Wander(Gyro);
    AccelGaussMarkov, Accel, "Gauss-Markov bias of the accelerometers" in "ug" = MICRO_G,
        "imu.noise" ACCEL.gauss_markov, part of Wander(Accel);
    MagneticDisturbance, Gyro, "disturbance of the magnetic field" in "nT" = 1e-9,
        "imu.noise" ("mag_disturbance_nt", 1e-9), part of MagneticDisturbance;
}

impl Source {
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

    /// Whether the run states a nonzero figure for this source.
    pub(in crate::calibration) fn stated(self, problem: &Problem) -> bool {
        let of_dwells = problem.run().standstill.sigma.get(self.triad());
        let seen = matches!(self, Self::Velocity | Self::Attitude) && of_dwells.is_none();
        !seen && self.sigma(problem) > 0.0
    }

    /// σ as modelled in a problem, in SI units and radians; the floor of the standstill noise counts
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
            Self::Settling => model.settling_sigma,
            Self::GyroGaussMarkov | Self::AccelGaussMarkov => {
                noise.gauss_markov.map_or(0.0, |bias| bias.sigma)
            }
            Self::MagneticDisturbance => model.magnetic.disturbance,
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
            Self::MagneticDisturbance => model.magnetic.disturbance = sigma,
            Self::TablePosition => model.position_sigma = sigma,
            Self::TableReading => model.reading_sigma = sigma,
            Self::Settling => model.settling_sigma = sigma,
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
