//! One quantity over all units.

use super::outlier::outliers;
use super::quantity::{Quantity, Sample};
use super::spread::{Scatter, scatter};
use super::trend::{Against, Trend, trend};
use super::unit::Row;
use crate::imu::BodyFrame;

/// False-alarm rate of outliers, and of significant spreads, for all quantities of a lot together.
pub const FALSE_ALARM: f64 = 0.01;
/// False-alarm rate of trends, for all quantities of a lot together, by serial number and by date.
pub const FALSE_TREND: f64 = 0.01;

/// Statistics of one quantity over the units.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistics {
    /// The quantity.
    pub quantity: Quantity,
    /// Number of units that have it.
    pub count: usize,
    /// Indices of outliers, which the other statistics exclude.
    pub outliers: Vec<usize>,
    /// Mean and spread.
    pub scatter: Scatter,
    /// Whether the spread exceeds the units' σ significantly, at [`FALSE_ALARM`] over all quantities.
    pub real: bool,
    /// Significant trends with serial number or date, at [`FALSE_TREND`] over all quantities and both.
    pub trends: Vec<Trend>,
}

/// Statistics of every quantity that at least two units have. `gravity` is the shared relative 1σ of gravity.
pub fn of_all(rows: &[Row], body_frame: BodyFrame, gravity: f64) -> Vec<Statistics> {
    let quantities = Quantity::all(body_frame);
    let alarm = FALSE_ALARM / quantities.len() as f64;
    let false_trend = FALSE_TREND / quantities.len() as f64 / Against::ALL.len() as f64;
    let of = |quantity: Quantity| {
        let shared = if quantity.follows_gravity() {
            gravity
        } else {
            0.0
        };
        let sample = |(place, row): (usize, &Row)| {
            let Sample { value, sigma } = row.sample(quantity)?;
            let own = (sigma * sigma - shared * shared).max(0.0);
            Some((place, (value, own)))
        };
        let samples = rows.iter().enumerate().filter_map(sample);
        let (places, samples): (Vec<usize>, Vec<(f64, f64)>) = samples.unzip();
        let apart = outliers(&samples, alarm);
        let of_lot: Vec<usize> = (0..samples.len()).filter(|k| !apart.contains(k)).collect();
        let without: Vec<(f64, f64)> = of_lot.iter().map(|&k| samples[k]).collect();
        let mut scatter = scatter(&without)?;
        scatter.mean_sigma = scatter.mean_sigma.hypot(shared);
        let weight = |own: f64| match scatter.spread.value.powi(2) + own {
            all if all > 0.0 => all.recip(),
            _ => 1.0,
        };
        let trends = Against::ALL.into_iter().filter_map(|against| {
            let points = of_lot.iter().filter_map(|&k| {
                let (value, own) = samples[k];
                Some((against.place(&rows[places[k]].unit)?, value, weight(own)))
            });
            trend(against, &points.collect::<Vec<_>>(), false_trend)
        });
        Some(Statistics {
            quantity,
            count: samples.len(),
            trends: trends.collect(),
            outliers: apart.iter().map(|&k| places[k]).collect(),
            real: scatter.chi_square.is_some_and(|chi2| chi2.p < alarm),
            scatter,
        })
    };
    quantities.into_iter().filter_map(of).collect()
}
