//! From a calibration with stated noise to one with the noise that its data show.

use super::super::error::CalibrationError;
use super::super::innovation::Innovation;
use super::super::iterations::{Iterated, iterate};
use super::super::linearisation::AttitudePrior;
use super::super::model::Model;
use super::super::outcome::Pass;
use super::super::pass::Gate;
use super::super::problem::Problem;
use super::factors::{Factors, Scale};
use super::fit::{Fit, Likelihood};
use super::likelihood_ratio::limit;
use super::policy::NoisePolicy;
use super::replay::Script;
use super::report::{NoiseReport, NoiseTest, SourceFigures};
use super::source::Source;

/// Chance that stated figures which are right are given up; each of the two tests has half of it.
const FALSE_ALARM: f64 = 1e-3;
/// Chance that the score test calls for a likelihood ratio which it does not need. The score of a variance
/// is as skewed as χ², so it does not decide; but it costs no fit.
const SCREEN: f64 = 0.05;
/// Points of linearisation at most.
const ROUNDS: usize = 6;
/// A change of −2 ln of the likelihood from one point of linearisation to the next that is nothing: a
/// third of a σ of one factor.
const SETTLED: f64 = 0.1;
/// Half of a 95 % interval in σ, and what 95 % stay below.
const INTERVAL: f64 = 1.96;
const ONE_SIDED: f64 = 1.645;

/// A calibration with the noise of its record.
pub(in crate::calibration) struct Learnt {
    pub model: Model,
    pub iterated: Iterated,
    pub report: NoiseReport,
}

/// Keeps stated noise or learns it, as the problem's options say, from what converged with it.
pub(in crate::calibration) fn learn(
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
    };
    if policy == NoisePolicy::Stated {
        return Ok(keep(stated, None));
    }
    let at = stated.held.estimate.clone();
    let script = Script::new(problem, priors, &at)?;
    let scale = Scale::new(problem, &script.moves());
    let mut accepted: Vec<bool> = let_in(&stated.held.innovations);
    let likelihood = Likelihood {
        problem,
        script: &script,
        scale: &scale,
        accepted: &accepted,
    };
    let (test, fitted) = likelihood.test(policy)?;
    let Some(mut fit) = fitted else {
        return Ok(keep(stated, Some(test)));
    };
    if policy == NoisePolicy::Auto && !test.rejected && stated.converged {
        return Ok(keep(stated, Some(test)));
    }

    let mut iterated = stated;
    // Stated noise may have thrown the gate open; the learnt one decides once.
    let mut open = accepted.iter().all(|&accepted| accepted);
    let mut script = script;
    let mut before = None;
    let mut at;
    let mut round = 0;
    loop {
        round += 1;
        let distances = likelihood_of(problem, &script, &scale, &accepted)
            .replay(&fit.factors)?
            .distances;
        let changed = regate(&mut accepted, &distances, problem.gate(), open);
        open = false;
        let model = scale.apply(&fit.factors, &problem.model);
        let with_noise = problem.with_model(model.clone());
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
        script = Script::new(problem, priors, &at)?;
        let likelihood = likelihood_of(problem, &script, &scale, &accepted);
        let now = likelihood.replay(&fit.factors)?.deviance();
        let moved = before.is_none_or(|before: f64| (now - before).abs() > SETTLED);
        if (!changed && !moved) || round == ROUNDS {
            let report = likelihood.report(policy, test, &fit.factors)?;
            return Ok(Learnt {
                model,
                iterated,
                report,
            });
        }
        before = Some(now);
        fit = likelihood.fit(&fit.factors, &scale.present())?;
    }
}

fn likelihood_of<'a>(
    problem: &'a Problem<'a>,
    script: &'a Script<'a>,
    scale: &'a Scale,
    accepted: &'a [bool],
) -> Likelihood<'a> {
    Likelihood {
        problem,
        script,
        scale,
        accepted,
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
        for i in suspects {
            let one = self.fit(&stated, &sources[i..=i])?;
            let ratio = (deviance - one.deviance) / of_one(i, 0.5 * FALSE_ALARM);
            if test.ratio_of_one.is_none_or(|largest| ratio > largest) {
                test.ratio_of_one = Some(ratio);
                test.of = Some(Source::ALL[sources[i]]);
            }
        }
        let all = self.fit(&stated, &sources)?;
        let ratio = deviance - all.deviance;
        test.ratio = Some(ratio);
        test.rejected =
            ratio > test.ratio_limit || test.ratio_of_one.is_some_and(|ratio| ratio > 1.0);
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
