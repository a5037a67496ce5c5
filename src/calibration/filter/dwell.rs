//! Processing of a part of a dwell in one step.

use super::Filter;
use super::at_rest::{Map, begins};
use super::dwell_filter::{DwellFilter, Observed, Summary};
use super::gain_cache::GainCache;
use super::gate::{Decision, Judge};
use crate::calibration::record::Rest;
use crate::calibration::{ATTITUDE, Known, NAVIGATION, Observation, POSITION, Stretch, VELOCITY};

/// Result of processing a part of a dwell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken {
    Whole,
    Abandoned,
    /// A covariance is no longer positive definite.
    Diverged,
}

/// Processes parts of dwells for filters of one kind.
pub trait DwellFilters {
    /// Processes a part of a dwell. Innovations are computed if prior knowledge of the constants (`known`) is given.
    fn take_in(
        &mut self,
        filter: &mut Filter,
        of: (&Rest, &Stretch),
        known: Option<&Known>,
        judge: &mut Judge,
    ) -> Taken;
}

impl<const M: usize, const G: usize> DwellFilters for GainCache<M, G> {
    fn take_in(
        &mut self,
        filter: &mut Filter,
        of: (&Rest, &Stretch),
        known: Option<&Known>,
        judge: &mut Judge,
    ) -> Taken {
        filter.update_dwell(self, of, known, judge)
    }
}

/// The implementation for this filter, by its moving states: navigation errors; plus rotation at rest or the biases of
/// a triad; plus two of these; plus all.
pub fn dwell_filters(filter: &Filter) -> Box<dyn DwellFilters> {
    let moving = filter.moving().len();
    let begins = begins(moving);
    match moving {
        9 => Box::new(GainCache::<9, 12>::new(&begins)),
        12 => Box::new(GainCache::<12, 15>::new(&begins)),
        15 => Box::new(GainCache::<15, 18>::new(&begins)),
        _ => Box::new(GainCache::<18, 21>::new(&begins)),
    }
}

impl Filter {
    /// Starts a part of a dwell, before its first observation.
    pub fn begin_rest(&mut self, rest: &Rest, stretch: &Stretch) {
        if rest.first {
            self.come_to_rest(&rest.from);
        }
        self.refer(&rest.from, &rest.begin);
        if rest.first {
            self.begin_dwell();
            self.begin_to_hold();
        }
        if rest.first && rest.new_position {
            if self.model.velocity_anew {
                self.redraw_velocity(stretch.velocity_sigma());
            }
            self.redraw_table();
            // Between positions the IMU moves by its distance from the table's centre, within one
            // not at all: one observation a dwell, however long it is.
            self.update_position(&rest.begin, stretch.position_variance(&self.model));
        }
    }

    fn update_dwell<const M: usize, const G: usize>(
        &mut self,
        gains: &mut GainCache<M, G>,
        (rest, stretch): (&Rest, &Stretch),
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
        match self.through(&mut dwell, (rest, stretch), judge) {
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

    /// Runs the separate filter of a part through the whole part.
    fn through<const M: usize, const G: usize>(
        &self,
        dwell: &mut DwellFilter<M, G>,
        (rest, stretch): (&Rest, &Stretch),
        judge: &mut Judge,
    ) -> Taken {
        let turn = self.layout.turn_at_rest.map(|_| NAVIGATION);
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
                    variance: stretch.observation_variance(&self.model, seen.kind, seen.readings),
                };
                match dwell.observe(&observed, judge) {
                    None => return Taken::Diverged,
                    Some(Decision::Abandoned) => return Taken::Abandoned,
                    Some(Decision::Accepted | Decision::Rejected) => {}
                }
            }
        }
        Taken::Whole
    }

    /// Sets the moving states to their values at the end of a part.
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
