//! A part of a dwell at once.

use super::Filter;
use super::at_rest::{Map, begins};
use super::dwell_filter::{DwellFilter, Observed, Summary};
use super::gain_cache::GainCache;
use super::gate::{Judge, Verdict};
use crate::calibration::record::Rest;
use crate::calibration::{
    ATTITUDE, Known, Model, NAVIGATION, Observation, POSITION, Stretch, VELOCITY,
};

/// What a part of a dwell did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken {
    Whole,
    Abandoned,
    /// A covariance is not positive definite any more.
    Diverged,
}

/// Takes parts of dwells into filters of one kind, by what moves in them.
pub enum DwellFilters {
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
        let moving = filter.moving().len();
        match moving {
            9 => Self::Navigation(GainCache::new(begins(moving))),
            12 => Self::Three(GainCache::new(begins(moving))),
            15 => Self::Six(GainCache::new(begins(moving))),
            _ => Self::Nine(GainCache::new(begins(moving))),
        }
    }

    /// Takes in a part of a dwell. Innovations are worked out where it is told what is `known` of the constants.
    pub fn take_in(
        &mut self,
        filter: &mut Filter,
        rest: &Rest,
        of: (&Model, &Stretch),
        known: Option<&Known>,
        judge: &mut Judge,
    ) -> Taken {
        match self {
            Self::Navigation(gains) => filter.update_dwell((rest, gains), of, known, judge),
            Self::Three(gains) => filter.update_dwell((rest, gains), of, known, judge),
            Self::Six(gains) => filter.update_dwell((rest, gains), of, known, judge),
            Self::Nine(gains) => filter.update_dwell((rest, gains), of, known, judge),
        }
    }
}

impl Filter {
    /// A part of a dwell begins, before anything is observed of it.
    pub fn begin_rest(&mut self, rest: &Rest, model: &Model, stretch: &Stretch) {
        if rest.first {
            self.come_to_rest(&rest.from);
        }
        self.refer(&rest.from, &rest.begin);
        if rest.first {
            self.begin_dwell();
            self.begin_to_hold();
        }
        if rest.first && rest.new_position && model.velocity_anew {
            self.redraw_velocity(stretch.velocity_sigma());
        }
        if rest.first && rest.new_position {
            self.redraw_table(model.position_sigma);
            // Between positions the IMU moves by its distance from the table's centre, within one
            // not at all: one observation a dwell, however long it is.
            self.update_position(&rest.begin, stretch.position_variance(model));
        }
    }

    fn update_dwell<const M: usize, const G: usize>(
        &mut self,
        (rest, gains): (&Rest, &mut GainCache<M, G>),
        of: (&Model, &Stretch),
        known: Option<&Known>,
        judge: &mut Judge,
    ) -> Taken {
        let Some(first) = rest.models.first() else {
            return Taken::Whole;
        };
        let moving = self.moving();
        let map = self.map(rest, first, G);
        let models = rest.models.iter().map(|block| self.step_model(block));
        gains.begin(models.collect());
        let across = &map.given.states * &self.p;
        let given = known.map(|known| self.given(&map.given, &across, known));
        let mut dwell = DwellFilter::new(given, gains);
        match self.through(&mut dwell, rest, of, judge) {
            Taken::Whole => {}
            other => return other,
        }
        let summary = dwell.summary();
        self.columns.squares += summary.squares;
        self.columns.log_determinant += summary.log_determinant;
        if !summary.values.is_empty() {
            let measured = map.given.combined(&summary.measured);
            let across = &summary.measured * across;
            self.take((&measured, across), &summary.values, 1.0);
        }
        self.end(&summary, &map, &moving);
        Taken::Whole
    }

    /// A filter of a part alone through all of it.
    fn through<const M: usize, const G: usize>(
        &self,
        dwell: &mut DwellFilter<M, G>,
        rest: &Rest,
        (model, stretch): (&Model, &Stretch),
        judge: &mut Judge,
    ) -> Taken {
        let turn = self.layout.turn_at_rest().map(|_| NAVIGATION);
        for step in &rest.steps {
            let errors = [ATTITUDE, VELOCITY, POSITION].into_iter();
            let turned = turn.map(|turn| (turn, step.referred[0]));
            for (first, by) in errors.zip(step.referred).chain(turned) {
                (0..3).for_each(|axis| dwell.refer(first + axis, by[axis]));
            }
            dwell.propagate(step.model);
            for seen in &rest.seen[step.seen.clone()] {
                let observed = Observed {
                    time: step.time,
                    kind: seen.kind,
                    state: match seen.kind {
                        Observation::Velocity => VELOCITY,
                        Observation::Table => ATTITUDE,
                        Observation::Attitude => turn.unwrap_or(ATTITUDE),
                    },
                    residual: seen.residual,
                    variance: stretch.observation_variance(model, seen.kind, seen.readings),
                };
                match dwell.observe(&observed, judge) {
                    None => return Taken::Diverged,
                    Some(Verdict::Abandoned) => return Taken::Abandoned,
                    Some(Verdict::Accepted | Verdict::Rejected) => {}
                }
            }
        }
        Taken::Whole
    }

    /// The states that move become what they are at the end of a part.
    fn end(&mut self, summary: &Summary, Map { given, table }: &Map, moving: &[usize]) {
        let mut end = given.combined(&summary.of_given);
        end.add(ATTITUDE, table);
        for axis in 0..3 {
            end.states[(POSITION + axis, POSITION + axis)] += 1.0;
        }
        let added = end.columns.transpose();
        self.carry(moving, end.states, &summary.covariance, &added);
        for (&state, offset) in moving.iter().zip(summary.offset.iter()) {
            self.x[state] += offset;
        }
    }
}
