//! What a design aims at: σ of groups of parameters relative to σ that are wanted.

use crate::calibration::{Estimate, Group, ParameterVector};
use crate::lot::Specification;

/// Power of the mean of the ratios: large enough that the worst decides.
const POWER: i32 = 16;
/// A ratio whose square is below this gains little from a better path.
const ENOUGH: f64 = 0.1;

/// Parameters with the RMS σ that is wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    pub parameters: Vec<usize>,
    pub sigma: f64,
}

/// All goals.
#[derive(Debug, Clone, PartialEq)]
pub struct Goals(pub Vec<Goal>);

impl Goals {
    /// The best σ of each group that any of these estimates has.
    pub fn of_best(estimates: &[Estimate]) -> Self {
        let goal = |group: Group| {
            let of_group = |estimate: &Estimate| {
                let parameters = group.estimated(estimate);
                let sigma = rms(&parameters, &estimate.sigma());
                (!parameters.is_empty()).then_some(Goal { parameters, sigma })
            };
            let all = estimates.iter().filter_map(of_group);
            all.min_by(|a, b| a.sigma.total_cmp(&b.sigma))
        };
        Self(Group::all().filter_map(goal).collect())
    }

    /// The σ that decide every limit on an estimated parameter.
    pub fn of_limits(specification: &Specification, estimate: &Estimate) -> Self {
        let sigma = estimate.sigma();
        let limits = specification.limits.iter();
        let limits = limits.filter(|limit| sigma[limit.parameter] > 0.0);
        let goal = |(parameter, within)| Goal {
            parameters: vec![parameter],
            sigma: specification.deciding_sigma(within),
        };
        let limits = limits.map(|limit| (limit.parameter, limit.within));
        Self(limits.map(goal).collect())
    }

    /// σ over the σ wanted.
    fn ratios<'a>(&'a self, sigma: &'a ParameterVector) -> impl Iterator<Item = f64> + 'a {
        let goals = self.0.iter();
        goals.map(|goal| rms(&goal.parameters, sigma) / goal.sigma)
    }

    /// The largest ratio.
    pub fn worst(&self, sigma: &ParameterVector) -> f64 {
        self.ratios(sigma).fold(0.0, f64::max)
    }

    /// A mean of the ratios in which the largest count most.
    pub fn cost(&self, sigma: &ParameterVector) -> f64 {
        let sum: f64 = self.ratios(sigma).map(|ratio| ratio.powi(POWER)).sum();
        (sum / self.0.len().max(1) as f64).powf(f64::from(POWER).recip())
    }

    /// Logarithm of all ratios, for paths that are far from the goals.
    pub fn distance(&self, sigma: &ParameterVector) -> f64 {
        let ratios = self.ratios(sigma);
        ratios.map(|ratio| (ratio * ratio + ENOUGH).ln()).sum()
    }

    /// The goals for σ that are in error by the same factors as `approximate`.
    pub fn corrected(&self, approximate: &ParameterVector, exact: &ParameterVector) -> Self {
        let goals = self.0.iter().map(|goal| {
            let [approximate, exact] = [approximate, exact].map(|of| rms(&goal.parameters, of));
            Goal {
                sigma: goal.sigma * approximate / exact,
                ..goal.clone()
            }
        });
        Self(goals.collect())
    }
}

fn rms(parameters: &[usize], sigma: &ParameterVector) -> f64 {
    let squares: f64 = parameters.iter().map(|&k| sigma[k].powi(2)).sum();
    (squares / parameters.len().max(1) as f64).sqrt()
}
