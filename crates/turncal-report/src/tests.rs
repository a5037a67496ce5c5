//! A simulated run with a made-up result: every figure that a report shows of it is independent of the filter.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::OnceLock;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::calibration::{ClosedForm, Report};
use turncal::calibration::result::TermRecord;
use turncal::calibration::*;
use turncal::calibration::{
    Direction, Observability, ParameterMatrix, ParameterVector, sensor_and_parameter,
};
use turncal::imu::*;
use turncal::run::Run;
use turncal::simulation::{Scenario, Simulated};
use turncal::study::navigation::{MethodOutlook, Mission};

static NO_TERMS: BTreeMap<String, TermRecord> = BTreeMap::new();

pub struct Synthetic {
    pub run: Run,
    pub outcome: Outcome,
    pub closed: Estimate,
    pub calibration: Calibration,
    pub truth: PerSensor<Triad>,
    pub dwells: Vec<Range<f64>>,
    pub navigation: Vec<MethodOutlook>,
}

impl Synthetic {
    pub fn report(&self) -> Report<'_> {
        Report {
            title: "Calibration of a made-up instrument",
            run: &self.run,
            aiding: self.run.aiding(),
            body_frame: self.run.aiding().body_frame(),
            outcome: Some(&self.outcome),
            findings: &self.outcome.findings,
            calibration: &self.calibration,
            budget: None,
            predicted: None,
            specification: None,
            quality: None,
            true_terms: &NO_TERMS,
            closed_form: Some(ClosedForm {
                estimate: &self.closed,
                note: "six positions for each triad, 60 min of its own",
            }),
            truth: Some(&self.truth),
            dwells: &self.dwells,
            navigation: Ok(&self.navigation),
        }
    }
}

fn vector(rng: &mut ChaCha8Rng) -> ParameterVector {
    ParameterVector::from_fn(|_, _| StandardNormal.sample(rng))
}

/// An estimate that is off the truth by these errors, with correlations of every strength.
fn estimate(
    truth: &PerSensor<Triad>,
    sigma: &ParameterVector,
    errors: &ParameterVector,
) -> Estimate {
    let form = truth.gyro.form;
    let correlation = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 1.0,
        1 => -0.4,
        2 => 0.1,
        _ => 0.0,
    };
    Estimate {
        triads: from_vector(form, &(to_vector(truth) + sigma.component_mul(errors))),
        covariance: ParameterMatrix::from_fn(|i, j| sigma[i] * sigma[j] * correlation(i, j)),
    }
}

/// A recording of the demonstration on a coarse clock.
fn simulated() -> Simulated {
    let mut scenario = Scenario::load("demo").unwrap();
    scenario.integrator.period = 0.1;
    let mut simulated = scenario.simulate(7, 0).unwrap();
    let recording = &mut simulated.run.recording;
    recording.name = "three-axis-made-up".to_owned();
    let instrument = (
        "instrument".to_owned(),
        "navigation-grade FOG <IMU> & co".to_owned(),
    );
    recording.meta.extend([instrument]);
    simulated
}

fn prior_sigma(run: &Run, form: InstallationForm) -> ParameterVector {
    ParameterVector::from_fn(|i, _| {
        let (sensor, p) = sensor_and_parameter(i);
        let sigma = run.instrument.prior.get(sensor).sigma(form)[p];
        if Triad::has_parameter(form, p) {
            sigma
        } else {
            0.0
        }
    })
}

fn innovations(dwells: &[Range<f64>], rng: &mut ChaCha8Rng) -> Vec<Innovation> {
    let mut innovations = Vec::new();
    for (number, dwell) in dwells.iter().enumerate() {
        for k in 1..20u32 {
            let whitened = [0; 3].map(|_| StandardNormal.sample(rng));
            let time = dwell.start + (dwell.end - dwell.start) * f64::from(k) / 20.0;
            let kinds = [Observation::Velocity, Observation::Table];
            innovations.extend(kinds.map(|observation| Innovation {
                time,
                observation,
                whitened,
                sigma: [1.0; 3],
                dwell: number,
                after_move: number > 0,
            }));
        }
    }
    innovations
}

/// One direction that the observations hardly tell of.
fn observability() -> Observability {
    let part = |index, component| {
        let name = parameter_name(InstallationForm::General, index);
        (name.unwrap(), component)
    };
    Observability {
        directions: vec![Direction {
            remaining: 0.002,
            words: "gyro scale z against gyro bias z".to_owned(),
            parts: [part(2, 0.8), part(11, -0.6)].into(),
        }],
    }
}

fn passes() -> Vec<Pass> {
    let pass = |largest_step, cost| Pass {
        largest_step,
        cost,
        observations: 7200,
    };
    vec![pass(812.0, 9.1e5), pass(3.1, 7310.0), pass(0.004, 7195.2)]
}

fn consistency() -> Consistency {
    let nis = |mean, count| Nis {
        mean,
        count,
        interval: (0.964, 1.036),
        lag_one: -0.013,
    };
    Consistency {
        all: nis(1.01, 7182),
        velocity: nis(1.002, 5985),
        table: nis(1.051, 1197),
        attitude: nis(f64::NAN, 0),
    }
}

/// Estimates whose σ fall with time, and whose errors, of `drawn` σ, swing by `gain`.
fn history(
    truth: &ParameterVector,
    final_sigma: &ParameterVector,
    drawn: &ParameterVector,
    length: f64,
    gain: f64,
) -> Vec<Epoch> {
    let moment = |k: u32| {
        let time = length * f64::from(k) / 400.0;
        let sigma = final_sigma * (length / time).min(1e3);
        let error = sigma.component_mul(drawn) * (1.0 + gain * (time / 40.0).sin());
        Epoch {
            time,
            estimate: truth + error,
            sigma,
            magnetic: None,
        }
    };
    (1..=400).map(moment).collect()
}

/// A calibration by the filter, the same for all tests.
fn calibrated() -> Outcome {
    static CALIBRATED: OnceLock<Outcome> = OnceLock::new();
    let calibrate = || {
        let simulated = Scenario::load("demo").unwrap().simulate(1, 0).unwrap();
        let options = Options::default().noise(NoisePolicy::Stated);
        let problem = Problem::new(&simulated.run, &options.no_auto_terms());
        turncal::calibration::estimate(&problem, UNWATCHED).unwrap()
    };
    CALIBRATED.get_or_init(calibrate).clone()
}

/// A result whose σ fall from `prior_sigma` to `final_sigma`, with errors of `drawn` σ.
fn outcome(
    run: &Run,
    truth: &PerSensor<Triad>,
    [prior_sigma, final_sigma, drawn]: [ParameterVector; 3],
    innovations: Vec<Innovation>,
) -> Outcome {
    let length = run.recording.imu.duration();
    let mut outcome = calibrated();
    outcome.estimate = estimate(truth, &final_sigma, &drawn);
    outcome.prior_sigma = prior_sigma;
    outcome.auxiliary = Auxiliary::default();
    outcome.terms = Vec::new();
    outcome.observability = observability();
    outcome.passes = passes();
    outcome.converged = true;
    outcome.history = history(&to_vector(truth), &final_sigma, &drawn, length, 0.3);
    outcome.innovations = innovations;
    outcome.consistency = consistency();
    outcome.velocity_sigma = 1.2e-5;
    outcome.findings = vec![Finding::of_recording(
        "The path turns about z by less than a full turn; gyro K z rests on one move.".to_owned(),
    )];
    outcome
}

/// σ that fall to a thousandth of the prior's, and errors of that size.
pub fn synthetic(form: InstallationForm) -> Synthetic {
    let rng = &mut ChaCha8Rng::seed_from_u64(7);
    let Simulated { run, truth, .. } = simulated();
    let seconds = |dwell: turncal::run::Dwell| {
        run.recording.imu.time(dwell.samples.start)..run.recording.imu.time(dwell.samples.end)
    };
    let dwells: Vec<Range<f64>> = run.dwells(run.aiding()).into_iter().map(seconds).collect();
    let truth = PerSensor::from_fn(|sensor| truth.get(sensor).in_form(form));
    let prior_sigma = prior_sigma(&run, form);
    let final_sigma = prior_sigma * 1e-3;
    let drawn = vector(rng);
    let innovations = innovations(&dwells, rng);
    let sizes = [prior_sigma, final_sigma, drawn];
    let outcome = outcome(&run, &truth, sizes, innovations);
    let closed = estimate(&truth, &(final_sigma * 40.0), &vector(rng));
    let mission = Mission::standing_level(&run.site, 600);
    let navigation = [("closed form", &closed), ("EKF", &outcome.estimate)]
        .map(|(method, estimate)| MethodOutlook {
            method,
            outlook: mission.outlook(estimate, Some(&truth)).unwrap(),
        })
        .to_vec();
    let calibration = Calibration {
        verdict: Some(Verdict::of(&outcome.findings)),
        findings: outcome.findings.clone(),
        ..outcome.estimate.record(&run, run.aiding().body_frame())
    };
    Synthetic {
        calibration,
        run,
        outcome,
        closed,
        truth,
        dwells,
        navigation,
    }
}
