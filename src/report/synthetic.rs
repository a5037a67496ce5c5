//! A made-up run and result of realistic size, to draw before and without a filter.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{ClosedForm, Navigated, Report};
use crate::attitude;
use crate::calibration::AttitudePrior;
use crate::calibration::result::TermRecord;
use crate::calibration::*;
use crate::calibration::{Direction, Linearisation, Observability, Part};
use crate::calibration::{PARAMETERS, ParameterMatrix, ParameterVector, sensor_and_parameter};
use crate::earth::Site;
use crate::imu::*;
use crate::recording::{ImuSamples, TableLog};
use crate::run::{Run, SET_BY_HAND, Standstill};
use crate::study::navigation::Mission;
use crate::units::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, DEGREE, MICRO_G};

static NO_TERMS: BTreeMap<String, TermRecord> = BTreeMap::new();
const PERIOD: f64 = 0.05;
const DWELL: f64 = 20.0;
const TURN: f64 = 8.0;
const POSITIONS: usize = 21;
/// σ at the end for K, E, D of gyros and accelerometers, as a ten-minute path gives them.
const FINAL: [[f64; 3]; 2] = [
    [0.27e-6, 0.33 * ARCSEC, 0.0034 * DEG_PER_H],
    [0.43e-6, 0.34 * ARCSEC, 0.41 * MICRO_G],
];

pub(super) struct Synthetic {
    pub(super) run: Run,
    pub(super) outcome: Outcome,
    pub(super) closed: Estimate,
    pub(super) truth: PerSensor<Triad>,
    pub(super) dwells: Vec<Range<f64>>,
    pub(super) navigation: Vec<Navigated>,
}

impl Synthetic {
    pub(super) fn report(&self) -> Report<'_> {
        Report {
            title: "Calibration of a made-up instrument",
            run: &self.run,
            aiding: self.run.aiding(),
            body_frame: self.run.aiding().body_frame(),
            outcome: Some(&self.outcome),
            effects: &[],
            quality: None,
            true_terms: &NO_TERMS,
            closed_form: Some(ClosedForm {
                estimate: &self.closed,
                note: "six positions for each triad, 60 min of its own",
                warnings: &[],
            }),
            truth: Some(&self.truth),
            dwells: &self.dwells,
            navigation: Ok(&self.navigation),
        }
    }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

fn dwells() -> Vec<Range<f64>> {
    (0..POSITIONS)
        .map(|k| k as f64 * (DWELL + TURN))
        .map(|start| start..start + DWELL)
        .collect()
}

fn prior() -> PerSensor<Prior> {
    PerSensor::from_fn(|sensor| Prior {
        scale_sigma: Vector3::repeat(5000e-6),
        installation_sigma: Vector3::repeat(0.1 * DEGREE),
        bias: Vector3::zeros(),
        bias_sigma: Vector3::repeat(match sensor {
            Sensor::Gyro => 50.0 * DEG_PER_H,
            Sensor::Accel => 2000.0 * MICRO_G,
        }),
    })
}

/// Turns about x, y and z in turn, 180° each, seen as a trapezoid of rate.
fn run(form_rng: &mut ChaCha8Rng) -> Run {
    let samples = ((POSITIONS as f64 * (DWELL + TURN) - TURN) / PERIOD) as usize;
    let mut c = attitude::from_pitch_roll_heading(0.02, 0.01, 0.3);
    let (mut gyro, mut accel, mut time, mut angles) = (vec![], vec![], vec![], vec![]);
    for k in 0..samples {
        let t = k as f64 * PERIOD;
        let (cycle, within) = ((t / (DWELL + TURN)) as usize, t % (DWELL + TURN) - DWELL);
        let ramp = (within / 1.0).min((TURN - within) / 1.0).clamp(0.0, 1.0);
        let mut rate = Vector3::zeros();
        rate[cycle % 3] = ramp * std::f64::consts::PI / (TURN - 1.0);
        c *= attitude::exp(rate * PERIOD);
        gyro.push((rate + Vector3::from_fn(|_, _| 1e-4 * normal(form_rng))) * PERIOD);
        accel.push(c.transpose() * Vector3::new(0.0, 0.0, 9.8) * PERIOD);
        if k % 20 == 0 {
            time.push(t);
            angles.push(c);
        }
    }
    Run {
        term_sigma: Default::default(),
        name: "three-axis-made-up".to_owned(),
        site: Site::with_normal_gravity(39.9 * DEGREE, 116.3 * DEGREE, 50.0),
        meta: BTreeMap::from([
            (
                "instrument".to_owned(),
                "navigation-grade FOG <IMU> & co".to_owned(),
            ),
            ("operator".to_owned(), "nobody".to_owned()),
        ]),
        imu: ImuSamples {
            start: 0.0,
            period: PERIOD,
            continuous: true,
            gyro,
            accel,
            pulse: PerSensor {
                gyro: 0.1 * ARCSEC,
                accel: 1e-4,
            },
            faults: Vec::new(),
            bridges: Vec::new(),
            log: None,
        },
        noise: PerSensor {
            gyro: Noise {
                random_walk: 0.001 * DEG_PER_SQRT_H,
                gauss_markov: Some(GaussMarkov {
                    sigma: 0.003 * DEG_PER_H,
                    correlation_time: 3600.0,
                }),
            },
            accel: Noise {
                random_walk: 5.0 * MICRO_G,
                gauss_markov: None,
            },
        },
        prior: prior(),
        nominal: PerSensor {
            gyro: Nominal(Vector3::repeat(2_062_648.0)),
            accel: Nominal(Vector3::repeat(10_000.0)),
        },
        unit: PerSensor::from_fn(|_| "count".to_owned()),
        standstill: Standstill::default(),
        table: Some(TableLog {
            time,
            attitude: angles,
            position_sigma: ARCSEC,
            reading_sigma: 0.3 * ARCSEC,
            geometry: Default::default(),
            tilts: Vec::new(),
        }),
        files: Vec::new(),
        notes: Vec::new(),
        segments: Vec::new(),
        segment_sigma: SET_BY_HAND,
    }
}

/// Positive definite with correlations of every strength.
fn covariance(sigma: &ParameterVector, rng: &mut ChaCha8Rng) -> ParameterMatrix {
    let mix = ParameterMatrix::from_fn(|i, j| {
        if i == j {
            1.0
        } else if (i + j) % 5 == 0 {
            0.6 * normal(rng)
        } else {
            0.1 * normal(rng)
        }
    });
    let raw = mix * mix.transpose();
    ParameterMatrix::from_fn(|i, j| {
        sigma[i] * sigma[j] * raw[(i, j)] / (raw[(i, i)] * raw[(j, j)]).sqrt()
    })
}

/// A calibration of 24 parameters that falls in steps, one at each turn.
pub(super) fn synthetic(form: InstallationForm) -> Synthetic {
    let rng = &mut ChaCha8Rng::seed_from_u64(7);
    let run = run(rng);
    let dwells = dwells();
    let prior_sigma = ParameterVector::from_fn(|i, _| {
        let (sensor, p) = sensor_and_parameter(i);
        run.instrument.prior.get(sensor).sigma(form)[p]
    });
    let prior_mean = to_vector(&PerSensor::from_fn(|s| {
        run.instrument.prior.get(s).mean(form)
    }));
    let final_sigma = ParameterVector::from_fn(|i, _| {
        let (sensor, p) = sensor_and_parameter(i);
        let kind = ParameterKind::ALL
            .iter()
            .position(|k| *k == Triad::kind(p))
            .unwrap();
        let spread = 0.8 + 0.4 * rng.random::<f64>();
        let has = Triad::has_parameter(form, p);
        if has {
            FINAL[sensor as usize][kind] * spread
        } else {
            0.0
        }
    });
    let truth = prior_mean + prior_sigma.component_mul(&vector(rng));
    let drawn = final_sigma.component_mul(&vector(rng));
    let seen: Vec<f64> = (0..PARAMETERS)
        .map(|i| DWELL * (1.0 + (i % 7) as f64))
        .collect();
    let length = run.recording.imu.duration();
    let history: Vec<Epoch> = (0..(length * 5.0) as usize)
        .map(|k| {
            let time = (k as f64 + 1.0) / 5.0;
            let sigma = ParameterVector::from_fn(|i, _| {
                let steps = (time / (DWELL + TURN)).floor() + 1.0;
                let gain = if time < seen[i] { 1e-3 * time } else { 1.0 };
                let aim = final_sigma[i] * (length / time).sqrt() * (21.0 / steps).powf(0.7);
                prior_sigma[i].min(aim / gain)
            });
            let wander = 0.3 * (time / 40.0).sin();
            let estimate = truth
                + drawn
                    .component_div(&final_sigma.map(|s| s.max(1e-300)))
                    .component_mul(&sigma)
                    * (1.0 + wander);
            Epoch {
                time,
                estimate,
                sigma,
            }
        })
        .collect();
    let innovations = dwells
        .iter()
        .flat_map(|dwell| (0..95).map(move |k| (dwell.start + 0.2 * f64::from(k) + 1.0, k)))
        .flat_map(|(time, k)| {
            let velocity = (time, Observation::Velocity);
            let table = (k % 5 == 0).then_some((time, Observation::Table));
            [Some(velocity), table].into_iter().flatten()
        })
        .map(|(time, observation)| {
            let accepted = rng.random::<f64>() > 0.004;
            let scale = if accepted { 1.0 } else { 5.0 };
            Innovation {
                time,
                observation,
                whitened: [0; 3].map(|_| scale * normal(rng)),
                accepted,
            }
        })
        .collect();
    let estimate = Estimate {
        triads: from_vector(form, &(truth + drawn)),
        covariance: covariance(&final_sigma, rng),
    };
    let closed_sigma = final_sigma * 40.0;
    let closed = Estimate {
        triads: from_vector(form, &(truth + closed_sigma.component_mul(&vector(rng)))),
        covariance: covariance(&closed_sigma, rng),
    };
    let pass = |live, largest_step, merit, rejected| Pass {
        live,
        largest_step,
        merit,
        observations: 7200,
        rejected,
    };
    let nis = |mean, count| Nis {
        mean,
        count,
        interval: (0.964, 1.036),
        lag_one: -0.013,
    };
    let outcome = Outcome {
        form_test: None,
        estimate,
        prior_sigma,
        prior_mean,
        further: Default::default(),
        prior_attitude: AttitudePrior {
            mean: nalgebra::Matrix3::identity(),
            sigma: nalgebra::Vector3::repeat(60.0 * crate::units::ARCSEC),
        },
        attitude_sigma: nalgebra::Vector3::repeat(crate::units::ARCSEC),
        observability: Observability {
            directions: vec![Direction {
                remaining: 0.002,
                parts: vec![
                    Part {
                        parameter: 2,
                        component: 0.8,
                    },
                    Part {
                        parameter: 11,
                        component: -0.6,
                    },
                ],
                others: false,
                attitude: Vec::new(),
            }],
        },
        linearised_at: Linearisation {
            triads: from_vector(form, &(truth + drawn)),
            further: Default::default(),
            initial_attitude: nalgebra::Matrix3::identity(),
        },
        passes: vec![
            pass(true, 812.0, 9.1e5, 4),
            pass(false, 3.1, 7310.0, 9),
            pass(false, 0.004, 7195.2, 9),
        ],
        converged: true,
        log_determinant: 0.0,
        live_history: live(&history, &truth),
        history,
        innovations,
        consistency: Consistency {
            all: nis(1.01, 7182),
            velocity: nis(1.002, 5985),
            table: nis(1.051, 1197),
        },
        velocity_sigma: 1.2e-5,
        warnings: vec![
            "The path turns about z by less than a full turn; gyro K z rests on one move."
                .to_owned(),
        ],
    };
    let truth = from_vector(form, &truth);
    let mission = Mission::standing_level(&run.site, 600);
    let navigation = [("closed form", &closed), ("EKF", &outcome.estimate)]
        .map(|(method, estimate)| Navigated {
            method,
            outlook: mission.outlook(estimate, Some(&truth)).unwrap(),
        })
        .to_vec();
    Synthetic {
        run,
        outcome,
        closed,
        truth,
        dwells,
        navigation,
    }
}

/// The same with errors that feedback has made larger.
fn live(history: &[Epoch], truth: &ParameterVector) -> Vec<Epoch> {
    let widened = |m: &Epoch| {
        let gain = 1.6 + 1.2 * (m.time / 25.0).cos();
        let estimate = truth + (m.estimate - truth) * gain;
        Epoch { estimate, ..*m }
    };
    history.iter().map(widened).collect()
}

fn vector(rng: &mut ChaCha8Rng) -> ParameterVector {
    ParameterVector::from_fn(|_, _| normal(rng))
}
