//! What turns show, and what they do not.

use super::*;

/// Turns of 60° to 140° about x, y and z in sequence, each after a dwell of two seconds.
struct Turned {
    rate: f64,
    turns: usize,
    seconds: f64,
    /// Whether gyros show them: those of sections that are laid end to end do not.
    shown: bool,
}

const BY_HAND: Turned = Turned {
    rate: 100.0,
    turns: 9,
    seconds: 1.0,
    shown: true,
};

impl Turned {
    /// Time, angular rate and specific force.
    fn rows(&self) -> Vec<[f64; 7]> {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut noise = |sigma: f64| {
            Vector3::from_fn(|_, _| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                sigma * noise
            })
        };
        let mut up = Vector3::new(0.1, 0.2, 1.0).normalize();
        let mut rows = Vec::new();
        let [rest, length] = [2.0, self.seconds].map(|seconds| (seconds * self.rate) as usize);
        for turn in 0..self.turns {
            for step in 0..rest + length {
                let angle = (60.0 + 20.0 * (turn % 5) as f64).to_radians();
                let turns = if step < rest {
                    0.0
                } else {
                    angle / self.seconds
                };
                let rate = Vector3::ith(turn % 3, turns);
                up = turncal::attitude::exp(-rate / self.rate) * up;
                let shown = if self.shown { rate } else { Vector3::zeros() };
                let (gyro, accel) = (shown + noise(1e-3), up * 9.8 + noise(1e-2));
                let time = rows.len() as f64 / self.rate;
                rows.push([time, gyro.x, gyro.y, gyro.z, accel.x, accel.y, accel.z]);
            }
        }
        rows
    }
}

fn drafted(rows: &[[f64; 7]]) -> String {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("log.csv");
    let rows: String = rows.iter().map(|row| joined(row, ",") + "\n").collect();
    fs::write(&path, "time,wx,wy,wz,fx,fy,fz\n".to_owned() + &rows).unwrap();
    Draft::of_file(&path).unwrap().to_toml("log.csv")
}

#[test]
fn a_turn_within_two_rows_is_no_cut_if_gyros_show_it() {
    let fast = Turned {
        rate: 10.0,
        seconds: 0.2,
        ..BY_HAND
    };
    has(
        &drafted(&fast.rows()),
        &["continuous = true", "gyro_unit = \"rad/s\""],
    );
    let laid_end_to_end = Turned {
        shown: false,
        ..fast
    };
    has(
        &drafted(&laid_end_to_end.rows()),
        &["continuous = false  # the gravity direction jumps in 4 places"],
    );
}

#[test]
fn what_turned_where_rows_are_missing_is_no_cut_and_the_other_turns_tell_the_unit() {
    let mut rows = BY_HAND.rows();
    rows.retain(|row| !(4.9..6.1).contains(&row[0]));
    has(
        &drafted(&rows),
        &[
            "continuous = true  # rows are missing in one place",
            "gyro_unit = \"rad/s\"",
        ],
    );
}

#[test]
fn without_a_time_turns_tell_the_unit_that_has_a_usual_rate() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("log.csv");
    let rows = BY_HAND.rows();
    let rows: String = rows
        .iter()
        .map(|row| joined(&row[1..], ",") + "\n")
        .collect();
    fs::write(&path, "wx,wy,wz,fx,fy,fz\n".to_owned() + &rows).unwrap();
    let text = Draft::of_file(&path).unwrap().to_toml("log.csv");
    let why = "gyro_unit = \"rad/s\"  # integrated gyro angles match the change of gravity direction at about ";
    has(
        &text,
        &[
            why,
            "# no column increases steadily, as a time does; turncal estimates the sample period from the turns",
        ],
    );
    let rate = text.split(why).nth(1).unwrap().split(' ').next().unwrap();
    let rate: f64 = rate.parse().unwrap();
    assert!((rate - 100.0).abs() < 5.0, "{rate} Hz");
}

#[test]
fn one_rough_turn_and_none_are_told_apart() {
    let mut rows = Turned {
        turns: 2,
        ..BY_HAND
    }
    .rows();
    let never = &rows[..200].to_vec();
    has(
        &drafted(never),
        &[
            "# gyro_unit =  # TODO: the gravity direction does not change, so the unit cannot be estimated",
        ],
    );
    // A hand that shakes as it turns.
    for row in rows.iter_mut().skip(200).step_by(2).take(50) {
        row[4] += 5.0;
        row[5] -= 5.0;
    }
    rows.truncate(500);
    has(
        &drafted(&rows),
        &["# gyro_unit =  # TODO: there are too few usable turns to estimate the unit"],
    );
}
