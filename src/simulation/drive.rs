//! One drive of a table along its path, which is the common part of runs that differ only in random numbers.

use nalgebra::{Matrix3, Vector3};

use super::{Scenario, true_increments};
use crate::imu::{PerSensor, TermVector};
use crate::turntable::{AxisAngles, Imperfection, Motion, Moves, TableError, axis_angles};

/// Motion of a table, and the input sensed by an ideal instrument on it.
#[derive(Debug, Clone)]
pub struct Drive {
    imperfection: Imperfection,
    terms: TermVector,
    /// Duration, s.
    pub duration: f64,
    /// Integrals over each sample; see [`true_increments`].
    pub ideal: PerSensor<Vec<Vector3<f64>>>,
    /// Time, position number and attitude of a perfect table at each reading.
    pub read: Vec<(f64, usize, Matrix3<f64>)>,
    /// Axis angles at each of these times; during a move, the angles of the position before the move.
    pub axes: Vec<AxisAngles>,
}

impl Drive {
    pub fn new(
        scenario: &Scenario,
        imperfection: Imperfection,
        terms: TermVector,
    ) -> Result<Self, TableError> {
        let Scenario { table, path, .. } = scenario;
        let motion = Motion::new(table, path, &imperfection)?;
        let read = Motion::new(table, path, &Imperfection::none(table))?;
        let count = (read.duration() * scenario.reading_rate + 1e-6) as usize;
        let times = (0..=count).map(|k| k as f64 / scenario.reading_rate);
        let read: Vec<_> = times
            .map(|time| (time, read.position(time), read.at(time).attitude))
            .collect();
        Ok(Self {
            ideal: true_increments(&motion, &scenario.site, &scenario.integrator, &terms),
            duration: motion.duration(),
            axes: axes(scenario, &read),
            read,
            imperfection,
            terms,
        })
    }

    /// Whether the drive was computed with these imperfections and these error terms.
    pub fn is_of(&self, imperfection: &Imperfection, terms: &TermVector) -> bool {
        (&self.imperfection, &self.terms) == (imperfection, terms)
    }
}

fn axes(scenario: &Scenario, read: &[(f64, usize, Matrix3<f64>)]) -> Vec<AxisAngles> {
    let Moves::Axes { start, steps } = &scenario.path.moves else {
        return Vec::new();
    };
    let axes = || scenario.table.axes.iter().map(|axis| axis.direction);
    let mut angles = start.clone();
    let mut of_positions = vec![axis_angles(axes().zip(angles.iter().copied()))];
    for step in steps {
        for (angle, by) in angles.iter_mut().zip(&step.angles) {
            *angle += by;
        }
        of_positions.push(axis_angles(axes().zip(angles.iter().copied())));
    }
    let at = |&(_, position, _): &(f64, usize, _)| of_positions.get(position).copied();
    read.iter().filter_map(at).collect()
}
