//! Where the table is at any time.

use std::f64::consts::PI;

use super::chain::{Chain, Kinematics};
use super::{AxesStep, Axis, BodyStep, Imperfection, Moves, Path, Profile, Table, TableError};
use crate::attitude::exp;
use crate::units::DEGREE;

/// A stretch of the path in which the same joints move, or none.
#[derive(Debug, Clone, PartialEq)]
struct Stretch {
    start: f64,
    end: f64,
    position: usize,
    chain: Chain,
}

/// A path as driven by one table: attitude, rate and acceleration in closed form at any time from
/// zero to its duration.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// In order and never empty.
    stretches: Vec<Stretch>,
    breaks: Vec<f64>,
}

impl Motion {
    /// Drives a table with these imperfections along a path.
    ///
    /// A rotation about body axes is held against the lowest limits of all axes.
    ///
    /// # Errors
    /// If the path does not fit the table's axes or is beyond its limits.
    pub fn new(
        table: &Table,
        path: &Path,
        imperfection: &Imperfection,
    ) -> Result<Self, TableError> {
        match &path.moves {
            Moves::Axes { start, steps } => {
                axis_count(table, start, || "start".into())?;
                let mut angles = start.clone();
                let still = |angles: &[f64]| Chain::of_table(table, imperfection, angles, &[]);
                let mut motion = Self::standing(path.first_dwell, still(&angles));
                for (i, step) in steps.iter().enumerate() {
                    let profiles = axes_profiles(table, step, i + 1)?;
                    motion.go(Chain::of_table(table, imperfection, &angles, &profiles));
                    for (angle, by) in angles.iter_mut().zip(&step.angles) {
                        *angle += by;
                    }
                    motion.stand(step.dwell, still(&angles));
                }
                Ok(motion)
            }
            Moves::Body { start, steps } => {
                if imperfection.moves_axes() {
                    return Err(TableError::AxesUnknown);
                }
                let base = exp(imperfection.base);
                let mut attitude = *start;
                let mut motion = Self::standing(path.first_dwell, Chain::still(base * attitude));
                for (i, step) in steps.iter().enumerate() {
                    let vector = step.rotation.vector(&attitude);
                    let profile = body_profile(table, step, vector.norm(), i + 1)?;
                    let axis = vector.try_normalize(0.0).unwrap_or_default();
                    motion.go(Chain::about_body_axis(base * attitude, axis, profile));
                    attitude *= exp(vector);
                    motion.stand(step.dwell, Chain::still(base * attitude));
                }
                Ok(motion)
            }
        }
    }

    /// How long the path takes, s.
    pub fn duration(&self) -> f64 {
        self.stretches.last().map_or(0.0, |last| last.end)
    }

    /// The times in s, in order, at which derivatives of the rate jump. An integral across one of
    /// them is best made in two parts.
    pub fn breaks(&self) -> &[f64] {
        &self.breaks
    }

    /// Whether the table stands at a time in s.
    pub fn stands(&self, time: f64) -> bool {
        self.stretch(time).chain.stands()
    }

    /// How many moves have begun at a time in s: the number of the position in force.
    pub fn position(&self, time: f64) -> usize {
        self.stretch(time).position
    }

    /// When the table stands, `(start, end)` in s, in order.
    pub fn dwells(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.stretches
            .iter()
            .filter(|stretch| stretch.chain.stands())
            .map(|stretch| (stretch.start, stretch.end))
    }

    /// Attitude, rate and acceleration at a time in s.
    pub fn at(&self, time: f64) -> Kinematics {
        let stretch = self.stretch(time);
        stretch.chain.at(time - stretch.start)
    }

    fn stretch(&self, time: f64) -> &Stretch {
        let begun = self.stretches.partition_point(|s| s.start <= time);
        &self.stretches[begun.saturating_sub(1)]
    }

    /// Begins at rest. That is kept even if it takes no time: there is always an attitude.
    fn standing(duration: f64, chain: Chain) -> Self {
        let mut motion = Self {
            stretches: Vec::new(),
            breaks: Vec::new(),
        };
        motion.push(duration, 0, chain);
        motion
    }

    fn stand(&mut self, duration: f64, chain: Chain) {
        if duration > 0.0 {
            self.push(duration, 0, chain);
        }
    }

    fn go(&mut self, chain: Chain) {
        let duration = chain.duration();
        if duration > 0.0 {
            let start = self.duration();
            self.breaks
                .extend(chain.breaks().iter().map(|after| start + after));
            self.push(duration, 1, chain);
        }
    }

    fn push(&mut self, duration: f64, positions: usize, chain: Chain) {
        let (start, position) = self
            .stretches
            .last()
            .map_or((0.0, 0), |last| (last.end, last.position));
        self.stretches.push(Stretch {
            start,
            end: start + duration,
            position: position + positions,
            chain,
        });
    }
}

fn axis_count(
    table: &Table,
    angles: &[f64],
    place: impl FnOnce() -> String,
) -> Result<(), TableError> {
    if angles.len() == table.axes.len() {
        Ok(())
    } else {
        Err(TableError::AxisCount {
            place: place(),
            found: angles.len(),
            expected: table.axes.len(),
        })
    }
}

fn axes_profiles(
    table: &Table,
    step: &AxesStep,
    number: usize,
) -> Result<Vec<Profile>, TableError> {
    axis_count(table, &step.angles, || format!("step {number}"))?;
    table
        .axes
        .iter()
        .zip(&step.angles)
        .map(|(axis, &angle)| {
            let profile = Profile::limited(angle, step.rate, step.acceleration);
            if angle != 0.0 {
                within(axis, number, profile.peak_rate(), step.acceleration)?;
            }
            Ok(profile)
        })
        .collect()
}

fn body_profile(
    table: &Table,
    step: &BodyStep,
    angle: f64,
    number: usize,
) -> Result<Profile, TableError> {
    let profile = Profile::timed(angle, step.duration, step.acceleration).ok_or_else(|| {
        TableError::Hurried {
            step: number,
            angle_deg: angle / DEGREE,
            duration: step.duration,
            needed: (2.0 * PI * angle / step.acceleration).sqrt(),
        }
    })?;
    for axis in &table.axes {
        within(axis, number, profile.peak_rate(), step.acceleration)?;
    }
    Ok(profile)
}

fn within(axis: &Axis, step: usize, rate: f64, acceleration: f64) -> Result<(), TableError> {
    let above = |what, unit, found: f64, limit: f64| {
        // A limit given in degrees must admit itself.
        if found <= limit * (1.0 + 1e-12) {
            Ok(())
        } else {
            Err(TableError::Limit {
                step,
                what,
                found: found / DEGREE,
                limit: limit / DEGREE,
                unit,
                axis: axis.name.clone(),
            })
        }
    };
    above("rate", "°/s", rate, axis.max_rate)?;
    above("acceleration", "°/s²", acceleration, axis.max_acceleration)
}

#[cfg(test)]
mod tests;
