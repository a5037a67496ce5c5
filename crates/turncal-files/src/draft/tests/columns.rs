//! Tables without names, whose triads are permuted, doubled, filtered or swapped.

use rand::RngExt;
use rand::seq::SliceRandom;

use super::super::columns::Columns;
use super::*;

/// A table, and the triads that are right: none if the axes of a triad are in another order than those of the other.
struct Table {
    sheet: Sheet,
    right: PerSensor<Vec<[usize; 3]>>,
    is_swapped: bool,
}

/// Turns between rests, with the errors and noise of inexpensive sensors: rows of gyros, of accelerometers and of a
/// compass.
fn motion(rng: &mut ChaCha8Rng) -> (PerSensor<Vec<Vector3<f64>>>, Vec<Vector3<f64>>) {
    let rate = 10f64.powf(rng.random_range(1.2..2.4));
    let normal = |rng: &mut ChaCha8Rng| Vector3::from_fn(|_, _| StandardNormal.sample(&mut *rng));
    let mut up: Vector3<f64> = normal(rng).normalize();
    let (gyro_bias, accel_bias) = (normal(rng) * 0.02, normal(rng) * 0.2);
    let scale = Vector3::repeat(1.0) + normal(rng) * 0.01;
    let quiet = 10f64.powf(rng.random_range(-1.0..1.0));
    let mut north: Vector3<f64> = normal(rng).normalize() * 48.0;
    let (mut triads, mut compass) = (PerSensor::from_fn(|_| Vec::new()), Vec::new());
    let axes = if rng.random_bool(0.1) { 1 } else { 3 };
    for turn in 0..rng.random_range(1..18) {
        let seconds = [rng.random_range(1.0..6.0), rng.random_range(0.7..3.0)];
        let axis = match rng.random_bool(0.7) {
            true => Vector3::ith(turn % axes, 1.0),
            false => normal(rng).normalize(),
        };
        let angle = rng.random_range(0.7..3.1) * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let rows = seconds.map(|of| (of * rate).ceil() as usize);
        for row in 0..rows[0] + rows[1] {
            let phase = (row as f64 - rows[0] as f64 + 0.5) / rows[1] as f64;
            let shape = if phase > 0.0 {
                1.0 - (std::f64::consts::TAU * phase).cos()
            } else {
                0.0
            };
            let turned = axis * (shape * angle / seconds[1]);
            let half = turncal::attitude::exp(-turned * (0.5 / rate));
            (up, north) = (half * up, half * north);
            let shaken = if phase > 0.0 {
                normal(rng) * 0.05
            } else {
                Vector3::zeros()
            };
            triads
                .gyro
                .push(turned.component_mul(&scale) + gyro_bias + normal(rng) * (1e-3 * quiet));
            triads.accel.push(
                (up * 9.81).component_mul(&scale)
                    + accel_bias
                    + shaken
                    + normal(rng) * (1e-2 * quiet),
            );
            compass.push(north + normal(rng));
            (up, north) = (half * up, half * north);
        }
    }
    (triads, compass)
}

/// A triad as columns; the copy is filtered, and in its own unit if it is not beside the raw one.
fn filtered(columns: &[Vec<f64>], part: f64) -> Vec<Vec<f64>> {
    let filter = |column: &Vec<f64>| {
        let mut last = column[0];
        let next = |value: &f64| {
            last += part * (value - last);
            last
        };
        column.iter().map(next).collect()
    };
    columns.iter().map(filter).collect()
}

/// A column of another quantity.
fn another(rows: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let (kind, level) = (rng.random_range(0..4), rng.random_range(-50.0..50.0));
    let (step, mut value) = (10f64.powf(rng.random_range(-3.0..0.0)), level);
    let mut next = |k: usize| {
        let noise: f64 = StandardNormal.sample(&mut *rng);
        match kind {
            0 => level,
            1 => level + step * noise,
            2 => f64::from(u8::from(k % 97 > 48)),
            _ => {
                value += step * noise;
                value
            }
        }
    };
    (0..rows).map(&mut next).collect()
}

fn table(seed: u64) -> Table {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let (motion, compass) = motion(rng);
    let rows = motion.gyro.len();
    let mut orders = PerSensor::from_fn(|_| [(0, 1.0), (1, 1.0), (2, 1.0)]);
    let is_swapped = rng.random_bool(0.3);
    if rng.random_bool(0.3) {
        let mut order = orders.gyro;
        order.shuffle(rng);
        orders = PerSensor::from_fn(|_| order);
    }
    if is_swapped {
        match rng.random_range(0..3) {
            0 => orders.gyro.swap(0, 1),
            1 => orders.accel.rotate_left(1),
            _ => orders.accel[rng.random_range(0..3)].1 = -1.0,
        }
    }
    let unit = PerSensor::from_fn(|_| [1.0, 0.101_971_6, 57.295_78, 835.0][rng.random_range(0..4)]);
    let mut blocks: Vec<(Option<Sensor>, Vec<Vec<f64>>)> = Vec::new();
    for sensor in Sensor::ALL {
        let column = |(axis, sign): (usize, f64)| {
            let of = motion
                .get(sensor)
                .iter()
                .map(|row| sign * unit.get(sensor) * row[axis]);
            let of = of.map(|value| {
                if *unit.get(sensor) > 800.0 {
                    value.round()
                } else {
                    value
                }
            });
            of.collect::<Vec<f64>>()
        };
        let mut columns = orders.get(sensor).map(column).to_vec();
        if rng.random_bool(0.3) {
            columns.extend(filtered(&columns.clone(), rng.random_range(0.3..1.0)));
        }
        blocks.push((Some(sensor), columns));
    }
    for _ in 0..rng.random_range(0..3) {
        let columns = (0..rng.random_range(1..4))
            .map(|_| another(rows, rng))
            .collect();
        blocks.push((None, columns));
    }
    if rng.random_bool(0.2) {
        let column = |axis: usize| compass.iter().map(|row| row[axis]).collect();
        blocks.push((None, (0..3).map(column).collect()));
    }
    blocks.shuffle(rng);
    let time = (0..rows).map(|row| row as f64 * 0.01).collect();
    blocks.insert(0, (None, vec![time]));
    let (mut columns, mut right) = (Vec::new(), PerSensor::from_fn(|_| Vec::new()));
    for (sensor, block) in blocks {
        for place in (0..block.len()).step_by(3) {
            let first = columns.len() + place;
            if let Some(of) = sensor {
                right.get_mut(of).push([first, first + 1, first + 2]);
            }
        }
        columns.extend(block);
    }
    let sheet = Sheet {
        names: (1..=columns.len()).map(|k| k.to_string()).collect(),
        units: vec![String::new(); columns.len()],
        rate: None,
        columns,
        goes_on: false,
    };
    Table {
        sheet,
        right,
        is_swapped,
    }
}

/// Numbers of tables whose columns are right and certain, right and asked, wrong and asked; none may be wrong and certain.
fn counts(seeds: std::ops::Range<u64>) -> [usize; 3] {
    let mut counts = [0; 3];
    for seed in seeds {
        let Table {
            sheet,
            right,
            is_swapped,
        } = table(seed);
        let found = Columns::find(&sheet);
        let is_right = |sensor: Sensor| {
            found
                .triads
                .get(sensor)
                .is_some_and(|triad| right.get(sensor).contains(&triad))
        };
        let is_right = Sensor::ALL.into_iter().all(is_right);
        let is_certain = found.doubt.is_none();
        if !is_certain || !is_right || is_swapped {
            println!(
                "{seed}: {is_right}, swapped {is_swapped}, {:?} of {right:?}: {:?}",
                found.triads, found.doubt
            );
        }
        assert!(
            !is_certain || is_right && !is_swapped,
            "{seed}: {:?} of {right:?}",
            found.triads
        );
        counts[if found.doubt.is_none() {
            0
        } else if is_right {
            1
        } else {
            2
        }] += 1;
    }
    counts
}

#[test]
fn triads_without_names_are_right_or_asked() {
    let [certain, asked, wrong] = counts(0..200);
    println!("{certain} certain, {asked} asked, {wrong} wrong and asked");
}
