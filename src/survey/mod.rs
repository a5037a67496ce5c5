//! What a record holds, and what the methods could see of the instrument in it. Nothing is calibrated: all
//! is by nominal scales and prior biases.

mod outlook;

use crate::calibration::{Mounting, Options, Problem};
use crate::imu::{PerSensor, Sensor};
use crate::run::Run;
use crate::run::motion::{self, LabelCheck, Rest, Turn};
use crate::units::DEGREE;

pub use outlook::{Expected, MethodOutlook, Path};

/// What a record holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Where the instrument stands, in order.
    pub rests: Vec<Rest>,
    /// What it does from each of them to the next; empty in a record of sections, but for those labelled as
    /// turns.
    pub turns: Vec<Turn>,
    /// Labelled sections against what was found.
    pub labels: Vec<LabelCheck>,
    /// What each method could see.
    pub methods: Vec<MethodOutlook>,
    /// A mounting that the record shows in place of the stated one.
    pub mounting: Option<Mounting>,
    /// How long it stands.
    pub standing: Standing,
    /// Step of each axis' grid, rad/s or m/s², where the file's values lie on one.
    pub steps: PerSensor<[Option<f64>; 3]>,
    /// Directions of up that are further apart than [`APART`].
    pub directions: usize,
}

/// Directions nearer to each other tell no more than one, rad.
pub const APART: f64 = 15.0 * DEGREE;

/// How long the instrument stands.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Standing {
    /// In all, s.
    pub total: f64,
    /// In the longest dwell, s.
    pub longest: f64,
}

impl Survey {
    /// Looks at a run.
    pub fn of(run: &Run) -> Self {
        let rests = motion::rests(run);
        let durations = || rests.iter().map(|rest| rest.duration(run));
        Self {
            turns: motion::turns(run, &rests),
            labels: motion::checks(run, &rests),
            methods: outlook::methods(run),
            mounting: Mounting::contradicted(&Problem::new(run, &Options::default())),
            standing: Standing {
                total: durations().sum(),
                longest: durations().fold(0.0, f64::max),
            },
            steps: PerSensor::from_fn(|sensor| [0, 1, 2].map(|axis| step(run, sensor, axis))),
            directions: directions(&rests),
            rests,
        }
    }

    /// Of the six ways up, the rests in which each is: x up, x down, … z down.
    pub fn ways_up(&self) -> [usize; 6] {
        let mut ways = [0; 6];
        for rest in self.rests.iter().filter(|rest| rest.up.is_upright()) {
            ways[2 * rest.up.axis + usize::from(rest.up.down)] += 1;
        }
        ways
    }
}

/// How many directions of up differ.
fn directions(rests: &[Rest]) -> usize {
    let mut known: Vec<&Rest> = Vec::new();
    for rest in rests {
        if known
            .iter()
            .all(|other| other.force.angle(&rest.force) > APART)
        {
            known.push(rest);
        }
    }
    known.len()
}

/// A step of the file's values as a rate.
fn step(run: &Run, sensor: Sensor, axis: usize) -> Option<f64> {
    let column = &run.recording.imu.log.as_ref()?.columns.get(sensor)[axis];
    Some((column.step? * column.unit / run.recording.imu.period).abs())
}

#[cfg(test)]
mod tests;
