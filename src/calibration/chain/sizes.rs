//! Sizes of the effects between dwells, by restricted likelihood with a prior each.

use nalgebra::{DMatrix, DVector};

use super::descent::{Slope, descend};
use super::links::SLIP;
use super::usual::Usual;
use super::{Chain, Effect, Sizes};
use crate::calibration::{CalibrationError, Prior};

/// Degrees of freedom of the distribution of single events (Student's t).
const FREEDOM: f64 = 6.0;
/// Most rounds of sizes of effects and of single events.
const ROUNDS: usize = 8;
/// A change of ln of the size of every effect by less than this has settled.
const SETTLED: f64 = 0.05;

/// The likeliest sizes of effects and of single events.
pub struct Likeliest {
    /// Logarithms of σ over the usual ones, with which the links were made.
    pub logs: DVector<f64>,
    pub sizes: Sizes,
}

/// The likeliest sizes of effects, beginning at these logarithms, and of single events of those with heavy tails.
///
/// The gradient of the likelihood is that of the disturbances given all data, so one pass forward and backward gives
/// cost and gradient. An event of an effect with heavy tails has a variance of its own, so that one that is larger than
/// the others stands out instead of widening all (Lange, Little, Taylor 1989, J. Am. Stat. Assoc. 84(408)).
///
/// # Errors
/// [`CalibrationError::Diverged`] if a covariance is not positive definite.
pub fn likeliest(
    chain: &Chain,
    prior: &Prior,
    usual: &[Usual],
    start: DVector<f64>,
) -> Result<Likeliest, CalibrationError> {
    let mut events = chain.slips_first();
    let mut at = start;
    for _ in 0..ROUNDS {
        // Events first: the sizes that all share are not to grow for a single one.
        for _ in 0..ROUNDS {
            let next = of_events(chain, prior, &sizes(usual, &at, &events))?;
            let is_settled = next.is_like(&events);
            events = next;
            if is_settled {
                break;
            }
        }
        let next = of_effects(chain, prior, usual, &events, at.clone())?;
        let change = (&next - &at).amax();
        at = next;
        if change < SETTLED {
            break;
        }
    }
    let sizes = sizes(usual, &at, &events);
    Ok(Likeliest { logs: at, sizes })
}

impl Chain {
    /// Slips as wide as positions: where a slip explains as much as all positions after it, it is to be tried before
    /// them, and shrinks if it is not needed (graduated non-convexity: Blake and Zisserman, *Visual Reconstruction*, ch. 7).
    fn slips_first(&self) -> Sizes {
        let drives = self.links.iter().flat_map(|link| &link.transition.drives);
        let slips = drives.filter(|drive| matches!(drive.effect, Effect::Slip(_)));
        slips.fold(Sizes::default(), |sizes, drive| {
            sizes.with_event(drive.effect, drive.event, SLIP.powi(-2))
        })
    }
}

/// Variances of single events over those of their effects, given all data with these sizes.
fn of_events(chain: &Chain, prior: &Prior, sizes: &Sizes) -> Result<Sizes, CalibrationError> {
    let filtered = chain.filter(sizes)?;
    let smoothed = filtered.smoothed(&filtered.posterior(prior));
    let mut events = Sizes::default();
    for (&(effect, event), moments) in &smoothed.events {
        if effect.has_heavy_tails() {
            // What the data do not tell of an event says nothing of its size.
            let squares = moments.squares * sizes.of_event(effect, event);
            let factor = (FREEDOM + squares) / (FREEDOM + moments.count - moments.unknown);
            events = events.with_event(effect, event, factor);
        }
    }
    Ok(events)
}

fn of_effects(
    chain: &Chain,
    prior: &Prior,
    usual: &[Usual],
    events: &Sizes,
    start: DVector<f64>,
) -> Result<DVector<f64>, CalibrationError> {
    descend(start, |at| {
        let filtered = chain.filter(&sizes(usual, at, events))?;
        let posterior = filtered.posterior(prior);
        let smoothed = filtered.smoothed(&posterior);
        let of = |k: usize| smoothed.of(Effect::Noise(usual[k].source));
        let of_prior = |k: usize| usual[k].spread.powi(-2);
        let penalty = (0..at.len()).map(|k| at[k].powi(2) * of_prior(k));
        Ok(Slope {
            cost: posterior.deviance + penalty.sum::<f64>(),
            gradient: DVector::from_fn(at.len(), |k, _| 2.0 * (of(k).slope + at[k] * of_prior(k))),
            curvature: DMatrix::from_diagonal(&DVector::from_fn(at.len(), |k, _| {
                of(k).curvature + 2.0 * of_prior(k)
            })),
        })
    })
}

/// Variances over the usual ones, with those of single events.
fn sizes(usual: &[Usual], at: &DVector<f64>, events: &Sizes) -> Sizes {
    let pairs = usual.iter().zip(at);
    pairs.fold(events.clone(), |sizes, (of, by)| {
        sizes.with(Effect::Noise(of.source), (2.0 * by).exp())
    })
}
