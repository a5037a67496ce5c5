use nalgebra::{Matrix3, Vector3};

use super::*;
use crate::navigation::{ErrorMatrix, NavigationError, Solution};
use crate::units::ARCSEC;

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
    }
}

/// Errors that grow with time to two hours, σ half of them.
fn moments(covariance: bool) -> Vec<Epoch> {
    (0..=120)
        .map(|k| {
            let part = f64::from(k) / 120.0;
            let error = NavigationError {
                attitude: Vector3::new(3.0, -4.0, 5.0) * ARCSEC * part,
                velocity: Vector3::new(0.3, -0.4, 0.0) * part,
                position: Vector3::new(3.0, 4.0, 0.0) * NAUTICAL_MILE * part,
            };
            let sigma = error.to_vector() * 0.5;
            Epoch {
                time: f64::from(k) * INTERVAL,
                error,
                covariance: covariance
                    .then(|| ErrorMatrix::from_diagonal(&sigma.component_mul(&sigma))),
            }
        })
        .collect()
}

fn navigation<'a>(mission: &'a Mission, moments: &'a [Epoch]) -> Navigation<'a> {
    Navigation {
        calibration: "monday",
        truth: "truth",
        converged: true,
        terms: false,
        body_frame: BodyFrame::Table,
        only: None,
        mission,
        trajectory: None,
        moments,
    }
}

#[test]
fn the_document_is_hourly_and_has_lengths_of_components_and_of_their_sigma() {
    let (mission, moments) = (mission(), moments(true));
    let document = serde_json::to_value(navigation(&mission, &moments).document()).unwrap();
    let at = |pointer: &str| document.pointer(pointer).unwrap().as_f64().unwrap();
    assert_eq!(document["series"].as_array().unwrap().len(), 3);
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
        assert!(
            (at(pointer) - expected).abs() < 1e-9,
            "{pointer}: {}",
            at(pointer)
        );
    }
}

#[test]
fn without_covariance_nothing_is_predicted_and_that_is_said() {
    let (mission, moments) = (mission(), moments(false));
    let navigation = navigation(&mission, &moments);
    assert!(navigation.summary().contains("monday claims no σ"));
    let document = serde_json::to_value(navigation.document()).unwrap();
    assert!(document["series"][0]["sigma"].is_null());
    assert!(!navigation.csv().contains("sigma"));
}

#[test]
fn a_row_of_the_csv_has_as_many_numbers_as_the_heading_has_names() {
    let (mission, moments) = (mission(), moments(true));
    let text = navigation(&mission, &moments).csv();
    let mut lines = text.lines().map(|line| line.split(',').count());
    assert_eq!(lines.next(), Some(19));
    assert!(lines.clone().count() == 121 && lines.all(|count| count == 19));
}

#[test]
fn figures_of_one_and_of_several_navigations_name_units_and_lines() {
    let (small, none) = (moments(true), moments(false));
    let side = |name, moments| figures::Side { name, moments };
    let alone = figures::figures(&[side("error", &small[..])]).unwrap();
    assert!(alone[0].svg.contains("pitch, ″") && alone[2].svg.contains("position east, nmile"));
    let both = figures::figures(&[side("one", &small[..]), side("two", &none[..])]).unwrap();
    assert!(
        both.iter()
            .all(|f| f.svg.contains("one") && f.svg.contains("two"))
    );
    // A start alone has no extent.
    assert!(figures::figures(&[side("error", &small[..1])]).is_ok());
}
