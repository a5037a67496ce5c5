//! Filters of parts of dwells, by how many states move in them.

use super::super::courses::Courses;
use super::super::segment::Segment;
use super::Filter;
use super::back::{Effect, Told};
use super::operation::Driver;
use super::standing::{Observer, Taken, begins};

/// Takes parts of dwells into filters of one kind: what moves in them is always the same.
pub(in crate::calibration) enum Dwells {
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
        match moving.len() {
            9 => Self::Navigation(Courses::new(begins(&moving))),
            12 => Self::Three(Courses::new(begins(&moving))),
            15 => Self::Six(Courses::new(begins(&moving))),
            _ => Self::Nine(Courses::new(begins(&moving))),
        }
    }

    /// Takes in a part of a dwell.
    pub fn take_in(
        &mut self,
        filter: &mut Filter,
        segment: &Segment,
        observer: &mut impl Observer,
    ) -> Taken {
        match self {
            Self::Navigation(courses) => filter.stand(segment, courses, observer),
            Self::Three(courses) => filter.stand(segment, courses, observer),
            Self::Six(courses) => filter.stand(segment, courses, observer),
            Self::Nine(courses) => filter.stand(segment, courses, observer),
        }
    }

    /// Follows errors back through a part of a dwell: `at_end` is what errors of its moving states at its end
    /// do, `of_measured` what noise of each row does that it measured.
    pub fn back_through(
        &mut self,
        (filter, drivers): (&Filter, &[(Driver, Filter)]),
        segment: &Segment,
        observer: &mut impl Observer,
        effects: [&[Effect]; 2],
        told: &mut impl Told,
    ) -> Taken {
        match self {
            Self::Navigation(courses) => {
                filter.back_through(segment, courses, observer, drivers, effects, told)
            }
            Self::Three(courses) => {
                filter.back_through(segment, courses, observer, drivers, effects, told)
            }
            Self::Six(courses) => {
                filter.back_through(segment, courses, observer, drivers, effects, told)
            }
            Self::Nine(courses) => {
                filter.back_through(segment, courses, observer, drivers, effects, told)
            }
        }
    }
}
