//! Effects: what drives the chain, and the sizes that scale it.

use std::collections::BTreeMap;

use crate::calibration::Source;
use crate::calibration::budget::source::BudgetSource;

/// What drives the states of the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effect {
    /// Noise whose size is estimated.
    Noise(Source),
    /// A turn in a move that stays from then on.
    Slip(Slip),
    /// Something of a stated size.
    Stated(BudgetSource),
}

/// What slips in a move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Slip {
    /// The instrument on the table.
    Mount,
    /// The table on the ground.
    Base,
}

impl Effect {
    /// Whether single events may be far larger than the others: moves, positions, slips.
    pub fn has_heavy_tails(self) -> bool {
        match self {
            Self::Slip(_) => true,
            Self::Noise(source) => matches!(
                source,
                Source::GyroMotion | Source::AccelMotion | Source::TablePosition
            ),
            Self::Stated(_) => false,
        }
    }
}

/// A change of ln of the variance of a single event by less than this has settled.
const SETTLED: f64 = 0.05;

/// Variance of each effect over that with which the links were made, and of single events over that of their effect.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sizes {
    effects: BTreeMap<Effect, f64>,
    events: BTreeMap<(Effect, usize), f64>,
}

impl Sizes {
    /// The same with another variance of an effect.
    pub fn with(mut self, effect: Effect, factor: f64) -> Self {
        self.effects.insert(effect, factor);
        self
    }

    /// The same with another variance of an event.
    pub fn with_event(mut self, effect: Effect, event: usize, factor: f64) -> Self {
        self.events.insert((effect, event), factor);
        self
    }

    /// The factor of an event.
    pub fn of(&self, effect: Effect, event: usize) -> f64 {
        self.of_effect(effect) * self.of_event(effect, event)
    }

    /// The factor of an effect.
    pub fn of_effect(&self, effect: Effect) -> f64 {
        self.effects.get(&effect).copied().unwrap_or(1.0)
    }

    /// The factor of an event over that of its effect.
    pub fn of_event(&self, effect: Effect, event: usize) -> f64 {
        self.events.get(&(effect, event)).copied().unwrap_or(1.0)
    }

    /// Whether the events are as large as those of others.
    pub fn is_like(&self, other: &Self) -> bool {
        let changed = |(&(effect, event), factor): (&(Effect, usize), &f64)| {
            (factor / other.of_event(effect, event)).ln().abs() > SETTLED
        };
        !self.events.iter().any(changed)
    }

    /// The events.
    pub fn events(&self) -> impl Iterator<Item = ((Effect, usize), f64)> + '_ {
        self.events.iter().map(|(&event, &factor)| (event, factor))
    }
}
