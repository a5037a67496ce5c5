//! Tests of single figures of a calibration.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::super::svg;
use super::super::tests::{Synthetic, synthetic};
use super::{Report, Truth, document};
use crate::group::short_name;
use turncal::calibration::{Method, Options, Problem, UNWATCHED};
use turncal::imu::InstallationForm;
use turncal::lot::{Limit, Specification};
use turncal::simulation::{Scenario, Simulated};
use turncal::study::CheckedCalibration;
use turncal::units::PPM;

#[test]
fn the_figure_of_the_readme_is_that_of_the_demo() {
    let scenario = Scenario::load("demo").unwrap();
    let Simulated { run, truth, .. } = scenario.simulate(scenario.seed, 0).unwrap();
    let problem = Problem::new(&run, &Options::default());
    let solution = problem.solve(Method::Ekf, UNWATCHED).unwrap();
    let checked = CheckedCalibration::new(&problem, solution).unwrap();
    let truth = Truth {
        triads: truth,
        terms: BTreeMap::new(),
    };
    let of = (&checked, &checked.consequences(&problem, None));
    let document = document((&problem, "demo"), of, Some(&truth));
    let plot = document.plots().find(|plot| plot.file == "sigma.svg");
    // README is displayed in a column as narrow as a printed page.
    let drawn = svg::draw_at(plot.unwrap(), svg::WIDTHS[1]);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.readme/sigma.svg");
    if std::env::var("INSTA_UPDATE").is_ok_and(|update| update == "always") {
        fs::write(&path, &drawn).unwrap();
    }
    let shown = fs::read_to_string(&path).unwrap();
    assert!(
        shown == drawn,
        "the figure has changed; set INSTA_UPDATE=always to draw it again"
    );
}

#[test]
fn a_value_is_shown_between_the_limits_of_its_specification() {
    let made_up = synthetic(InstallationForm::General);
    let specification = Specification {
        limits: vec![Limit {
            parameter: 0,
            nominal: 1.0,
            within: 200.0 * PPM,
        }],
        ..turncal::models::specification("mems-by-hand".as_ref()).unwrap()
    };
    let mut report = made_up.report();
    let dashed = |report: &Report| {
        let plot = report.error_bars(&made_up.outcome.estimate);
        let series = plot.panels.iter().flat_map(|panel| &panel.series);
        series.filter(|series| series.pen.is_dashed).count()
    };
    assert_eq!(dashed(&report), 0);
    report.specification = Some(&specification);
    assert_eq!(dashed(&report), 2);
}

#[test]
fn a_position_that_every_dwell_is_far_from_is_missing() {
    let mut made_up = synthetic(InstallationForm::General);
    let caption = |made_up: &Synthetic| made_up.report().attitudes().unwrap().caption;
    assert!(caption(&made_up).contains("(of the six): none"));
    let imu = &mut made_up.run.recording.imu;
    let dwell = made_up.dwells[0].clone();
    let first = (dwell.end / imu.period) as usize;
    imu.gyro.to_mut().truncate(first);
    imu.accel.to_mut().truncate(first);
    made_up.run.recording.table = None;
    assert!(caption(&made_up).contains("(of the six): x up"));
}

#[test]
fn the_correlation_matrix_names_every_row_and_column_in_every_width() {
    for form in InstallationForm::ALL {
        let made_up = synthetic(form);
        let plots = made_up.report().figures();
        let plot = plots.iter().find(|plot| plot.file == "correlation.svg");
        for width in svg::WIDTHS {
            let drawn = svg::draw_at(plot.unwrap(), width);
            for i in made_up.outcome.estimate.estimated() {
                let name = format!("\n{}\n", short_name(form, i));
                assert_eq!(drawn.matches(&name).count(), 2, "{name} at {width}");
            }
        }
    }
}
