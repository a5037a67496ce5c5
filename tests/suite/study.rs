//! Studies of many runs.

use assert_cmd::Command;
use serde_json::Value;
use turncal::calibration::{
    NoisePolicy, Options, ParameterVector, Problem, UNWATCHED, bound, estimate, six_position,
    to_vector,
};
use turncal::imu::{PARAMETERS as PER_TRIAD, ParameterKind, Triad};
use turncal::simulation::Scenario;
use turncal::units::{ARCSEC, DEG_PER_H, MICRO_G, PPM};

const RUNS: u64 = 3;
const SEED: u64 = 8;

fn study(threads: &str) -> Vec<u8> {
    let (runs, seed) = (RUNS.to_string(), SEED.to_string());
    let mut turncal = Command::new(env!("CARGO_BIN_EXE_turncal"));
    let output = turncal
        .args([
            "study", "accuracy", "--with", "none", "--json", "--runs", &runs, "--seed", &seed,
        ])
        .env("RAYON_NUM_THREADS", threads)
        .assert()
        .success();
    output.get_output().stdout.clone()
}

/// RMS of the parameters of a triad and kind over runs.
fn rms(of_runs: &[ParameterVector], triad: usize, kind: ParameterKind) -> f64 {
    let members: Vec<usize> = (0..PER_TRIAD)
        .filter(|&p| Triad::kind(p) == kind)
        .map(|p| triad * PER_TRIAD + p)
        .collect();
    let squares = of_runs
        .iter()
        .flat_map(|run| members.iter().map(|&i| run[i].powi(2)));
    (squares.sum::<f64>() / (of_runs.len() * members.len()) as f64).sqrt()
}

/// Errors of filter and closed form, σ of the bound and of the filter, of each run made by itself.
fn by_hand() -> [Vec<ParameterVector>; 4] {
    let scenario = Scenario::load("demo").unwrap();
    let positions = scenario.clone().with_path("six-position").unwrap();
    let mut all = [const { Vec::new() }; 4];
    for stream in 0..RUNS {
        let made = scenario.simulate(SEED, stream).unwrap();
        let options = Options::default()
            .noise(NoisePolicy::Stated)
            .no_auto_terms();
        let problem = Problem::new(&made.run, &options);
        let filtered = estimate(&problem, UNWATCHED).unwrap().estimate;
        let truth = to_vector(&made.truth);
        let bound = bound(&problem, &made.truth, &made.terms).unwrap();
        let at_rest = positions.simulate(SEED, stream).unwrap();
        let closed = six_position(&Problem::new(&at_rest.run, &Options::default()))
            .unwrap()
            .estimate;
        let of_run = [
            filtered.vector() - truth,
            closed.vector() - to_vector(&at_rest.truth),
            bound.estimate.sigma(),
            filtered.sigma(),
        ];
        all.iter_mut()
            .zip(of_run)
            .for_each(|(all, one)| all.push(one));
    }
    all
}

#[test]
#[ignore = "slow: the same study on one thread, on two and by hand"]
fn a_study_is_its_runs_made_one_by_one_whatever_the_number_of_threads() {
    let one = study("1");
    assert_eq!(one, study("2"));

    let document: Value = serde_json::from_slice(&one).unwrap();
    assert_eq!(document["runs"], RUNS);
    assert_eq!(document["failures"], 0);
    let [filtered, closed, bound, claimed] = by_hand();
    for (group, triad, kind, unit) in [
        ("gyro.scale_ppm", 0, ParameterKind::Scale, PPM),
        (
            "gyro.installation_arcsec",
            0,
            ParameterKind::Installation,
            ARCSEC,
        ),
        ("gyro.bias_deg_per_h", 0, ParameterKind::Bias, DEG_PER_H),
        ("accel.scale_ppm", 1, ParameterKind::Scale, PPM),
        (
            "accel.installation_arcsec",
            1,
            ParameterKind::Installation,
            ARCSEC,
        ),
        ("accel.bias_ug", 1, ParameterKind::Bias, MICRO_G),
    ] {
        let of = |key: &str| document[group][key].as_f64().unwrap();
        let of_runs = |runs: &[ParameterVector]| rms(runs, triad, kind) / unit;
        let [filtered, closed, bound, claimed] =
            [&filtered, &closed, &bound, &claimed].map(|runs| of_runs(runs));
        for (key, expected) in [
            ("ekf_rms", filtered),
            ("six_position_rms", closed),
            ("bound_rms", bound),
            ("ratio", filtered / bound),
            ("gain", closed / filtered),
        ] {
            let found = of(key);
            assert!(
                (found / expected - 1.0).abs() < 1e-9,
                "{group} {key}: {found} {expected}"
            );
        }
        // The filter's σ are those of the bound but for where they are linearised.
        assert!(
            (claimed / bound - 1.0).abs() < 0.05,
            "{group}: {claimed} {bound}"
        );
        let [low, high] = [0, 1].map(|k| document[group]["ratio_interval"][k].as_f64().unwrap());
        assert!(low <= of("ratio") && of("ratio") <= high, "{group}");
    }
    for (place, name) in ["standing", "flight"].into_iter().enumerate() {
        let mission = &document["navigation"][place];
        assert_eq!(mission["mission"], name);
        let of = |key: &str| mission["position_nmile"][key].as_f64().unwrap();
        assert!(
            (of("claimed_rms") / of("bound_rms") - 1.0).abs() < 0.05,
            "{name}"
        );
        for held in mission["containment"].as_array().unwrap() {
            assert_eq!(held["runs"], RUNS);
        }
    }
}
