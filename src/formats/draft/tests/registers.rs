use super::{draft, has};

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
            "scale = 1879.302  # 32.8 counts for 1 deg/s",
            "scale = 417.6758  # 4096 counts for one g",
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

#[test]
fn gyros_get_the_order_and_the_signs_of_the_axes_that_gravity_turns_about() {
    let text = draft(HEADER, |k, [x, y, z, ax, ay, az]| {
        row(k, [-z, x, -y, ax, ay, az], [65.5, 8192.0], [0.0; 6])
    });
    has(
        &text,
        &[
            "columns = { time = \"t\", gyro = [\"gy\", \"gz\", \"gx\"], accel = [\"ax\", \"ay\", \"az\"] }",
            "scale = [3752.874, -3752.874, -3752.874]  # 65.5 counts for 1 deg/s",
        ],
    );
}

#[test]
fn one_attitude_leaves_the_zero_open_and_motion_without_rest_the_scale() {
    // Of no axis the same at any time, and of any noise.
    let noise = |k: usize| ((k * 7919 % 1009) as f64 / 1009.0 - 0.5) * 0.02;
    let text = draft(HEADER, |k, _| {
        let v = [
            noise(k),
            noise(k + 3),
            noise(k + 5),
            3.0 + noise(k + 7),
            1.0 + noise(k + 11),
            9.28,
        ];
        row(k, v, [65.5, 8192.0], [0.0; 6])
    });
    has(
        &text,
        &[
            "scale = 835.3515  # 8192 counts for one g; ",
            "# scale =  # TODO: counts for one rad/s",
        ],
    );
    assert!(text.contains("if it says nothing at zero"), "{text}");
    let text = draft(HEADER, |k, _| {
        let t = k as f64 * 0.01;
        let up = [
            (1.7 * t).sin() * (0.9 * t).cos(),
            (1.7 * t).cos() * (0.9 * t).cos(),
            (0.9 * t).sin(),
        ];
        let v = [
            1.1 + (2.0 * t).sin(),
            (1.3 * t).cos(),
            0.4 + t.sin(),
            9.8 * up[0],
            9.8 * up[1],
            9.8 * up[2],
        ];
        row(k, v, [65.5, 8192.0], [0.0; 6])
    });
    has(
        &text,
        &["# scale =  # TODO: counts for one m/s² by the data sheet"],
    );
    assert!(text.contains("nothing is at rest"), "{text}");
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
    said("t,ax,ay,az,gx,gy,gz\n", |v| v, "their names are swapped");
    said(
        HEADER,
        |v| v.map(|value| value.rem_euclid(65_536.0)),
        "written as unsigned ones",
    );
    said(
        HEADER,
        |mut v| {
            v[4] = 17.0;
            v
        },
        "\"ay\" says the same in all rows",
    );
}
