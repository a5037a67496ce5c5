//! Distribution of an error length over instruments.

use serde::Serialize;

use crate::study::ratio::quantile;

/// Distribution of a length.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// The median: half of all values are smaller.
    pub median: f64,
    /// The mean.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// First and third quartile.
    #[serde(skip)]
    pub quartiles: (f64, f64),
    /// The limit below which 68 % of all values lie.
    #[serde(rename = "below_68_percent")]
    pub below_68: f64,
    /// The limit below which 95 % of all values lie.
    #[serde(rename = "below_95_percent")]
    pub below_95: f64,
}

impl Spread {
    /// Distribution of these lengths; NaN if empty.
    pub(super) fn of(lengths: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = lengths.collect();
        sorted.sort_by(f64::total_cmp);
        let count = sorted.len() as f64;
        Self {
            median: quantile(&sorted, 0.5),
            mean: sorted.iter().sum::<f64>() / count,
            rms: (sorted.iter().map(|x| x * x).sum::<f64>() / count).sqrt(),
            quartiles: (quantile(&sorted, 0.25), quantile(&sorted, 0.75)),
            below_68: quantile(&sorted, 0.68),
            below_95: quantile(&sorted, 0.95),
        }
    }
}
