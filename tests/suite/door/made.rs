//! A run made up with every optional part.

use nalgebra::{UnitQuaternion, Vector3};
use turncal::earth::Site;
use turncal::imu::{GaussMarkov, Instrument, MotionNoise, Noise, PerSensor, Prior, Sensor, Term};
use turncal::recording::{LabelledMotion, Recording, Segment, TableLog};
use turncal::run::{Run, Standstill};
use turncal::turntable::TableAccuracy;
use turncal::units::DEGREE;

/// A run that turns and stands, with every optional part.
pub fn made_run(name: &str) -> Run {
    let gyro = (0..300).map(|k| Vector3::new(1.0, -2.0, 0.01) * 1e-3 * f64::from(k).sin());
    let accel =
        (0..300).map(|k| Vector3::new(0.1, -0.02, 9.8) / 128.0 * (1.0 + 1e-3 * f64::from(k)));
    let (gyro, accel): (Vec<_>, Vec<_>) = (gyro.collect(), accel.collect());
    let samples = Recording::from_samples(name, 3.25, 1.0 / 128.0, gyro, accel).unwrap();
    let recording = Recording {
        meta: [("serial", "A \"7\""), ("notes", "two\nlines")]
            .map(|(name, value)| (name.to_owned(), value.to_owned()))
            .into(),
        table: Some(TableLog {
            time: (0..20).map(|k| 3.25 + 0.125 * f64::from(k)).collect(),
            attitude: (0..20)
                .map(|k| UnitQuaternion::new(Vector3::new(0.1, -0.2, 0.3) * f64::from(k)))
                .collect(),
            axes: Vec::new(),
        }),
        segments: vec![Segment {
            start: 3.5,
            end: 4.25,
            samples: 32..128,
            label: "rot_x+360".to_owned(),
            motion: Some(LabelledMotion::Turns {
                axis: Vector3::x(),
                angle: 360.0 * DEGREE,
            }),
        }],
        ..samples
    };
    let prior = Prior {
        scale_sigma: Vector3::new(1e-3, 2e-3, 3e-3),
        installation_sigma: Vector3::new(1e-4, 2e-4, 3e-4),
        bias: Vector3::new(1e-5, -2e-5, 3e-5),
        bias_sigma: Vector3::new(1e-6, 2e-6, 3e-6),
    };
    let noise = PerSensor {
        gyro: Noise {
            random_walk: 3e-7,
            gauss_markov: Some(GaussMarkov {
                sigma: 5e-8,
                correlation_time: 300.0,
            }),
        },
        accel: Noise {
            random_walk: 5e-5,
            gauss_markov: None,
        },
    };
    let instrument = Instrument {
        motion_noise: PerSensor {
            gyro: MotionNoise {
                by_motion: 1e-3,
                by_duration: 0.5 * DEGREE,
            },
            accel: MotionNoise {
                by_motion: 0.25,
                by_duration: 2.0,
            },
        },
        unit: PerSensor {
            gyro: "rad".to_owned(),
            accel: "m/s".to_owned(),
        },
        absent_terms: vec![Term::SizeEffect, Term::GSensitivity],
        ..Instrument::new(
            PerSensor {
                gyro: prior,
                accel: prior,
            },
            noise,
        )
    };
    Run {
        table: TableAccuracy {
            position_sigma: 5e-6,
            reading_sigma: 2e-6,
            settling_sigma: 3e-6,
            geometry: Default::default(),
        },
        standstill: Standstill {
            sigma: PerSensor {
                gyro: Some(3e-8),
                accel: Some(2e-6),
            },
            turning: 0.25 * DEGREE,
            position_sigma: 0.4,
        },
        segment_sigma: 2.0 * DEGREE,
        ..Run::new(
            recording,
            instrument,
            Site::with_normal_gravity(0.7, -1.9, 123.4),
        )
    }
}

/// Equal but for the rounding of conversions.
pub fn assert_same(a: &Run, b: &Run) {
    let near = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * a.abs(), "{a} {b}");
    let near3 = |a: Vector3<f64>, b: Vector3<f64>| assert!((a - b).norm() <= 1e-12 * a.norm());
    assert_eq!(
        (
            &a.recording.name,
            &a.recording.meta,
            &a.instrument.unit,
            &a.instrument.nominal,
            &a.instrument.motion_noise,
            &a.instrument.absent_terms,
            &a.recording.segments,
            &a.standstill
        ),
        (
            &b.recording.name,
            &b.recording.meta,
            &b.instrument.unit,
            &b.instrument.nominal,
            &b.instrument.motion_noise,
            &b.instrument.absent_terms,
            &b.recording.segments,
            &b.standstill
        )
    );
    near(a.site.latitude, b.site.latitude);
    near(a.site.longitude, b.site.longitude);
    assert_eq!(
        (a.site.height, a.site.gravity),
        (b.site.height, b.site.gravity)
    );
    assert_eq!(
        (
            a.recording.imu.start(),
            a.recording.imu.period,
            a.recording.imu.continuous,
            a.recording.imu.pulse,
            a.recording.imu.len()
        ),
        (
            b.recording.imu.start(),
            b.recording.imu.period,
            b.recording.imu.continuous,
            b.recording.imu.pulse,
            b.recording.imu.len()
        )
    );
    for sensor in Sensor::ALL {
        let (noise_a, noise_b) = (
            a.instrument.noise.get(sensor),
            b.instrument.noise.get(sensor),
        );
        near(noise_a.random_walk, noise_b.random_walk);
        assert_eq!(
            noise_a.gauss_markov.is_some(),
            noise_b.gauss_markov.is_some()
        );
        if let (Some(a), Some(b)) = (noise_a.gauss_markov, noise_b.gauss_markov) {
            near(a.sigma, b.sigma);
            near(a.correlation_time, b.correlation_time);
        }
        let (prior_a, prior_b) = (
            a.instrument.prior.get(sensor),
            b.instrument.prior.get(sensor),
        );
        near3(prior_a.scale_sigma, prior_b.scale_sigma);
        near3(prior_a.installation_sigma, prior_b.installation_sigma);
        near3(prior_a.bias, prior_b.bias);
        near3(prior_a.bias_sigma, prior_b.bias_sigma);
    }
    for (a, b) in a.recording.imu.gyro.iter().zip(b.recording.imu.gyro.iter()) {
        near3(a, b);
    }
    for (a, b) in a
        .recording
        .imu
        .accel
        .iter()
        .zip(b.recording.imu.accel.iter())
    {
        near3(a, b);
    }
    assert_eq!(a.recording.table.is_some(), b.recording.table.is_some());
    if let (Some(log_a), Some(log_b)) = (&a.recording.table, &b.recording.table) {
        near(a.table.position_sigma, b.table.position_sigma);
        near(a.table.reading_sigma, b.table.reading_sigma);
        near(a.table.settling_sigma, b.table.settling_sigma);
        assert_eq!(log_a.time, log_b.time);
        for (a, b) in log_a.attitude.iter().zip(&log_b.attitude) {
            assert!(a.angle_to(b) < 1e-14);
        }
    }
}
