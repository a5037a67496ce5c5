//! From a calibration with stated noise to one with estimated noise.

use super::factors::{Factors, Scale};
use super::fit::{Fit, Likelihood, SETTLED};
use super::likelihood_ratio::{INTERVAL, limit};
use super::policy::NoisePolicy;
use super::report::{NoiseReport, NoiseTest, SourceFigures};
use super::source::Source;
use crate::calibration::{
    CalibrationError, Gate, Innovation, Observation, Problem, Progress, Script, Solved, iterate,
    pass,
};
use crate::statistics::FALSE_ALARM;

/// Most linearisation points.
const ROUNDS: usize = 6;
/// Number of observations of three components for the first noise estimate: of 900 numbers, half determine σ of
/// a white noise to 3 %.
const ENOUGH: usize = 300;
/// Maximum number of dwell steps between these observations: with longer intervals, white noise of velocity and
/// attitude could not be distinguished from random walk.
const LONGEST: usize = 10;
/// 95 % quantile of the normal distribution, one-sided, in σ.
const ONE_SIDED: f64 = 1.645;

/// Keeps the stated noise or estimates it, according to the problem's options, from a solution with some noise, and
/// iterates: noise at one linearisation point, then estimation, until both converge.
pub fn learn<'a>(
    as_stated: &Problem<'a>,
    solved: Solved<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let policy = as_stated.options.noise;
    if policy == NoisePolicy::Stated {
        return Ok(solved);
    }
    let as_stated = solved
        .problem
        .with(|model| *model = model.with_noise_of(&as_stated.model));
    let accepted = solved.iterated.held.accepted();
    // Few observations tell whether noise is called for at all; the first after each move is among them.
    let steps = (accepted.len() / ENOUGH).clamp(1, LONGEST);
    let thinned = as_stated.observed_every(steps);
    let script = Script::new(&thinned, &solved.priors, &solved.iterated.estimate)?;
    let scale = Scale::new(&as_stated, &script.moves());
    let likelihood = Likelihood {
        problem: &thinned,
        script: &script,
        scale: &scale,
        accepted: taken_together(&as_stated, &accepted, steps),
    };
    let fit = likelihood.fit(None)?;
    let test = likelihood.test(&fit)?;
    if test.rejected || policy == NoisePolicy::Learnt {
        return with_noise(&as_stated, solved.clone(), (fit, test), &scale, progress);
    }
    let solved = if solved.problem.model == as_stated.model {
        solved
    } else {
        solved.again(as_stated, progress)?
    };
    let noise = NoiseReport::stated(policy, Some(test));
    Ok(Solved { noise, ..solved })
}

/// Iterates with the noise estimated at one linearisation point, and estimates it again at the result, until both
/// converge.
fn with_noise<'a>(
    as_stated: &Problem<'a>,
    mut solved: Solved<'a>,
    (mut fit, test): (Fit, NoiseTest),
    scale: &Scale,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let mut accepted = solved.iterated.held.accepted();
    // Other noise may have thrown the gate open; the estimated one decides once.
    let mut open = accepted.iter().all(|&accepted| accepted);
    for round in 1.. {
        solved.problem = as_stated.with_model(scale.apply(&fit.factors, &as_stated.model));
        let (problem, priors) = (&solved.problem, &solved.priors);
        let at = solved.iterated.estimate;
        let script = Script::new(problem, priors, &at)?;
        let replay = pass(problem, &script, Gate::As(&accepted))?;
        let distances = replay.innovations.iter().map(Innovation::distance);
        regate(&mut accepted, distances, problem.gate_limit(), open);
        open = false;
        let (gate, passes) = (Gate::As(&accepted), &mut solved.passes);
        solved.iterated = iterate(problem, priors, at.clone(), gate, passes, progress)?;
        // Near the end all observations count: few cannot tell white noise from random walk.
        let likelihood = Likelihood {
            problem: as_stated,
            script: &Script::new(as_stated, priors, &solved.iterated.estimate)?,
            scale,
            accepted: accepted.clone(),
        };
        let before = likelihood.replay(&fit.factors)?.deviance();
        let now = likelihood.fit(Some(&fit))?;
        let settled = (now.deviance - before).abs() < SETTLED;
        if settled || round == ROUNDS {
            solved.noise = likelihood.report(as_stated.options.noise, test, &fit.factors)?;
            break;
        }
        fit = now;
    }
    Ok(solved)
}

/// Acceptance of observations for combined steps: accepted if all observations of the combined steps are.
fn taken_together(problem: &Problem, accepted: &[bool], steps: usize) -> Vec<bool> {
    let (mut accepted, mut together) = (accepted.iter(), Vec::new());
    for stretch in problem.stretches() {
        let at_rest = stretch
            .steps
            .iter()
            .filter_map(|step| Some((step, step.at_rest.as_ref()?)));
        let at_rest: Vec<_> = at_rest.collect();
        let dwells = at_rest.chunk_by(|_, (_, next)| !next.first);
        for part in dwells.flat_map(|dwell| dwell.chunks(steps)) {
            let mut of_kinds = [None; Observation::ALL.len()];
            for kind in part.iter().flat_map(|(step, _)| problem.observed(step)) {
                let let_in = accepted.next().is_none_or(|&accepted| accepted);
                let of_kind = &mut of_kinds[kind as usize];
                *of_kind = Some(of_kind.unwrap_or(true) && let_in);
            }
            together.extend(of_kinds.into_iter().flatten());
        }
    }
    together
}

/// Accepts observations within the gate; rejects others if `open`. If not `open`, the accepted set
/// only grows, so that it cannot toggle.
fn regate(accepted: &mut [bool], distances: impl Iterator<Item = f64>, gate: f64, open: bool) {
    for (accepted, distance) in accepted.iter_mut().zip(distances) {
        let sound = distance <= gate;
        if sound || open {
            *accepted = sound;
        }
    }
}

impl Likelihood<'_> {
    /// The test of the stated noise against a fit. The sources of the fit were selected from all present ones, so the
    /// limit is that for all of them.
    fn test(&self, fit: &Fit) -> Result<NoiseTest, CalibrationError> {
        let stated = self.scale.initial;
        let present = self.scale.present().into_iter();
        let (bounded, free): (Vec<usize>, Vec<usize>) = present.partition(|&k| stated[k] == 0.0);
        let ratio = if fit.sources.is_empty() {
            0.0
        } else {
            self.replay(&stated)?.deviance() - fit.deviance
        };
        let limit = limit(free.len(), bounded.len(), FALSE_ALARM);
        Ok(NoiseTest {
            ratio,
            limit,
            rejected: ratio > limit,
        })
    }

    fn report(
        &self,
        policy: NoisePolicy,
        test: NoiseTest,
        factors: &Factors,
    ) -> Result<NoiseReport, CalibrationError> {
        let sources = self.scale.present();
        let sigmas = self.sigma(factors, &sources)?;
        let stated = self.scale.initial;
        let of = |(&k, sigma): (&usize, &Option<f64>)| {
            let used = self.scale.sigma(factors, k);
            let interval = sigma.map(|sigma| match factors[k] {
                0.0 => {
                    let mut upper = *factors;
                    upper[k] = ONE_SIDED * sigma;
                    [0.0, self.scale.sigma(&upper, k)]
                }
                _ => [-1.0, 1.0].map(|side| used * (side * INTERVAL * sigma).exp()),
            });
            let stated = (stated[k] > 0.0).then(|| self.scale.sigma(&stated, k));
            SourceFigures::new(Source::ALL[k], stated, used, interval)
        };
        Ok(NoiseReport {
            policy,
            learnt: true,
            test: Some(test),
            sources: sources.iter().zip(&sigmas).map(of).collect(),
        })
    }
}
