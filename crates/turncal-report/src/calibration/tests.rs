//! Properties of every report.

use std::fs;
use std::path::Path;

use super::super::group::Group;
use super::super::tests::synthetic;
use super::super::{html, svg, terminal, write};
use super::*;
use turncal::calibration::{
    Budget, BudgetPart, BudgetSource, ErrorTerm, Nis, Observation, PARAMETERS, ParameterMatrix,
    TermEvidence, from_vector, parameter_name, to_vector,
};
use turncal::imu::{GaussMarkov, InstallationForm, Term};
use turncal::navigation::NearPole;
use turncal::study::navigation::NavigationStudyError;
use turncal::units::{DEG_PER_H, PPM};

/// Every file of a report, by name.
fn written(report: &Report) -> Vec<(String, String)> {
    let directory = tempfile::tempdir().unwrap();
    write(&report.document(), directory.path()).unwrap();
    let mut files: Vec<_> = fs::read_dir(directory.path())
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| {
            let name = entry.file_name().into_string().unwrap();
            (name, fs::read_to_string(entry.path()).unwrap())
        })
        .collect();
    files.sort();
    files
}

fn names(files: &[(String, String)]) -> Vec<&str> {
    files.iter().map(|(name, _)| name.as_str()).collect()
}

/// What must hold of any report.
fn assert_sound(files: &[(String, String)]) {
    let (figures, others): (Vec<_>, Vec<_>) =
        files.iter().partition(|(name, _)| name.ends_with(".svg"));
    let drawn: Vec<String> = figures.iter().map(|(_, svg)| svg.clone()).collect();
    svg::assert_sound(&drawn);
    let (_, page) = others[0];
    for bad in ["NaN", "inf<", "inf ", "<script", "href", "http"] {
        assert!(!page.contains(bad), "the page contains {bad}");
    }
    assert!(page.len() < 2_000_000);
    for (name, _) in figures {
        assert!(page.contains(name.as_str()), "the page shows {name}");
    }
}

/// The page without its figures.
fn page(report: &Report) -> String {
    let mut document = report.document();
    document
        .blocks
        .retain(|(_, block)| !matches!(block, Block::Plot(_)));
    html::page(&document).replace('\u{a0}', " ")
}

fn summary(report: &Report) -> String {
    terminal::text(&report.document(), None)
}

#[test]
fn the_summary_fits_terminals_of_80_and_120_columns() {
    let made_up = synthetic(InstallationForm::General);
    let document = made_up.report().document();
    for width in [80, 120] {
        let text = terminal::text(&document, Some(width));
        assert!(
            text.lines().all(|line| line.chars().count() <= width),
            "{text}"
        );
        insta::assert_snapshot!(format!("summary_{width}"), text);
    }
}

#[test]
fn an_error_is_estimate_minus_truth_in_ppm_and_in_sigma() {
    let mut made_up = synthetic(InstallationForm::General);
    let mut truth = to_vector(&made_up.outcome.estimate.triads);
    truth[0] += 3.0 * PPM;
    made_up.truth = from_vector(InstallationForm::General, &truth);
    made_up.outcome.estimate.covariance[(0, 0)] = (1.5 * PPM).powi(2);
    let page = page(&made_up.report());
    assert!(page.contains("<td>−3.0</td><td>−2.00</td>"), "{page}");
    // The other two scale factors have no error: RMS 3/√3.
    assert!(page.contains("<td>1.7 ppm</td>"), "{page}");
}

#[test]
fn a_nis_outside_its_interval_is_called_so() {
    let page = page(&synthetic(InstallationForm::General).report());
    assert!(page.contains("1.051, above") && !page.contains("1.002,"));
}

#[test]
fn noise_is_given_in_the_units_of_data_sheets() {
    let mut made_up = synthetic(InstallationForm::General);
    made_up.run.instrument.noise.gyro.gauss_markov = Some(GaussMarkov {
        sigma: 0.003 * DEG_PER_H,
        correlation_time: 3600.0,
    });
    let page = page(&made_up.report());
    for fact in [
        "random walk 0.0010 °/√h, Gauss–Markov bias 0.0030 °/h over 3600 s",
        "random walk 5.0 µg/√Hz",
        "position error 1.0 ″",
        "latitude 34.00000°",
    ] {
        assert!(page.contains(fact), "{fact}");
    }
}

#[test]
fn a_report_has_every_figure_and_names_every_parameter_in_every_form() {
    for form in InstallationForm::ALL {
        let made_up = synthetic(form);
        let files = written(&made_up.report());
        assert_sound(&files);
        assert_eq!(
            names(&files),
            [
                "attitudes.svg",
                "correlation.svg",
                "index.html",
                "innovations.svg",
                "navigation.svg",
                "noise.svg",
                "path.svg",
                "sigma.svg",
                "values.svg"
            ]
        );
        let (_, page) = &files[2];
        for name in (0..PARAMETERS).filter_map(|i| parameter_name(form, i)) {
            assert!(page.contains(&name), "{name}");
        }
    }
}

#[test]
fn the_same_result_makes_the_same_bytes() {
    let bytes = || written(&synthetic(InstallationForm::General).report());
    assert_eq!(bytes(), bytes());
}

#[test]
fn warnings_stand_before_every_figure_and_text_is_escaped() {
    let made_up = synthetic(InstallationForm::General);
    let files = written(&made_up.report());
    let page = &files
        .iter()
        .find(|(name, _)| name == "index.html")
        .unwrap()
        .1;
    let warning = page.find(&made_up.outcome.findings[0].to_string()).unwrap();
    assert!(warning < page.find("<figure").unwrap());
    assert!(page.contains("&lt;IMU&gt; &amp; co"));
}

#[test]
fn a_parameter_that_keeps_its_prior_sigma_is_marked() {
    let mut made_up = synthetic(InstallationForm::General);
    assert!(!page(&made_up.report()).contains("not observed"));
    made_up.outcome.prior_sigma[2] = 1.5 * made_up.outcome.estimate.sigma()[2];
    assert!(page(&made_up.report()).contains("not observed"));
}

#[test]
fn without_truth_or_baseline_no_error_is_claimed() {
    let made_up = synthetic(InstallationForm::General);
    let mut navigation = made_up.navigation.clone();
    for moment in navigation.iter_mut().flat_map(|of| &mut of.outlook) {
        moment.error = None;
    }
    let mut report = made_up.report();
    assert!(page(&report).contains("EKF: largest"));
    report.truth = None;
    report.navigation = Ok(&navigation);
    let files = written(&report);
    assert_sound(&files);
    let page = page(&report);
    assert!(!page.contains("error / σ") && !page.contains("EKF: largest"));
    assert!(page.contains("The truth is not known"));
    report.closed_form = None;
    report.navigation = Ok(&navigation[1..]);
    assert_sound(&written(&report));
}

#[test]
fn a_closed_form_alone_is_reported() {
    let made_up = synthetic(InstallationForm::SixAngle);
    let mut report = made_up.report();
    report.outcome = None;
    report.navigation = Ok(&made_up.navigation[..1]);
    let files = written(&report);
    assert_sound(&files);
    assert_eq!(
        names(&files),
        [
            "correlation.svg",
            "index.html",
            "navigation.svg",
            "path.svg",
            "values.svg"
        ]
    );
}

#[test]
fn a_run_without_a_table_is_reported() {
    let mut made_up = synthetic(InstallationForm::General);
    made_up.run.recording.table = None;
    let innovations = &mut made_up.outcome.innovations;
    innovations.retain(|i| i.observation == Observation::Velocity);
    made_up.outcome.consistency.table = Nis {
        mean: f64::NAN,
        count: 0,
        interval: (f64::NAN, f64::NAN),
        lag_one: f64::NAN,
    };
    let report = made_up.report();
    let files = written(&report);
    assert_sound(&files);
    let page = page(&report);
    for absent in ["table attitude", "live"] {
        assert!(!page.contains(absent), "{absent}");
    }
    assert!(!summary(&report).contains("table –"));
}

#[test]
fn a_group_of_fixed_parameters_has_neither_error_nor_figure() {
    let mut made_up = synthetic(InstallationForm::ThreeAngle);
    let mut groups = Group::all();
    let installation = groups.find(|group| group.title() == "accel misalignment E");
    let fixed = installation
        .unwrap()
        .parameters(InstallationForm::ThreeAngle);
    for &i in &fixed {
        for covariance in [
            &mut made_up.outcome.estimate.covariance,
            &mut made_up.closed.covariance,
        ] {
            covariance.row_mut(i).fill(0.0);
            covariance.column_mut(i).fill(0.0);
        }
    }
    let report = made_up.report();
    let files = written(&report);
    assert_sound(&files);
    let (_, text) = files.iter().find(|(file, _)| file == "sigma.svg").unwrap();
    assert!(text.contains("accel scale factor K") && !text.contains("accel misalignment E"));
    let row = summary(&report);
    let row = row
        .lines()
        .rfind(|line| line.contains("accel misalignment E"));
    assert!(row.unwrap().contains("–"), "{row:?}");
}

#[test]
fn a_parameter_held_fixed_has_no_sigma_and_no_correlation() {
    let mut made_up = synthetic(InstallationForm::General);
    let fixed = PARAMETERS - 1;
    let covariance = &mut made_up.outcome.estimate.covariance;
    covariance.row_mut(fixed).fill(0.0);
    covariance.column_mut(fixed).fill(0.0);
    let files = written(&made_up.report());
    assert_sound(&files);
    let text = |name: &str| &files.iter().find(|(file, _)| file == name).unwrap().1;
    assert!(text("index.html").contains("(fixed)"));
    assert!(text("correlation.svg").contains("accel D y"));
    assert!(!text("correlation.svg").contains("accel D z"));
}

#[test]
fn a_filter_that_saw_next_to_nothing_is_reported() {
    for moments in 0..3 {
        let mut made_up = synthetic(InstallationForm::General);
        made_up.outcome.history.truncate(moments);
        made_up.outcome.innovations.truncate(moments);
        made_up.outcome.passes.clear();
        made_up.outcome.converged = false;
        if moments == 0 {
            made_up.outcome.estimate.covariance = ParameterMatrix::zeros();
        }
        made_up.dwells.clear();
        if let Some(table) = &mut made_up.run.recording.table {
            table.time.clear();
            table.attitude.clear();
        }
        made_up.run.recording.imu.gyro.to_mut().truncate(moments);
        made_up.run.recording.imu.accel.to_mut().truncate(moments);
        let page = page(&made_up.report());
        assert!(!page.contains("NaN"));
        assert!(page.contains("NOT CONVERGED"));
    }
}

#[test]
fn a_missing_directory_is_named() {
    let made_up = synthetic(InstallationForm::General);
    let error = write(&made_up.report().document(), Path::new("no/such/place")).unwrap_err();
    assert!(error.to_string().contains("no/such/place"), "{error}");
}

#[test]
fn a_site_that_cannot_be_navigated_from_is_said_to_be_one() {
    let made_up = synthetic(InstallationForm::General);
    let mut report = made_up.report();
    let pole = NavigationStudyError::from(NearPole { latitude: 1.57 });
    report.navigation = Err(&pole);
    let files = written(&report);
    assert_sound(&files);
    assert!(!names(&files).contains(&"navigation.svg"));
    assert!(page(&report).contains("Not navigated"));
    assert!(!summary(&report).contains("nmile"));
}

#[test]
fn the_position_error_at_the_end_stands_in_the_summary() {
    let mut made_up = synthetic(InstallationForm::General);
    let end = made_up.navigation[1].outlook.last_mut().unwrap();
    end.error.as_mut().unwrap().position = nalgebra::Vector3::new(3.0, -4.0, 0.0) * 1852.0;
    end.sigma
        .as_mut()
        .unwrap()
        .fixed_rows_mut::<3>(6)
        .fill(1852.0);
    let summary = summary(&made_up.report());
    assert!(summary.contains("EKF 5.00 nmile (σ 1.41)"), "{summary}");
}

/// Evidence for a term that the path shows, with this probability that it is present.
fn evidence(present: f64) -> TermEvidence {
    TermEvidence {
        term: ErrorTerm::Instrument(Term::GyroAsymmetry),
        shown: false,
        present,
        remaining: 0.1,
        sigma_factors: [None; 6],
    }
}

/// The row that the table of error terms has for this evidence.
fn explained(evidence: TermEvidence) -> Vec<String> {
    let table = terms::explained(&[evidence]);
    let row = table.sections[0][0].clone();
    assert_eq!(row.len(), table.columns.len());
    row
}

#[test]
fn a_term_is_estimated_if_requested_and_otherwise_present_with_a_probability() {
    for (present, said) in [
        (1.0, "estimated"),
        (0.9995, "> 99.9 %"),
        (0.998, "99.8 %"),
        (0.95, "95 %"),
        (0.0321, "3.2 %"),
        (1e-9, "< 0.1 %"),
    ] {
        assert_eq!(explained(evidence(present))[1], said);
    }
}

#[test]
fn terms_that_were_requested_stand_before_those_that_may_be_present() {
    let table = terms::explained(&[evidence(0.2), evidence(1.0), evidence(0.3)]);
    let present = |section: &Vec<Vec<String>>| -> Vec<String> {
        section.iter().map(|row| row[1].clone()).collect()
    };
    let present: Vec<_> = table.sections.iter().map(present).collect();
    assert_eq!(present, [vec!["estimated"], vec!["20 %", "30 %"]]);
}

#[test]
fn the_group_whose_sigma_grows_most_with_a_term_is_named() {
    let grows = |sigma_factors| {
        let evidence = TermEvidence {
            sigma_factors,
            ..evidence(0.5)
        };
        explained(evidence)[2].clone()
    };
    let factors = [Some(1.1), None, Some(1.704), None, Some(1.2), None];
    assert_eq!(grows(factors), "gyro D × 1.70");
    assert_eq!(grows([Some(1.004); 6]), NONE);
}

#[test]
fn a_term_that_the_path_does_not_show_has_the_moves_that_do() {
    assert_eq!(explained(evidence(0.5))[3], "yes");
    let hidden = TermEvidence {
        remaining: 0.9,
        ..evidence(0.5)
    };
    assert_eq!(explained(hidden)[3], "no: turns both ways about each axis");
}

#[test]
fn the_evidence_for_every_error_term_stands_in_the_report() {
    let mut made_up = synthetic(InstallationForm::General);
    assert!(!page(&made_up.report()).contains("gyro asymmetry"));
    made_up.outcome.terms = vec![evidence(0.25)];
    let page = page(&made_up.report());
    assert!(page.contains("gyro asymmetry") && page.contains("25 %"));
}

#[test]
fn a_budget_names_the_inputs_that_it_takes_as_exact() {
    let estimate = synthetic(InstallationForm::General).outcome.estimate;
    let exact = |sources: &[BudgetSource]| {
        let part = |&source: &BudgetSource| BudgetPart {
            source,
            covariance: estimate.covariance,
            degrees_of_freedom: f64::INFINITY,
        };
        let parts = sources.iter().map(part).collect();
        let notes = budget::table(&Budget { parts }, &estimate).notes.concat();
        ["Taken as exact", "latitude", "gravity ("].map(|words| notes.contains(words))
    };
    assert_eq!(exact(&[BudgetSource::Prior]), [true; 3]);
    assert_eq!(exact(&[BudgetSource::EarthRate]), [true, false, true]);
    let both = [BudgetSource::EarthRate, BudgetSource::Gravity];
    assert_eq!(exact(&both), [false; 3]);
}
