use std::fs;

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;

mod columns;
mod turns;

/// Three quarter turns about each axis in turn with rests between, at 100 Hz; `row` makes a line of time,
/// angular rate and specific force.
fn draft(header: &str, row: impl Fn(usize, [f64; 6]) -> String) -> String {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("log.csv");
    let mut text = header.to_owned();
    let mut up = Vector3::new(0.1, 0.2, 1.0).normalize();
    let mut k = 0;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for turn in 0..9 {
        for step in 0..300 {
            let rate = if step < 200 {
                0.0
            } else {
                std::f64::consts::FRAC_PI_2
            };
            let rate = Vector3::ith(turn % 3, rate);
            let noise: f64 = StandardNormal.sample(&mut rng);
            up = turncal::attitude::exp(-rate * 0.01) * up;
            let (gyro, accel) = (
                rate.add_scalar(noise * 1e-3),
                (up * 9.8).add_scalar(noise * 1e-2),
            );
            text += &row(k, [gyro.x, gyro.y, gyro.z, accel.x, accel.y, accel.z]);
            text.push('\n');
            k += 1;
        }
    }
    fs::write(&path, text).unwrap();
    Draft::of_file(&path).unwrap().to_toml("log.csv")
}

fn has(text: &str, lines: &[&str]) {
    for line in lines {
        assert!(
            text.lines().any(|found| found.starts_with(line)),
            "no `{line}` in\n{text}"
        );
    }
}

#[test]
fn si_rates_are_known_by_gravity_and_its_turns() {
    let text = draft("time,wx,wy,wz,fx,fy,fz\n", |k, v| {
        format!(
            "{},{},{},{},{},{},{}",
            k as f64 * 0.01,
            v[0],
            v[1],
            v[2],
            v[3],
            v[4],
            v[5]
        )
    });
    has(
        &text,
        &[
            "output = \"rate\"",
            "gyro_unit = \"rad/s\"",
            "accel_unit = \"m/s^2\"",
            "continuous = true",
            "# sample_period_s = 0.01 ",
            "columns = { time = \"time\", gyro = [\"wx\", \"wy\", \"wz\"], accel = [\"fx\", \"fy\", \"fz\"] }",
            "# latitude_deg =  # north positive",
        ],
    );
    assert!(!text.contains("time_unit"), "{text}");
}

#[test]
fn a_file_of_numbers_alone_is_told_by_them() {
    // Milliseconds, temperature-free, accelerometers in g first, gyros in °/s.
    let text = draft("", |k, v| {
        let deg = 180.0 / std::f64::consts::PI;
        let g = 9.80665;
        let [gx, gy, gz, ax, ay, az] = v;
        format!(
            "{} {} {} {} {} {} {}",
            10 * k,
            ax / g,
            ay / g,
            az / g,
            gx * deg,
            gy * deg,
            gz * deg
        )
    });
    has(
        &text,
        &[
            "gyro_unit = \"deg/s\"",
            "accel_unit = \"g\"",
            "time_unit = \"ms\"",
            "columns = { time = \"1\", gyro = [\"5\", \"6\", \"7\"], accel = [\"2\", \"3\", \"4\"] }",
        ],
    );
}

/// Accels, then gyros, as unsigned 16-bit registers of a data sheet's scale.
fn registers([gx, gy, gz, ax, ay, az]: [f64; 6], separator: &str) -> String {
    let gyro = |x: f64| (32_768.0 + x.to_degrees() * 65.5).round();
    let accel = |x: f64| (32_768.0 + x / 9.80665 * 4096.0).round();
    [
        accel(ax),
        accel(ay),
        accel(az),
        gyro(gx),
        gyro(gy),
        gyro(gz),
    ]
    .map(|register| register.to_string())
    .join(separator)
}

#[test]
fn unsigned_registers_have_their_zero_in_the_middle_and_a_data_sheets_scale() {
    let text = draft("n;AccX;AccY;AccZ;GyrX;GyrY;GyrZ\n", |k, v| {
        format!("{k};{}", registers(v, ";"))
    });
    has(
        &text,
        &[
            "output = \"rate\"",
            "gyro_unit = \"count\"",
            "accel_unit = \"count\"",
            "time_unit = \"count\"",
            "# sample_period_s =  # TODO",
            "bias = 32768.0",
            "scale = 417.6758  # 4096 counts per g",
        ],
    );
}

/// Whole signed counts at 65.5 per °/s and 8192 per g, with times; `change` is applied to them.
fn counts(change: fn(f64) -> f64) -> String {
    draft("t,gx,gy,gz,ax,ay,az\n", |k, v| {
        let [gx, gy, gz, ax, ay, az] = v;
        let gyro = [gx, gy, gz].map(|rate| rate.to_degrees() * 65.5);
        let accel = [ax, ay, az].map(|force| force / 9.80665 * 8192.0);
        let counts = [gyro, accel].concat();
        let counts: Vec<f64> = counts.iter().map(|count| change(count.round())).collect();
        format!("{:.2},{}", k as f64 * 0.01, joined(&counts, ","))
    })
}

#[test]
fn counts_get_the_data_sheets_scale_from_gravity_and_its_turns() {
    has(
        &counts(|count| count),
        &[
            "scale = 3752.874  # 65.5 counts per deg/s; measured 65.",
            "scale = 835.3515  # 8192 counts per g; measured 81",
        ],
    );
    // Of another sign than the accelerometers, and no data sheet's.
    let text = counts(|count| (-1.1 * count).round());
    has(
        &text,
        &["scale = 918.", "# Gravity rotates in the opposite"],
    );
}

#[test]
fn signed_counts_that_were_written_as_unsigned_stay_open() {
    let text = counts(|count| count.rem_euclid(65_536.0));
    has(&text, &["# columns = { time = \"t\""]);
    assert!(text.contains("written as unsigned:"), "{text}");
}

#[test]
fn increments_and_pulses_are_known_by_the_period_and_by_their_sums() {
    let text = draft("t,gx,gy,gz,ax,ay,az\n", |k, v| {
        let row = v.map(|value| (value * 0.01).to_string());
        format!("{},{}", k as f64 * 0.01, row.join(","))
    });
    has(
        &text,
        &[
            "output = \"increment\"",
            "gyro_unit = \"rad\"",
            "accel_unit = \"m/s\"",
        ],
    );
    let carried = std::cell::RefCell::new([0.0; 6]);
    let text = draft("t,gx,gy,gz,ax,ay,az\n", |k, v| {
        let mut carried = carried.borrow_mut();
        let mut row = format!("{}", k as f64 * 0.01);
        for (axis, value) in v.iter().enumerate() {
            let scale = if axis < 3 { 2e5 } else { 1e3 };
            let before = carried[axis];
            carried[axis] += value * 0.01 * scale;
            row += &format!(",{}", carried[axis].floor() - before.floor());
        }
        row
    });
    has(
        &text,
        &[
            "output = \"pulse\"",
            "gyro_unit = \"count\"",
            "accel_unit = \"count\"",
            "scale = 19",
        ],
    );
}

#[test]
fn registers_without_names_and_time_are_told_by_their_numbers() {
    let text = draft("", |_, v| registers(v, " "));
    has(
        &text,
        &[
            "columns = { gyro = [\"4\", \"5\", \"6\"], accel = [\"1\", \"2\", \"3\"] }",
            "# TODO: no column increases steadily, as time stamps do",
        ],
    );
}

fn joined(row: &[f64], separator: &str) -> String {
    let row: Vec<String> = row.iter().map(f64::to_string).collect();
    row.join(separator)
}

/// Orientation, angular velocity and linear acceleration as `sensor_msgs/Imu` has them.
fn message([gx, gy, gz, ax, ay, az]: [f64; 6]) -> String {
    let mut row = Vec::new();
    for of in [&[0.0, 0.0, 0.0, 1.0][..], &[gx, gy, gz], &[ax, ay, az]] {
        row.extend(of);
        row.extend([0.0; 9]);
    }
    joined(&row, ",")
}

#[test]
fn names_in_a_comment_above_rows_with_a_text_are_those_of_the_columns() {
    let covariance = |of: &str| {
        (0..9)
            .map(|k| format!(",field.{of}_covariance{k}"))
            .collect()
    };
    let triad = |of: &str, axes: &str| {
        let axes: String = axes
            .chars()
            .map(|axis| format!(",field.{of}.{axis}"))
            .collect();
        let covariance: String = covariance(of);
        axes + &covariance
    };
    let header = format!(
        "%time,field.header.seq,field.header.stamp,field.header.frame_id{}{}{}\n",
        triad("orientation", "xyzw"),
        triad("angular_velocity", "xyz"),
        triad("linear_acceleration", "xyz")
    );
    let text = draft(&header, |k, v| {
        let stamp = 1_520_530_308_140_000_000u64 + 10_000_000 * k as u64;
        format!("{},{k},{stamp},imu_link,{}", stamp + 977, message(v))
    });
    has(
        &text,
        &[
            "time_unit = \"ns\"",
            "gyro_unit = \"rad/s\"",
            "accel_unit = \"m/s^2\"",
            "columns = { time = \"field.header.stamp\", gyro = [\"field.angular_velocity.x\", ",
        ],
    );
}

#[test]
fn names_in_a_comment_may_have_their_units_in_the_comment_below() {
    let header = "% time gyr_x gyr_y gyr_z acc_x acc_y acc_z\n\
                  % s rad/s rad/s rad/s m/s^2 m/s^2 m/s^2\n";
    let text = draft(header, |k, v| {
        format!("{} {}", k as f64 * 0.01, joined(&v, " "))
    });
    has(
        &text,
        &[
            "gyro_unit = \"rad/s\"",
            "accel_unit = \"m/s^2\"",
            "columns = { time = \"time\", gyro = [\"gyr_x\", ",
        ],
    );
}

#[test]
fn seconds_and_nanoseconds_are_one_time_with_and_without_names() {
    let time = |k: usize| format!("{},{}", 1_520_530_308 + k / 100, 10_000_000 * (k % 100));
    let text = draft("", |k, v| format!("{},imu_link,{}", time(k), message(v)));
    has(
        &text,
        &[
            "columns = { time = [\"1\", \"2\"], gyro = [\"17\", \"18\", \"19\"], accel = [\"29\", \"30\", \"31\"] }",
            "gyro_unit = \"rad/s\"",
            "# sample_period_s = 0.01 ",
        ],
    );
    let text = draft(
        "stamp.sec,stamp.nanosec,frame_id,wx,wy,wz,fx,fy,fz\n",
        |k, v| format!("{},imu_link,{}", time(k), joined(&v, ",")),
    );
    has(
        &text,
        &["columns = { time = [\"stamp.sec\", \"stamp.nanosec\"], gyro = [\"wx\", "],
    );
}

#[test]
fn a_level_that_rises_seldom_beside_milliseconds_is_no_second() {
    // The third axis of a magnetometer, then the times at which a reader began and ended.
    let text = draft("", |k, v| {
        let time = format!("{},{}", 20 * k + 2, 20 * k + 3);
        format!("{},{},{time}", joined(&v, ","), 3815 + k / 400)
    });
    has(&text, &["columns = { time = \"8\", gyro = "]);
    assert!(!text.contains("time = ["), "{text}");
}

#[test]
fn a_rate_in_a_comment_decides_what_a_time_without_a_unit_is() {
    let comments = "// Start Time: Unknown\n// Update Rate: 100.0Hz\n";
    let names = "Acc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\tRoll\n";
    let row = |[gx, gy, gz, ax, ay, az]: [f64; 6]| joined(&[ax, ay, az, gx, gy, gz], "\t");
    let text = draft(
        &format!("{comments}PacketCounter\tSampleTimeFine\t{names}"),
        |k, v| {
            format!(
                "{}\t{}\t{}\t",
                (65_000 + k) % 65_536,
                48_211 + 100 * k,
                row(v)
            )
        },
    );
    has(
        &text,
        &[
            "time_unit = 0.0001  # steps of 100 at 100 Hz",
            "# sample_period_s = 0.01  # 100 Hz",
            "gyro_unit = \"rad/s\"",
            "columns = { time = \"SampleTimeFine\", ",
        ],
    );
    // Without a counter and without the comment.
    let text = draft(&format!("SampleTimeFine\t{names}"), |k, v| {
        format!("{}\t{}\t", 48_211 + 100 * k, row(v))
    });
    has(
        &text,
        &[
            "time_unit = 0.0001",
            "columns = { time = \"SampleTimeFine\", ",
        ],
    );
    // Neither a counter nor a time.
    let text = draft(&format!("{comments}{names}"), |_, v| {
        format!("{}\t", row(v))
    });
    has(
        &text,
        &[
            "sample_period_s = 0.01  # 100 Hz, stated in the file",
            "gyro_unit = \"rad/s\"",
            "columns = { gyro = ",
        ],
    );
    // Steps of ten are milliseconds at 100 Hz and microseconds at 100 kHz.
    let text = draft(
        "# sampling rate 100 Hz\nclock,wx,wy,wz,fx,fy,fz\n",
        |k, v| format!("{},{}", 10 * k, joined(&v, ",")),
    );
    has(&text, &["time_unit = \"ms\"  # steps of 10 at 100 Hz"]);
}

#[test]
fn rows_of_a_second_instrument_and_rows_without_samples_are_passed_over() {
    let header = "timestamp,TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,T\n";
    let text = draft(header, |k, v| {
        let time = 112_345_678 + 10_000 * k;
        let seconds = time as f64 * 1e-6;
        let other = v.map(|value| 0.9 * value + 0.1);
        format!(
            "{seconds:.6},{time},0,{},40\n{seconds:.6},{time},1,{},41",
            joined(&v, ","),
            joined(&other, ",")
        )
    });
    has(
        &text,
        &[
            "instance = { column = \"I\", number = 0 }",
            "# sample_period_s = 0.01 ",
            "continuous = true  # no gaps",
        ],
    );
    let text = draft("time_s,type,wx,wy,wz,fx,fy,fz,pressure\n", |k, v| {
        let time = k as f64 * 0.01;
        let row = format!("{time:.3},imu,{},", joined(&v, ","));
        match k % 10 {
            3 => format!("{row}\n{:.3},baro,,,,,,,1013.2", time + 0.005),
            _ => row,
        }
    });
    has(
        &text,
        &["# sample_period_s = 0.01 ", "continuous = true  # no gaps"],
    );
}

#[test]
fn gyros_and_accelerometers_in_rows_of_their_own_are_two_streams_of_one_file() {
    let header = "t,gx,gy,gz,ax,ay,az,note\n";
    let text = draft(header, |k, [gx, gy, gz, ax, ay, az]| {
        let time = k as f64 * 0.01;
        let gyro = format!("{time:.3},{gx},{gy},{gz},,,,");
        match k % 2 {
            0 => gyro,
            _ => format!("{gyro}\n{:.3},,,,{ax},{ay},{az},", time + 0.002),
        }
    });
    has(
        &text,
        &[
            "accel_from = { time = \"t\", time_unit = \"s\" }",
            "gyro_unit = \"rad/s\"",
            "accel_unit = \"m/s^2\"",
            "columns = { time = \"t\", gyro = [\"gx\", \"gy\", \"gz\"], accel = [\"ax\", \"ay\", \"az\"] }",
        ],
    );
}

#[test]
fn a_counter_that_other_packets_share_is_no_time_and_a_compass_no_gyro() {
    let triad = |of: &str| ["X", "Y", "Z"].map(|axis| format!("%float({of}{axis})"));
    let names = ["RawCompass", "RawGyro", "RawAccel"].map(triad).concat();
    let text = draft(&format!("Packet number,{}\n", names.join(",")), |k, v| {
        let packet = 2 * k + usize::from(k % 3 == 1);
        format!(
            "{packet},-0.1,0.5,{},{}",
            0.2 + 1e-3 * v[0],
            joined(&v, ",")
        )
    });
    has(
        &text,
        &[
            "# a counter shared with other packets cannot serve as a time column",
            "columns = { gyro = [\"%float(RawGyroX)\", \"%float(RawGyroY)\", \"%float(RawGyroZ)\"], \
             accel = [\"%float(RawAccelX)\", ",
        ],
    );
}

#[test]
fn rows_that_a_tag_tells_apart_are_streams_and_constants_no_axes() {
    let text = draft("", |k, [gx, gy, gz, ax, ay, az]| {
        let time = 10 * k;
        format!("1 {time} {ax} {ay} {az}\n2 {time} {gx} {gy} {gz}")
    });
    has(
        &text,
        &[
            "stream = \"2\"",
            "accel_from = { stream = \"1\", time = \"2\", time_unit = \"ms\" }",
            "gyro_unit = \"rad/s\"",
            "columns = { time = \"2\", gyro = [\"3\", \"4\", \"5\"], accel = [\"3\", \"4\", \"5\"] }",
        ],
    );
    // The names of streams make no axes of the numbers of columns.
    let text = draft("", |k, [gx, gy, gz, ax, ay, az]| {
        let time = 88_000_000_000_000u64 + 10_000_000 * k as u64;
        format!("ACC,{time},{ax},{ay},{az}\nGYR,{time},{gx},{gy},{gz}")
    });
    has(
        &text,
        &[
            "stream = \"GYR\"",
            "accel_from = { stream = \"ACC\", time = \"2\", time_unit = \"ns\" }",
            "columns = { time = \"2\", gyro = [\"3\", \"4\", \"5\"], accel = [\"3\", \"4\", \"5\"] }",
        ],
    );
    let text = draft("", |k, v| {
        let compass = (k as f64).sin();
        format!("Raw:{k},1\nUni:{},{compass},7,9", joined(&v, ","))
    });
    has(
        &text,
        &[
            "gyro_unit = \"rad/s\"",
            "columns = { time = \"1\", gyro = [\"3\", \"4\", \"5\"], accel = [\"6\", \"7\", \"8\"] }",
        ],
    );
}
