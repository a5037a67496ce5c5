//! Selection of the noise sources that the data support, and Fisher scoring of their factors.
//!
//! Source: gradient and expected information of a Gaussian likelihood by its innovations, Gupta and Mehra
//! 1974, "Computational aspects of maximum likelihood estimation and reduction in sensitivity function
//! calculations", IEEE Trans. Automatic Control 19(6); here with differences of whole replays for the
//! sensitivities.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::factors::{Factors, SOURCES, Scale};
use super::likelihood_ratio::limit;
use crate::calibration::{CalibrationError, Gate, Innovation, PassResult, Problem, Script, pass};

/// Prior 1σ of ln σ of a stated figure: a factor of three.
pub const LOG_SIGMA: f64 = 1.098_612_288_668_109_8;
/// False-alarm rate of the screening by scores. The score of a variance is as skewed as χ², so it is only a screening,
/// but it needs no fit.
const SCREEN: f64 = 0.05;
/// Probability of keeping an absent source.
const NEEDLESS: f64 = 0.05;
/// Step for differences: of ln σ or, for a zero variance, of the variance relative to its reference.
const DIFFERENCE: f64 = 1e-3;
/// An unstated variance below this part of its reference counts as zero.
const NOTHING: f64 = 1e-3;
/// A decrease of −2 ln of the likelihood below this counts as converged: a third of a σ of one factor.
pub const SETTLED: f64 = 0.1;
/// Longest step of ln σ.
const LONGEST: f64 = 1.5;
/// A step is abandoned if it does not lower the cost at this fraction.
const SHORTEST: f64 = 0.01;
/// Most steps.
const STEPS: usize = 40;

/// The likelihood of noise at one linearisation point.
pub struct Likelihood<'a> {
    pub problem: &'a Problem<'a>,
    pub script: &'a Script<'a>,
    pub scale: &'a Scale,
    /// Whether each observation of three components is accepted.
    pub accepted: Vec<bool>,
}

/// A point with gradient and expected information of −½ of the deviance, with respect to ln σ of a positive factor, or
/// to the variance over its reference.
pub struct Slope {
    pub here: PassResult,
    pub score: DVector<f64>,
    pub information: DMatrix<f64>,
}

/// The factors of largest posterior density.
#[derive(Debug, Clone)]
pub struct Fit {
    pub factors: Factors,
    /// The sources that differ from the stated noise.
    pub sources: Vec<usize>,
    /// −2 ln of the likelihood of the fit, without the prior of factors.
    pub deviance: f64,
}

impl Likelihood<'_> {
    pub fn replay(&self, factors: &Factors) -> Result<PassResult, CalibrationError> {
        let model = self.scale.apply(factors, &self.problem.model);
        let problem = self.problem.with_model(model);
        pass(&problem, self.script, Gate::As(&self.accepted))
    }

    /// Score and information of these sources from a replay at a point and one more replay per source.
    pub fn slope(
        &self,
        here: PassResult,
        factors: &Factors,
        sources: &[usize],
    ) -> Result<Slope, CalibrationError> {
        let differences = sources.par_iter().map(|&k| {
            let mut moved = *factors;
            moved[k] = match factors[k] {
                0.0 => DIFFERENCE,
                v => v * (2.0 * DIFFERENCE).exp(),
            };
            let there = self.replay(&moved)?;
            Ok(differences(&here, &there))
        });
        let differences: Vec<Vec<(f64, f64)>> =
            differences.collect::<Result<_, CalibrationError>>()?;
        let n = sources.len();
        let score = DVector::from_fn(n, |i, _| {
            let each = here.let_in().flat_map(|of| of.whitened);
            each.zip(&differences[i])
                .map(|(whitened, (variance, innovation))| {
                    0.5 * variance * (whitened.powi(2) - 1.0) - whitened * innovation
                })
                .sum()
        });
        let information = DMatrix::from_fn(n, n, |i, j| {
            let each = differences[i].iter().zip(&differences[j]);
            each.map(|(a, b)| 0.5 * a.0 * b.0 + a.1 * b.1).sum()
        });
        Ok(Slope {
            here,
            score,
            information,
        })
    }

    /// −2 ln of the prior of stated figures.
    fn penalty(&self, factors: &Factors) -> f64 {
        let stated = (0..SOURCES).filter(|&k| self.scale.stated[k]);
        stated
            .map(|k| (0.5 * factors[k].ln() / LOG_SIGMA).powi(2))
            .sum()
    }

    /// The factors of largest posterior density of all sources, starting from those of another linearisation point; as
    /// stated if no score is significant.
    pub fn fit(&self, before: Option<&Fit>) -> Result<Fit, CalibrationError> {
        let present = self.scale.present();
        let stated = self.scale.initial;
        let start = match before {
            Some(before) => before.factors,
            None => {
                let slope = self.slope(self.replay(&stated)?, &stated, &present)?;
                if !self.is_called_for(&slope, &stated, &present) {
                    return Ok(Fit {
                        factors: stated,
                        sources: Vec::new(),
                        deviance: slope.here.deviance(),
                    });
                }
                self.scale.broad()
            }
        };
        let of_before = |k: &usize| before.is_none_or(|before| before.sources.contains(k));
        let mut sources: Vec<usize> = present.into_iter().filter(of_before).collect();
        let (mut factors, mut deviance) = self.settled(&start, &sources)?;
        if before.is_none() {
            sources = self.called_for(&mut factors, &sources)?;
            (factors, deviance) = self.settled(&factors, &sources)?;
        }
        Ok(Fit {
            factors,
            deviance,
            sources,
        })
    }

    /// Selects the sources that the data support, at the factors of largest posterior density; the others get their
    /// stated value, or zero.
    ///
    /// A variance cannot be negative, so a fit of every source gives a small variance to about half of the absent ones,
    /// and their sum makes σ of the parameters too large. The least significant source is removed first, then the next
    /// by the quadratic model of the likelihood.
    fn called_for(
        &self,
        factors: &mut Factors,
        sources: &[usize],
    ) -> Result<Vec<usize>, CalibrationError> {
        let at = *factors;
        let above_zero = sources.iter().copied().filter(|&k| at[k] > 0.0);
        let mut left: Vec<usize> = above_zero.collect();
        let slope = self.slope(self.replay(&at)?, &at, &left)?;
        let slope = slope.with_prior(self.scale, &at, &left);
        let Some(inverse) = slope.information.cholesky().map(|root| root.inverse()) else {
            return Ok(left);
        };
        // How far each variance is from what is stated, in itself; 1σ of one is twice that of ln σ.
        let stated = |k: usize| self.scale.stated[k];
        let mut values = DVector::from_fn(left.len(), |i, _| {
            if stated(left[i]) {
                at[left[i]].ln()
            } else {
                1.0
            }
        });
        let mut covariance = inverse * 4.0;
        let limits = [limit(0, 1, NEEDLESS), limit(1, 0, NEEDLESS)];
        loop {
            // Over its limit.
            let part = |i: &usize| {
                let stated = stated(left[*i]);
                let value = if stated || values[*i] > 0.0 {
                    values[*i]
                } else {
                    0.0
                };
                value.powi(2) / covariance[(*i, *i)] / limits[usize::from(stated)]
            };
            let least = (0..left.len()).min_by(|i, j| part(i).total_cmp(&part(j)));
            let Some(least) = least.filter(|least| part(least) < 1.0) else {
                return Ok(left);
            };
            let variance = covariance[(least, least)];
            let column = covariance.column(least) / variance;
            let value = values[least];
            values -= &column * value;
            covariance -= &column * column.transpose() * variance;
            values = values.remove_row(least);
            covariance = covariance.remove_row(least).remove_column(least);
            let source = left.remove(least);
            factors[source] = if stated(source) { 1.0 } else { 0.0 };
        }
    }

    /// Whether the score of any source is significant; a zero variance with a negative score is not.
    fn is_called_for(&self, slope: &Slope, stated: &Factors, present: &[usize]) -> bool {
        present.iter().enumerate().any(|(i, &k)| {
            let one_sided = usize::from(stated[k] == 0.0);
            let limit = limit(1 - one_sided, one_sided, SCREEN / present.len() as f64);
            let (score, information) = (slope.score[i], slope.information[(i, i)]);
            let rises = score > 0.0 || one_sided == 0;
            rises && information > 0.0 && score.powi(2) / information > limit
        })
    }

    /// The factors of largest posterior density of these sources, with the others fixed, and −2 ln of the likelihood
    /// there.
    ///
    /// A variance that is zero and would become negative is kept at zero until the others have converged; then each is
    /// tested again.
    fn settled(
        &self,
        start: &Factors,
        sources: &[usize],
    ) -> Result<(Factors, f64), CalibrationError> {
        let mut at = *start;
        let mut resting: Vec<usize> = Vec::new();
        let mut looked_again = false;
        let mut here = self.replay(start)?;
        let mut deviance = here.deviance();
        for _ in 0..STEPS {
            let moving = sources.iter().filter(|k| !resting.contains(k));
            let moving: Vec<usize> = moving.copied().collect();
            let slope = self.slope(here, &at, &moving)?;
            let slope = slope.with_prior(self.scale, &at, &moving);
            let cost = deviance + self.penalty(&at);
            let (free, rests): (Vec<usize>, Vec<usize>) =
                (0..moving.len()).partition(|&i| at[moving[i]] > 0.0 || slope.score[i] > 0.0);
            resting.extend(rests.iter().map(|&i| moving[i]));
            let of_free = slope.score.select_rows(&free);
            let information = slope.information.select_rows(&free).select_columns(&free);
            let Some(step) = solve(information, &of_free) else {
                break;
            };
            if of_free.dot(&step) < SETTLED {
                if resting.is_empty() || looked_again {
                    break;
                }
                looked_again = true;
                resting.clear();
                here = slope.here;
                continue;
            }
            let free: Vec<usize> = free.iter().map(|&i| moving[i]).collect();
            let Some(there) = self.shortened(&at, &free, &step, cost) else {
                break;
            };
            (at, here) = there;
            deviance = here.deviance();
        }
        Ok((at, deviance))
    }

    /// The point at the longest fraction of a step that lowers the cost; `None` if there is no such step.
    fn shortened(
        &self,
        at: &Factors,
        free: &[usize],
        step: &DVector<f64>,
        cost: f64,
    ) -> Option<(Factors, PassResult)> {
        let mut fraction = 1.0;
        while fraction > SHORTEST {
            let mut there = *at;
            for (&k, step) in free.iter().zip(step) {
                let v = &mut there[k];
                if *v > 0.0 {
                    *v *= (2.0 * (fraction * step).clamp(-LONGEST, LONGEST)).exp();
                    if *v < NOTHING && !self.scale.stated[k] {
                        *v = 0.0;
                    }
                } else if *step > 0.0 {
                    *v = (fraction * step).clamp(2.0 * NOTHING, (2.0 * LONGEST).exp());
                }
            }
            // Noise that the filter cannot run with is too far.
            if let Ok(replay) = self.replay(&there)
                && replay.deviance() + self.penalty(&there) < cost
            {
                return Some((there, replay));
            }
            fraction *= 0.5;
        }
        None
    }

    /// Posterior 1σ of ln σ of each positive factor, and of the variance relative to its reference of each zero
    /// factor.
    pub fn sigma(
        &self,
        factors: &Factors,
        sources: &[usize],
    ) -> Result<Vec<Option<f64>>, CalibrationError> {
        let slope = self.slope(self.replay(factors)?, factors, sources)?;
        let slope = slope.with_prior(self.scale, factors, sources);
        // None where the data do not show all of them.
        let covariance = slope.information.cholesky().map(|root| root.inverse());
        let sigma = |i: usize| covariance.as_ref().map(|of| of[(i, i)].sqrt());
        Ok((0..sources.len()).map(sigma).collect())
    }
}

/// Derivatives with respect to a factor from two passes, for each accepted scalar: of ln of its variance, and of its
/// normalised innovation.
fn differences(here: &PassResult, there: &PassResult) -> Vec<(f64, f64)> {
    let scalars = |of: &Innovation| [0, 1, 2].map(|k| (of.whitened[k], of.sigma[k]));
    let here = here.let_in().flat_map(scalars);
    let pairs = here.zip(there.let_in().flat_map(scalars));
    let each = pairs.map(|((one, sigma), (other, there))| {
        let change = other * (there / sigma) - one;
        (2.0 * (there / sigma).ln() / DIFFERENCE, change / DIFFERENCE)
    });
    each.collect()
}

/// The solution of `information · step = score`, without a step in directions without information.
fn solve(mut information: DMatrix<f64>, score: &DVector<f64>) -> Option<DVector<f64>> {
    for i in 0..information.nrows() {
        information[(i, i)] += f64::EPSILON.sqrt() * (1.0 + information[(i, i)]);
    }
    Some(information.cholesky()?.solve(score))
}

impl Slope {
    /// Adds the prior of stated figures.
    fn with_prior(mut self, scale: &Scale, at: &Factors, sources: &[usize]) -> Self {
        for (i, &k) in sources
            .iter()
            .enumerate()
            .filter(|(_, k)| scale.stated[**k])
        {
            self.score[i] -= 0.5 * at[k].ln() / LOG_SIGMA.powi(2);
            self.information[(i, i)] += LOG_SIGMA.powi(-2);
        }
        self
    }
}
