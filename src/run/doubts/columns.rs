//! Columns that no instrument gives.

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
