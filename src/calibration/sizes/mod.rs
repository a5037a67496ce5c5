//! Sizes of all effects: noise at rest from the dwells alone, all others from the chain, and averages over effects that
//! may be absent.

mod at_rest;
mod averages;
mod candidates;
mod descent;
mod likeliest;
mod usual;

use nalgebra::{DMatrix, DVector};

use crate::calibration::chain::{Chain, Dispersion, Effect, Filtered, Sizes, Slip};
use crate::calibration::checks::recordings::RecordingDifference;
use crate::calibration::noise::{INTERVAL, NAMED};
use crate::calibration::{
    CalibrationError, Constant, Known, Model, NoisePolicy, NoiseReport, NoiseTest, Posterior,
    Prior, Problem, Script, Source, SourceFigures,
};
use crate::statistics::{FALSE_ALARM, chi_square_limit};
pub use averages::LARGEST;
pub use candidates::Candidates;
pub use likeliest::FREEDOM;
use likeliest::{At, Search};
pub use usual::LOG_SIGMA;
pub use usual::Usual;
use usual::What;

/// Maximum number of rounds of sizes and averages at one linearisation point, the first time it is near.
const ROUNDS: usize = 4;
/// Sizes and averages have settled if no log size (in its σ) and no probability of absence changes by more than this.
const SETTLED: f64 = 0.1;

/// Factor of the variance of the three components of a disturbance because its weight is estimated too: information on
/// the location of Student's t without this weight over that with it (Louis 1982, J. Royal Stat. Soc. B 44(2);
/// Lange, Little, Taylor 1989).
const MISSING: f64 = (FREEDOM + 5.0) / (FREEDOM + 3.0);

/// An estimated size.
#[derive(Debug, Clone, Copy)]
struct Size {
    usual: Usual,
    /// Log of the size over the typical magnitude, and its 1σ.
    log: f64,
    sigma: f64,
}

/// Distance of a linearisation point from the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// The point is far from the estimate: errors of the linearisation dominate the residuals.
    Far,
    /// The point is near the estimate for the first time.
    FirstNear,
    /// The point is near the estimate, as in the previous pass.
    Near,
}

/// Sizes of all effects.
#[derive(Debug, Clone)]
pub struct Effects {
    at_rest: Vec<Size>,
    between: Vec<Size>,
    pub dispersion: Dispersion,
    /// Variances of single events, divided by those of their effects.
    events: Sizes,
    pub candidates: Candidates,
    pub are_settled: bool,
}

/// The chain with its sizes, and its information on the constants.
pub struct Weighed<'a> {
    pub filtered: Filtered<'a>,
    pub prior: Prior,
    pub known: Known,
    pub posterior: Posterior,
}

impl Effects {
    /// The stated sizes.
    pub fn new(problem: &Problem) -> Self {
        let constants = Constant::all(&problem.model, problem.one_gravity());
        Self {
            at_rest: Vec::new(),
            between: Vec::new(),
            dispersion: Dispersion::alike(problem),
            events: Sizes::default(),
            candidates: Candidates::new(&constants, &problem.model),
            are_settled: false,
        }
    }

    /// Improves the sizes at a linearisation point; once the point is near, in several rounds.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Diverged`] if a covariance is not positive definite.
    pub fn improve(
        &mut self,
        problem: &Problem,
        script: &Script,
        stage: Stage,
    ) -> Result<(), CalibrationError> {
        let is_stated = problem.options.noise == NoisePolicy::Stated;
        // The noise found from the dwells alone hardly depends on the linearisation.
        if !is_stated && (self.at_rest.is_empty() || stage == Stage::FirstNear) {
            self.improve_at_rest(problem, script);
        }
        let rounds = if stage == Stage::Far { 1 } else { ROUNDS };
        if stage == Stage::FirstNear {
            self.begin();
        }
        let chain = self.chain(problem, script)?;
        let prior = Prior::new(&chain.constants, &problem.model, &script.at);
        for round in 0..rounds {
            let change = if is_stated {
                let filtered = chain.filter(&self.sizes(&chain))?;
                self.candidates.weigh(&filtered.known(&prior), &prior)
            } else {
                self.improve_between(&chain, &prior)?
            };
            if round == 0 {
                self.are_settled = change < SETTLED;
            }
            if change < SETTLED {
                break;
            }
        }
        Ok(())
    }

    /// Restarts everything that was estimated far from the estimate, because there the misfit was due to the
    /// linearisation.
    fn begin(&mut self) {
        self.events = Sizes::default();
        self.between.iter_mut().for_each(|size| size.log = 0.0);
        self.candidates.begin();
    }

    /// The noise at rest, from the dwells alone.
    fn improve_at_rest(&mut self, problem: &Problem, script: &Script) {
        let usual = Usual::all(problem, &script.moves());
        let (between, at_rest): (Vec<Usual>, Vec<Usual>) =
            usual.into_iter().partition(|of| of.effect().is_some());
        let before = (!self.at_rest.is_empty()).then(|| {
            let logs = self.at_rest.iter().map(|size| size.log);
            let logs = DVector::from_iterator(self.at_rest.len(), logs);
            (self.dispersion.clone(), logs)
        });
        let still = at_rest::likeliest(problem, script, &at_rest, before);
        self.dispersion = still.dispersion;
        let sizes = at_rest.into_iter().zip(&still.logs).zip(&still.sigma);
        self.at_rest = sizes
            .map(|((usual, &log), &sigma)| Size { usual, log, sigma })
            .collect();
        let log = |k: usize| self.between.get(k).map_or(0.0, |size: &Size| size.log);
        let sizes = between.into_iter().enumerate();
        self.between = sizes
            .map(|(k, usual)| Size {
                usual,
                log: log(k),
                sigma: usual.spread,
            })
            .collect();
    }

    /// Updates the sizes between dwells and the averages over effects that may be absent; returns the largest change.
    fn improve_between(&mut self, chain: &Chain, prior: &Prior) -> Result<f64, CalibrationError> {
        let usual: Vec<Usual> = self.between.iter().map(|size| size.usual).collect();
        let search = Search {
            chain,
            prior,
            usual: &usual,
        };
        let mut start = At::usual(&usual, chain);
        let before = DVector::from_iterator(usual.len(), self.between.iter().map(|of| of.log));
        start.logs.copy_from(&before);
        if self.events != Sizes::default() {
            start.events = self.events.clone();
        }
        let here = search.likeliest(start, &self.candidates.sites(prior).within())?;
        let change = self.candidates.weigh(&here.known, prior);
        let sigma = here.sigma(&usual);
        for (k, size) in self.between.iter_mut().enumerate() {
            (size.log, size.sigma) = (here.at.logs[k], sigma[k]);
        }
        // Sizes that the data hardly determine may wander.
        let moved = (&here.at.logs - before).component_div(&sigma);
        let of_sizes = moved.iter().map(|by| by.abs()).fold(0.0, f64::max);
        self.events = here.at.events;
        Ok(change.max(of_sizes))
    }

    /// The chain at a linearisation point.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Diverged`] if a part of a dwell cannot be reduced.
    pub fn chain(&self, problem: &Problem, script: &Script) -> Result<Chain, CalibrationError> {
        let made = problem.with(|model| self.set(model, |_| 0.0));
        Chain::new(&made, script, &self.dispersion)
    }

    /// Information on the constants from a filter with these sizes between dwells.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Diverged`] if a part cannot be reduced, or a covariance is not positive definite.
    pub fn information(
        &self,
        problem: &Problem,
        script: &Script,
        sizes: &Sizes,
    ) -> Result<DMatrix<f64>, CalibrationError> {
        let made = problem.with(|model| self.set(model, |_| 0.0));
        Chain::information(&made, script, (&self.dispersion, sizes))
    }

    /// A chain with its sizes and its information on the constants.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Diverged`] if a covariance is not positive definite.
    pub fn weighed<'a>(
        &self,
        chain: &'a Chain,
        problem: &Problem,
        script: &Script,
    ) -> Result<Weighed<'a>, CalibrationError> {
        let filtered = chain.filter(&self.sizes(chain))?;
        let prior = Prior::new(&chain.constants, &problem.model, &script.at);
        let known = filtered.known(&prior);
        let time = chain.links.last().map_or(0.0, |link| link.time);
        let posterior = filtered
            .posterior_with(&known, &self.candidates.sites(&prior))
            .ok_or(CalibrationError::Diverged { time })?;
        Ok(Weighed {
            filtered,
            prior,
            known,
            posterior,
        })
    }

    /// Does the same as [`Self::weighed`] for some of the rows, and averages the candidates again.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Diverged`] if a covariance is not positive definite.
    pub fn weighed_anew<'a>(
        &self,
        chain: &'a Chain,
        problem: &Problem,
        script: &Script,
    ) -> Result<Weighed<'a>, CalibrationError> {
        let mut anew = self.clone();
        let prior = Prior::new(&chain.constants, &problem.model, &script.at);
        let known = chain.filter(&self.sizes(chain))?.known(&prior);
        anew.candidates.weigh(&known, &prior);
        anew.weighed(chain, problem, script)
    }

    /// Variance of each effect, relative to the variance that was assumed when the links of the chain were made. If the
    /// noise is stated, slips are excluded.
    pub fn sizes(&self, chain: &Chain) -> Sizes {
        if self.at_rest.is_empty() && self.between.is_empty() {
            let slips = chain.states.slips.is_some();
            let slips = [Slip::Mount, Slip::Base].into_iter().filter(|_| slips);
            return slips.fold(Sizes::default(), |sizes, slip| {
                sizes.with(Effect::Slip(slip), 0.0)
            });
        }
        // A variance that follows its own disturbance makes the disturbance seem better known than it is.
        let of_field = Effect::Noise(Source::MagneticDisturbance);
        let events = self.events.clone().scaled(of_field, MISSING);
        let each = self.between.iter();
        each.fold(events, |sizes, size| match size.usual.effect() {
            Some(effect) => sizes.with(effect, (2.0 * size.log).exp()),
            None => sizes,
        })
    }

    /// Sets the noise at rest in a model, and all other effects to these logs over their typical magnitudes.
    fn set(&self, model: &mut Model, log: impl Fn(&Size) -> f64) {
        self.at_rest
            .iter()
            .for_each(|size| size.usual.set(model, size.log));
        self.between
            .iter()
            .for_each(|size| size.usual.set(model, log(size)));
    }

    /// A copy of the model that contains all sizes.
    pub fn model(&self, stated: &Model) -> Model {
        let mut model = stated.clone();
        self.set(&mut model, |size| size.log);
        model
    }

    /// The noise that was used, and whether the data contradict the stated noise.
    pub fn report(&self, problem: &Problem) -> NoiseReport {
        let policy = problem.options.noise;
        if policy == NoisePolicy::Stated {
            return NoiseReport::stated(policy);
        }
        let sizes = self.at_rest.iter().chain(&self.between);
        let figures = sizes.clone().filter_map(|size| {
            let What::Noise(source) = size.usual.what else {
                return None;
            };
            let used = size.usual.sigma * size.log.exp();
            let off = INTERVAL * size.sigma;
            let interval = [-off, off].map(|off| used * off.exp());
            let stated = size.usual.stated.then_some(size.usual.sigma);
            Some(SourceFigures::new(source, stated, used, Some(interval)))
        });
        let stated = sizes.filter(|size| size.usual.stated);
        let distances = stated.map(|size| (size.log, (size.log / size.sigma).powi(2)));
        let distances: Vec<(f64, f64)> = distances.collect();
        let limit = chi_square_limit(1.0, FALSE_ALARM / distances.len().max(1) as f64);
        NoiseReport {
            policy,
            learnt: true,
            test: Some(NoiseTest {
                ratio: distances.iter().map(|of| of.1).fold(0.0, f64::max),
                limit,
                rejected: distances
                    .iter()
                    .any(|&(log, distance)| distance > limit && log > NAMED.ln()),
            }),
            sources: figures.collect(),
        }
    }

    /// Differences between recordings beyond the stated ones, from a chain with these sizes.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Diverged`] if a covariance is not positive definite.
    pub fn differences(
        &self,
        of: &Weighed,
        problem: &Problem,
    ) -> Result<Vec<RecordingDifference>, CalibrationError> {
        let each = self
            .between
            .iter()
            .filter_map(|size| match size.usual.what {
                What::Difference(group) => Some((size, group)),
                What::Noise(_) | What::SettlingTime => None,
            });
        let each: Vec<_> = each.collect();
        let limit = chi_square_limit(1.0, FALSE_ALARM / each.len().max(1) as f64);
        let sites = self.candidates.sites(&of.prior);
        let mut found = Vec::new();
        for (size, group) in each {
            let without = if size.usual.stated { 1.0 } else { 0.0 };
            let sizes = self.sizes(of.filtered.chain);
            let sizes = sizes.with(Effect::Difference(group), without);
            let filtered = of.filtered.chain.filter(&sizes)?;
            let posterior = filtered.posterior_with(&filtered.known(&of.prior), &sites);
            let ratio = posterior.map_or(0.0, |other| other.deviance - of.posterior.deviance);
            if ratio > limit && (size.log > 0.0 || !size.usual.stated) {
                let difference =
                    RecordingDifference::new(group, &problem.model, &size.usual, size.log);
                found.push(RecordingDifference {
                    ratio,
                    limit,
                    ..difference
                });
            }
        }
        Ok(found)
    }
}
