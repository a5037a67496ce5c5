//! Estimation of the sizes of the effects between dwells by restricted likelihood, with a prior for each size.

use std::collections::BTreeMap;

use nalgebra::DVector;

use super::usual::Usual;
use crate::calibration::chain::{Chain, Effect, Filtered, Moments, Sizes, Smoothed};
use crate::calibration::constants::Sites;
use crate::calibration::{CalibrationError, Known, Posterior, Prior};

/// Degrees of freedom of the distribution of single events (Student's t).
pub const FREEDOM: f64 = 6.0;
/// Maximum number of steps.
const STEPS: usize = 40;
/// A step is abandoned if it does not lower the cost even at this fraction.
const SHORTEST: f64 = 0.05;
/// The descent ends if −2 ln of the density decreases by less than this.
const SETTLED: f64 = 0.05;
/// Longest step of the logarithm of a σ.
const LONGEST: f64 = 1.0;

/// Sizes of effects and of single events.
#[derive(Debug, Clone)]
pub struct At {
    /// Logarithms of σ divided by the usual σ with which the links were made.
    pub logs: DVector<f64>,
    /// Variances of single events, divided by the variances of their effects.
    pub events: Sizes,
}

/// A point with its cost.
pub struct Here<'a> {
    pub at: At,
    pub known: Known,
    filtered: Filtered<'a>,
    posterior: Posterior,
    /// −2 ln of the restricted likelihood and of the priors of the sizes.
    cost: f64,
}

/// A chain whose sizes are estimated.
pub struct Search<'a> {
    pub chain: &'a Chain,
    pub prior: &'a Prior,
    /// Effects whose sizes are estimated, with the usual sizes with which the links were made.
    pub usual: &'a [Usual],
}

impl<'a> Search<'a> {
    /// Variances, divided by the variances with which the links were made.
    pub fn sizes(&self, at: &At) -> Sizes {
        let pairs = self.usual.iter().zip(&at.logs);
        pairs.fold(at.events.clone(), |sizes, (of, by)| match of.effect() {
            Some(effect) => sizes.with(effect, (2.0 * by).exp()),
            None => sizes,
        })
    }

    fn here(&self, at: At, sites: &Sites) -> Result<Here<'a>, CalibrationError> {
        let filtered = self.chain.filter(&self.sizes(&at))?;
        let known = filtered.known(self.prior);
        let undetermined = CalibrationError::Diverged {
            time: self.chain.links.last().map_or(0.0, |link| link.time),
        };
        let posterior = filtered
            .posterior_with(&known, sites)
            .filter(|posterior| posterior.deviance.is_finite())
            .ok_or(undetermined)?;
        let of_logs = self.usual.iter().zip(&at.logs);
        let of_logs: f64 = of_logs.map(|(of, by)| (by / of.spread).powi(2)).sum();
        // The prior term of an inverse-gamma distribution of the variance; normal draws then follow Student's t.
        let of_events: f64 = at
            .events
            .events()
            .map(|(_, factor)| FREEDOM * (factor.ln() + factor.recip() - 1.0))
            .sum();
        Ok(Here {
            cost: posterior.deviance + of_logs + of_events,
            at,
            known,
            filtered,
            posterior,
        })
    }

    /// The most likely sizes, found from a start with these normal priors (`sites`) of the constants that may be
    /// absent.
    ///
    /// One forward and one backward pass give the cost, the gradient and the most likely variance of each event
    /// (Koopman and Shephard 1992). Each event of an effect with heavy tails has its own variance, so that an unusually
    /// large event does not increase the σ of all events (Lange, Little, Taylor 1989, J. Am. Stat. Assoc. 84(408)).
    /// Each step lowers the cost.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Diverged`] if a covariance is not positive definite.
    pub fn likeliest(&self, start: At, sites: &Sites) -> Result<Here<'a>, CalibrationError> {
        let mut here = self.here(start, sites)?;
        for _ in 0..STEPS {
            let next = self.next(&here);
            let fractions = std::iter::successors(Some(1.0), |of| Some(0.5 * of));
            let mut shorter = fractions.take_while(|&of| of > SHORTEST);
            let lower = shorter.find_map(|fraction| {
                let there = self.here(here.at.towards(&next, fraction), sites).ok()?;
                (there.cost < here.cost).then_some(there)
            });
            let Some(there) = lower else {
                break;
            };
            let fall = here.cost - there.cost;
            here = there;
            if fall < SETTLED {
                break;
            }
        }
        Ok(here)
    }

    /// A step of Fisher scoring for the sizes of effects, and the variance factor of each event.
    fn next(&self, here: &Here) -> At {
        let smoothed = here.smoothed();
        let by_effect = smoothed.by_effect();
        let mut at = here.at.clone();
        for (k, of) in self.usual.iter().enumerate() {
            let moments = of.effect().and_then(|effect| by_effect.get(&effect));
            let Moments {
                slope, curvature, ..
            } = moments.copied().unwrap_or_default();
            let of_prior = of.spread.powi(-2);
            let step = -2.0 * (slope + at.logs[k] * of_prior) / (curvature + 2.0 * of_prior);
            at.logs[k] += step.clamp(-LONGEST, LONGEST);
        }
        let mut events = at.events.of_events_alone();
        for (&(effect, event), moments) in &smoothed.0 {
            if effect.has_heavy_tails() {
                // The part of an event that the data do not determine gives no information on its size.
                let squares = moments.squares * at.events.of_event(effect, event);
                let known = moments.count - moments.unknown;
                let factor = (FREEDOM + squares) / (FREEDOM + known);
                events = events.with_event(effect, event, factor);
            }
        }
        at.events = events;
        at
    }
}

impl Here<'_> {
    fn smoothed(&self) -> Smoothed {
        self.filtered.smoothed(&self.posterior)
    }

    /// 1σ of the log size of each effect.
    pub fn sigma(&self, usual: &[Usual]) -> DVector<f64> {
        let by_effect = self.smoothed().by_effect();
        DVector::from_iterator(
            usual.len(),
            usual.iter().map(|of| {
                let moments = of.effect().and_then(|effect| by_effect.get(&effect));
                let curvature = moments.map_or(0.0, |moments| moments.curvature);
                (0.5 * curvature + of.spread.powi(-2)).sqrt().recip()
            }),
        )
    }
}

impl At {
    /// The usual sizes, with slips as large as position errors. The search thus first tries a slip that explains as
    /// much as all later positions, and reduces the size if slips are not needed (graduated non-convexity: Blake and
    /// Zisserman, *Visual Reconstruction*, ch. 7).
    pub fn usual(usual: &[Usual], chain: &Chain) -> Self {
        let drives = chain.links.iter().flat_map(|link| &link.transition.drives);
        let slips = drives.filter(|drive| matches!(drive.effect, Effect::Slip(_)));
        Self {
            logs: DVector::zeros(usual.len()),
            events: slips.fold(Sizes::default(), |sizes, drive| {
                sizes.with_event(drive.effect, drive.event, chain.slip.powi(-2))
            }),
        }
    }

    /// The point a fraction of the way to another.
    fn towards(&self, other: &Self, fraction: f64) -> Self {
        let between = |(event, to): ((Effect, usize), f64)| {
            let from: f64 = self.events.of_event(event.0, event.1);
            (event, from.powf(1.0 - fraction) * to.powf(fraction))
        };
        let events: BTreeMap<_, _> = other.events.events().map(between).collect();
        Self {
            logs: &self.logs * (1.0 - fraction) + &other.logs * fraction,
            events: events
                .into_iter()
                .fold(Sizes::default(), |sizes, (of, factor)| {
                    sizes.with_event(of.0, of.1, factor)
                }),
        }
    }
}
