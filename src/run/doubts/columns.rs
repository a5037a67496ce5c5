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
pub(super) fn columns(run: &Run) -> Option<String> {
    let imu = &run.recording.imu;
    let pairs = Sensor::ALL.into_iter().flat_map(|sensor| {
        let name = sensor.name();
        let alike = alike(imu.of(sensor)).into_iter();
        alike.map(move |[one, other]| format!("{name} {one} and {name} {other}"))
    });
    let pairs: Vec<String> = pairs.collect();
    (!pairs.is_empty()).then(|| {
        format!(
            "The same in every row: {}. A column is named twice, or copied.",
            pairs.join(", ")
        )
    })
}

/// Axes that never change, though the noise that is stated would have them leave a step of the grid on which
/// the other axes of their triad lie.
pub(super) fn still(run: &Run) -> Option<String> {
    let imu = &run.recording.imu;
    let axes = Sensor::ALL.into_iter().flat_map(|sensor| {
        let sigma = run.instrument.noise.get(sensor).random_walk * imu.period.sqrt();
        let axes = dead(imu.of(sensor), sigma).into_iter();
        axes.map(move |axis| format!("{} {axis}", sensor.name()))
    });
    let axes: Vec<String> = axes.collect();
    (!axes.is_empty()).then(|| {
        format!(
            "The same value in all {} rows, in spite of the noise that is stated: {}. The axis is dead, or its \
             column is another.",
            imu.len(),
            axes.join(", ")
        )
    })
}

/// Of increments with this noise each.
fn dead(rows: &Series, sigma: f64) -> Vec<char> {
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
        assert_eq!(still(&run), None);
        let accel = run.recording.imu.accel.to_mut();
        accel.iter_mut().for_each(|row| row.x = 0.0);
        let said = still(&run).unwrap();
        assert!(said.contains("stated: accel x."), "{said}");
        // 16 mg a step, as of a module with eight bits.
        let step = 0.16 * run.recording.imu.period;
        let accel = run.recording.imu.accel.to_mut();
        accel
            .iter_mut()
            .for_each(|row| *row = row.map(|v| (v / step).round() * step));
        assert_eq!(still(&run), None);
    }

    #[test]
    fn one_axis_that_is_another_is_named_and_axes_that_never_change_are_not() {
        let mut run = Scenario::load("mems").unwrap().simulate(1, 0).unwrap().run;
        assert_eq!(columns(&run), None);
        let imu = &mut run.recording.imu;
        imu.gyro.to_mut().iter_mut().for_each(|row| row.x = -row.y);
        imu.accel.to_mut().iter_mut().for_each(|row| *row *= 0.0);
        let said = columns(&run).unwrap();
        assert!(said.contains("every row: gyro x and gyro y."), "{said}");
    }
}
