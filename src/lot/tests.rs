//! Lots of drawn units.

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::calibration::result::frame::tests::{record, with_covariance};
use crate::calibration::result::{Calibration, GravityRecord, Provenance, TermRecord, TriadRecord};
use crate::imu::InstallationForm;
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

fn provenance() -> Provenance {
    Provenance {
        program: "turncal".to_owned(),
        inputs: Vec::new(),
        nominal: PerSensor::from_fn(|_| [SCALE; 3]),
        latitude_deg: None,
        height_m: 0.0,
        duration_s: 600.0,
        rate_hz: 100.0,
        dwells: 20,
    }
}

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
        calibration.provenance = Some(provenance());
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
        let found = Lot::new(drawn(50, draw, seed), None, None);
        let scale = of(&found, "gyro.scale.x");
        let Spread { value, interval } = scale.scatter.spread;
        assert_eq!(scale.count, 50);
        real += usize::from(scale.real);
        inside += usize::from((interval.0..=interval.1).contains(&draw.spread));
        pull += ((value - draw.spread) / (0.25 * (interval.1 - interval.0))).powi(2);
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
        let found = Lot::new(drawn(10, draw, seed), None, None);
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
    let found = Lot::new(drawn(50, draw, 3), None, None);
    assert!((found.shared.gravity.unwrap() / PPM - 30.0).abs() < 1e-9);
    let accel = of(&found, "accel.scale.x").scatter;
    // χ² of 49 degrees of freedom: 1 ± 0.2 each; with the shared part it would be 0.06.
    let ratio = accel.chi_square.unwrap().value / 49.0;
    assert!((0.4..1.8).contains(&ratio), "{ratio}");
    assert!((accel.mean_sigma / PPM - 30.1).abs() < 0.2);
}

#[test]
fn units_that_are_outliers_fail_or_cannot_be_used_are_named_and_left_out() {
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
    let found = Lot::new(units, None, None);
    let failed: Vec<&str> = found
        .failures()
        .map(|(unit, _)| unit.name.as_str())
        .collect();
    assert_eq!(failed, ["unit-7", "unit-9", "unit-11"]);
    let scale = of(&found, "gyro.scale.y");
    assert_eq!((scale.outliers.as_slice(), scale.count), (&[4][..], 17));
    assert!(scale.scatter.deviation < 60.0 * PPM);
    let outliers = found.statistics.iter().flat_map(|of| &of.outliers);
    assert_eq!(outliers.collect::<Vec<_>>(), [&4]);
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
        let provenance = of.calibration.provenance.as_mut().unwrap();
        provenance.nominal.accel = [stated * SCALE; 3];
        of.noise = Some(RestNoise {
            tau_s: 4.0,
            density: PerSensor {
                gyro: [1e-6; 3],
                accel: [1e-4 / stated; 3],
            },
            freedom: 50.0,
        });
    }
    let found = Lot::new(units, None, None);
    let accel = of(&found, "accel.noise.y");
    assert!((accel.scatter.mean - 1e-4).abs() < 1e-12 && accel.outliers.is_empty());
}

#[test]
fn a_lot_of_one_unit_or_none_has_rows_and_no_statistics() {
    let draw = Draw {
        spread: 0.0,
        sigma: 1.0 * PPM,
        shared: 0.0,
    };
    let one = Lot::new(drawn(1, draw, 1), None, None);
    assert_eq!((one.rows.len(), one.statistics.len()), (1, 0));
    assert!(Lot::new(Vec::new(), None, None).rows.is_empty());
    let failed = Unit {
        name: "a".to_owned(),
        meta: BTreeMap::new(),
        calibrated: Err("why".to_owned()),
    };
    let none = Lot::new(vec![failed], None, None);
    assert_eq!(none.failures().next().unwrap().1, "why");
}

fn side_by_side(records: &[&Calibration], truth: Option<&Calibration>) -> Lot {
    let unit = |(k, record): (usize, &&Calibration)| {
        Unit::of_record(k.to_string(), (*record).clone(), None)
    };
    let units = records.iter().enumerate().map(unit).collect();
    let truth = truth.map(|truth| Unit::of_record("truth", truth.clone(), None));
    Lot::new(units, truth, None)
}

fn difference(lot: &Lot, row: usize, parameter: usize) -> Sample {
    lot.difference(&lot.rows[row], Quantity::Parameter(parameter))
        .unwrap()
}

#[test]
fn a_difference_from_the_truth_is_calibration_less_truth_in_parts_of_the_nominal_value() {
    let truth = record();
    let mut estimate = with_covariance(record(), InstallationForm::General);
    estimate.gyro.scale[1] *= 1.0 + 3e-6;
    estimate.accel.bias[0] += 2e-5 * 1.006e5;
    let lot = side_by_side(&[&estimate], Some(&truth));
    let scale = difference(&lot, 0, 1);
    assert!((scale.value - 3e-6).abs() < 1e-15);
    assert!((difference(&lot, 0, 21).value - 2e-5).abs() < 1e-15);
    let own = lot.rows[0].sample(Quantity::Parameter(1)).unwrap().sigma;
    assert_eq!(scale.in_sigma(), Some(scale.value / own));
    // Without any σ there is a difference and no more.
    let lot = side_by_side(&[&truth, &truth], None);
    assert_eq!(difference(&lot, 1, 1).in_sigma(), None);
    assert_eq!((lot.rows[1].nees, lot.joint), (None, None));
}

#[test]
fn nees_of_the_truth_is_zero_and_of_one_sigma_along_one_axis_one_in_n() {
    let truth = record();
    let mut estimate = with_covariance(record(), InstallationForm::General);
    let nees = |estimate: &Calibration| {
        side_by_side(&[estimate], Some(&truth)).rows[0]
            .nees
            .unwrap()
    };
    assert!(nees(&estimate).mean < 1e-12);
    assert_eq!(nees(&estimate).count, 24);
    for (i, row) in estimate.covariance.iter_mut().enumerate() {
        for (j, value) in row.iter_mut().enumerate() {
            *value *= f64::from(i == j);
        }
    }
    estimate.gyro.bias[2] += estimate.covariance[11][11].sqrt();
    assert!((nees(&estimate).mean * 24.0 - 1.0).abs() < 1e-6);
}

#[test]
fn three_angles_have_as_many_directions_as_they_have_parameters() {
    let mut estimate = record();
    let c = InstallationForm::ThreeAngle.matrix(&[0.003, -0.002, 0.004, 0.0, 0.0, 0.0].into());
    for triad in [&mut estimate.gyro, &mut estimate.accel] {
        triad.installation = [0, 1, 2].map(|i| [c[(i, 0)], c[(i, 1)], c[(i, 2)]]);
    }
    let truth = estimate.clone();
    let estimate = with_covariance(estimate, InstallationForm::ThreeAngle);
    let lot = side_by_side(&[&estimate, &estimate], Some(&truth));
    assert_eq!(lot.rows[0].nees.unwrap().count, 18);
    assert_eq!(lot.joint.unwrap().freedom, 18);
}

#[test]
fn two_calibrations_differ_by_the_sigma_of_both_except_for_a_gravity_that_they_share() {
    let mut a = with_covariance(record(), InstallationForm::General);
    let mut b = a.clone();
    b.unit = None;
    b.gyro.scale[0] *= 1.0 + 1e-5;
    let lot = side_by_side(&[&a, &b], None);
    let scale = difference(&lot, 1, 0);
    let own = |parameter: usize| {
        lot.rows[0]
            .sample(Quantity::Parameter(parameter))
            .unwrap()
            .sigma
    };
    assert!((scale.sigma / own(0) - 2f64.sqrt()).abs() < 1e-6);
    let chi2 = of(&lot, "gyro.scale.x").scatter.chi_square.unwrap();
    assert!((chi2.value.sqrt() / scale.in_sigma().unwrap() - 1.0).abs() < 1e-6);

    let of_accel = own(12);
    for record in [&mut a, &mut b] {
        record.gravity = Some(GravityRecord {
            m_s2: 9.8,
            sigma_m_s2: 9.8 * 0.5 * of_accel,
        });
    }
    let lot = side_by_side(&[&a, &b], None);
    let accel = difference(&lot, 1, 12).sigma;
    assert!((accel / (of_accel * 1.5f64.sqrt()) - 1.0).abs() < 1e-6);
}

#[test]
fn calibrations_without_sigma_have_a_mean_and_no_chi_square_and_terms_are_compared_too() {
    let with_offset = |value: f64| {
        let mut record = record();
        let sigma = Some(3e-6);
        let offset = TermRecord { value, sigma };
        record.terms.insert("accel.time_offset".to_owned(), offset);
        record
    };
    let all = [5e-3, 5.006e-3, 4.994e-3].map(with_offset);
    let lot = side_by_side(&[&all[0], &all[1], &all[2]], None);
    let scale = of(&lot, "gyro.scale.x");
    assert_eq!((scale.scatter.chi_square, scale.count), (None, 3));
    let offset = of(&lot, "accel.time_offset").scatter;
    assert!((offset.mean - 5e-3).abs() < 1e-9);
    // Two values are 2 σ off.
    assert!((offset.chi_square.unwrap().value - 8.0).abs() < 1e-6);
}
