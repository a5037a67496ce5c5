//! Evaluates a custom path: the Cramér–Rao bound of every parameter group, here for the nineteen positions from two
//! start attitudes.
//!
//! Run it with `cargo run --release --example study_of_a_path`.

use turncal::calibration::{Group, Options, Problem, bound};
use turncal::run::Aiding;
use turncal::simulation::Scenario;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for path in ["three-axis", "nineteen-position"] {
        // A path of your own: give its TOML file instead of the name of an embedded one.
        let scenario = Scenario::load("demo")?.with_path(path)?;
        let simulated = scenario.simulate(1, 0)?;
        let problem = Problem::new(&simulated.run, &Options::default().aiding(Aiding::Velocity));
        let bound = bound(&problem, &simulated.truth, &simulated.terms)?;
        let sigma = bound.estimate.sigma();
        println!(
            "{path}, {:.0} s, zero velocity alone:",
            simulated.run.recording.imu.duration()
        );
        for group in Group::all() {
            let indices = group.estimated(&bound.estimate);
            let square: f64 = indices.iter().map(|&i| sigma[i].powi(2)).sum();
            let rms = (square / indices.len().max(1) as f64).sqrt();
            println!("  {:?} {:?}: RMS σ {rms:.2e}", group.sensor(), group.kind());
        }
    }
    Ok(())
}
