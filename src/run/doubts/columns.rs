//! Columns that no instrument gives.

use statrs::function::erf::erf;

use super::FALSE_ALARMS;
use crate::imu::{AXES, Sensor};
use crate::recording::Series;
use crate::run::Run;

/// Axes that give the same as another in every row.
///
/// Two axes have noise of their own, so not even two that sense the same are alike. One that never changes may
/// be at rest under coarse pulses.
pub fn copied(run: &Run) -> Option<String> {
    let pairs = listed(|sensor| {
        let name = sensor.name();
        let alike = alike(run.recording.imu.of(sensor)).into_iter();
        let pair = move |[one, other]: [char; 2]| format!("{name} {one} and {name} {other}");
        alike.map(pair).collect()
    })?;
    Some(format!(
        "These columns are the same in every row: {pairs}. A column is named twice, or copied."
    ))
}

/// Axes that never change, though the noise that is stated would have them leave a step of the grid on which
/// the other axes of their triad lie.
pub fn dead(run: &Run) -> Option<String> {
    let imu = &run.recording.imu;
    let axes = listed(|sensor| {
        let sigma = run.instrument.noise.get(sensor).random_walk * imu.period.sqrt();
        let axes = without_noise(imu.of(sensor), sigma).into_iter();
        let name = move |axis| format!("{} {axis}", sensor.name());
        axes.map(name).collect()
    })?;
    Some(format!(
        "These columns never change ({} rows), although their noise should make them vary: {axes}. The axis is \
         dead, or the wrong column is named.",
        imu.len()
    ))
}

/// What is found in both triads; `None` if nothing is.
fn listed(of: impl Fn(Sensor) -> Vec<String>) -> Option<String> {
    let all: Vec<String> = Sensor::ALL.into_iter().flat_map(of).collect();
    (!all.is_empty()).then(|| all.join(", "))
}

/// Of increments with this noise each.
fn without_noise(rows: &Series, sigma: f64) -> Vec<char> {
    let (mut before, mut step, mut changes) = (rows.at(0), f64::INFINITY, [false; 3]);
    for row in rows.iter() {
        for axis in 0..3 {
            let change = (row[axis] - before[axis]).abs();
            if change > 0.0 {
                changes[axis] = true;
                step = step.min(change);
            }
        }
        before = row;
    }
    // Noise leaves a step by chance in each row anew, most seldom where the truth is in the middle of it.
    let stays = erf(step / (8f64.sqrt() * sigma)).ln() * rows.len() as f64;
    let is_dead = |axis: &usize| !changes[*axis] && stays < FALSE_ALARMS.ln();
    (0..3).filter(is_dead).map(|axis| AXES[axis]).collect()
}

fn alike(rows: &Series) -> Vec<[char; 2]> {
    let first = rows.at(0);
    let changes = |axis: usize| rows.iter().any(|row| row[axis] != first[axis]);
    let same = |one: usize, other: usize| rows.iter().all(|row| row[one].abs() == row[other].abs());
    let pairs = [[0, 1], [0, 2], [1, 2]].into_iter();
    let alike = pairs.filter(|&[one, other]| changes(one) && same(one, other));
    alike.map(|pair| pair.map(|axis| AXES[axis])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::Scenario;

    #[test]
    fn an_axis_without_its_noise_is_dead_but_not_one_whose_grid_is_coarse() {
        let mut run = Scenario::load("mems").unwrap().simulate(1, 0).unwrap().run;
        assert_eq!(dead(&run), None);
        let accel = run.recording.imu.accel.to_mut();
        accel.iter_mut().for_each(|row| row.x = 0.0);
        let said = dead(&run).unwrap();
        assert!(said.contains("vary: accel x."), "{said}");
        // 16 mg a step, as of a module with eight bits.
        let step = 0.16 * run.recording.imu.period;
        let accel = run.recording.imu.accel.to_mut();
        accel
            .iter_mut()
            .for_each(|row| *row = row.map(|v| (v / step).round() * step));
        assert_eq!(dead(&run), None);
    }

    #[test]
    fn one_axis_that_is_another_is_named_and_axes_that_never_change_are_not() {
        let mut run = Scenario::load("mems").unwrap().simulate(1, 0).unwrap().run;
        assert_eq!(copied(&run), None);
        let imu = &mut run.recording.imu;
        imu.gyro.to_mut().iter_mut().for_each(|row| row.x = -row.y);
        imu.accel.to_mut().iter_mut().for_each(|row| *row *= 0.0);
        let said = copied(&run).unwrap();
        assert!(said.contains("every row: gyro x and gyro y."), "{said}");
    }
}
