//! A run made up with every optional part.

use nalgebra::Vector3;
use turncal::attitude;
use turncal::earth::Site;
use turncal::imu::{Instability, Noise, Nominal, PerSensor, Prior, Sensor};
use turncal::recording::{LabelledMotion, Segment};
use turncal::recording::{ImuSamples, TableLog};
use turncal::run::{Run, Standstill};
use turncal::units::DEGREE;

/// A run that turns and stands, with every optional part.
pub fn made_run(name: &str) -> Run {
    let imu = ImuSamples {
        start: 3.25,
        period: 1.0 / 128.0,
        continuous: true,
        gyro: (0..300)
            .map(|k| Vector3::new(1.0, -2.0, 0.01) * 1e-3 * f64::from(k).sin())
            .collect(),
        accel: (0..300)
            .map(|k| Vector3::new(0.1, -0.02, 9.8) / 128.0 * (1.0 + 1e-3 * f64::from(k)))
            .collect(),
        pulse: PerSensor::default(),
        faults: Vec::new(),
        bridges: Vec::new(),
        log: None,
    };
    let prior = Prior {
        scale_sigma: Vector3::new(1e-3, 2e-3, 3e-3),
        installation_sigma: Vector3::new(1e-4, 2e-4, 3e-4),
        bias: Vector3::new(1e-5, -2e-5, 3e-5),
        bias_sigma: Vector3::new(1e-6, 2e-6, 3e-6),
    };
    Run {
        further_sigma: Default::default(),
        name: name.to_owned(),
        site: Site::with_normal_gravity(0.7, -1.9, 123.4),
        meta: [("serial", "A \"7\""), ("notes", "two\nlines")]
            .map(|(name, value)| (name.to_owned(), value.to_owned()))
            .into(),
        imu,
        noise: PerSensor {
            gyro: Noise {
                random_walk: 3e-7,
                instability: Some(Instability {
                    sigma: 5e-8,
                    correlation_time: 300.0,
                }),
            },
            accel: Noise {
                random_walk: 5e-5,
                instability: None,
            },
        },
        prior: PerSensor {
            gyro: prior,
            accel: prior,
        },
        nominal: PerSensor {
            gyro: Nominal(Vector3::repeat(1.0)),
            accel: Nominal(Vector3::repeat(1.0)),
        },
        unit: PerSensor {
            gyro: "rad".to_owned(),
            accel: "m/s".to_owned(),
        },
        standstill: Standstill {
            velocity_sigma: Some(2e-6),
            position_sigma: 0.4,
        },
        table: Some(TableLog {
            time: (0..20).map(|k| 3.25 + 0.125 * f64::from(k)).collect(),
            attitude: (0..20)
                .map(|k| attitude::exp(Vector3::new(0.1, -0.2, 0.3) * f64::from(k)))
                .collect(),
            position_sigma: 5e-6,
            reading_sigma: 2e-6,
            geometry: Default::default(),
            tilts: Vec::new(),
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
        segment_sigma: 2.0 * DEGREE,
        files: Vec::new(),
        notes: Vec::new(),
    }
}

/// Equal but for the rounding of conversions.
pub fn assert_same(a: &Run, b: &Run) {
    let near = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * a.abs(), "{a} {b}");
    let near3 = |a: Vector3<f64>, b: Vector3<f64>| assert!((a - b).norm() <= 1e-12 * a.norm());
    assert_eq!(
        (
            &a.name,
            &a.meta,
            &a.unit,
            &a.nominal,
            &a.segments,
            &a.standstill
        ),
        (
            &b.name,
            &b.meta,
            &b.unit,
            &b.nominal,
            &b.segments,
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
            a.imu.start,
            a.imu.period,
            a.imu.continuous,
            a.imu.pulse,
            a.imu.len()
        ),
        (
            b.imu.start,
            b.imu.period,
            b.imu.continuous,
            b.imu.pulse,
            b.imu.len()
        )
    );
    for sensor in Sensor::ALL {
        let (noise_a, noise_b) = (a.noise.get(sensor), b.noise.get(sensor));
        near(noise_a.random_walk, noise_b.random_walk);
        assert_eq!(noise_a.instability.is_some(), noise_b.instability.is_some());
        if let (Some(a), Some(b)) = (noise_a.instability, noise_b.instability) {
            near(a.sigma, b.sigma);
            near(a.correlation_time, b.correlation_time);
        }
        let (prior_a, prior_b) = (a.prior.get(sensor), b.prior.get(sensor));
        near3(prior_a.scale_sigma, prior_b.scale_sigma);
        near3(prior_a.installation_sigma, prior_b.installation_sigma);
        near3(prior_a.bias, prior_b.bias);
        near3(prior_a.bias_sigma, prior_b.bias_sigma);
    }
    for (a, b) in a.imu.gyro.iter().zip(&b.imu.gyro) {
        near3(*a, *b);
    }
    for (a, b) in a.imu.accel.iter().zip(&b.imu.accel) {
        near3(*a, *b);
    }
    assert_eq!(a.table.is_some(), b.table.is_some());
    if let (Some(a), Some(b)) = (&a.table, &b.table) {
        near(a.position_sigma, b.position_sigma);
        near(a.reading_sigma, b.reading_sigma);
        assert_eq!(a.time, b.time);
        for (a, b) in a.attitude.iter().zip(&b.attitude) {
            assert!((a - b).amax() < 1e-14);
        }
    }
}
