//! Every unit that a noise figure is stated in.

use super::Scale::{self, Increments, Linear, Power, Samples};
use super::{Convention, Quantity};
use crate::imu::Sensor;
use crate::units::{
    ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, DEGREE, MICRO_G, MILLIGAL, STANDARD_GRAVITY,
};

/// √3600: from the root of a second to that of an hour.
const SQRT_H: f64 = 60.0;

const fn convention(
    unit: &'static str,
    scale: Scale,
    meaning: &'static str,
    also: &'static [&'static str],
) -> Convention {
    Convention {
        unit,
        scale,
        meaning,
        also,
    }
}

/// A unit that means several things means the first of them that can be.
pub(super) const QUANTITIES: [Quantity; 6] = [
    Quantity {
        sensor: Sensor::Gyro,
        name: "angle random walk",
        conventions: &ANGLE_RANDOM_WALK,
    },
    Quantity {
        sensor: Sensor::Accel,
        name: "velocity random walk",
        conventions: &VELOCITY_RANDOM_WALK,
    },
    Quantity {
        sensor: Sensor::Gyro,
        name: "gyro rate random walk",
        conventions: &GYRO_RATE_RANDOM_WALK,
    },
    Quantity {
        sensor: Sensor::Accel,
        name: "accelerometer bias random walk",
        conventions: &ACCEL_RATE_RANDOM_WALK,
    },
    Quantity {
        sensor: Sensor::Gyro,
        name: "gyro bias instability",
        conventions: &GYRO_INSTABILITY,
    },
    Quantity {
        sensor: Sensor::Accel,
        name: "accelerometer bias instability",
        conventions: &ACCEL_INSTABILITY,
    },
];

const ANGLE_RANDOM_WALK: [Convention; 13] = [
    convention(
        "°/√h",
        Linear(DEG_PER_SQRT_H),
        "angle random walk: data sheets, turncal, PSINS `web`, KF-GINS `arw`",
        &["angle_random_walk_deg_per_sqrt_h", "web", "arw"],
    ),
    convention(
        "°/h/√Hz",
        Linear(DEG_PER_H),
        "rate noise density: data sheets of optical gyros",
        &[],
    ),
    convention(
        "°/s/√Hz",
        Linear(DEGREE),
        "rate noise density: data sheets of MEMS gyros",
        &[],
    ),
    convention(
        "m°/s/√Hz",
        Linear(1e-3 * DEGREE),
        "rate noise density (mdps/√Hz): data sheets of MEMS gyros",
        &["mdeg/s/sqrthz"],
    ),
    convention(
        "rad/s/√Hz",
        Linear(1.0),
        "rate noise density: Kalibr `gyroscope_noise_density`",
        &["gyroscope_noise_density", "rad/sqrts"],
    ),
    convention(
        "″/√s",
        Linear(ARCSEC),
        "angle random walk in a second",
        &["arcsec/sqrts"],
    ),
    convention(
        "rad²/s",
        Power(1.0),
        "power spectral density (rad/s)²/Hz, two-sided: Q of a Kalman filter, GTSAM",
        &["rad/s2/hz", "rad2/s2/hz"],
    ),
    convention(
        "°²/h",
        Power(DEG_PER_SQRT_H),
        "angle variance in an hour",
        &[],
    ),
    convention("rad/s", Samples(1.0), "1σ of each rate sample", &[]),
    convention("°/s", Samples(DEGREE), "1σ of each rate sample", &[]),
    convention("°/h", Samples(DEG_PER_H), "1σ of each rate sample", &[]),
    convention("rad", Increments(1.0), "1σ of each angle increment", &[]),
    convention("″", Increments(ARCSEC), "1σ of each angle increment", &[]),
];

const VELOCITY_RANDOM_WALK: [Convention; 11] = [
    convention(
        "µg/√Hz",
        Linear(MICRO_G),
        "noise density: data sheets, turncal, PSINS `wdb`",
        &["velocity_random_walk_ug_per_sqrt_hz", "wdb"],
    ),
    convention(
        "mg/√Hz",
        Linear(1e3 * MICRO_G),
        "noise density: data sheets",
        &[],
    ),
    convention(
        "m/s²/√Hz",
        Linear(1.0),
        "noise density: Kalibr `accelerometer_noise_density`; m/s/√s",
        &["accelerometer_noise_density", "m/s/sqrts"],
    ),
    convention(
        "m/s/√h",
        Linear(1.0 / SQRT_H),
        "velocity random walk: data sheets, KF-GINS `vrw`",
        &["vrw"],
    ),
    convention(
        "g/√Hz",
        Linear(STANDARD_GRAVITY),
        "noise density: data sheets",
        &[],
    ),
    convention(
        "m²/s³",
        Power(1.0),
        "power spectral density (m/s²)²/Hz, two-sided: Q of a Kalman filter, GTSAM",
        &["m/s22/hz", "m2/s4/hz"],
    ),
    convention("m/s²", Samples(1.0), "1σ of each sample", &[]),
    convention("mg", Samples(1e3 * MICRO_G), "1σ of each sample", &[]),
    convention("µg", Samples(MICRO_G), "1σ of each sample", &[]),
    convention("mGal", Samples(MILLIGAL), "1σ of each sample", &[]),
    convention("m/s", Increments(1.0), "1σ of each velocity increment", &[]),
];

const GYRO_RATE_RANDOM_WALK: [Convention; 5] = [
    convention(
        "°/h/√h",
        Linear(DEG_PER_H / SQRT_H),
        "rate random walk: IEEE Std 952",
        &["deg/h1.5", "deg/h3/2"],
    ),
    convention(
        "°/h/√s",
        Linear(DEG_PER_H),
        "rate random walk in a second",
        &[],
    ),
    convention(
        "rad/s²/√Hz",
        Linear(1.0),
        "Kalibr `gyroscope_random_walk`; rad/s/√s",
        &["gyroscope_random_walk", "rad/s/sqrts"],
    ),
    convention(
        "°/s/√h",
        Linear(DEGREE / SQRT_H),
        "rate random walk in an hour",
        &[],
    ),
    convention(
        "rad²/s³",
        Power(1.0),
        "power spectral density of the bias rate: Q of a Kalman filter",
        &[],
    ),
];

const ACCEL_RATE_RANDOM_WALK: [Convention; 4] = [
    convention(
        "µg/√h",
        Linear(MICRO_G / SQRT_H),
        "acceleration random walk: IEEE Std 1293",
        &[],
    ),
    convention(
        "µg/√s",
        Linear(MICRO_G),
        "acceleration random walk in a second",
        &[],
    ),
    convention(
        "m/s³/√Hz",
        Linear(1.0),
        "Kalibr `accelerometer_random_walk`; m/s²/√s",
        &["accelerometer_random_walk", "m/s2/sqrts"],
    ),
    convention(
        "m²/s⁵",
        Power(1.0),
        "power spectral density of the bias rate: Q of a Kalman filter",
        &[],
    ),
];

const GYRO_INSTABILITY: [Convention; 6] = [
    convention(
        "°/h",
        Linear(DEG_PER_H),
        "coefficient B: IEEE Std 952, many data sheets",
        &[],
    ),
    convention(
        "°/s",
        Linear(DEGREE),
        "coefficient B: data sheets of MEMS gyros",
        &[],
    ),
    convention("rad/s", Linear(1.0), "coefficient B", &[]),
    convention(
        "°/h floor",
        Linear(DEG_PER_H / FLOOR),
        "minimum of the Allan deviation, 0.664 B: other data sheets",
        &["floor_deg/h"],
    ),
    convention(
        "°/h Gauss–Markov",
        Linear(DEG_PER_H / MARKOV),
        "1σ whose Allan deviation peaks at that minimum: turncal `gyro_gauss_markov_sigma_deg_per_h`, \
         KF-GINS `gbstd`",
        &["gyro_gauss_markov_sigma_deg_per_h", "gbstd"],
    ),
    convention(
        "rad/s Gauss–Markov",
        Linear(1.0 / MARKOV),
        "the same 1σ in SI",
        &[],
    ),
];

const ACCEL_INSTABILITY: [Convention; 6] = [
    convention(
        "µg",
        Linear(MICRO_G),
        "coefficient B: IEEE Std 1293, many data sheets",
        &[],
    ),
    convention(
        "mg",
        Linear(1e3 * MICRO_G),
        "coefficient B: data sheets",
        &[],
    ),
    convention("m/s²", Linear(1.0), "coefficient B", &[]),
    convention(
        "µg floor",
        Linear(MICRO_G / FLOOR),
        "minimum of the Allan deviation, 0.664 B: other data sheets",
        &["floor_ug"],
    ),
    convention(
        "µg Gauss–Markov",
        Linear(MICRO_G / MARKOV),
        "1σ whose Allan deviation peaks at that minimum: turncal `accel_gauss_markov_sigma_ug`",
        &["accel_gauss_markov_sigma_ug"],
    ),
    convention(
        "mGal Gauss–Markov",
        Linear(MILLIGAL / MARKOV),
        "the same 1σ: KF-GINS `abstd`",
        &["abstd", "mgal"],
    ),
];

/// Floor of the Allan deviation of flicker noise over its coefficient, √(2 ln 2 / π).
const FLOOR: f64 = 0.664_282;
/// 1σ of the Gauss–Markov process whose Allan deviation peaks (at 0.617 σ) at that floor, over the
/// coefficient.
const MARKOV: f64 = FLOOR / 0.617_362;
