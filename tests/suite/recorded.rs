//! Records that other programs made, with known truth.

use turncal::calibration::{
    NoisePolicy, Options, Outcome, PARAMETERS, Problem, UNWATCHED, estimate, to_vector, triads_of,
};
use turncal::imu::{InstallationForm, PARAMETERS as PER_TRIAD, ParameterKind, Triad};
use turncal::units::{ARCSEC, DEG_PER_H, MICRO_G, PPM};

use crate::shared::{read, shared};

/// With the noise that the run states, which is that of its data, and without terms that it does not state.
fn stated() -> Options {
    Options::default()
        .noise(NoisePolicy::Stated)
        .no_auto_terms()
}

/// Largest errors: K in ppm, E in ″, D in °/h or µg, gyro before accelerometer.
fn calibrated(name: &str) -> Option<(Outcome, [f64; 6], f64)> {
    let directory = shared(name)?;
    let run = read(&directory);
    let truth = turncal_files::read_calibration(&directory.join("truth.json")).unwrap();
    let outcome = estimate(&Problem::new(&run, &stated()), UNWATCHED).unwrap();
    let truth = triads_of(&truth, &run.instrument.nominal, InstallationForm::General);
    let error = outcome.estimate.vector() - to_vector(&truth);
    let mut largest = [0f64; 6];
    for index in 0..PARAMETERS {
        let (triad, kind) = (index / PER_TRIAD, Triad::kind(index % PER_TRIAD));
        let (place, unit) = match kind {
            ParameterKind::Scale => (0, PPM),
            ParameterKind::Installation => (1, ARCSEC),
            ParameterKind::Bias => (2, [DEG_PER_H, MICRO_G][triad]),
        };
        let largest = &mut largest[3 * triad + place];
        *largest = largest.max((error[index] / unit).abs());
    }
    let sigmas = error.component_div(&outcome.estimate.sigma()).amax();
    println!("{name}: largest errors {largest:.4?}, {sigmas:.2} σ");
    Some((outcome, largest, sigmas))
}

fn assert_within(largest: [f64; 6], limits: [f64; 6]) {
    for (found, limit) in largest.into_iter().zip(limits) {
        assert!(found <= limit, "{largest:?} beyond {limits:?}");
    }
}

#[test]
#[ignore = "slow: learns noise that is not there"]
fn a_record_without_noise_is_calibrated_whatever_is_learnt_of_its_noise() {
    let Some(directory) = shared("nineteen-position-clean") else {
        return;
    };
    let run = read(&directory);
    let outcome = estimate(&Problem::new(&run, &Options::default()), UNWATCHED).unwrap();
    assert!(outcome.converged);
}

#[test]
fn a_three_axis_run_in_counts_is_calibrated_within_four_passes() {
    let Some((outcome, largest, sigmas)) = calibrated("three-axis-counts") else {
        return;
    };
    assert!(outcome.converged && outcome.passes.len() <= 4);
    assert!(sigmas < 4.0);
    assert_within(largest, [1.0, 1.2, 0.012, 1.6, 1.2, 1.5]);
}

#[test]
fn nineteen_positions_without_noise_leave_no_more_than_the_floor_of_the_algorithm() {
    let Some((_, largest, _)) = calibrated("nineteen-position-clean") else {
        return;
    };
    // The record is exact: what is left is the floor of the algorithm.
    assert_within(largest, [0.005, 0.005, 0.0001, 0.005, 0.005, 0.02]);
}
