//! Events of all stretches at one linearisation point: navigation runs only once, because it does not depend on the
//! noise.

use super::{Event, Rest, events};
use crate::calibration::{AttitudePrior, CalibrationError, Linearisation, Problem};
use crate::imu::{PerSensor, Sensor};

/// Events at one linearisation point, independent of the noise.
#[derive(Debug)]
pub struct Script {
    pub at: Linearisation,
    pub priors: Vec<AttitudePrior>,
    /// Events of each stretch.
    pub events: Vec<Vec<Event>>,
}

/// Quantities that scale the noise in moves, summed over all moves.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moves {
    /// Duration, s.
    pub duration: f64,
    /// ∫|ω − ω_ie|² dt and ∫|f + g|² dt.
    pub motion: PerSensor<f64>,
}

impl Script {
    /// Navigates once through all stretches of a problem, linearised at this point.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Singular`] if a triad cannot be inverted at this point.
    pub fn new(
        problem: &Problem,
        priors: &[AttitudePrior],
        at: &Linearisation,
    ) -> Result<Self, CalibrationError> {
        let mut dwells = 0;
        let stretches = problem.stretches().iter().zip(&at.initial_attitudes);
        let events = stretches.map(|(stretch, initial)| {
            let first = dwells;
            dwells += stretch.dwells.len();
            events((problem, stretch), (at, initial, first))
        });
        Ok(Self {
            events: events.collect::<Result<_, _>>()?,
            at: at.clone(),
            priors: priors.to_vec(),
        })
    }

    /// The parts of dwells of a stretch.
    pub fn parts(&self, stretch: usize) -> impl Iterator<Item = &Rest> {
        let events = self.events.get(stretch).into_iter().flatten();
        events.filter_map(|event| match event {
            Event::Rest(rest) => Some(&**rest),
            Event::Move(_) => None,
        })
    }

    /// Quantities that scale the noise in moves.
    pub fn moves(&self) -> Moves {
        let mut moves = Moves::default();
        for event in self.events.iter().flatten() {
            if let Event::Move(block) = event {
                for part in &block.noise.parts {
                    moves.duration += part.moving;
                    for sensor in Sensor::ALL {
                        *moves.motion.get_mut(sensor) += part.motion.get(sensor);
                    }
                }
            }
        }
        moves
    }
}
