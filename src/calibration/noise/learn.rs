//! From a calibration with stated noise to one with the noise that its data show.

use super::factors::{Factors, Scale};
use super::fit::{Fit, Likelihood};
use super::likelihood_ratio::limit;
use super::policy::NoisePolicy;
use super::replay::Script;
use super::report::{NoiseReport, NoiseTest, SourceFigures};
use super::selection::Selection;
use super::source::Source;
use crate::calibration::checks::innovation::{Innovation, Observation};
use crate::calibration::error::CalibrationError;
use crate::calibration::iterations::{Iterated, iterate};
use crate::calibration::linearisation::AttitudePrior;
use crate::calibration::model::Model;
use crate::calibration::outcome::Pass;
use crate::calibration::parameters::ParameterMatrix;
use crate::calibration::pass::Gate;
use crate::calibration::problem::Problem;
use crate::calibration::record::schedule::Step;
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
/// Half of a 95 % interval in σ, and what 95 % stay below.
pub const INTERVAL: f64 = 1.96;
const ONE_SIDED: f64 = 1.645;

/// A calibration with the noise of its record.
pub struct Learnt {
    pub model: Model,
    pub iterated: Iterated,
    pub report: NoiseReport,
    /// Mean square by which the parameters would be others with other noise, as likely; none where it is stated.
    pub of_other_noise: Option<ParameterMatrix>,
}

impl Learnt {
    /// The noise as stated, not tested.
    pub fn stated(problem: &Problem, iterated: Iterated) -> Self {
        Self {
            model: problem.model.clone(),
            iterated,
            report: NoiseReport::stated(problem.options.noise, None),
            of_other_noise: None,
        }
    }
}

/// Keeps stated noise or learns it, as the problem's options say, from what converged with it.
pub fn learn(
    problem: &Problem,
    priors: &[AttitudePrior],
    stated: Iterated,
    passes: &mut Vec<Pass>,
    progress: &dyn Fn(&Pass),
) -> Result<Learnt, CalibrationError> {
    let policy = problem.options.noise;
    let keep = |iterated, test| Learnt {
        model: problem.model.clone(),
        iterated,
        report: NoiseReport::stated(policy, test),
        of_other_noise: None,
    };
    if policy == NoisePolicy::Stated {
        return Ok(Learnt::stated(problem, stated));
    }
    let at = stated.held.estimate.clone();
    let mut accepted: Vec<bool> = let_in(&stated.held.innovations);
    let thinned = Thinned::new(problem, (accepted.len() / ENOUGH).clamp(1, LONGEST));
    let script = Script::new(&thinned.problem, priors, &at)?;
    let scale = Scale::new(problem, &script.moves());
    let likelihood = thinned.likelihood(&script, &scale, &accepted);
    let (test, fitted) = likelihood.test(policy)?;
    let Some(fitted) = fitted else {
        return Ok(keep(stated, Some(test)));
    };
    if policy == NoisePolicy::Auto && !test.rejected && stated.converged {
        return Ok(keep(stated, Some(test)));
    }
    let Selection {
        mut fit,
        mut sources,
    } = likelihood.select(&fitted.factors, scale.present())?;

    let mut iterated = stated;
    // Stated noise may have thrown the gate open; the learnt one decides once.
    let mut open = accepted.iter().all(|&accepted| accepted);
    // Near the end all observations count: few cannot tell white noise from random walk.
    let whole = Thinned::new(problem, 1);
    let mut before = None;
    let mut at = at;
    let mut round = 0;
    loop {
        round += 1;
        let model = scale.apply(&fit.factors, &problem.model);
        let with_noise = problem.with_model(model.clone());
        let distances = Script::new(&with_noise, priors, &at)?
            .replay(&with_noise, &accepted)?
            .distances;
        let changed = regate(&mut accepted, &distances, problem.gate(), open);
        open = false;
        let as_decided: Vec<Innovation> = iterated
            .held
            .innovations
            .iter()
            .zip(&accepted)
            .map(|(innovation, &accepted)| Innovation {
                accepted,
                ..*innovation
            })
            .collect();
        let from = iterated.held.estimate.clone();
        let gate = Gate::As(&as_decided);
        iterated = iterate(&with_noise, priors, from, gate, passes, progress)?;
        at = iterated.held.estimate.clone();
        let script = Script::new(&whole.problem, priors, &at)?;
        let likelihood = whole.likelihood(&script, &scale, &accepted);
        let now = likelihood.replay(&fit.factors)?.deviance();
        let moved = before.is_none_or(|before: f64| (now - before).abs() > SETTLED);
        if (!changed && !moved) || round == ROUNDS {
            let of_other_noise =
                likelihood.moves_parameters_by(&fit.factors, problem, priors, &iterated)?;
            return Ok(Learnt {
                model,
                report: likelihood.report(policy, test, &fit.factors)?,
                iterated,
                of_other_noise: Some(of_other_noise),
            });
        }
        before = Some(now);
        Selection { fit, sources } = likelihood.select(&fit.factors, sources)?;
    }
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
            ratio_limit: limit(free.len(), bounded.len(), 0.5 * FALSE_ALARM),
            ratio_of_one: None,
            of: None,
            rejected: false,
        };
        // A bound at zero halves the chance that a factor alone goes beyond.
        let of_one = |i: usize, chance: f64| {
            let chance = chance / sources.len() as f64;
            let one_sided = usize::from(bounded.contains(&i));
            limit(1 - one_sided, one_sided, chance)
        };
        let suspect = |i: &usize| slope.statistic_of(*i, bounded.contains(i)) > of_one(*i, SCREEN);
        let suspects: Vec<usize> = (0..sources.len()).filter(suspect).collect();
        let suspicious = test.score > test.score_limit || !suspects.is_empty();
        if policy == NoisePolicy::Auto && !suspicious {
            return Ok((test, None));
        }
        let deviance = slope.here.deviance();
        let all = self.fit(&stated, &sources)?;
        let ratio = deviance - all.deviance;
        test.ratio = Some(ratio);
        test.rejected = ratio > test.ratio_limit;
        // One factor alone may be beyond its limit where all together are not.
        let suspects = suspects.into_iter().filter(|_| !test.rejected);
        for i in suspects.collect::<Vec<_>>() {
            let one = self.fit(&stated, &sources[i..=i])?;
            let ratio = (deviance - one.deviance) / of_one(i, 0.5 * FALSE_ALARM);
            if test.ratio_of_one.is_none_or(|largest| ratio > largest) {
                test.ratio_of_one = Some(ratio);
                test.of = Some(Source::ALL[sources[i]]);
            }
        }
        test.rejected |= test.ratio_of_one.is_some_and(|ratio| ratio > 1.0);
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
