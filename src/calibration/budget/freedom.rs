//! How well the variance of a source is known.

use super::source::BudgetSource;
use crate::calibration::{Outcome, Source};

/// The end of a 95 % interval, in σ.
const END_OF_INTERVAL: f64 = 1.959_963_984_540_054;

impl BudgetSource {
    /// Degrees of freedom with which its variance is known: ½ (u/Δu)² (JCGM 100, G.4.2), Δu from the upper
    /// end of the interval of what was learnt, for the lower one may be nothing at all; of several the
    /// least, and not less than one.
    pub(in crate::calibration) fn degrees_of_freedom(self, outcome: &Outcome) -> f64 {
        if self == Self::DwellScatter {
            let parameters = outcome.estimate.estimated().count().max(1);
            let scores = outcome.dwell_scatter.map_or(0, |scatter| scatter.count);
            return (scores as f64 / parameters as f64).max(1.0);
        }
        let learnt = outcome.noise.sources.iter();
        let of_own = learnt.filter(|figures| self.learnt().contains(&figures.source));
        let freedoms = of_own.filter_map(|figures| {
            let [_, high] = figures.interval?;
            let relative = (high / figures.used).ln() / END_OF_INTERVAL;
            (figures.used > 0.0 && relative > 0.0).then(|| (0.5 / relative.powi(2)).max(1.0))
        });
        freedoms.fold(f64::INFINITY, f64::min)
    }

    /// What is learnt of it from a record, if anything is.
    fn learnt(self) -> &'static [Source] {
        match self {
            Self::GyroNoise => &[Source::AngleRandomWalk],
            Self::AccelNoise => &[Source::VelocityRandomWalk],
            Self::GyroMoves => &[Source::GyroMotion, Source::GyroMoving],
            Self::AccelMoves => &[Source::AccelMotion, Source::AccelMoving],
            Self::GyroWander => &[Source::GyroGaussMarkov],
            Self::AccelWander => &[Source::AccelGaussMarkov],
            Self::VelocityAtRest => &[Source::Velocity],
            Self::AttitudeAtRest => &[Source::Attitude],
            Self::RotationAtRest => &[Source::RotationAtRest],
            Self::TablePosition => &[Source::TablePosition],
            Self::TableReading => &[Source::TableReading],
            _ => &[],
        }
    }
}
