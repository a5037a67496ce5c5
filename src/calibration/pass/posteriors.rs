//! What is known of the constants as dwells go by.

use crate::calibration::checks::dwell_scatter::Posterior;

/// So many are kept at least once there are as many: a dwell that tells a smaller part of all says little by
/// itself, and with its neighbours as much.
const FEWEST: usize = 256;

/// What is known of the constants before the first dwell and after each; where there are very many, after each
/// so many, and after the last.
#[derive(Debug, Clone)]
pub struct Posteriors {
    kept: Vec<Posterior>,
    /// Of the last dwell, where it is not kept.
    last: Option<Posterior>,
    dwells: usize,
    together: usize,
}

impl Default for Posteriors {
    fn default() -> Self {
        Self {
            kept: Vec::new(),
            last: None,
            dwells: 0,
            together: 1,
        }
    }
}

impl Posteriors {
    /// Before the first dwell.
    pub fn begin(&mut self, prior: Posterior) {
        self.kept.push(prior);
    }

    /// Number of dwells so far.
    pub fn dwells(&self) -> usize {
        self.dwells
    }

    /// After one more dwell.
    pub fn after_dwell(&mut self, posterior: Posterior) {
        self.dwells += 1;
        if !self.dwells.is_multiple_of(self.together) {
            self.last = Some(posterior);
            return;
        }
        self.last = None;
        self.kept.push(posterior);
        // The prior is first.
        if self.kept.len() > 2 * FEWEST {
            let mut number = 0..self.kept.len();
            self.kept
                .retain(|_| number.next().is_some_and(|n| n.is_multiple_of(2)));
            self.together *= 2;
        }
    }

    /// All that are kept, in order.
    pub fn finish(mut self) -> Vec<Posterior> {
        self.kept.extend(self.last);
        self.kept
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    #[test]
    fn few_dwells_are_all_kept_and_of_many_each_so_many_and_the_last() {
        let posterior = |n: usize| Posterior {
            mean: DVector::repeat(1, n as f64),
            covariance: DMatrix::identity(1, 1),
        };
        let kept = |dwells: usize| {
            let mut posteriors = Posteriors::default();
            posteriors.begin(posterior(0));
            (1..=dwells).for_each(|n| posteriors.after_dwell(posterior(n)));
            assert_eq!(posteriors.dwells(), dwells);
            let of = posteriors.finish().into_iter();
            of.map(|posterior| posterior.mean[0] as usize)
                .collect::<Vec<_>>()
        };
        assert_eq!(kept(500), (0..=500).collect::<Vec<_>>());
        assert_eq!(kept(512), (0..=512).step_by(2).collect::<Vec<_>>());
        let many: Vec<_> = (0..=5000).step_by(16).chain([5001]).collect();
        assert_eq!(kept(5001), many);
    }
}
