//! What no noise explains is no calibration by the closed form either.

use turncal::calibration::{ClosedForm, Finding, Method, Options, Problem, Solution};
use turncal::run::Run;
use turncal::simulation::Scenario;

fn solved(run: &Run) -> (bool, ClosedForm) {
    let problem = Problem::new(run, &Options::default());
    let solution = problem.solve(Method::SixPosition, &|_| {}).unwrap();
    let usable = solution.is_usable();
    match solution {
        Solution::ClosedForm(closed_form) => (usable, *closed_form),
        Solution::Filter(_) => unreachable!("the closed form was asked for"),
    }
}

fn simulated(scenario: &str, seed: u64) -> Run {
    let scenario = Scenario::load(scenario).unwrap();
    scenario.simulate(seed, 0).unwrap().run
}

#[test]
fn a_site_on_the_other_hemisphere_is_no_calibration_by_the_closed_form() {
    let mut run = simulated("demo", 1);
    assert!(solved(&run).0);
    run.site.latitude = -run.site.latitude;
    let (usable, closed_form) = solved(&run);
    assert!(!usable);
    let nis = closed_form
        .findings
        .iter()
        .find_map(|finding| match finding {
            Finding::Unexplained { nis, limit, .. } => Some(nis / limit),
            _ => None,
        });
    assert!(nis.unwrap() > 1.0);
}
