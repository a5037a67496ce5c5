//! Estimated noise in the notation of `run.toml`.

use super::report::NoiseReport;
use super::source::Source;
use crate::imu::{NoiseKeys, PerSensor};
use crate::units::{ARCSEC, DEGREE};

/// Tables of `run.toml` that state noise.
const TABLES: [&str; 3] = ["imu.noise", "standstill", "turntable"];

impl NoiseReport {
    /// The lines of `run.toml` that state the estimated noise, each below the table it belongs to; `None` if no
    /// noise was estimated. `correlation_time` is that of each triad's Gauss–Markov bias in s.
    pub fn run_toml(&self, correlation_time: PerSensor<Option<f64>>) -> Option<String> {
        if !self.learnt {
            return None;
        }
        let used = self.sources.iter().filter(|figures| figures.used > 0.0);
        let lines: Vec<(&str, String)> = used
            .flat_map(|figures| {
                let sigma = figures.used * figures.source.unit().1;
                figures.source.lines(sigma, correlation_time)
            })
            .collect();
        let of_table = |table: &str| -> Option<String> {
            let of_table = lines.iter().filter(|(of, _)| *of == table);
            let lines: String = of_table.map(|(_, line)| format!("{line}\n")).collect();
            (!lines.is_empty()).then(|| format!("[{table}]\n{lines}"))
        };
        let tables: Vec<String> = TABLES.into_iter().filter_map(of_table).collect();
        Some(tables.join("\n"))
    }
}

impl Source {
    /// Table and line for each figure that states this σ, in SI and radians.
    fn lines(
        self,
        sigma: f64,
        correlation_time: PerSensor<Option<f64>>,
    ) -> Vec<(&'static str, String)> {
        let [imu, standstill, turntable] = TABLES;
        let keys = NoiseKeys::of(self.triad());
        let (table, (name, unit)) = match self {
            Self::AngleRandomWalk | Self::VelocityRandomWalk => (imu, keys.random_walk),
            Self::GyroMotion | Self::AccelMotion => (imu, (keys.by_motion, 1.0)),
            Self::GyroMoving | Self::AccelMoving => (imu, keys.by_duration),
            Self::GyroGaussMarkov | Self::AccelGaussMarkov => (imu, keys.gauss_markov),
            Self::Velocity => (standstill, ("velocity_sigma_m_s", 1.0)),
            Self::Attitude => (standstill, ("attitude_sigma_arcsec", ARCSEC)),
            Self::RotationAtRest => (standstill, ("turning_deg_per_sqrt_s", DEGREE)),
            Self::TablePosition => (turntable, ("position_sigma_arcsec", ARCSEC)),
            Self::TableReading => (turntable, ("reading_sigma_arcsec", ARCSEC)),
        };
        let varies = matches!(self, Self::GyroGaussMarkov | Self::AccelGaussMarkov);
        let time = correlation_time.get(self.triad()).filter(|_| varies);
        let time = time.map(|time| (keys.correlation_time, time));
        let lines = [(name, sigma / unit)].into_iter().chain(time);
        let lines = lines.map(|(name, value)| (table, format!("{name} = {}", rounded(value))));
        lines.collect()
    }
}

/// A TOML number of four digits.
fn rounded(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    format!("{rounded:?}")
}
