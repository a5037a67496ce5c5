//! What `run.toml` does not state: place, noise, sample period, prior.

use std::fs;
use std::path::Path;

use turncal::calibration::{Estimate, Options, Problem, UNWATCHED, estimate, parameter};
use turncal::imu::Sensor;
use turncal::run::Run;

use crate::shared::{read, shared};

/// A copy of a run without these tables and fields of `run.toml`.
fn without(directory: &Path, dropped: &[&str]) -> Run {
    let place = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            fs::copy(&path, place.path().join(path.file_name().unwrap())).unwrap();
        }
    }
    let text = fs::read_to_string(directory.join("run.toml")).unwrap();
    let mut table = "";
    let mut kept = String::new();
    for line in text.lines() {
        if let Some(name) = line.strip_prefix('[') {
            table = name.trim_end_matches(']');
        }
        let field = line.split('=').next().unwrap_or_default().trim();
        if !dropped.contains(&table) && !dropped.contains(&field) {
            kept += &format!("{line}\n");
        }
    }
    fs::write(place.path().join("run.toml"), kept).unwrap();
    read(place.path())
}

fn calibrated(run: &Run) -> Estimate {
    let outcome = estimate(&Problem::new(run, &Options::default()), UNWATCHED).unwrap();
    assert!(outcome.is_usable());
    outcome.estimate
}

#[test]
fn gyros_are_within_one_sigma_of_those_with_place_noise_and_period_stated() {
    for name in ["real-mems-lot-0", "real-mems-six-position"] {
        let Some(directory) = shared(name) else {
            return;
        };
        let stated = calibrated(&read(&directory));
        let dropped = ["site", "imu.noise", "sample_period_s"];
        let unstated = calibrated(&without(&directory, &dropped));
        let off = (unstated.vector() - stated.vector()).component_div(&unstated.sigma());
        for k in unstated.estimated().filter(|&k| k < 12) {
            assert!(off[k].abs() < 1.0, "{name} {k}: {}", off[k]);
        }
    }
}

#[test]
fn accelerometers_have_the_sigma_of_gravity_all_over_the_earth() {
    let Some(directory) = shared("real-mems-lot-0") else {
        return;
    };
    let estimate = calibrated(&without(&directory, &["site"]));
    let first = parameter(Sensor::Accel, 0);
    let of_scale = estimate.covariance[(first, first + 1)].sqrt();
    assert!(
        (of_scale / (0.015 / 9.806) - 1.0).abs() < 0.05,
        "{of_scale}"
    );
}
