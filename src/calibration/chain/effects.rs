//! Effects that drive the chain, and the sizes that scale them.

use std::collections::BTreeMap;

use crate::calibration::budget::source::BudgetSource;
use crate::calibration::{Group, Problem, Source};

/// An effect that drives the states of the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effect {
    /// Noise of a source; its size is estimated.
    Noise(Source),
    /// Differences between recordings; their size is estimated.
    Difference(Group),
    /// A slip: a rotation in a move that remains afterwards.
    Slip(Slip),
    /// An effect of stated size.
    Stated(BudgetSource),
}

/// The object that slips in a move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Slip {
    /// The instrument on the table.
    Mount,
    /// The table on the ground.
    Base,
}

impl Effect {
    /// Whether single events of this effect (moves, position errors, bias steps and slips) may be far larger than the
    /// others.
    pub fn has_heavy_tails(self) -> bool {
        match self {
            Self::Slip(_) => true,
            Self::Noise(source) => matches!(
                source,
                Source::GyroMotion
                    | Source::AccelMotion
                    | Source::TablePosition
                    | Source::GyroGaussMarkov
                    | Source::AccelGaussMarkov
                    | Source::MagneticDisturbance
            ),
            Self::Difference(_) | Self::Stated(_) => false,
        }
    }

    /// Source in the uncertainty budget.
    pub fn in_budget(self) -> BudgetSource {
        match self {
            Self::Noise(source) => source.in_budget(),
            Self::Difference(_) => BudgetSource::Recording,
            Self::Slip(_) => BudgetSource::Slips,
            Self::Stated(source) => source,
        }
    }
}

/// Variance of each effect, relative to the variance with which the links were made, and of each single event, relative
/// to its effect.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sizes {
    effects: BTreeMap<Effect, f64>,
    events: BTreeMap<(Effect, usize), f64>,
}

impl Sizes {
    /// A copy in which an effect has a different variance.
    pub fn with(mut self, effect: Effect, factor: f64) -> Self {
        self.effects.insert(effect, factor);
        self
    }

    /// A copy in which an event has a different variance.
    pub fn with_event(mut self, effect: Effect, event: usize, factor: f64) -> Self {
        self.events.insert((effect, event), factor);
        self
    }

    /// The variance factor of an event.
    pub fn of(&self, effect: Effect, event: usize) -> f64 {
        let of_effect = self.effects.get(&effect).copied().unwrap_or(1.0);
        of_effect * self.of_event(effect, event)
    }

    /// The variance factor of an event, divided by that of its effect.
    pub fn of_event(&self, effect: Effect, event: usize) -> f64 {
        self.events.get(&(effect, event)).copied().unwrap_or(1.0)
    }

    /// The events.
    pub fn events(&self) -> impl Iterator<Item = ((Effect, usize), f64)> + '_ {
        self.events.iter().map(|(&event, &factor)| (event, factor))
    }

    /// A copy with the variance of each event of an effect multiplied by a factor.
    pub fn scaled(mut self, effect: Effect, factor: f64) -> Self {
        let events = self.events.iter_mut().filter(|((of, _), _)| *of == effect);
        events.for_each(|(_, variance)| *variance *= factor);
        self
    }

    /// A copy in which every effect has the size with which the links were made.
    pub fn of_events_alone(&self) -> Self {
        Self {
            effects: BTreeMap::new(),
            events: self.events.clone(),
        }
    }
}

/// Variance of the noise at rest in each dwell, relative to that of all dwells.
///
/// With this factor, a dwell with more motion than the others does not increase the noise of the others: with an
/// inverse-gamma prior for the variance, the noise of a dwell follows Student's t distribution (Lange, Little, Taylor
/// 1989, J. Am. Stat. Assoc. 84(408)).
#[derive(Debug, Clone, PartialEq)]
pub struct Dispersion(Vec<f64>);

impl Dispersion {
    /// All dwells alike.
    pub fn alike(problem: &Problem) -> Self {
        Self(vec![1.0; problem.dwells().count()])
    }

    /// Dispersion from these factors, divided by the factor of the median dwell; also returns this factor.
    pub fn of_dwells(mut factors: Vec<f64>) -> (Self, f64) {
        let middle = crate::statistics::median(&mut factors.clone()).unwrap_or(1.0);
        factors.iter_mut().for_each(|factor| *factor /= middle);
        (Self(factors), middle)
    }

    /// The variance factor of a dwell.
    pub fn of(&self, dwell: usize) -> f64 {
        self.0.get(dwell).copied().unwrap_or(1.0)
    }
}
