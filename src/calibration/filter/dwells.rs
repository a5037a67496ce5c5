//! Filters of parts of dwells, by how many states move in them.

use super::Filter;
use super::at_rest::begins;
use super::courses::Courses;
use super::standing::{Observer, Taken};
use crate::calibration::record::segment::Segment;

/// Takes parts of dwells into filters of one kind: what moves in them is always the same.
pub struct Dwells(Moving);

/// What moves.
enum Moving {
    /// Navigation errors alone.
    Navigation(Courses<9, 12>),
    /// And the turn at rest, or the biases of a triad.
    Three(Courses<12, 15>),
    /// And two of these.
    Six(Courses<15, 18>),
    /// And all of them.
    Nine(Courses<18, 21>),
}

impl Dwells {
    /// Of filters like this.
    pub fn of(filter: &Filter) -> Self {
        let moving = filter.moving();
        Self(match moving.len() {
            9 => Moving::Navigation(Courses::new(begins(&moving))),
            12 => Moving::Three(Courses::new(begins(&moving))),
            15 => Moving::Six(Courses::new(begins(&moving))),
            _ => Moving::Nine(Courses::new(begins(&moving))),
        })
    }

    /// Takes in a part of a dwell.
    pub fn take_in(
        &mut self,
        filter: &mut Filter,
        segment: &Segment,
        observer: &mut impl Observer,
    ) -> Taken {
        match &mut self.0 {
            Moving::Navigation(courses) => filter.stand(segment, courses, observer),
            Moving::Three(courses) => filter.stand(segment, courses, observer),
            Moving::Six(courses) => filter.stand(segment, courses, observer),
            Moving::Nine(courses) => filter.stand(segment, courses, observer),
        }
    }
}
