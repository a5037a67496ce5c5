//! Positions and turns made by hand, without a table, and what is known of quality without a truth.

use nalgebra::Vector3;
use serde_json::Value;
use turncal::calibration::{
    Finding, Options, Problem, Reference, UNWATCHED, estimate, parameter_name, six_position,
};
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
        let problem = Problem::new(&run, &Options::default());
        let closed_form = six_position(&problem).unwrap();
        assert_eq!(closed_form.reference, Reference::Labels);
        assert_eq!((closed_form.positions.accel, closed_form.turns), (6, 3));
        let record = closed_form.record(&problem, &closed_form.quality(&problem).unwrap());
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
fn static_sections_laid_end_to_end_show_accelerometers_and_name_what_gyros_hide() {
    let Some(directory) = shared("real-mems-raw-sections") else {
        return;
    };
    let mut run = read(&directory);
    assert!(!run.recording.imu.continuous);
    let problem = Problem::new(&run, &Options::default());
    let outcome = estimate(&problem, UNWATCHED).unwrap();
    assert!(outcome.converged);
    // Six static sections, each a stretch of its own; the turns between them cannot be navigated.
    assert_eq!(problem.dwells().count(), 6);
    assert_eq!(outcome.prior_attitudes.len(), 6);
    let hidden = |finding: &Finding| match finding.kind.as_str() {
        "not-observed" => serde_json::from_value(finding.figures["parameters"].clone()).unwrap(),
        _ => Vec::new(),
    };
    let hidden: Vec<String> = outcome.findings.iter().flat_map(hidden).collect();
    // No turn shows the gyros, and six lengths of gravity do not tell six scales and biases from three angles.
    let turns = |name: &String| name.starts_with("gyro.scale") || name.contains("installation");
    let names = outcome.estimate.estimated();
    let names = names.filter_map(|k| parameter_name(FORM, k));
    let of_turns: Vec<String> = names.filter(turns).collect();
    assert_eq!((of_turns.len(), hidden), (12, of_turns));

    run.recording.segments.truncate(5);
    let closed_form = six_position(&Problem::new(&run, &Options::default())).unwrap();
    let sigma = closed_form.estimate.sigma();
    let scale = |axis: &str| {
        let name = format!("accel.scale.{axis}");
        let named = |&k: &usize| parameter_name(FORM, k).as_deref() == Some(&name);
        sigma[(0..sigma.len()).find(named).unwrap()]
    };
    let of = ["x", "y", "z"].map(scale);
    let (least, largest) = (
        of.into_iter().fold(f64::MAX, f64::min),
        of.into_iter().fold(0.0, f64::max),
    );
    // Where one end of an axis is missing its bias is that of the other positions, each off by a degree.
    assert!(largest > 10.0 * least, "{of:?}");
}

#[test]
#[ignore = "slow: several calibrations"]
fn a_record_turned_by_hand_is_explained_better_than_by_labels() {
    let Some(directory) = shared("real-mems-six-position") else {
        return;
    };
    let run = read(&directory);
    let problem = Problem::new(&run, &Options::default());
    let filtered = estimate(&problem, UNWATCHED).unwrap();
    assert!(filtered.converged);
    let by_filter = filtered.quality(&problem).unwrap();
    let mut unlabelled = run.clone();
    unlabelled.recording.segments.clear();
    let unlabelled = Problem::new(&unlabelled, &Options::default());
    let by_gravity = six_position(&unlabelled).unwrap();
    assert_eq!(by_gravity.reference, Reference::Gravity);
    // What imucal leaves over all standstills, and on those that it did not use.
    let all = by_filter.all;
    println!("{all:?}");
    assert!(all.gravity.rms < 0.38 * MILLI_G);
    assert!(all.direction.rms < 0.645 * DEGREE);
    let closed = by_gravity.quality(&unlabelled).unwrap().all;
    println!("{closed:?}");
    assert!(closed.direction.rms < 0.645 * DEGREE);
    let held_out = by_filter.held_out.unwrap();
    println!("{held_out:?}");
    // Every other dwell and its turn.
    let half = by_filter.all.gravity.count / 2;
    assert_eq!(held_out.gravity.count, half);
    assert!(held_out.gravity.rms != by_filter.all.gravity.rms);
    assert!(held_out.gravity.rms < 0.51 * MILLI_G);
    assert!(held_out.direction.rms < 0.645 * DEGREE);
}

#[test]
fn errors_of_scale_show_in_gravity_and_in_turns_by_their_size() {
    let simulated = Scenario::load("demo").unwrap().simulate(6, 0).unwrap();
    let run = simulated.run;
    let problem = Problem::new(&run, &Options::default());
    let outcome = estimate(&problem, UNWATCHED).unwrap();
    let quality = outcome.quality(&problem).unwrap();
    // 5 µg/√Hz over 15 s and a bias instability; arc seconds of table and walk.
    assert!(quality.all.gravity.rms < 3.0 * MICRO_G);
    assert!(quality.all.turns.rms < 5.0 / 3600.0 * DEGREE);
    assert!(quality.held_out.unwrap().gravity.rms < 3.0 * MICRO_G);
    assert_eq!(
        quality.all.direction.count,
        run.dwells(run.aiding()).len() - 1
    );

    let (wrong, size) = (100e-6, Vector3::repeat(1.0 - 100e-6));
    let mut spoilt = outcome.clone();
    let triads = &mut spoilt.estimate.triads;
    *triads = PerSensor::from_fn(|sensor| {
        let mut triad = *triads.get(sensor);
        triad.scale.component_mul_assign(&size);
        triad
    });
    let judged = spoilt.quality(&problem).unwrap();
    // What is held out is judged by a calibration of its own, which is not spoilt.
    assert_eq!(judged.held_out, quality.held_out);
    let all = judged.all;
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
