//! Detection of columns that a working instrument cannot produce.

use nalgebra::Vector3;
use statrs::function::erf::erf;

use crate::imu::{AXES, Sensor};
use crate::recording::Series;
use crate::run::Run;
use crate::statistics::FALSE_ALARM;

/// Reports axes whose values equal those of another axis in every row.
///
/// Each axis has its own noise, so even two axes with the same input differ. An axis that never changes is not
/// reported, because it may be at rest with coarse pulses.
pub fn copied(run: &Run) -> Option<String> {
    let pairs = listed(run, |sensor, rows| {
        let alike = |&(one, other): &(usize, usize)| {
            let same = |row: Vector3<f64>| row[one].abs() == row[other].abs();
            rows.iter().all(same) && smallest_changes(rows)[one].is_finite()
        };
        let name = |axis: usize| format!("{} {}", sensor.name(), AXES[axis]);
        let pairs = [(0, 1), (0, 2), (1, 2)].into_iter().filter(alike);
        let words = pairs.map(|(one, other)| format!("{} and {}", name(one), name(other)));
        words.collect()
    })?;
    Some(format!(
        "The values of these columns are equal in every row: {pairs}. The same column was named or copied twice; \
         correct the column names in run.toml."
    ))
}

/// Reports axes that never change, although the stated noise exceeds the resolution of the other axes of the
/// triad.
pub fn dead(run: &Run) -> Option<String> {
    let imu = &run.recording.imu;
    let axes = listed(run, |sensor, rows| {
        let sigma = run.instrument.noise.get(sensor).random_walk * imu.period.sqrt();
        let changes = smallest_changes(rows);
        // In each row, noise may leave a step by chance, most rarely if the true value is in the middle of the step.
        let stays = erf(changes.min() / (8f64.sqrt() * sigma)).ln() * rows.len() as f64;
        let is_beyond_chance = stays < (FALSE_ALARM / 6.0).ln();
        let axes = (0..AXES.len()).filter(|&axis| is_beyond_chance && changes[axis].is_infinite());
        let words = axes.map(|axis| format!("{} {}", sensor.name(), AXES[axis]));
        words.collect()
    })?;
    Some(format!(
        "These columns never change ({} rows), although their noise should make them vary: {axes}. Either the axis is \
         dead, or run.toml names the wrong column.",
        imu.len()
    ))
}

/// The findings of both triads; `None` if there are none.
fn listed(run: &Run, of: impl Fn(Sensor, &Series) -> Vec<String>) -> Option<String> {
    let of_triad = |sensor| of(sensor, run.recording.imu.of(sensor));
    let all: Vec<String> = Sensor::ALL.into_iter().flat_map(of_triad).collect();
    (!all.is_empty()).then(|| all.join(", "))
}

/// The smallest change of each axis from one row to the next; infinite if it never changes.
fn smallest_changes(rows: &Series) -> Vector3<f64> {
    let (mut smallest, mut before) = (Vector3::repeat(f64::INFINITY), rows.at(0));
    for row in rows.iter() {
        let changes = (row - before).map(|change| {
            if change == 0.0 {
                f64::INFINITY
            } else {
                change.abs()
            }
        });
        (smallest, before) = (smallest.inf(&changes), row);
    }
    smallest
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
