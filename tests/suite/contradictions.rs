//! What no noise explains is no calibration by the closed form either, and a prior that data contradict is said
//! where it holds the estimate.

use turncal::calibration::{
    ClosedForm, Finding, FindingKind, Method, Options, Problem, Solution, UNWATCHED,
};
use turncal::run::Run;
use turncal::simulation::Scenario;
use turncal::units::{ARCSEC, PPM};

fn solved(run: &Run) -> (bool, ClosedForm) {
    let problem = Problem::new(run, &Options::default());
    let solution = problem.solve(Method::SixPosition, UNWATCHED).unwrap();
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
    let unexplained = |finding: &&Finding| finding.is(FindingKind::Unexplained);
    let figures = &closed_form
        .findings
        .iter()
        .find(unexplained)
        .unwrap()
        .figures;
    assert!(figures["nis"].as_f64().unwrap() > figures["limit"].as_f64().unwrap());
}

/// Parameters that are named as far from their prior, by gravity alone.
fn far(change: fn(&mut Run), seed: u64) -> Vec<String> {
    let mut run = simulated("mems", seed);
    run.recording.table = None;
    change(&mut run);
    let findings = solved(&run).1.findings.into_iter();
    let far = findings.filter(|finding| finding.kind == "far-from-prior");
    let names =
        |far: Finding| serde_json::from_value::<Vec<String>>(far.figures["parameters"].clone());
    far.flat_map(|far| names(far).unwrap()).collect()
}

#[test]
fn a_prior_too_tight_to_let_the_estimate_go_is_named_by_gravity_alone() {
    for seed in 1..=12 {
        let named = far(|_| {}, seed);
        assert!(named.is_empty(), "seed {seed}: {named:?}");
    }
    for seed in 1..=3 {
        let named = far(|run| run.instrument.prior.accel.scale_sigma.fill(PPM), seed);
        assert!(
            named.iter().any(|n| n.starts_with("accel.scale")),
            "{named:?}"
        );
        let named = far(|run| run.instrument.prior.gyro.scale_sigma.fill(PPM), seed);
        assert!(
            named.iter().any(|n| n.starts_with("gyro.scale")),
            "{named:?}"
        );
        let named = far(
            |run| run.instrument.prior.accel.installation_sigma.fill(ARCSEC),
            seed,
        );
        let of = |n: &String| n.starts_with("accel.installation");
        assert!(named.iter().any(of), "{named:?}");
    }
}
