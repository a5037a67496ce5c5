//! From a calibration with stated noise to one with the noise that its data show.

use super::factors::{Factors, Scale};
use super::fit::{Fit, Likelihood};
use super::likelihood_ratio::{INTERVAL, limit};
use super::policy::NoisePolicy;
use super::report::{NoiseReport, NoiseTest, SourceFigures};
use super::selection::Selection;
use super::source::Source;
use crate::calibration::checks::innovation::{Innovation, Observation};
use crate::calibration::error::CalibrationError;
use crate::calibration::gauss_newton::{Progress, iterate};
use crate::calibration::pass::Gate;
use crate::calibration::problem::Problem;
use crate::calibration::record::schedule::Step;
use crate::calibration::reduction::Script;
use crate::calibration::solved::Solved;
use crate::statistics::FALSE_ALARM;

/// Chance that the score test calls for a likelihood ratio which it does not need. The score of a variance
/// is as skewed as χ², so it does not decide; but it costs no fit.
const SCREEN: f64 = 0.05;
/// Points of linearisation at most.
const ROUNDS: usize = 6;
/// A change of −2 ln of the likelihood from one point of linearisation to the next that is nothing: a
/// third of a σ of one factor.
const SETTLED: f64 = 0.1;
/// Observations of three components that noise is first learnt from: 3,000 numbers, half of which tell σ of
/// a white noise to 2 %.
const ENOUGH: usize = 1000;
/// Steps of a dwell between these observations at most: longer ones would not tell white noise of velocity
/// and attitude from random walk at all.
const LONGEST: usize = 10;
/// What 95 % stay below, in σ.
const ONE_SIDED: f64 = 1.645;

/// Keeps stated noise or estimates it, as the problem's options say, from what was solved with stated noise.
pub fn learn<'a>(stated: Solved<'a>, progress: Progress) -> Result<Solved<'a>, CalibrationError> {
    let problem = &stated.problem.clone();
    let policy = problem.options.noise;
    if policy == NoisePolicy::Stated {
        return Ok(stated);
    }
    let at = stated.iterated.held.estimate.clone();
    let accepted = let_in(&stated.iterated.held.innovations);
    let thinned = Thinned::new(problem, (accepted.len() / ENOUGH).clamp(1, LONGEST));
    let script = Script::new(&thinned.problem, &stated.priors, &at)?;
    let scale = Scale::new(problem, &script.moves());
    let likelihood = thinned.likelihood(&script, &scale, &accepted);
    let (test, fitted) = likelihood.test(policy)?;
    let contradicted = policy != NoisePolicy::Auto || test.rejected || !stated.iterated.converged;
    let Some(fitted) = fitted.filter(|_| contradicted) else {
        return Ok(Solved {
            noise: NoiseReport::stated(policy, Some(test)),
            ..stated
        });
    };
    let selection = likelihood.select(&fitted.factors, scale.present())?;
    with_noise(stated, (selection, test), &scale, accepted, progress)
}

/// Iterates with noise that was estimated at one point of linearisation, and estimates it there again, until neither
/// moves.
fn with_noise<'a>(
    mut solved: Solved<'a>,
    (mut selection, test): (Selection, NoiseTest),
    scale: &Scale,
    mut accepted: Vec<bool>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let problem = &solved.problem.clone();
    let priors = &solved.priors.clone();
    // Stated noise may have thrown the gate open; the estimated one decides once.
    let mut open = accepted.iter().all(|&accepted| accepted);
    // Near the end all observations count: few cannot tell white noise from random walk.
    let whole = Thinned::new(problem, 1);
    let mut before = None;
    for round in 1.. {
        let factors = selection.fit.factors;
        let with_noise = problem.with_model(scale.apply(&factors, &problem.model));
        let at = solved.iterated.held.estimate.clone();
        let script = Script::new(&with_noise, priors, &at)?;
        let distances = script.replay(&with_noise, &accepted)?.distances;
        let changed = regate(&mut accepted, &distances, problem.gate_limit(), open);
        open = false;
        let innovations = solved.iterated.held.innovations.iter().zip(&accepted);
        let decided: Vec<Innovation> = innovations
            .map(|(&innovation, &accepted)| Innovation {
                accepted,
                ..innovation
            })
            .collect();
        let (gate, passes) = (Gate::As(&decided), &mut solved.passes);
        solved.iterated = iterate(&with_noise, priors, at, gate, passes, progress)?;
        let at = &solved.iterated.held.estimate;
        let script = Script::new(&whole.problem, priors, at)?;
        let likelihood = whole.likelihood(&script, scale, &accepted);
        let now = likelihood.replay(&factors)?.deviance();
        let moved = before.is_none_or(|before: f64| (now - before).abs() > SETTLED);
        if (!changed && !moved) || round == ROUNDS {
            solved.noise = likelihood.report(problem.options.noise, test, &factors)?;
            solved.problem = with_noise;
            break;
        }
        before = Some(now);
        selection = likelihood.select(&factors, selection.sources)?;
    }
    Ok(solved)
}

/// A problem of which only so many observations are looked at as noise needs: those of a dwell are thinned
/// out, the first after each move stays.
struct Thinned<'a> {
    problem: Problem<'a>,
    /// Observations of three components that one of each kind stands for, in their order.
    groups: Vec<Vec<usize>>,
}

impl<'a> Thinned<'a> {
    fn new(problem: &Problem<'a>, steps_of_dwell: usize) -> Self {
        let thinned = problem.observed_every(steps_of_dwell);
        let mut groups = Vec::new();
        let mut next = 0;
        for (all, few) in problem.stretches().iter().zip(thinned.stretches()) {
            let mut all = all
                .steps
                .iter()
                .filter(|step| step.at_rest.is_some())
                .peekable();
            for step in few.steps.iter().filter(|step| step.at_rest.is_some()) {
                let mut of_kinds: [Vec<usize>; Observation::ALL.len()] = Default::default();
                let within = |one: &&Step| one.samples.end <= step.samples.end;
                while let Some(one) = all.next_if(within) {
                    for kind in problem.observed(one) {
                        of_kinds[kind as usize].push(next);
                        next += 1;
                    }
                }
                let kinds = problem.observed(step);
                groups.extend(kinds.map(|kind| std::mem::take(&mut of_kinds[kind as usize])));
            }
        }
        Self {
            problem: thinned,
            groups,
        }
    }

    /// The likelihood of noise where these of all observations are let in.
    fn likelihood<'b>(
        &'b self,
        script: &'b Script<'b>,
        scale: &'b Scale,
        accepted: &[bool],
    ) -> Likelihood<'b> {
        let let_in = |index: &usize| accepted.get(*index).copied().unwrap_or(true);
        let group = |group: &Vec<usize>| group.iter().all(let_in);
        Likelihood {
            problem: &self.problem,
            script,
            scale,
            accepted: self.groups.iter().map(group).collect(),
        }
    }
}

fn let_in(innovations: &[Innovation]) -> Vec<bool> {
    innovations.iter().map(|i| i.accepted).collect()
}

/// Lets in what the gate allows; leaves out what it does not where that is still `open`. Otherwise the set
/// only grows, so it cannot toggle. Whether anything changed.
fn regate(accepted: &mut [bool], distances: &[f64], gate: f64, open: bool) -> bool {
    let mut changed = false;
    for (accepted, &distance) in accepted.iter_mut().zip(distances) {
        let sound = distance <= gate;
        if *accepted != sound && (sound || open) {
            *accepted = sound;
            changed = true;
        }
    }
    changed
}

impl Likelihood<'_> {
    /// The test of what is stated, and the fit of all factors where one was made.
    fn test(&self, policy: NoisePolicy) -> Result<(NoiseTest, Option<Fit>), CalibrationError> {
        let sources = self.scale.present();
        let stated = self.scale.initial();
        let slope = self.slope(&stated, &sources)?;
        let (bounded, free): (Vec<usize>, Vec<usize>) =
            (0..sources.len()).partition(|&i| stated.0[sources[i]] == 0.0);
        let mut test = NoiseTest {
            score: slope.statistic(&bounded),
            score_limit: limit(free.len(), bounded.len(), SCREEN),
            ratio: None,
            ratio_limit: limit(free.len(), bounded.len(), FALSE_ALARM),
            rejected: false,
        };
        if policy == NoisePolicy::Auto && test.score <= test.score_limit {
            return Ok((test, None));
        }
        let all = self.fit(&stated, &sources)?;
        let ratio = slope.here.deviance() - all.deviance;
        test.ratio = Some(ratio);
        test.rejected = ratio > test.ratio_limit;
        Ok((test, Some(all)))
    }

    fn report(
        &self,
        policy: NoisePolicy,
        test: NoiseTest,
        factors: &Factors,
    ) -> Result<NoiseReport, CalibrationError> {
        let sources = self.scale.present();
        let sigmas = self.sigma(factors, &sources)?;
        let stated = self.scale.initial();
        let of = |(&k, sigma): (&usize, &Option<f64>)| {
            let source = Source::ALL[k];
            let (unit, value) = source.unit();
            let used = self.scale.sigma(factors, k) / value;
            let interval = sigma.map(|sigma| match factors.0[k] {
                0.0 => {
                    let mut upper = *factors;
                    upper.0[k] = ONE_SIDED * sigma;
                    [0.0, self.scale.sigma(&upper, k) / value]
                }
                _ => [-1.0, 1.0].map(|side| used * (side * INTERVAL * sigma).exp()),
            });
            SourceFigures {
                source,
                name: source.name().to_owned(),
                unit: unit.to_owned(),
                stated: (stated.0[k] > 0.0).then(|| self.scale.sigma(&stated, k) / value),
                used,
                interval,
            }
        };
        Ok(NoiseReport {
            policy,
            learnt: true,
            test: Some(test),
            sources: sources.iter().zip(&sigmas).map(of).collect(),
        })
    }
}
