//! Positions and turns made by hand, without a table, and what is known of quality without a truth.

use nalgebra::Vector3;
use serde_json::Value;
use turncal::calibration::{CalibrationError, Reference, estimate, six_position};
use turncal::imu::{InstallationForm, PerSensor};
use turncal::simulation::Scenario;
use turncal::units::{DEGREE, MICRO_G, MILLI_G};

use crate::shared::{read, shared};

const FORM: InstallationForm = InstallationForm::General;

/// The parameters that imucal found in the same sections.
fn peer(directory: &std::path::Path, angle: &str) -> Value {
    let text = std::fs::read_to_string(directory.join("reference.json")).unwrap();
    let reference: Value = serde_json::from_str(&text).unwrap();
    reference["runs"][format!("expected_angle_{angle}")]["parameters"].clone()
}

fn near(found: f64, expected: &Value, tolerance: f64) {
    let expected = expected.as_f64().unwrap();
    let off = (found - expected).abs();
    assert!(off <= tolerance, "{found} against {expected}: {off:e}");
}

#[test]
fn labelled_sections_give_what_another_program_finds_in_them() {
    for (name, angle, unit) in [
        ("real-mems-six-position", "-360", DEGREE),
        ("real-mems-raw-sections", "360", DEGREE),
    ] {
        let Some(directory) = shared(name) else {
            return;
        };
        let run = read(&directory);
        let closed_form = six_position(&run, FORM).unwrap();
        assert_eq!(closed_form.reference, Reference::Labels);
        assert_eq!((closed_form.positions.accel, closed_form.turns), (6, 3));
        let record = closed_form.record(&run, &closed_form.quality(&run).unwrap());
        let peer = peer(&directory, angle);
        for i in 0..3 {
            let scale = record.accel.scale[i];
            near(scale, &peer["K_a"][i][i], 1e-6 * scale);
            near(
                record.accel.bias[i],
                &peer["b_a"][i],
                1e-6 * record.accel.bias[i].abs(),
            );
            for j in 0..3 {
                near(record.accel.installation[i][j], &peer["R_a"][i][j], 1e-6);
            }
            // The peer takes g-sensitivity off, which is the larger part of what is left.
            let scale = record.gyro.scale[i] * unit;
            near(scale, &peer["K_g"][i][i], 2e-4 * scale);
        }
    }
}

#[test]
fn sections_laid_end_to_end_are_refused_where_turns_must_be_navigated() {
    let Some(directory) = shared("real-mems-raw-sections") else {
        return;
    };
    let mut run = read(&directory);
    let refused = estimate(&run, FORM, &|_| {}).unwrap_err();
    assert_eq!(refused, CalibrationError::NotContinuous);
    run.recording.segments.truncate(5);
    let refused = six_position(&run, FORM).unwrap_err().to_string();
    assert!(
        refused.contains("`y_down`") && refused.contains("each axis up and down"),
        "{refused}"
    );
}

#[test]
fn a_record_turned_by_hand_is_explained_better_than_by_labels() {
    let Some(directory) = shared("real-mems-six-position") else {
        return;
    };
    let run = read(&directory);
    let filtered = estimate(&run, FORM, &|_| {}).unwrap();
    assert!(filtered.converged);
    let by_filter = filtered.quality(&run).unwrap();
    let mut unlabelled = run.clone();
    unlabelled.segments.clear();
    let by_gravity = six_position(&unlabelled, FORM).unwrap();
    assert_eq!(by_gravity.reference, Reference::Gravity);
    // What imucal leaves over all standstills, and on those that it did not use.
    for all in [by_filter.all, by_gravity.quality(&unlabelled).unwrap().all] {
        println!("{all:?}");
        assert!(all.gravity.rms < 0.38 * MILLI_G);
        assert!(all.direction.rms < 0.645 * DEGREE);
    }
    let held_out = by_filter.held_out.unwrap();
    println!("{held_out:?}");
    assert!(held_out.gravity.rms < 0.51 * MILLI_G);
    assert!(held_out.direction.rms < 0.645 * DEGREE);
}

#[test]
fn errors_of_scale_show_in_gravity_and_in_turns_by_their_size() {
    let simulated = Scenario::load("demo").unwrap().simulate(6, 0).unwrap();
    let run = simulated.run;
    let outcome = estimate(&run, FORM, &|_| {}).unwrap();
    let quality = outcome.quality(&run).unwrap();
    // 5 µg/√Hz over 15 s and a bias instability; arc seconds of table and walk.
    assert!(quality.all.gravity.rms < 3.0 * MICRO_G);
    assert!(quality.all.turns.rms < 5.0 / 3600.0 * DEGREE);
    assert!(quality.held_out.unwrap().gravity.rms < 3.0 * MICRO_G);
    assert_eq!(quality.all.direction.count, run.dwells().len() - 1);

    let (wrong, size) = (100e-6, Vector3::repeat(1.0 - 100e-6));
    let mut spoilt = outcome.clone();
    let triads = &mut spoilt.estimate.triads;
    *triads = PerSensor::from_fn(|sensor| {
        let mut triad = *triads.get(sensor);
        triad.scale.component_mul_assign(&size);
        triad
    });
    let all = spoilt.quality(&run).unwrap().all;
    let expected = wrong * run.site.gravity;
    assert!((all.gravity.rms / expected - 1.0).abs() < 0.02, "{all:?}");
    assert!(
        (all.gravity.largest / expected - 1.0).abs() < 0.1,
        "{all:?}"
    );
    // The first turns are 720° about one axis each.
    let full = wrong * 720.0 * DEGREE;
    assert!((all.turns.largest / full - 1.0).abs() < 0.02, "{all:?}");
}
