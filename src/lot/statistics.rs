//! Statistics of each quantity over all units.

use super::quantity::{Quantity, Sample, Shared};
use super::scatter::{Scatter, outliers, scatter};
use super::unit::Row;
use crate::imu::BodyFrame;

/// False-alarm rate of outliers, and of significant spreads, for all quantities together.
pub const FALSE_ALARM: f64 = 0.01;

/// Statistics of one quantity over the units that state its σ, or over all units if fewer than two state a σ.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistics {
    /// The quantity.
    pub quantity: Quantity,
    /// Number of units used.
    pub count: usize,
    /// Indices of outliers, which the other statistics exclude.
    pub outliers: Vec<usize>,
    /// Mean and spread.
    pub scatter: Scatter,
    /// Whether the spread exceeds the units' σ significantly, at [`FALSE_ALARM`] over all quantities.
    pub real: bool,
}

impl Statistics {
    /// The mean with its 1σ.
    pub fn mean(&self) -> Sample {
        Sample {
            value: self.scatter.mean,
            sigma: self.scatter.mean_sigma,
        }
    }
}

/// Values of one quantity with their variances, each with the index of its unit.
type Samples = Vec<(usize, (f64, f64))>;

/// Statistics of every quantity that at least two units have.
pub fn of_all(rows: &[Row], body_frame: BodyFrame, shared: Shared) -> Vec<Statistics> {
    let quantities =
        Quantity::all(body_frame).map(|quantity| (quantity, samples(rows, quantity, shared)));
    let quantities: Vec<(Quantity, Samples)> = quantities
        .filter(|(_, samples)| samples.len() > 1)
        .collect();
    let alarm = FALSE_ALARM / quantities.len() as f64;
    let of = |(quantity, samples): (Quantity, Samples)| {
        let values = |of: &Samples| -> Vec<(f64, f64)> { of.iter().map(|of| of.1).collect() };
        let all = values(&samples);
        let apart = outliers(&all, &scatter(&all)?, alarm);
        let apart: Vec<usize> = apart.into_iter().map(|k| samples[k].0).collect();
        let count = samples.len();
        let rest = samples.into_iter().filter(|of| !apart.contains(&of.0));
        let mut scatter = scatter(&values(&rest.collect()))?;
        let of_mean = shared.of(quantity, scatter.mean);
        scatter.mean_sigma = scatter.mean_sigma.hypot(of_mean);
        Some(Statistics {
            quantity,
            count,
            outliers: apart,
            real: scatter.chi_square.is_some_and(|chi2| chi2.p < alarm),
            scatter,
        })
    };
    quantities.into_iter().filter_map(of).collect()
}

fn samples(rows: &[Row], quantity: Quantity, shared: Shared) -> Samples {
    let all = rows.iter().enumerate();
    let all = all.filter_map(|(place, row)| Some((place, row.sample(quantity)?)));
    let mut all: Vec<(usize, Sample)> = all.collect();
    let stated = |of: &(usize, Sample)| of.1.sigma > 0.0;
    if all.iter().filter(|of| stated(of)).count() > 1 {
        all.retain(stated);
    }
    let own = |of: Sample| (of.sigma.powi(2) - shared.of(quantity, of.value).powi(2)).max(0.0);
    { all.into_iter() }
        .map(|(place, of)| (place, (of.value, own(of))))
        .collect()
}
