use super::*;
use crate::attitude::log;
use crate::imu::InstallationForm;
use crate::units::{ARCSEC, DEG_PER_H, DEGREE, PPM};

fn demo() -> Scenario {
    Scenario::load("demo").unwrap()
}

#[test]
fn the_same_seed_and_stream_give_the_same_bits_and_others_do_not() {
    let scenario = demo();
    let once = scenario.simulate(7, 3).unwrap();
    assert_eq!(once, scenario.simulate(7, 3).unwrap());
    assert_ne!(once.truth, scenario.simulate(7, 4).unwrap().truth);
    assert_ne!(once.truth, scenario.simulate(8, 3).unwrap().truth);
}

#[test]
fn the_table_s_errors_move_neither_truth_nor_noise() {
    let plain = demo().simulate(7, 3).unwrap();
    let mut scenario = demo();
    scenario.table.errors.position *= 10.0;
    scenario.table.errors.reading = 0.0;
    let other = scenario.simulate(7, 3).unwrap();
    assert_eq!(plain.truth, other.truth);
    assert_eq!(plain.run.imu, other.run.imu);
    assert_ne!(plain.run.table, other.run.table);
}

#[test]
fn the_paper_s_draw_keeps_its_bounds_in_every_form() {
    for form in InstallationForm::ALL {
        let mut scenario = demo();
        scenario.installation = models_installation(form);
        let of_form = scenario.simulate(1, 0).unwrap();
        for stream in 0..50 {
            let truth = PerSensor::from_fn(|sensor| {
                scenario.draw_truth(sensor, &mut Draws::GyroTruth.generator(2, stream))
            });
            for (triad, scale) in [(truth.gyro, 2500.0), (truth.accel, 5e6 / 700.0)] {
                assert_eq!(triad.form, form);
                assert!((triad.scale.add_scalar(-1.0)).amax() <= scale * PPM);
                assert!(triad.angles.amax() <= 0.1 * DEGREE);
                assert!(
                    triad.angles.iter().filter(|a| **a != 0.0).count() == form.angle_names().len()
                );
            }
            assert!(
                truth
                    .gyro
                    .bias
                    .iter()
                    .all(|d| (d / DEG_PER_H - 25.0).abs() <= 2.5)
            );
            assert!(
                truth
                    .accel
                    .bias
                    .iter()
                    .all(|d| (d - 20.0 / 700.0).abs() <= 5.0 / 700.0 + 1e-9)
            );
        }
        assert_eq!(of_form.truth.gyro.form, form);
    }
}

fn models_installation(form: InstallationForm) -> crate::models::InstallationModel {
    crate::models::InstallationModel::load(form.name(), &crate::models::Place::Embedded).unwrap()
}

#[test]
fn the_prior_is_the_draw_s_mean_and_standard_deviation() {
    let prior = demo().simulate(1, 0).unwrap().run.prior;
    let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
    assert!(close(prior.gyro.scale_sigma.x, 2500.0 * PPM / 3f64.sqrt()));
    assert!(close(
        prior.gyro.installation_sigma.y,
        360.0 * ARCSEC / 3f64.sqrt()
    ));
    assert!(close(prior.gyro.bias.z, 25.0 * DEG_PER_H));
    assert!(close(prior.accel.bias.x, 20.0 / 700.0));
    assert!(close(prior.accel.bias_sigma.x, 5.0 / 700.0 / 3f64.sqrt()));
}

#[test]
fn a_position_error_stays_while_the_table_stands_and_is_new_after_each_move() {
    let mut scenario = demo();
    scenario.table.errors.reading = 0.0;
    let table = scenario.simulate(1, 0).unwrap().run.table.unwrap();
    let motion = Motion::new(
        &scenario.table,
        &scenario.path,
        &Imperfection::none(&scenario.table),
    )
    .unwrap();
    assert_eq!(table.time[0], 0.0);
    let mut positions: Vec<(usize, Vector3<f64>)> = Vec::new();
    for (&time, attitude) in table.time.iter().zip(&table.attitude) {
        // Reading = exp(−[τ×]) true.
        let tau = -log(&(attitude * motion.at(time).attitude.transpose()));
        match positions.last() {
            Some((position, of_position)) if *position == motion.position(time) => {
                assert!((tau - of_position).norm() < 1e-14);
            }
            _ => positions.push((motion.position(time), tau)),
        }
    }
    assert_eq!(positions.len(), motion.dwells().count());
    let mean_square = positions
        .iter()
        .map(|(_, tau)| tau.norm_squared())
        .sum::<f64>()
        / (3 * positions.len()) as f64;
    assert!((mean_square.sqrt() / scenario.table.errors.position - 1.0).abs() < 0.4);
}

#[test]
fn level_and_north_errors_move_the_truth_but_not_the_reading() {
    let mut crooked = demo();
    crooked.table.errors.level = 5.0 * ARCSEC;
    crooked.table.errors.north = 20.0 * ARCSEC;
    crooked.table.errors.nonorthogonality = 3.0 * ARCSEC;
    let [plain, crooked] = [demo(), crooked].map(|scenario| scenario.simulate(1, 0).unwrap());
    assert_eq!(plain.run.table, crooked.run.table);
    assert_ne!(plain.run.imu.accel, crooked.run.imu.accel);
}

#[test]
fn pulses_add_up_to_the_increments_within_a_count() {
    let pulses = demo().simulate(1, 0).unwrap().run.imu;
    let increments = Scenario {
        output: Output::Increment,
        ..demo()
    }
    .simulate(1, 0)
    .unwrap()
    .run
    .imu;
    for (counted, integral, pulse) in [
        (&pulses.gyro, &increments.gyro, pulses.pulse.gyro),
        (&pulses.accel, &increments.accel, pulses.pulse.accel),
    ] {
        let mut lag = Vector3::zeros();
        for (counted, integral) in counted.iter().zip(integral) {
            let counts = counted / pulse;
            assert!((counts - counts.map(f64::round)).amax() < 1e-6);
            lag += counted - integral;
            assert!(lag.amax() < 0.5001 * pulse);
        }
    }
}

#[test]
fn what_standing_still_leaves_beside_the_model_is_the_stated_random_walk() {
    let scenario = Scenario {
        output: Output::Increment,
        ..demo()
    };
    let simulated = scenario.simulate(1, 0).unwrap();
    let imu = &simulated.run.imu;
    // The first dwell: model output is constant, so the scatter is the noise.
    let still = 0..5900;
    for (samples, noise) in [
        (&imu.gyro, &simulated.run.noise.gyro),
        (&imu.accel, &simulated.run.noise.accel),
    ] {
        let samples = &samples[still.clone()];
        let mean = samples.iter().sum::<Vector3<f64>>() / samples.len() as f64;
        let variance = samples
            .iter()
            .map(|s| (s - mean).norm_squared())
            .sum::<f64>()
            / (3 * samples.len()) as f64;
        let density = (variance / imu.period).sqrt();
        assert!((density / noise.random_walk - 1.0).abs() < 0.02);
    }
}
