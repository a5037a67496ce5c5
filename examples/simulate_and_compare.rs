//! Simulates a run on a turntable, calibrates it with the filter and with the closed form, and compares both with the
//! truth.
//!
//! Run it with `cargo run --release --example simulate_and_compare`.

use turncal::calibration::{Group, Method, Options, Problem, UNWATCHED, nees, to_vector};
use turncal::simulation::Scenario;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let simulated = Scenario::load("demo")?.simulate(1, 0)?;
    let problem = Problem::new(&simulated.run, &Options::default());
    let truth = to_vector(&simulated.truth);
    for method in [Method::SixPosition, Method::Ekf] {
        let solution = problem.solve(method, UNWATCHED)?;
        let estimate = solution.estimate();
        let error = estimate.vector() - truth;
        println!("{method:?}: RMS error over RMS σ of each group");
        for group in Group::all() {
            let of_group = group.estimated(estimate);
            let square =
                |v: &dyn Fn(usize) -> f64| of_group.iter().map(|&i| v(i).powi(2)).sum::<f64>();
            let sigma = estimate.sigma();
            let ratio = (square(&|i| error[i]) / square(&|i| sigma[i])).sqrt();
            println!("  {:?} {:?}: {ratio:.2}", group.sensor(), group.kind());
        }
        let all: Vec<usize> = estimate.estimated().collect();
        if let Some(nees) = nees(&error, &estimate.covariance, &all) {
            println!("  NEES/n {:.2} over {} parameters", nees.mean, nees.count);
        }
    }
    Ok(())
}
