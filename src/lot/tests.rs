//! Lots of drawn units.

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::calibration::result::{Calibration, GravityRecord, TriadRecord};
use crate::imu::Sensor;
use crate::noise::RestNoise;
use crate::units::PPM;

/// How units are drawn: 1σ of scale factors from unit to unit, and of each calibration.
#[derive(Clone, Copy)]
pub struct Draw {
    pub(crate) spread: f64,
    pub(crate) sigma: f64,
    /// 1σ of an error of gravity that all share, in that of each calibration.
    pub(crate) shared: f64,
}

const SCALE: f64 = 2e6;

pub fn drawn(count: usize, draw: Draw, seed: u64) -> Vec<Unit> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = |sigma: f64| {
        let white: f64 = StandardNormal.sample(&mut rng);
        sigma * white
    };
    let gravity = normal(draw.shared);
    let units = (0..count).map(|k| {
        let own = (draw.spread.powi(2) + draw.sigma.powi(2) - draw.shared.powi(2)).sqrt();
        let mut triad = |shared: f64| TriadRecord {
            scale: [0, 1, 2].map(|_| SCALE * (1.0 + normal(own) + shared)),
            installation: [0, 1, 2].map(|i| [0, 1, 2].map(|j| f64::from(u8::from(i == j)))),
            bias: [0.0; 3],
        };
        let (gyro, accel) = (triad(0.0), triad(gravity));
        let mut calibration = Calibration::new(gyro, accel);
        calibration.converged = Some(true);
        calibration.gravity = (draw.shared > 0.0).then_some(GravityRecord {
            m_s2: 9.8,
            sigma_m_s2: 9.8 * draw.shared,
        });
        let of_sigma = TriadRecord {
            scale: [SCALE * draw.sigma; 3],
            installation: [[0.0; 3]; 3],
            bias: [0.0; 3],
        };
        calibration.sigma = Some(PerSensor {
            gyro: of_sigma,
            accel: of_sigma,
        });
        let meta = [
            ("serial", format!("A{k}")),
            ("date", format!("2026-01-{:02}", k % 28 + 1)),
        ];
        Unit {
            name: format!("unit-{k}"),
            meta: meta.map(|(key, value)| (key.to_owned(), value)).into(),
            calibrated: Ok(Calibrated {
                calibration,
                nominal: PerSensor {
                    gyro: [SCALE; 3],
                    accel: [SCALE; 3],
                },
                noise: None,
            }),
        }
    });
    units.collect()
}

fn of<'a>(lot: &'a Lot, name: &str) -> &'a Statistics {
    let mut all = lot.statistics.iter();
    all.find(|of| of.quantity.name() == name).unwrap()
}

fn calibration(unit: &mut Unit) -> &mut Calibrated {
    unit.calibrated.as_mut().unwrap()
}

#[test]
fn the_spread_of_a_lot_is_found_within_its_own_sigma_and_is_real() {
    let draw = Draw {
        spread: 30.0 * PPM,
        sigma: 20.0 * PPM,
        shared: 0.0,
    };
    let (mut inside, mut real, mut pull) = (0, 0, 0.0);
    let lots = 40;
    for seed in 0..lots {
        let found = Lot::new(drawn(50, draw, seed), None);
        let scale = of(&found, "gyro.scale.x");
        let Spread {
            value,
            sigma,
            interval,
        } = scale.scatter.spread;
        assert_eq!(scale.count, 50);
        real += usize::from(scale.real);
        inside += usize::from((interval.0..=interval.1).contains(&draw.spread));
        pull += ((value - draw.spread) / sigma.unwrap()).powi(2);
        assert!((scale.scatter.mean - 1.0).abs() < 5.0 * scale.scatter.mean_sigma);
    }
    // 95 % of 40 are 38 ± 1.4; the mean square of 40 numbers of σ 1 is 1 ± 0.22.
    assert!(inside >= 33, "{inside}");
    // χ²/n is 3.25 ± 0.66 and must be above 1.8: one lot in a hundred is not told from one without a spread.
    assert!(real >= 37, "{real}");
    let pull = pull / 40.0;
    assert!((0.4..2.0).contains(&pull), "{pull}");
}

#[test]
fn a_lot_whose_units_differ_by_their_own_sigma_alone_has_no_real_spread() {
    let draw = Draw {
        spread: 0.0,
        sigma: 20.0 * PPM,
        shared: 0.0,
    };
    let (mut real, mut p) = (0, 0.0);
    for seed in 0..100 {
        let found = Lot::new(drawn(10, draw, seed), None);
        let scale = of(&found, "gyro.scale.y");
        real += found.statistics.iter().filter(|of| of.real).count();
        p += scale.scatter.chi_square.unwrap().p;
        assert!(scale.scatter.spread.interval.0 < 20.0 * PPM);
    }
    // A false alarm in a hundred lots is expected once; the mean of p is 0.5 ± 0.03.
    assert!(real <= 5, "{real}");
    let p = p / 100.0;
    assert!((0.38..0.62).contains(&p), "{p}");
}

#[test]
fn an_error_of_gravity_that_all_share_is_in_their_mean_and_not_in_their_scatter() {
    let draw = Draw {
        spread: 0.0,
        sigma: 31.0 * PPM,
        shared: 30.0 * PPM,
    };
    let found = Lot::new(drawn(50, draw, 3), None);
    assert!((found.shared_gravity.unwrap() / PPM - 30.0).abs() < 1e-9);
    let accel = of(&found, "accel.scale.x").scatter;
    // χ² of 49 degrees of freedom: 1 ± 0.2 each; with the shared part it would be 0.06.
    let ratio = accel.chi_square.unwrap().value / 49.0;
    assert!((0.4..1.8).contains(&ratio), "{ratio}");
    assert!((accel.mean_sigma / PPM - 30.1).abs() < 0.2);
}

#[test]
fn units_that_are_apart_fail_or_cannot_be_used_are_named_and_left_out() {
    let draw = Draw {
        spread: 30.0 * PPM,
        sigma: 1.0 * PPM,
        shared: 0.0,
    };
    let mut units = drawn(20, draw, 5);
    calibration(&mut units[4]).calibration.gyro.scale[1] *= 1.001;
    units[7].calibrated = Err("no log".to_owned());
    calibration(&mut units[9]).calibration.converged = Some(false);
    let unit = |name: &str| {
        Some(PerSensor {
            gyro: name.to_owned(),
            accel: name.to_owned(),
        })
    };
    for (k, of) in units.iter_mut().enumerate().filter(|(k, _)| *k != 7) {
        let of = calibration(of);
        of.calibration.unit = unit(if k == 11 { "rad" } else { "count" });
    }
    let found = Lot::new(units, None);
    let failed: Vec<&str> = found
        .failures()
        .map(|(unit, _)| unit.name.as_str())
        .collect();
    assert_eq!(failed, ["unit-7", "unit-9", "unit-11"]);
    let scale = of(&found, "gyro.scale.y");
    assert_eq!((scale.outliers.as_slice(), scale.count), (&[4][..], 17));
    assert!(scale.scatter.deviation < 60.0 * PPM);
    let apart: Vec<_> = found
        .statistics
        .iter()
        .flat_map(|of| &of.outliers)
        .collect();
    assert_eq!(apart, [&4]);
}

#[test]
fn a_trend_with_the_serial_is_told_and_its_slope_found() {
    let draw = Draw {
        spread: 10.0 * PPM,
        sigma: 1.0 * PPM,
        shared: 0.0,
    };
    let mut units = drawn(30, draw, 6);
    for (k, unit) in units.iter_mut().enumerate() {
        calibration(unit).calibration.gyro.scale[2] *= 1.0 + 3.0 * PPM * k as f64;
    }
    let found = Lot::new(units, None);
    let told: Vec<_> = found
        .statistics
        .iter()
        .filter(|of| of.trends.iter().any(|t| t.against == Against::Serial))
        .map(|of| of.quantity.name())
        .collect();
    assert_eq!(told, ["gyro.scale.z"]);
    let trend = of(&found, "gyro.scale.z").trends[0];
    assert!(
        (trend.slope - 3.0 * PPM).abs() < 4.0 * trend.sigma,
        "{trend:?}"
    );
    assert!((trend.sigma / PPM - 0.21).abs() < 0.1, "{trend:?}");
}

#[test]
fn a_limit_is_kept_broken_or_open_by_the_probability_of_being_within_it() {
    let at = |off: f64| Sample {
        value: 1.0 + off * PPM,
        sigma: 1.0 * PPM,
    };
    let specification = Specification {
        confidence: 0.95,
        limits: vec![Limit {
            parameter: 0,
            nominal: 1.0,
            within: 10.0 * PPM,
        }],
    };
    // Guard bands of a normal distribution: 1.645 σ on either side of the limit.
    for (off, expected) in [
        (0.0, Verdict::Pass),
        (8.34, Verdict::Pass),
        (-8.34, Verdict::Pass),
        (8.37, Verdict::NotDecided),
        (10.0, Verdict::NotDecided),
        (-11.63, Verdict::NotDecided),
        (11.66, Verdict::Fail),
        (-300.0, Verdict::Fail),
    ] {
        let checks = checks(&specification, |_| Some(at(off)));
        assert_eq!(checks[0].verdict, expected, "{off}");
    }
    let wide = checks(&specification, |_| {
        Some(Sample {
            value: 1.0,
            sigma: 20.0 * PPM,
        })
    });
    assert_eq!(wide[0].verdict, Verdict::NotDecided);
    assert!((wide[0].probability.unwrap() - 0.3829).abs() < 1e-3);
    let without = checks(&specification, |_| None);
    assert_eq!(overall(&without), Verdict::NotDecided);
}

#[test]
fn noise_is_compared_by_one_scale_whatever_the_runs_state() {
    let draw = Draw {
        spread: 0.0,
        sigma: 1.0 * PPM,
        shared: 0.0,
    };
    let mut units = drawn(8, draw, 1);
    for (k, unit) in units.iter_mut().enumerate() {
        let of = calibration(unit);
        let stated = if k == 3 { 2.0 } else { 1.0 };
        of.nominal.accel = [stated * SCALE; 3];
        of.noise = Some(RestNoise {
            tau_s: 4.0,
            density: PerSensor {
                gyro: [1e-6; 3],
                accel: [1e-4 / stated; 3],
            },
            freedom: 50.0,
        });
    }
    let found = Lot::new(units, None);
    let accel = of(&found, "accel.noise.y");
    assert!((accel.scatter.mean - 1e-4f64.ln()).abs() < 1e-9 && accel.outliers.is_empty());
    let off = found.rows[3].nominal_off(&found.nominal).unwrap();
    assert_eq!((off.0, off.2), (Sensor::Accel, 1.0));
    assert_eq!(found.rows[4].nominal_off(&found.nominal), None);
}

#[test]
fn a_lot_of_one_unit_or_none_has_rows_and_no_statistics() {
    let draw = Draw {
        spread: 0.0,
        sigma: 1.0 * PPM,
        shared: 0.0,
    };
    let one = Lot::new(drawn(1, draw, 1), None);
    assert_eq!((one.rows.len(), one.statistics.len()), (1, 0));
    assert!(Lot::new(Vec::new(), None).rows.is_empty());
    let failed = Unit {
        name: "a".to_owned(),
        meta: BTreeMap::new(),
        calibrated: Err("why".to_owned()),
    };
    let none = Lot::new(vec![failed], None);
    assert_eq!(none.failures().next().unwrap().1, "why");
}
