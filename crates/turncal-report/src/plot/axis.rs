//! Axes: their specification, and the scale with ticks derived from it and the data.

use turncal::number;

/// Maximum number of decades of a logarithmic axis; lower values are drawn at its lower end.
const DECADES: i32 = 10;
/// An axis with fewer decades has ticks at 1, 2 and 5 of each.
const FEW_DECADES: f64 = 2.5;
/// Margin at both ends of a logarithmic axis, as a factor.
const MARGIN: f64 = 1.15;

/// How an axis is scaled.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Kind {
    /// Linear.
    #[default]
    Linear,
    /// Logarithmic.
    Log,
}

/// Specification of an axis. Unless its ends are given, the axis ends where the data end.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Axis {
    /// Title of a horizontal axis; the title of the vertical axis belongs to the panel.
    pub title: String,
    /// Scaling.
    pub kind: Kind,
    /// Fixed ends.
    pub ends: Option<(f64, f64)>,
    /// Values to include in addition to the data.
    pub including: Vec<f64>,
    /// Margins below and above the data, given as fractions of the span of the data, as factors (logarithmic axis), or
    /// as numbers of positions (axis of names).
    pub room: (f64, f64),
    /// Names at the positions 0, 1, 2 …, shown instead of numbers.
    pub places: Vec<String>,
    /// Whether the axis is hidden, as in a map.
    pub is_bare: bool,
}

impl Axis {
    /// A linear axis.
    pub fn linear(title: &str) -> Self {
        Self::of(title, Kind::Linear)
    }

    /// A logarithmic axis.
    pub fn log(title: &str) -> Self {
        Self::of(title, Kind::Log)
    }

    /// An axis with a position for each name.
    pub fn places(names: impl IntoIterator<Item = String>) -> Self {
        Self {
            places: names.into_iter().collect(),
            ..Self::default()
        }
    }

    /// An axis with these ends that is hidden.
    pub fn bare(low: f64, high: f64) -> Self {
        Self {
            is_bare: true,
            ..Self::default().between(low, high)
        }
    }

    fn of(title: &str, kind: Kind) -> Self {
        Self {
            title: title.to_owned(),
            kind,
            ..Self::default()
        }
    }

    /// Fixed ends.
    pub fn between(mut self, low: f64, high: f64) -> Self {
        self.ends = Some((low, high));
        self
    }

    /// Includes these values.
    pub fn including(mut self, values: impl IntoIterator<Item = f64>) -> Self {
        self.including.extend(values);
        self
    }

    /// Sets margins below and above the data.
    pub fn room(mut self, below: f64, above: f64) -> Self {
        self.room = (below, above);
        self
    }

    /// The scale that covers these values.
    pub fn scale(&self, values: impl IntoIterator<Item = f64>) -> Scale {
        if !self.places.is_empty() {
            return Scale::places(&self.places, self.room);
        }
        let values = values.into_iter().chain(self.including.iter().copied());
        let values = values.filter(|v| v.is_finite() && (*v > 0.0 || self.kind != Kind::Log));
        let nothing = (f64::INFINITY, f64::NEG_INFINITY);
        let held = || {
            values.fold(nothing, |(low, high), v| {
                (f64::min(low, v), f64::max(high, v))
            })
        };
        let (low, high) = self.ends.unwrap_or_else(held);
        let (below, above) = self.room;
        let mut scale = match self.kind {
            Kind::Linear => {
                let span = high - low;
                Scale::linear(low - below * span, high + above * span)
            }
            Kind::Log => Scale::log(low * (1.0 - below), high * (1.0 + above)),
        };
        if self.is_bare {
            scale.ticks.clear();
        }
        scale
    }
}

/// An axis with ends and ticks.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    kind: Kind,
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
    /// Tick values and their labels, the most important first.
    pub ticks: Vec<(f64, String)>,
}

impl Scale {
    fn linear(low: f64, high: f64) -> Self {
        let (low, high) = widened(low, high);
        let raw = (high - low) / 6.0;
        let power = 10f64.powf(raw.log10().floor());
        let round = [1.0, 2.0, 5.0].into_iter().find(|m| m * power >= raw);
        let step = power * round.unwrap_or(10.0);
        let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
        let values = (first..=last).map(|k| k as f64 * step);
        Self {
            kind: Kind::Linear,
            low,
            high,
            ticks: values.map(|x| (x, number::tick(x, step))).collect(),
        }
    }

    fn log(low: f64, high: f64) -> Self {
        let (low, high) = if low > 0.0 && high.is_finite() && high >= low {
            (low.max(high * 10f64.powi(-DECADES)), high)
        } else {
            (0.1, 10.0)
        };
        // Space that keeps marks and a single value off the ends.
        let (low, high) = (low / MARGIN, high * MARGIN);
        let few = (high / low).log10() < FEW_DECADES;
        let of_decade: &[f64] = if few { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let (first, last) = (low.log10().floor() as i32, high.log10().floor() as i32);
        // Every decade, or every second or third if there are many.
        let decades = (first..=last).step_by(((last - first) / 5).max(1) as usize);
        let ticks = decades.flat_map(|k| of_decade.iter().map(move |m| (m * 10f64.powi(k), k)));
        let ticks = ticks.filter(|(x, _)| (low..=high).contains(x));
        let label = |(x, k): (f64, i32)| {
            let power = number::power_of_ten(k);
            (
                x,
                if few {
                    number::tick(x, 10f64.powi(k))
                } else {
                    power
                },
            )
        };
        let mut ticks: Vec<(f64, String)> = ticks.map(label).collect();
        if ticks.len() < 2 {
            // An axis this short is nearly linear.
            ticks = Self::linear(low, high).ticks;
        }
        Self {
            kind: Kind::Log,
            low,
            high,
            ticks,
        }
    }

    fn places(names: &[String], (below, above): (f64, f64)) -> Self {
        let ticks = names.iter().enumerate();
        Self {
            kind: Kind::Linear,
            low: -0.5 - below,
            high: names.len() as f64 - 0.5 + above,
            ticks: ticks.map(|(k, name)| (k as f64, name.clone())).collect(),
        }
    }

    /// Length of one position on a categorical axis of this length.
    pub fn step(&self, length: f64) -> f64 {
        length / (self.high - self.low)
    }

    /// Position of a value, from 0 at the low end to 1 at the high end; values outside the axis are placed at its ends.
    pub fn part(&self, value: f64) -> f64 {
        let straight = |value: f64| match self.kind {
            Kind::Linear => value,
            Kind::Log => value.max(self.low).ln(),
        };
        let (low, high) = (straight(self.low), straight(self.high));
        ((straight(value) - low) / (high - low)).clamp(0.0, 1.0)
    }
}

/// The smallest and the largest positive number.
pub fn positive_range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let positive = values.filter(|value| *value > 0.0);
    positive.fold((f64::INFINITY, 0.0), |(low, high), value| {
        (f64::min(low, value), f64::max(high, value))
    })
}

/// Valid ends of a linear axis.
fn widened(low: f64, high: f64) -> (f64, f64) {
    if !(low.is_finite() && high.is_finite()) {
        (0.0, 1.0)
    } else if high - low > 1e-9 * low.abs().max(high.abs()) {
        (low, high)
    } else {
        (low - 0.5, low + 0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_axis_holds_every_value() {
        let scale = Axis::log("").scale([0.008, 4000.0, 0.0, f64::NAN]);
        assert!(scale.low < 0.008 && scale.high > 4000.0);
        assert!(scale.part(0.008) > 0.0 && scale.part(0.0) == 0.0);
        assert!(scale.ticks.iter().any(|(_, label)| label == "0.01"));
        let narrow = Axis::log("").scale([0.3, 4.0]);
        assert!(narrow.low < 0.3 && narrow.high > 4.0);
        assert!(narrow.ticks.iter().any(|(_, label)| label == "0.5"));
    }

    #[test]
    fn a_log_axis_has_two_numbers_at_least_however_short_it_is() {
        for low in [0.0021, 0.3, 1.05, 2e4, 2.1e4, 6e4, 9.7e4] {
            for factor in [1.0, 1.01, 1.3, 2.0, 20.0, 300.0, 1e6] {
                let free = Axis::log("").scale([low, low * factor]);
                let fixed = Axis::log("").between(low, low * factor * 1.001).scale([]);
                for scale in [free, fixed] {
                    let mut labels: Vec<&String> = scale.ticks.iter().map(|tick| &tick.1).collect();
                    labels.sort();
                    labels.dedup();
                    assert!(labels.len() > 1, "{scale:?}");
                    assert_eq!(labels.len(), scale.ticks.len(), "{scale:?}");
                    let ends = scale.low..=scale.high;
                    assert!(scale.ticks.iter().all(|tick| ends.contains(&tick.0)));
                }
            }
        }
    }

    #[test]
    fn axes_of_nothing_are_still_axes() {
        let log = Axis::log("");
        for (axis, values) in [
            (Axis::linear(""), vec![3.0]),
            (Axis::linear(""), vec![f64::INFINITY, f64::NAN]),
            (log.clone(), vec![]),
            (log.clone(), vec![3.0]),
            (log.between(f64::INFINITY, 0.0), vec![]),
            (Axis::linear("").between(0.0, 0.0), vec![]),
        ] {
            let scale = axis.scale(values);
            assert!(
                scale.high > scale.low && scale.part(1.0).is_finite(),
                "{scale:?}"
            );
        }
    }
}
