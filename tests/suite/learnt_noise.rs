//! Noise learnt from one record, stated for the next.

use toml::{Table, Value};
use turncal::calibration::{NoisePolicy, Options, Outcome, Problem, estimate};
use turncal::formats::write_run;
use turncal::imu::Output;
use turncal::run::Run;
use turncal::simulation::Scenario;

fn estimated(run: &Run, noise: NoisePolicy) -> Outcome {
    let problem = Problem::new(run, &Options::default().noise(noise));
    estimate(&problem, &|_| {}).unwrap()
}

/// Puts every field of one table into another, table by table.
fn put(into: &mut Table, from: Table) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(Value::Table(into)), Value::Table(from)) => put(into, from),
            (_, value) => drop(into.insert(key, value)),
        }
    }
}

#[test]
#[ignore = "slow: several calibrations"]
fn what_was_learnt_and_is_then_stated_gives_the_same_calibration() {
    let directory = tempfile::tempdir().unwrap();
    let scenario = Scenario::load("mems").unwrap();
    let run = scenario.simulate(1, 0).unwrap().run;
    write_run(directory.path(), &run, Output::Rate, None).unwrap();
    let file = directory.path().join("run.toml");
    let mut text: Table = std::fs::read_to_string(&file).unwrap().parse().unwrap();
    let noise = text["imu"]["noise"].as_table_mut().unwrap();
    for key in [
        "angle_random_walk_deg_per_sqrt_h",
        "velocity_random_walk_ug_per_sqrt_hz",
    ] {
        let stated = noise[key].as_float().unwrap();
        noise.insert(key.to_owned(), Value::Float(stated / 3.0));
    }
    std::fs::write(&file, text.to_string()).unwrap();
    let learnt = estimated(&Run::read(&file).unwrap(), NoisePolicy::Auto);
    assert!(learnt.noise.learnt);

    let lines = learnt.noise.run_toml(Default::default()).unwrap();
    put(&mut text, lines.parse().unwrap());
    std::fs::write(&file, text.to_string()).unwrap();
    let stated = estimated(&Run::read(&file).unwrap(), NoisePolicy::Stated);
    let off = stated.estimate.vector() - learnt.estimate.vector();
    let sigma = learnt.estimate.sigma();
    for i in learnt.estimate.estimated() {
        assert!(
            (off[i] / sigma[i]).abs() < 0.01,
            "{i}: {} σ",
            off[i] / sigma[i]
        );
        let ratio = stated.estimate.sigma()[i] / sigma[i];
        // Figures in the lines have four digits.
        assert!((ratio - 1.0).abs() < 1e-2, "{i}: {ratio}");
    }
}
