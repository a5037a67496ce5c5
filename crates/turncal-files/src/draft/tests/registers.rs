use std::cell::RefCell;

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{draft, has};
use turncal::attitude::exp;

const HEADER: &str = "t,gx,gy,gz,ax,ay,az\n";

/// Whole counts by scale and zero, in the order of the file.
fn row(k: usize, values: [f64; 6], scale: [f64; 2], zero: [f64; 6]) -> String {
    let count = |axis: usize| {
        let unit = if axis < 3 {
            scale[0].to_degrees()
        } else {
            scale[1] / 9.80665
        };
        (values[axis] * unit + zero[axis]).round().to_string()
    };
    let counts: Vec<String> = (0..6).map(count).collect();
    format!("{:.2},{}", k as f64 * 0.01, counts.join(","))
}

#[test]
fn the_zero_of_a_register_is_where_gravity_at_rest_is_centred() {
    let zero = [700.0, -900.0, 350.0, 2500.0, -1800.0, 900.0];
    let text = draft(HEADER, |k, v| row(k, v, [32.8, 4096.0], zero));
    has(
        &text,
        &[
            "scale = 1879.302  # 32.8 counts per deg/s",
            "scale = 417.6758  # 4096 counts per g",
        ],
    );
    let bias: Vec<f64> = text
        .lines()
        .filter_map(|line| line.strip_prefix("bias = ["))
        .filter_map(|line| line.split(']').next())
        .flat_map(|line| line.split(", ").map(|value| value.parse().unwrap()))
        .collect();
    assert_eq!(bias.len(), 6, "{text}");
    for (found, zero) in bias.iter().zip(zero) {
        assert!((found - zero).abs() < 40.0, "{found} {zero}\n{text}");
    }
}

/// Turns about axes of all directions with rests between, in rad/s and m/s².
fn tumbling() -> Vec<[f64; 6]> {
    let (mut rng, mut up) = (ChaCha8Rng::seed_from_u64(2), Vector3::z());
    let mut rows = Vec::new();
    for turn in 0..10 {
        let t = f64::from(turn);
        let axis = Vector3::new(t.sin(), (1.7 * t).cos(), (2.3 * t + 1.0).sin()).normalize();
        for step in 0..270 {
            let rate = if step < 185 {
                Vector3::zeros()
            } else {
                axis * (1.6 + 0.4 * t.cos())
            };
            up = exp(-rate * 0.01) * up;
            let [gyro, accel] = [(rate, 1e-3), (up * 9.8, 1e-2)].map(|(of, sigma)| {
                of.map(|value| {
                    let noise: f64 = StandardNormal.sample(&mut rng);
                    value + sigma * noise
                })
            });
            rows.push([gyro.x, gyro.y, gyro.z, accel.x, accel.y, accel.z]);
        }
    }
    rows
}

#[test]
fn gyros_get_the_order_and_the_signs_of_the_axes_that_gravity_turns_about() {
    let rows = tumbling();
    let text = draft(HEADER, |k, _| {
        let [x, y, z, ax, ay, az] = rows[k];
        row(k, [-z, x, -y, ax, ay, az], [65.5, 8192.0], [0.0; 6])
    });
    has(
        &text,
        &[
            "columns = { time = \"t\", gyro = [\"gy\", \"gz\", \"gx\"], accel = [\"ax\", \"ay\", \"az\"] }",
            "scale = [3752.874, -3752.874, -3752.874]  # 65.5 counts per deg/s",
        ],
    );
}

#[test]
fn one_attitude_leaves_the_zero_open_and_motion_without_rest_the_scale() {
    let rng = RefCell::new(ChaCha8Rng::seed_from_u64(3));
    let noisy = |value: f64, sigma: f64| {
        let noise: f64 = StandardNormal.sample(&mut *rng.borrow_mut());
        value + sigma * noise
    };
    let text = draft(HEADER, |k, _| {
        let v = [
            (0.0, 2e-3),
            (0.0, 2e-3),
            (0.0, 2e-3),
            (3.0, 0.02),
            (1.0, 0.02),
            (9.28, 0.02),
        ];
        row(
            k,
            v.map(|(value, sigma)| noisy(value, sigma)),
            [65.5, 8192.0],
            [0.0; 6],
        )
    });
    has(
        &text,
        &[
            "scale = 835.3515  # 8192 counts per g; ",
            "# scale =  # TODO: counts per rad/s",
        ],
    );
    assert!(text.contains("if the zero offset is zero"), "{text}");
    let text = draft(HEADER, |k, _| {
        let t = k as f64 * 0.01;
        let (level, turned) = (0.9 * t, 1.7 * t);
        let up = [
            turned.sin() * level.cos(),
            turned.cos() * level.cos(),
            level.sin(),
        ];
        let rate = [1.1 + (2.0 * t).sin(), (1.3 * t).cos(), 0.4 + t.sin()];
        let force = up.map(|of| noisy(9.8 * of, 0.02));
        let v = [rate[0], rate[1], rate[2], force[0], force[1], force[2]];
        row(k, v, [65.5, 8192.0], [0.0; 6])
    });
    has(
        &text,
        &["# scale =  # TODO: counts per m/s² from the data sheet"],
    );
    assert!(text.contains("no dwells to estimate it from"), "{text}");
}

#[test]
fn columns_of_counts_that_hold_something_else_stay_open() {
    let scale = [65.5, 8192.0];
    let said = |header: &str, change: fn([f64; 6]) -> [f64; 6], reason: &str| {
        let text = draft(header, |k, v| {
            let counts = row(k, v, scale, [0.0; 6]);
            let (time, counts) = counts.split_once(',').unwrap();
            let mut values = counts.split(',').map(|value| value.parse().unwrap());
            let changed = change(std::array::from_fn(|_| values.next().unwrap()));
            format!(
                "{time},{}",
                changed.map(|value| value.to_string()).join(",")
            )
        });
        has(&text, &["# columns = { time = \"t\""]);
        assert!(text.contains(reason), "{text}");
    };
    said(
        HEADER,
        |v| v.map(|value| value.rem_euclid(65_536.0)),
        "written as unsigned:",
    );
}
