//! Attitude of the table at any time.

use super::chain::{Chain, Kinematics};
use super::{AxesStep, Axis, BodyStep, Imperfection, Moves, Path, Profile, Table, TableError};
use crate::attitude::exp;
use crate::units::DEGREE;

/// A stretch of the path in which the same joints (or none) move.
#[derive(Debug, Clone, PartialEq)]
struct Stretch {
    start: f64,
    end: f64,
    position: usize,
    chain: Chain,
}

/// The motion of one table along a path, with attitude, rate and acceleration in closed form at any time from zero to
/// the duration of the path.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// In order and never empty.
    stretches: Vec<Stretch>,
    breaks: Vec<f64>,
    moves: Vec<(f64, f64)>,
}

impl Motion {
    /// Drives a table with these imperfections along a path.
    ///
    /// A rotation about body axes must stay within the lowest limits of all axes.
    ///
    /// # Errors
    /// Returns an error if the path does not fit the axes of the table or exceeds its limits.
    pub fn new(
        table: &Table,
        path: &Path,
        imperfection: &Imperfection,
    ) -> Result<Self, TableError> {
        let mut motion = Self {
            stretches: Vec::new(),
            breaks: Vec::new(),
            moves: Vec::new(),
        };
        match &path.moves {
            Moves::Axes { start, steps } => {
                axis_count(table, start, "start".to_owned())?;
                let mut angles = start.clone();
                let still = |angles: &[f64]| Chain::of_table(table, imperfection, angles, &[]);
                motion.push(path.first_dwell, still(&angles));
                for (number, step) in (1..).zip(steps) {
                    let profiles = profiles(table, step, number)?;
                    let moving = Chain::of_table(table, imperfection, &angles, &profiles);
                    motion.push_move(moving);
                    for (angle, by) in angles.iter_mut().zip(&step.angles) {
                        *angle += by;
                    }
                    motion.push(step.dwell, still(&angles));
                }
            }
            Moves::Body { .. } if imperfection.moves_axes() => return Err(TableError::AxesUnknown),
            Moves::Body { start, steps } => {
                let base = exp(imperfection.base);
                let mut attitude = *start;
                motion.push(path.first_dwell, Chain::still(base * attitude));
                for (number, step) in (1..).zip(steps) {
                    let vector = step.rotation.vector(&attitude);
                    let profile = body_profile(table, step, vector.norm(), number)?;
                    let axis = vector.try_normalize(0.0).unwrap_or_default();
                    let moving = Chain::about_body_axis(base * attitude, axis, profile);
                    motion.push_move(moving);
                    attitude *= exp(vector);
                    motion.push(step.dwell, Chain::still(base * attitude));
                }
            }
        }
        motion.breaks.sort_by(f64::total_cmp);
        Ok(motion)
    }

    /// Duration of the path, s.
    pub fn duration(&self) -> f64 {
        self.stretches.last().map_or(0.0, |last| last.end)
    }

    /// The times in s, in order, at which derivatives of the rate jump. An integral across such a time is best computed
    /// in two parts.
    pub fn breaks(&self) -> &[f64] {
        &self.breaks
    }

    /// Whether the table is at rest at a time in s.
    pub fn stands(&self, time: f64) -> bool {
        self.stretch(time).chain.stands()
    }

    /// Number of moves started before a time in s; this is also the number of the current position.
    pub fn position(&self, time: f64) -> usize {
        self.stretch(time).position
    }

    /// The dwells, `(start, end)` in s, in order.
    pub fn dwells(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.stretches
            .iter()
            .filter(|stretch| stretch.chain.stands())
            .map(|stretch| (stretch.start, stretch.end))
    }

    /// The moves, `(start, end)` in s, in order.
    pub fn moves(&self) -> &[(f64, f64)] {
        &self.moves
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

    fn push_move(&mut self, moving: Chain) {
        let start = self.duration();
        self.push(moving.duration(), moving);
        self.moves.push((start, self.duration()));
    }

    /// Adds a stretch that takes time. The first stretch, at rest, is kept even if it takes no time, so that there is
    /// always an attitude.
    fn push(&mut self, duration: f64, chain: Chain) {
        let last = self.stretches.last();
        let (start, position) = last.map_or((0.0, 0), |last| (last.end, last.position));
        if duration > 0.0 || last.is_none() {
            self.breaks
                .extend(chain.breaks().map(|after| start + after));
            self.stretches.push(Stretch {
                start,
                end: start + duration,
                position: position + usize::from(!chain.stands()),
                chain,
            });
        }
    }
}

fn axis_count(table: &Table, angles: &[f64], place: String) -> Result<(), TableError> {
    match (angles.len(), table.axes.len()) {
        (found, expected) if found == expected => Ok(()),
        (found, expected) => Err(TableError::AxisCount {
            place,
            found,
            expected,
        }),
    }
}

fn profiles(table: &Table, step: &AxesStep, number: usize) -> Result<Vec<Profile>, TableError> {
    axis_count(table, &step.angles, format!("step {number}"))?;
    let of_axis = |(axis, &angle): (&Axis, &f64)| {
        let profile = Profile::limited(angle, step.rate, step.acceleration);
        if angle != 0.0 {
            within(axis, number, profile.peak_rate(), step.acceleration)?;
        }
        Ok(profile)
    };
    table.axes.iter().zip(&step.angles).map(of_axis).collect()
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
            needed: step.shortest(angle),
        }
    })?;
    for axis in &table.axes {
        within(axis, number, profile.peak_rate(), step.acceleration)?;
    }
    Ok(profile)
}

fn within(axis: &Axis, step: usize, rate: f64, acceleration: f64) -> Result<(), TableError> {
    let above = |what, unit, found: f64, limit: f64| {
        // A value equal to a limit given in degrees must be accepted.
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
