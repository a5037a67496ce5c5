//! The filter against batch least squares on the same linear problem.

use turncal::calibration::states::PARAMETERS;
use turncal::calibration::{Outcome, batch_estimate, estimate};
use turncal::imu::InstallationForm;
use turncal::run::Run;
use turncal::simulation::Scenario;

/// Largest difference of estimate and of covariance, in σ and its products.
fn difference(run: &Run, outcome: &Outcome) -> (f64, f64) {
    let batch = batch_estimate(run, outcome).unwrap();
    let sigma = batch.sigma();
    let filter = &outcome.estimate;
    let apart = filter.vector() - batch.vector();
    let (mut estimate, mut covariance) = (0f64, 0f64);
    for i in (0..PARAMETERS).filter(|&i| sigma[i] > 0.0) {
        estimate = estimate.max((apart[i] / sigma[i]).abs());
        for j in (0..PARAMETERS).filter(|&j| sigma[j] > 0.0) {
            let apart = filter.covariance[(i, j)] - batch.covariance[(i, j)];
            covariance = covariance.max((apart / (sigma[i] * sigma[j])).abs());
        }
    }
    println!("estimate {estimate:.1e} σ, covariance {covariance:.1e}");
    (estimate, covariance)
}

#[test]
fn batch_least_squares_gives_the_filters_estimate_and_covariance() {
    let simulated = Scenario::load("demo").unwrap().simulate(1, 0).unwrap();
    let t = std::time::Instant::now();
    let outcome = estimate(&simulated.run, InstallationForm::General, &|_| {}).unwrap();
    println!("filter {:?}", t.elapsed());
    let t = std::time::Instant::now();
    let (estimate, covariance) = difference(&simulated.run, &outcome);
    println!("batch {:?}", t.elapsed());
    assert!(estimate < 1e-6 && covariance < 1e-6);
}
