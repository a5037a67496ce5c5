//! Axes: linear, logarithmic, and logarithmic to both sides of a linear middle.

use std::ops::Range;

use plotters::coord::ranged1d::{
    KeyPointHint, KeyPointWeight, NoDefaultFormatting, Ranged, ValueFormatter,
};

use super::number;

#[derive(Debug, Clone, Copy)]
enum Scale {
    Linear,
    Log,
    Symlog { linear: f64 },
}

/// The most decades of a logarithmic axis; what lies lower is drawn at its foot.
const DECADES: i32 = 10;

/// One axis of a panel, with its ticks and their labels.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    scale: Scale,
    low: f64,
    high: f64,
    ticks: Vec<(f64, String)>,
}

impl Axis {
    /// A linear axis with about six round ticks.
    pub(super) fn linear(low: f64, high: f64) -> Self {
        let (low, high) = widened(low, high);
        let raw = (high - low) / 6.0;
        let power = 10f64.powf(raw.log10().floor());
        let step = power
            * [1.0, 2.0, 5.0]
                .into_iter()
                .find(|&m| m * power >= raw)
                .unwrap_or(10.0);
        Self::stepped(low, high, step)
    }

    /// A linear axis with a tick every `step`.
    pub(super) fn stepped(low: f64, high: f64, step: f64) -> Self {
        let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
        Self {
            scale: Scale::Linear,
            low,
            high,
            ticks: (first..=last)
                .map(|k| k as f64 * step)
                .map(|x| (x, number::tick(x, step)))
                .collect(),
        }
    }

    /// A logarithmic axis over whole decades that hold the positive values.
    pub(super) fn log(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values
            .filter(|v| v.is_finite() && *v > 0.0)
            .fold((f64::INFINITY, 0.0), |(l, h): (f64, f64), v| {
                (l.min(v), h.max(v))
            });
        let (first, last) = if high > 0.0 {
            // An error that is zero but for rounding must not squeeze all others.
            let first = (low.log10().floor() as i32).max(high.log10().ceil() as i32 - DECADES);
            (first, (high.log10().ceil() as i32).max(first + 1))
        } else {
            (-1, 1)
        };
        Self {
            scale: Scale::Log,
            low: 10f64.powi(first),
            high: 10f64.powi(last),
            ticks: decades(first, last)
                .map(|k| (10f64.powi(k), number::power_of_ten(k)))
                .collect(),
        }
    }

    /// A logarithmic axis between two positive numbers, ticks at 1, 2 and 5 of each decade.
    pub(super) fn log_between(low: f64, high: f64) -> Self {
        if !(low > 0.0 && high.is_finite() && high > low) {
            return Self::log([low, high].into_iter());
        }
        let decades = low.log10().floor() as i32..=high.log10().floor() as i32;
        let ticks =
            decades.flat_map(|k| [1.0, 2.0, 5.0].map(|m| (m * 10f64.powi(k), 10f64.powi(k))));
        Self {
            scale: Scale::Log,
            low,
            high,
            ticks: ticks
                .filter(|(x, _)| (low..=high).contains(x))
                .map(|(x, decade)| (x, number::tick(x, decade)))
                .collect(),
        }
    }

    /// An axis to ±`extent` that is linear below `linear` and logarithmic beyond.
    pub(super) fn symlog(linear: f64, extent: f64) -> Self {
        let linear = if linear.is_finite() && linear > 0.0 {
            linear
        } else {
            1.0
        };
        let extent = if extent.is_finite() {
            extent.max(4.0 * linear)
        } else {
            4.0 * linear
        };
        let mut ticks = vec![(0.0, "0".to_owned())];
        // A tick nearer to zero would have its label written over the zero.
        let first = (2.0 * linear).log10().ceil() as i32;
        for k in decades(first, extent.log10().floor() as i32) {
            let label = number::power_of_ten(k);
            ticks.push((-(10f64.powi(k)), format!("−{label}")));
            ticks.push((10f64.powi(k), label));
        }
        Self {
            scale: Scale::Symlog { linear },
            low: -extent,
            high: extent,
            ticks,
        }
    }

    /// An axis with one place for each name.
    pub(super) fn places(names: impl IntoIterator<Item = String>) -> Self {
        let ticks: Vec<_> = names
            .into_iter()
            .enumerate()
            .map(|(i, name)| (i as f64, name))
            .collect();
        Self {
            scale: Scale::Linear,
            low: -0.5,
            high: ticks.len().max(1) as f64 - 0.5,
            ticks,
        }
    }

    /// Lowest value.
    pub(super) fn low(&self) -> f64 {
        self.low
    }

    /// Highest value.
    pub(super) fn high(&self) -> f64 {
        self.high
    }

    fn straightened(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => value,
            Scale::Log => value.max(self.low).ln(),
            Scale::Symlog { linear } => (value / linear).asinh(),
        }
    }
}

/// Every decade, or every second or third where they are many.
fn decades(first: i32, last: i32) -> impl Iterator<Item = i32> {
    let stride = ((last - first) / 5).max(1) as usize;
    (first..=last).step_by(stride)
}

/// Bounds that a linear axis can be made of.
fn widened(low: f64, high: f64) -> (f64, f64) {
    if !(low.is_finite() && high.is_finite()) {
        (0.0, 1.0)
    } else if high - low > 1e-9 * low.abs().max(high.abs()) {
        (low, high)
    } else {
        (low - 0.5, low + 0.5)
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let (low, high) = (self.straightened(self.low), self.straightened(self.high));
        let place = ((self.straightened(*value) - low) / (high - low)).clamp(0.0, 1.0);
        limit.0 + (place * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        match hint.weight() {
            KeyPointWeight::Bold => self.ticks.iter().map(|(value, _)| *value).collect(),
            KeyPointWeight::Any => Vec::new(),
        }
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        self.ticks
            .iter()
            .find(|(tick, _)| tick == value)
            .map(|(_, label)| label.clone())
            .unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symlog_axis_is_odd_and_keeps_small_values_apart() {
        let axis = Axis::symlog(0.3, 7000.0);
        let at = |v: f64| axis.map(&v, (0, 10_000));
        assert_eq!(at(0.0), 5000);
        assert_eq!(at(-7000.0), 0);
        assert_eq!(at(0.9) - 5000, 5000 - at(-0.9));
        assert!(at(0.9) - 5000 > 500);
    }

    #[test]
    fn a_log_axis_holds_every_value_and_its_lowest_decade() {
        let axis = Axis::log([0.02, 4000.0, 0.0, f64::NAN].into_iter());
        assert_eq!((axis.low(), axis.high()), (0.01, 10_000.0));
        assert_eq!(axis.map(&0.01, (0, 600)), 0);
        assert!(axis.ticks.iter().any(|(_, label)| label == "0.01"));
        assert_eq!(axis.map(&0.0, (0, 600)), 0);
    }

    #[test]
    fn axes_of_nothing_are_still_axes() {
        for axis in [
            Axis::linear(3.0, 3.0),
            Axis::linear(f64::INFINITY, f64::NEG_INFINITY),
            Axis::log(std::iter::empty()),
            Axis::symlog(0.0, f64::NAN),
            Axis::places([]),
            Axis::log_between(f64::INFINITY, 0.0),
            Axis::log_between(3.0, 3.0),
        ] {
            assert!(axis.high() > axis.low());
            assert!((0..=100).contains(&axis.map(&1.0, (0, 100))));
        }
    }
}
