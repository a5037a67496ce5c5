//! What a design aims at: σ of groups of parameters relative to σ that are wanted.

use super::expected::{ByTerms, Sigma};
use crate::calibration::{Estimate, Group, ParameterVector, Terms};
use crate::lot::Specification;

/// Power of the mean of the ratios: large enough that the worst decides.
const POWER: i32 = 16;
/// A ratio whose square is below this gains little from a better path.
const ENOUGH: f64 = 0.1;

/// Parameters of an instrument, with the desired RMS σ.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    pub terms: Terms,
    pub parameters: Vec<usize>,
    pub sigma: f64,
    /// For σ of joined legs.
    correction: Correction,
}

/// Exact σ divided by σ of joined legs, against the duration of the dwells: `factor · (dwell / at)^power`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Correction {
    factor: f64,
    at: f64,
    power: f64,
}

/// All goals.
#[derive(Debug, Clone, PartialEq)]
pub struct Goals(pub Vec<Goal>);

/// σ of a path with dwells of this duration in s.
#[derive(Debug, Clone)]
pub struct Compared {
    pub dwell: f64,
    pub joined: Sigma,
    pub exact: Sigma,
}

impl Goal {
    fn new(terms: Terms, parameters: Vec<usize>, sigma: f64) -> Self {
        let correction = Correction {
            factor: 1.0,
            at: 1.0,
            power: 0.0,
        };
        Self {
            terms,
            parameters,
            sigma,
            correction,
        }
    }

    /// RMS σ, if these terms are considered.
    fn rms(&self, sigma: &Sigma) -> Option<f64> {
        Some(rms(&self.parameters, sigma.of(self.terms)?))
    }

    /// The correction that follows from σ with two durations of the dwells.
    fn correction(&self, [near, far]: &[Compared; 2]) -> Option<Correction> {
        let ratio = |of: &Compared| Some(self.rms(&of.exact)? / self.rms(&of.joined)?);
        let factor = ratio(near)?;
        Some(Correction {
            factor,
            at: near.dwell,
            power: (ratio(far)? / factor).ln() / (far.dwell / near.dwell).ln(),
        })
    }
}

impl Goals {
    /// The best σ of each group that any of these paths has, without and with the error terms that may be absent.
    pub fn of_best(paths: &[ByTerms<Estimate>]) -> Self {
        let goal = |terms: Terms, group: Group| {
            let of_group = |path: &ByTerms<Estimate>| {
                let estimate = path.of(terms)?;
                let parameters = group.estimated(estimate);
                let sigma = rms(&parameters, &estimate.sigma());
                (!parameters.is_empty()).then(|| Goal::new(terms, parameters, sigma))
            };
            let all = paths.iter().filter_map(of_group);
            all.min_by(|a, b| a.sigma.total_cmp(&b.sigma))
        };
        let both = [Terms::None, Terms::All].into_iter();
        Self(
            both.flat_map(|terms| Group::all().filter_map(move |group| goal(terms, group)))
                .collect(),
        )
    }

    /// The σ that decide every limit on an estimated parameter.
    pub fn of_limits(specification: &Specification, estimate: &Estimate) -> Self {
        let sigma = estimate.sigma();
        let limits = specification.limits.iter();
        let limits = limits.filter(|limit| sigma[limit.parameter] > 0.0);
        let goal = |(parameter, within)| {
            let sigma = specification.deciding_sigma(within);
            Goal::new(Terms::None, vec![parameter], sigma)
        };
        let limits = limits.map(|limit| (limit.parameter, limit.within));
        Self(limits.map(goal).collect())
    }

    /// σ divided by the desired σ, for dwells of this duration in s.
    fn ratios<'a>(&'a self, sigma: &'a Sigma, dwell: f64) -> impl Iterator<Item = f64> + 'a {
        self.0.iter().filter_map(move |goal| {
            let Correction { factor, at, power } = goal.correction;
            Some(goal.rms(sigma)? / goal.sigma * factor * (dwell / at).powf(power))
        })
    }

    /// The largest ratio.
    pub fn worst(&self, sigma: &Sigma, dwell: f64) -> f64 {
        self.ratios(sigma, dwell).fold(0.0, f64::max)
    }

    /// A mean of the ratios in which the largest count most.
    pub fn cost(&self, sigma: &Sigma, dwell: f64) -> f64 {
        let ratios = self.ratios(sigma, dwell);
        let sum: f64 = ratios.map(|ratio| ratio.powi(POWER)).sum();
        (sum / self.0.len().max(1) as f64).powf(f64::from(POWER).recip())
    }

    /// Logarithm of all ratios, for paths that are far from the goals.
    pub fn distance(&self, sigma: &Sigma, dwell: f64) -> f64 {
        let ratios = self.ratios(sigma, dwell);
        ratios.map(|ratio| (ratio * ratio + ENOUGH).ln()).sum()
    }

    /// The goals for σ of joined legs with errors as those of a path with two durations of its dwells. Joined legs
    /// lose a part of every dwell at its ends; in fact this part does not grow with the dwell.
    pub fn corrected(&self, by: &[Compared; 2]) -> Self {
        let goals = self.0.iter().map(|goal| Goal {
            correction: goal.correction(by).unwrap_or(goal.correction),
            ..goal.clone()
        });
        Self(goals.collect())
    }
}

fn rms(parameters: &[usize], sigma: &ParameterVector) -> f64 {
    let squares: f64 = parameters.iter().map(|&k| sigma[k].powi(2)).sum();
    (squares / parameters.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::expected::{along, expected};
    use super::super::legs::Legs;
    use super::super::machine::Machine;
    use super::super::turn::Turn;
    use super::*;
    use crate::study::path::{Named, PathStudy};

    /// Corrected for dwells of 15 s and 21 s, the σ of joined legs are right for dwells of 30 s. A gyro of this instrument
    /// loses seconds at the ends of every dwell, whose duration does not matter.
    #[test]
    fn corrected_sigma_are_right_for_other_dwells() {
        let mut setting = PathStudy::setting(&Named::default()).unwrap();
        setting.options.auto_terms = false;
        let table = setting.scenario.table.clone();
        let machine = Machine::Table(&table);
        let all = machine.turns();
        let turns: Vec<Turn> = (0..14).map(|k| all[7 * k % all.len()].clone()).collect();
        let study = |dwell| along(&setting, machine.path(&machine.start(), &turns, dwell)).unwrap();
        let mut legs = Legs::new(machine, &study(15.0)).unwrap();
        legs.make([&turns[..]].into_iter()).unwrap();
        let compared = |dwell| Compared {
            dwell,
            joined: legs.sigma(&turns, dwell).unwrap(),
            exact: expected(&study(dwell)).unwrap().sigma(),
        };
        let goals = Goals::of_best(&[expected(&study(30.0)).unwrap()]);
        let corrected = goals.corrected(&[compared(15.0), compared(21.0)]);
        let joined = legs.sigma(&turns, 30.0).unwrap();
        let right: Vec<f64> = corrected.ratios(&joined, 30.0).collect();
        for (goal, ratio) in goals.0.iter().zip(&right) {
            assert!((ratio - 1.0).abs() < 0.03, "{goal:?}: {ratio}");
        }
        // With the correction of the shorter dwells.
        let wrong: Vec<f64> = corrected.ratios(&joined, 15.0).collect();
        assert!(wrong.iter().any(|ratio| *ratio > 1.05), "{wrong:?}");
    }
}
