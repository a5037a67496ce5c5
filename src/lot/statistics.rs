//! One quantity over all units.

use super::outlier::outliers;
use super::quantity::Quantity;
use super::row::Row;
use super::spread::Scatter;
use super::trend::{Against, Trend, trend};

/// Chance that any outlier is named, or any spread called real, in a sound lot: for all quantities at once.
pub const FALSE_ALARM: f64 = 0.01;
/// Chance that any trend is told of a lot without one: for all quantities, by serial and by date.
pub const FALSE_TREND: f64 = 0.01;

/// What the units say of one quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistics {
    /// The quantity.
    pub quantity: Quantity,
    /// How many units have it.
    pub count: usize,
    /// Places of units that are apart from the others; the rest is without them.
    pub outliers: Vec<usize>,
    /// Mean and spread.
    pub scatter: Scatter,
    /// Whether the spread is more than the units' σ make, at [`FALSE_ALARM`] over all quantities.
    pub real: bool,
    /// Changes with serial or date, at [`FALSE_TREND`] over all quantities and both.
    pub trends: Vec<Trend>,
}

impl Statistics {
    /// Of every quantity that two units have. `shared` is the 1σ of an error that all units have in common.
    pub(super) fn of_all(
        rows: &[Row],
        quantities: &[Quantity],
        shared: impl Fn(Quantity) -> f64,
    ) -> Vec<Self> {
        let chances = (
            FALSE_ALARM / quantities.len() as f64,
            FALSE_TREND / (quantities.len() * Against::ALL.len()) as f64,
        );
        let of = |&quantity: &Quantity| Self::of(rows, quantity, shared(quantity), chances);
        quantities.iter().filter_map(of).collect()
    }

    fn of(
        rows: &[Row],
        quantity: Quantity,
        shared: f64,
        (alarm, false_trend): (f64, f64),
    ) -> Option<Self> {
        let common = shared * shared;
        let (places, samples): (Vec<usize>, Vec<(f64, f64)>) = rows
            .iter()
            .enumerate()
            .filter_map(|(place, row)| {
                let sample = row.sample(quantity)?;
                let own = (sample.sigma * sample.sigma - common).max(0.0);
                Some((place, (sample.value, own)))
            })
            .unzip();
        let apart = outliers(&samples, alarm);
        let kept = |k: &usize| !apart.contains(k);
        let of_lot: Vec<usize> = (0..samples.len()).filter(kept).collect();
        let without: Vec<(f64, f64)> = of_lot.iter().map(|&k| samples[k]).collect();
        let mut scatter = Scatter::of(&without)?;
        scatter.mean_sigma = scatter.mean_sigma.hypot(shared);
        let weight = |variance: f64| {
            let all = scatter.spread.value.powi(2) + variance;
            if all > 0.0 { all.recip() } else { 1.0 }
        };
        let trends = Against::ALL.into_iter().filter_map(|against| {
            let points = of_lot.iter().filter_map(|&k| {
                let place = against.place(&rows[places[k]].unit)?;
                Some((place, samples[k].0, weight(samples[k].1)))
            });
            trend(against, &points.collect::<Vec<_>>(), false_trend)
        });
        Some(Self {
            quantity,
            count: samples.len(),
            trends: trends.collect(),
            outliers: apart.iter().map(|&k| places[k]).collect(),
            real: scatter.chi_square.is_some_and(|chi2| chi2.p < alarm),
            scatter,
        })
    }
}
