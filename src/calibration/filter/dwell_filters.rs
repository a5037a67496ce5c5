//! Filters of parts of dwells, by how many states move in them.

use super::Filter;
use super::dwell_update::{ObservationJudge, Taken};
use super::gain_cache::GainCache;
use super::step_at_rest::begins;
use crate::calibration::constants::Known;
use crate::calibration::model::Model;
use crate::calibration::problem::Stretch;
use crate::calibration::record::segment::Segment;

/// Takes parts of dwells into filters of one kind: what moves in them is always the same.
pub struct DwellFilters(Moving);

/// What moves.
enum Moving {
    /// Navigation errors alone.
    Navigation(GainCache<9, 12>),
    /// And the turn at rest, or the biases of a triad.
    Three(GainCache<12, 15>),
    /// And two of these.
    Six(GainCache<15, 18>),
    /// And all of them.
    Nine(GainCache<18, 21>),
}

impl DwellFilters {
    /// Of filters like this.
    pub fn of(filter: &Filter) -> Self {
        let moving = filter.moving();
        Self(match moving.len() {
            9 => Moving::Navigation(GainCache::new(begins(&moving))),
            12 => Moving::Three(GainCache::new(begins(&moving))),
            15 => Moving::Six(GainCache::new(begins(&moving))),
            _ => Moving::Nine(GainCache::new(begins(&moving))),
        })
    }

    /// Takes in a part of a dwell. Innovations are worked out where it is told what is `known` of the constants.
    pub fn take_in(
        &mut self,
        filter: &mut Filter,
        segment: &Segment,
        of: (&Model, &Stretch),
        known: Option<&Known>,
        judge: &mut impl ObservationJudge,
    ) -> Taken {
        match &mut self.0 {
            Moving::Navigation(gains) => filter.update_dwell((segment, gains), of, known, judge),
            Moving::Three(gains) => filter.update_dwell((segment, gains), of, known, judge),
            Moving::Six(gains) => filter.update_dwell((segment, gains), of, known, judge),
            Moving::Nine(gains) => filter.update_dwell((segment, gains), of, known, judge),
        }
    }
}
