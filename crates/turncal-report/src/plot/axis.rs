//! Axes: their specification, and the scale with ticks derived from it and the data.

use turncal::number;

/// Maximum number of decades of a logarithmic axis; lower values are drawn at its lower end.
const DECADES: i32 = 10;
/// An axis with fewer decades has ticks at 1, 2 and 5 of each and ends near the data.
const FEW_DECADES: f64 = 2.5;

/// An axis about zero becomes logarithmic if some series reach this many times further than others.
const APART: f64 = 20.0;

/// Scaling of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Kind {
    /// Linear.
    #[default]
    Linear,
    /// Logarithmic.
    Log,
    /// Linear on both sides of zero up to this magnitude, logarithmic beyond.
    Symlog(f64),
}

/// Specification of an axis. Its ends are those of the data unless given.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Axis {
    /// Its title; the panel provides that of the vertical axis.
    pub title: String,
    /// Its scaling.
    pub kind: Kind,
    /// Fixed ends.
    pub ends: Option<(f64, f64)>,
    /// Values to include in addition to the data.
    pub including: Vec<f64>,
    /// Tick spacing, if fixed.
    pub step: Option<f64>,
    /// Margins below and above the data: fractions of their span, factors for a logarithmic axis, positions for an axis
    /// of names.
    pub room: (f64, f64),
    /// Names at 0, 1, 2 … instead of numbers.
    pub places: Vec<String>,
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

    /// An axis that is linear up to this magnitude and logarithmic beyond, symmetric about zero.
    pub fn symlog(linear: f64) -> Self {
        Self::of("", Kind::Symlog(linear))
    }

    /// An axis with a position for each name.
    pub fn places(names: impl IntoIterator<Item = String>) -> Self {
        Self {
            places: names.into_iter().collect(),
            ..Self::default()
        }
    }

    /// Time in a unit from zero, with ticks at whole units or even fractions.
    pub fn time(unit: &str, end: f64) -> Self {
        let steps: &[f64] = match unit {
            "h" => &[0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0, 24.0, 48.0, 96.0],
            _ => &[0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0],
        };
        let step = steps.iter().copied().find(|step| end / step <= 12.0);
        Self {
            step: step.filter(|_| end > 0.0),
            ..Self::linear(&format!("time, {unit}")).between(0.0, end)
        }
    }

    /// An axis that includes zero, and an addition to its title: it is logarithmic on both sides of zero if some series
    /// reach much further than others.
    pub fn about_zero(reaches: impl Iterator<Item = f64>) -> (Self, &'static str) {
        let (least, most) = positive_range(reaches);
        match most > APART * least {
            true => (
                Self::symlog(0.3 * least).room(0.0, 0.5),
                ", logarithmic on both sides",
            ),
            false => (Self::linear("").including([0.0]).room(0.06, 0.06), ""),
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

    /// A tick every `step`.
    pub fn step(mut self, step: f64) -> Self {
        self.step = Some(step);
        self
    }

    /// Sets margins below and above the data.
    pub fn room(mut self, below: f64, above: f64) -> Self {
        self.room = (below, above);
        self
    }

    /// The scale that includes these values.
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
        match self.kind {
            Kind::Linear => {
                let span = high - low;
                Scale::linear(low - below * span, high + above * span, self.step)
            }
            Kind::Log => Scale::log(
                low * (1.0 - below),
                high * (1.0 + above),
                self.ends.is_some(),
            ),
            Kind::Symlog(linear) => {
                Scale::symlog(linear, low.abs().max(high.abs()) * (1.0 + above))
            }
        }
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
    /// Values and their labels, the most important first.
    pub ticks: Vec<(f64, String)>,
}

impl Scale {
    fn linear(low: f64, high: f64, step: Option<f64>) -> Self {
        let (low, high) = widened(low, high);
        let raw = (high - low) / 6.0;
        let power = 10f64.powf(raw.log10().floor());
        let round = [1.0, 2.0, 5.0].into_iter().find(|m| m * power >= raw);
        let step = step.unwrap_or(power * round.unwrap_or(10.0));
        let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
        let values = (first..=last).map(|k| k as f64 * step);
        Self {
            kind: Kind::Linear,
            low,
            high,
            ticks: values.map(|x| (x, number::tick(x, step))).collect(),
        }
    }

    fn log(low: f64, high: f64, fixed: bool) -> Self {
        let (low, high) = match low > 0.0 && high.is_finite() && high >= low {
            true => (low.max(high * 10f64.powi(-DECADES)), high),
            false => (0.1, 10.0),
        };
        let few = (high / low).log10() < FEW_DECADES;
        if few || fixed {
            // Space that keeps a single value off the ends.
            let free = if fixed && high > low { 1.0 } else { 1.15 };
            let (low, high) = (low / free, high * free);
            let decades = decades(low.log10().floor() as i32, high.log10().floor() as i32);
            let of_decade: &[f64] = if few { &[1.0, 2.0, 5.0] } else { &[1.0] };
            let ticks = decades.flat_map(|k| of_decade.iter().map(move |m| (m * 10f64.powi(k), k)));
            let ticks = ticks.filter(|(x, _)| (low..=high).contains(x));
            let label = |(x, k): (f64, i32)| match few {
                true => (x, number::tick(x, 10f64.powi(k))),
                false => (x, number::power_of_ten(k)),
            };
            let mut ticks: Vec<(f64, String)> = ticks.map(label).collect();
            if ticks.len() < 2 {
                // An axis this short is nearly linear.
                ticks = Self::linear(low, high, None).ticks;
            }
            return Self {
                kind: Kind::Log,
                low,
                high,
                ticks,
            };
        }
        let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
        Self {
            kind: Kind::Log,
            low: 10f64.powi(first),
            high: 10f64.powi(last),
            ticks: decades(first, last).map(power).collect(),
        }
    }

    fn symlog(linear: f64, extent: f64) -> Self {
        let linear = if linear.is_finite() && linear > 0.0 {
            linear
        } else {
            1.0
        };
        let extent = if extent.is_finite() { extent } else { 0.0 }.max(4.0 * linear);
        let mut ticks = vec![(0.0, "0".to_owned())];
        let decades = decades(linear.log10().ceil() as i32, extent.log10().floor() as i32);
        let mut beside: Vec<_> = decades.map(power).collect();
        if beside.is_empty() {
            let even = Self::linear(linear, extent, None).ticks;
            beside.extend(even.into_iter().next_back());
        }
        for (value, label) in beside {
            ticks.push((-value, format!("−{label}")));
            ticks.push((value, label));
        }
        Self {
            kind: Kind::Symlog(linear),
            low: -extent,
            high: extent,
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

    /// Position of a value, from 0 at the low to 1 at the high end; values outside are at the end.
    pub fn part(&self, value: f64) -> f64 {
        let straight = |value: f64| match self.kind {
            Kind::Linear => value,
            Kind::Log => value.max(self.low).ln(),
            Kind::Symlog(linear) => (value / linear).asinh(),
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

/// A power of ten with its label.
fn power(exponent: i32) -> (f64, String) {
    (10f64.powi(exponent), number::power_of_ten(exponent))
}

/// Every decade, or every second or third if there are many.
fn decades(first: i32, last: i32) -> impl Iterator<Item = i32> {
    (first..=last).step_by(((last - first) / 5).max(1) as usize)
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
    fn a_symlog_axis_is_odd_and_keeps_small_values_apart() {
        let scale = Axis::symlog(0.3).scale([7000.0]);
        assert_eq!((scale.part(0.0), scale.part(-7000.0)), (0.5, 0.0));
        assert!((scale.part(0.9) + scale.part(-0.9) - 1.0).abs() < 1e-12);
        assert!(scale.part(0.9) > 0.55);
    }

    #[test]
    fn a_log_axis_holds_every_value_and_its_lowest_decade() {
        let scale = Axis::log("").scale([0.02, 4000.0, 0.0, f64::NAN]);
        assert_eq!((scale.low, scale.high), (0.01, 10_000.0));
        assert_eq!((scale.part(0.01), scale.part(0.0)), (0.0, 0.0));
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
                for scale in [free, fixed, Axis::symlog(low).scale([low * factor])] {
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
            (Axis::symlog(0.0), vec![f64::NAN]),
            (Axis::time("h", 0.0), vec![]),
        ] {
            let scale = axis.scale(values);
            assert!(
                scale.high > scale.low && scale.part(1.0).is_finite(),
                "{scale:?}"
            );
        }
    }
}
