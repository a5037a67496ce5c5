use super::*;
use crate::attitude::{log, matrix};
use crate::calibration::ErrorTerm;
use crate::imu::InstallationForm;
use crate::models::{InstallationModel, Place};
use crate::turntable::{AXIS_ERRORS, Motion, axis_response};
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
fn table_errors_move_neither_truth_nor_noise() {
    let plain = demo().simulate(7, 3).unwrap();
    let mut scenario = demo();
    scenario.table.errors.position *= 10.0;
    scenario.table.errors.reading = 0.0;
    let other = scenario.simulate(7, 3).unwrap();
    assert_eq!(plain.truth, other.truth);
    assert_eq!(plain.run.recording.imu, other.run.recording.imu);
    assert_ne!(plain.run.recording.table, other.run.recording.table);
}

#[test]
fn the_paper_s_draw_keeps_its_bounds_in_every_form() {
    for form in InstallationForm::ALL {
        let mut scenario = demo();
        scenario.installation = InstallationModel::load(form.name(), &Place::Embedded).unwrap();
        for stream in 0..100 {
            for (sensor, scale, bias, half_width) in [
                (
                    Sensor::Gyro,
                    5.0 / 2000.0,
                    25.0 * DEG_PER_H,
                    2.5 * DEG_PER_H,
                ),
                (Sensor::Accel, 5.0 / 700.0, 20.0 / 700.0, 5.0 / 700.0),
            ] {
                let mut rng = Draws::GyroTruth.generator(2, stream);
                let triad = scenario.draw_truth(sensor, &mut rng);
                let within = |offset: f64, bound: f64| offset.abs() <= bound * (1.0 + 1e-6);
                assert!(triad.scale.iter().all(|k| within(k - 1.0, scale)));
                assert!(triad.bias.iter().all(|d| within(d - bias, half_width)));
                assert!(triad.angles.iter().all(|&e| within(e, 0.1 * DEGREE)));
                let drawn = triad.angles.iter().filter(|&&e| e != 0.0).count();
                assert_eq!(drawn, form.angle_names().len());
            }
        }
    }
}

#[test]
fn the_prior_is_the_draw_s_mean_and_standard_deviation() {
    let prior = demo().simulate(1, 0).unwrap().run.instrument.prior;
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
    let table = scenario
        .simulate(1, 0)
        .unwrap()
        .run
        .recording
        .table
        .unwrap();
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
        let tau = -log(&(matrix(attitude) * motion.at(time).attitude.transpose()));
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
    let [read, of_crooked] =
        [&plain, &crooked].map(|made| made.run.recording.table.as_ref().unwrap());
    assert_eq!(read.attitude, of_crooked.attitude);
    assert_eq!(plain.run.table.geometry, TableGeometry::default());
    assert_ne!(crooked.run.table.geometry, TableGeometry::default());
    assert_ne!(
        plain.run.recording.imu.accel,
        crooked.run.recording.imu.accel
    );
}

#[test]
fn pulses_add_up_to_the_increments_within_a_count() {
    let pulses = demo().simulate(1, 0).unwrap().run.recording.imu;
    let increments = Scenario {
        output: Output::Increment,
        ..demo()
    }
    .simulate(1, 0)
    .unwrap()
    .run
    .recording
    .imu;
    for (counted, integral, pulse) in [
        (&pulses.gyro, &increments.gyro, pulses.pulse.gyro),
        (&pulses.accel, &increments.accel, pulses.pulse.accel),
    ] {
        let mut lag = Vector3::zeros();
        for (counted, integral) in counted.iter().zip(integral.iter()) {
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
    let imu = &simulated.run.recording.imu;
    // The first dwell: model output is constant, so the scatter is the noise.
    let still = 0..5900;
    for (samples, noise) in [
        (&imu.gyro, &simulated.run.instrument.noise.gyro),
        (&imu.accel, &simulated.run.instrument.noise.accel),
    ] {
        let samples = samples.part(still.clone());
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

#[test]
fn every_attitude_of_the_nineteen_positions_agrees_with_an_independent_simulation() {
    // Ideal increments of the same sequence, made with PSINS (attrottt, avp2imu) under GNU Octave, to
    // which the true K, E and D below were applied. Printed to twelve digits.
    let samples = [
        (
            1000,
            [4.13584370037e-07, -1.29521040954e-08, 5.82779004082e-07],
            [0.0979243396085, 0.0016948770956, -0.00172900848874],
        ),
        (
            25500,
            [5.92346069514e-07, -1.31230442363e-08, -4.32767029216e-07],
            [-0.00171922674893, 0.00169004619087, -0.0979614192986],
        ),
        (
            50000,
            [-8.21115036153e-09, 5.87613328963e-07, 4.03994883399e-07],
            [0.00169992649202, -0.00172890709131, 0.097902737401],
        ),
        (
            94100,
            [-8.24304605622e-09, -4.27951532004e-07, 5.82556051075e-07],
            [0.00169992649201, -0.097952618348, -0.00175283151649],
        ),
    ];
    let given = |scale: [f64; 3], angles: [f64; 6], bias: [f64; 3]| Given {
        scale: Some(Vector3::from(scale).add_scalar(-1.0)),
        angles: Some(angles.into()),
        bias: Some(bias.into()),
    };
    let mut scenario = Scenario::load("nineteen-position").unwrap();
    scenario.output = Output::Increment;
    scenario.site.gravity = 9.796493808290316;
    scenario.instrument.noise = PerSensor::default();
    scenario.given = PerSensor {
        gyro: given(
            [0.9999900058761665, 0.9999800293811254, 0.9999700716906613],
            [
                4.8481852644592604e-05,
                9.696370528918521e-05,
                0.00014544700899964399,
                0.00019392934533285863,
                0.00024241409559880913,
                0.0002908969147185709,
            ],
            [
                -4.84813681109536e-07,
                -9.69627362219072e-07,
                -1.4544410433286078e-06,
            ],
        ),
        accel: given(
            [0.99999, 0.999980001175245, 0.9999700152783381],
            [
                0.0,
                0.0,
                4.848233770072899e-05,
                0.0,
                9.69656437097446e-05,
                0.0001454484655646169,
            ],
            [-0.00097803267715, -0.0019560653543, -0.00293409803145],
        ),
    };
    let imu = scenario.simulate(1, 0).unwrap().run.recording.imu;
    assert_eq!(imu.len(), 98_200);
    for (k, gyro, accel) in samples {
        // The gyros differ by the last digit of the Earth's rate, the accelerometers by the printing.
        assert!((imu.gyro.at(k) - Vector3::from(gyro)).norm() < 2e-14);
        assert!((imu.accel.at(k) - Vector3::from(accel)).norm() < 2e-13);
    }
}

#[test]
fn the_axes_of_a_table_turn_it_by_their_errors_wherever_it_stands() {
    let mut scenario = demo();
    for kind in AxisError::ALL {
        scenario = scenario.with_error_term(ErrorTerm::TableAxes(kind));
    }
    let mut rng = Draws::Imperfection.generator(5, 0);
    let imperfection = Imperfection::draw(&scenario.table, || StandardNormal.sample(&mut rng));
    let motion = |imperfection: &Imperfection| {
        Motion::new(&scenario.table, &scenario.path, imperfection).unwrap()
    };
    let (real, read) = (
        motion(&imperfection),
        motion(&Imperfection::none(&scenario.table)),
    );
    let none = Imperfection::none(&scenario.table);
    let drive = Drive::new(&scenario, none, TermVector::zeros()).unwrap();
    let errors = scenario.geometry(&imperfection);
    let errors = errors.fixed_rows::<AXIS_ERRORS>(3);
    assert!(errors.iter().all(|&error| error != 0.0));
    for (start, end) in read.dwells() {
        let time = 0.5 * (start + end);
        let reading = (time * scenario.reading_rate) as usize;
        let turned = log(&(real.at(time).attitude * read.at(time).attitude.transpose()));
        // Of second order in some tens of seconds of arc.
        let off = turned - axis_response(&drive.axes[reading]) * errors;
        assert!(off.norm() < 0.01 * ARCSEC, "{time}: {off} of {turned}");
    }
}
