use nalgebra::{Matrix3, Vector3};

use super::super::{svg, terminal};
use super::*;
use turncal::navigation::{NavigationError, Solution};
use turncal::units::ARCSEC;

fn mission() -> Mission {
    Mission {
        motion: Motion::Standing(Solution {
            attitude: Matrix3::identity(),
            velocity: Vector3::zeros(),
            latitude: 45.0 * DEGREE,
            longitude: 0.0,
            height: 0.0,
        }),
        intervals: 120,
        interval: 60.0,
    }
}

/// Errors that grow with time to two hours, σ half of them.
fn moments(sigma: bool) -> Vec<Outlook> {
    let moment = |k: u32| {
        let part = f64::from(k) / 120.0;
        let error = NavigationError {
            attitude: Vector3::new(3.0, -4.0, 5.0) * ARCSEC * part,
            velocity: Vector3::new(0.3, -0.4, 0.0) * part,
            position: Vector3::new(3.0, 4.0, 0.0) * NAUTICAL_MILE * part,
        };
        Outlook {
            time: f64::from(k) * INTERVAL,
            error: Some(error),
            sigma: sigma.then(|| error.to_vector().abs() * 0.5),
        }
    };
    (0..=120).map(moment).collect()
}

fn document(moments: &[Outlook]) -> Document {
    let navigated = MethodOutlook {
        method: "error",
        outlook: moments.to_vec(),
    };
    let navigation = Navigation {
        calibration: "monday",
        truth: "truth",
        verdict: Some(Word::Good),
        terms: false,
        body_frame: BodyFrame::Table,
        only: None,
        mission: &mission(),
        trajectory: None,
        navigated: &navigated,
    };
    navigation.document()
}

#[test]
fn data_are_hourly_and_have_lengths_of_components_and_of_their_sigma() {
    let data = document(&moments(true)).data;
    assert_eq!(data["series"].as_array().unwrap().len(), 3);
    for (pointer, expected) in [
        ("/series/1/t_h", 1.0),
        ("/series/1/position_nmile", 2.5),
        ("/series/2/velocity_m_s", 0.5),
        ("/series/2/sigma/position_nmile", 2.5),
        ("/max_abs/roll_deg", 4.0 / 3600.0),
        ("/final/position_north_nmile", 4.0),
        ("/drift_nmile_per_h", 2.5),
        ("/drift_nmile_per_40_h", 100.0),
    ] {
        let found = data.pointer(pointer).and_then(Value::as_f64).unwrap();
        assert!((found - expected).abs() < 1e-9, "{pointer}: {found}");
    }
}

#[test]
fn without_covariance_nothing_is_predicted_and_that_is_said() {
    let document = document(&moments(false));
    assert!(document.warnings.items[0].contains("monday states no σ"));
    assert!(document.data["series"][0]["sigma"].is_null());
    assert!(!document.files[0].1.contains("sigma"));
}

#[test]
fn a_row_of_the_csv_has_as_many_numbers_as_the_heading_has_names() {
    let document = document(&moments(true));
    let mut lines = document.files[0]
        .1
        .lines()
        .map(|line| line.split(',').count());
    assert_eq!(lines.next(), Some(20));
    assert!(lines.clone().count() == 121 && lines.all(|count| count == 20));
}

#[test]
fn a_navigation_is_shown_with_its_predicted_sigma() {
    insta::assert_snapshot!(terminal::text(&document(&moments(true)), Some(80)));
}

#[test]
fn figures_are_in_readable_units_and_drawn_of_a_start_alone() {
    for moments in [&moments(true)[..], &moments(true)[..1]] {
        let document = document(moments);
        let drawn = svg::drawn(document.plots());
        assert_eq!(drawn.len(), 3);
        if moments.len() > 1 {
            assert!(drawn[0].contains("pitch, ″") && drawn[2].contains("position east, nmile"));
        }
    }
}
