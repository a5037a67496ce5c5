//! Errors of an estimate followed back through what a filter did.
//!
//! `λᵀ e` is what errors e of the states make of an error of the estimate. Every operation of a linear filter
//! makes of e another e and adds noise to it; read backwards it makes of λ another λ, and λ times the root
//! of the covariance of that noise is what the noise does to the estimate (adjoint of the filter: Bryson and
//! Ho, *Applied Optimal Control*, §12.7; Gelb, *Applied Optimal Estimation*, §7.1 for error budgets).

use super::courses::{Courses, Gain};
use super::given::Given;
use super::local::Local;
use super::operation::{Driver, Operation};
use super::rows::roots;
use super::standing::{Done, Observer, Taken};
use super::{ATTITUDE, Filter, NAVIGATION};
use crate::calibration::parameters::PARAMETERS;
use crate::calibration::record::segment::{Seen, Segment};
use crate::navigation::Block;

/// What an error of one σ does to each parameter.
pub type Effect = [f64; PARAMETERS];

/// λ of every state, and who is told of noise.
pub struct Followed {
    /// For each state, by parameter.
    pub of_states: Vec<Effect>,
}

impl Followed {
    /// Errors of the estimated parameters themselves.
    pub fn of(filter: &Filter) -> Self {
        let mut of_states = vec![[0.0; PARAMETERS]; filter.layout.size()];
        for (state, index) in filter.layout.parameters() {
            of_states[state][index] = 1.0;
        }
        Self { of_states }
    }

    /// What the states that an operation moved become of, by its moving states; they are taken out.
    fn taken_out(&mut self, moving: &[usize]) -> Vec<Effect> {
        let out = |&state: &usize| std::mem::replace(&mut self.of_states[state], [0.0; PARAMETERS]);
        moving.iter().map(out).collect()
    }

    /// Follows back one operation; returns what its noise, of unit variance each, does: one effect for
    /// what is drawn, one of each scalar that is taken, the effects of the moving states for what is carried.
    pub fn back(&mut self, operation: &Operation) -> Vec<Effect> {
        match operation {
            Operation::Drawn { states, sigma } => {
                let mut effect = [0.0; PARAMETERS];
                for of_state in self.taken_out(states) {
                    add(&mut effect, *sigma, &of_state);
                }
                vec![effect]
            }
            Operation::Turned { first, by } => {
                for row in 0..3 {
                    let of_row = self.of_states[first + row];
                    for column in 0..3 {
                        let of_attitude = &mut self.of_states[ATTITUDE + column];
                        add(of_attitude, by[(row, column)], &of_row);
                    }
                }
                Vec::new()
            }
            Operation::Varied {
                state,
                keep,
                variance,
            } => {
                let of_state = &mut self.of_states[*state];
                let effect = of_state.map(|x| x * variance.sqrt());
                of_state.iter_mut().for_each(|x| *x *= keep);
                vec![effect]
            }
            Operation::Taken {
                rows,
                gain,
                variance,
            } => {
                let of_scalars = gain.column_iter().map(|gain| {
                    let mut of_noise = [0.0; PARAMETERS];
                    for (of_state, gain) in self.of_states.iter().zip(gain.iter()) {
                        add(&mut of_noise, -gain, of_state);
                    }
                    of_noise
                });
                let of_scalars: Vec<Effect> = of_scalars.collect();
                for (of_noise, row) in of_scalars.iter().zip(rows.row_iter()) {
                    for (of_state, weight) in self.of_states.iter_mut().zip(row.iter()) {
                        if *weight != 0.0 {
                            add(of_state, *weight, of_noise);
                        }
                    }
                }
                let sigma = variance.sqrt();
                let effects = of_scalars.iter().map(|effect| effect.map(|x| x * sigma));
                effects.collect()
            }
            Operation::Carried { moving, transition } => {
                let out = self.taken_out(moving);
                for (of_moving, row) in out.iter().zip(transition.row_iter()) {
                    for (of_state, weight) in self.of_states.iter_mut().zip(row.iter()) {
                        if *weight != 0.0 {
                            add(of_state, *weight, of_moving);
                        }
                    }
                }
                out
            }
        }
    }
}

/// Who is told what noise within a part of a dwell does.
pub trait Told {
    /// Noise of an observation, of unit variance, does this by axis.
    fn observed(&mut self, seen: &Seen, effects: &[Effect; 3]);
    /// Noise of a driver, of unit variance, does this.
    fn driven(&mut self, driver: Driver, effect: &Effect);
}

impl Filter {
    /// Follows errors back through a part of a dwell: `at_end` is what errors of its moving states at its end
    /// do, `of_measured` what noise of each row does that it measured.
    pub fn back_through<const M: usize, const G: usize>(
        &self,
        segment: &Segment,
        courses: &mut Courses<M, G>,
        observer: &mut impl Observer,
        drivers: &[(Driver, Self)],
        [at_end, of_measured]: [&[Effect]; 2],
        told: &mut impl Told,
    ) -> Taken {
        courses.tidy();
        let models = self.models(segment, courses);
        let mut local = Local::new(Given::certain(), courses);
        let mut done = Vec::new();
        match self.through(&mut local, (segment, &models), observer, &mut |what| {
            done.push(what)
        }) {
            Taken::Whole => {}
            other => return other,
        }
        // Σ rᵀ ν over all observations is Rᵀ times the noise of the rows R that are measured.
        let rows = local.measured();
        let mut of_sum = [[0.0; PARAMETERS]; G];
        for (n, (pivot, row)) in rows.iter().enumerate().rev() {
            let mut effect = of_measured.get(n).copied().unwrap_or([0.0; PARAMETERS]);
            for (later, _) in &rows[n + 1..] {
                add(&mut effect, -row[*later], &of_sum[*later]);
            }
            of_sum[*pivot] = effect.map(|x| x / row[*pivot]);
        }
        let mut of_errors = [[0.0; PARAMETERS]; M];
        for (own, at_end) in of_errors.iter_mut().zip(at_end) {
            *own = *at_end;
        }
        let of_drivers = self.drivers::<M>(segment, drivers);
        for done in done.into_iter().rev() {
            match done {
                Done::Step(model) => {
                    for (driver, root) in &of_drivers[model] {
                        told.driven(*driver, &combined(root, &of_errors));
                    }
                    let mut before = [[0.0; PARAMETERS]; M];
                    for &(row, column, phi) in &courses.model(models[model]).transition {
                        add(&mut before[column], phi, &of_errors[row]);
                    }
                    of_errors = before;
                }
                Done::Observed { state, seen, point } => {
                    let gain = courses.gain(point);
                    let effects = of_observation(gain, &of_errors, &of_sum);
                    for (axis, effect) in effects.iter().enumerate() {
                        add(&mut of_errors[state + axis], 1.0, effect);
                    }
                    told.observed(seen, &effects);
                }
            }
        }
        Taken::Whole
    }

    /// What noise of a block of a move does, `effects` what the navigation errors at its end do, and after them
    /// those of the turn at rest.
    pub fn back_through_noise(
        &self,
        block: &Block,
        drivers: &[(Driver, Self)],
        effects: &[Effect],
        told: &mut impl Told,
    ) {
        match self.layout.turn_at_rest() {
            Some(_) => told_of::<{ NAVIGATION + 3 }>(block, drivers, effects, told),
            None => told_of::<NAVIGATION>(block, drivers, effects, told),
        }
    }

    /// Roots of the noise that each driver adds in a step, by model of the segment.
    fn drivers<const M: usize>(
        &self,
        segment: &Segment,
        drivers: &[(Driver, Self)],
    ) -> Vec<Vec<(Driver, [f64; M])>> {
        let moving = self.moving();
        let models = segment.models.iter().map(|block| {
            let of = |filter: &Self| filter.step_model::<M>(block, &moving).noise;
            alone(drivers, of)
        });
        models.collect()
    }
}

fn told_of<const MOVING: usize>(
    block: &Block,
    drivers: &[(Driver, Filter)],
    effects: &[Effect],
    told: &mut impl Told,
) {
    for (driver, root) in alone(drivers, |filter| filter.noise_of_move::<MOVING>(block)) {
        told.driven(driver, &combined(&root, effects));
    }
}

/// Roots of the noise of each driver less that of interpolated samples, which all have.
fn alone<const N: usize>(
    drivers: &[(Driver, Filter)],
    noise: impl Fn(&Filter) -> [[f64; N]; N],
) -> Vec<(Driver, [f64; N])> {
    let interpolated = drivers
        .iter()
        .find(|(driver, _)| *driver == Driver::Interpolated);
    let common = interpolated.map_or([[0.0; N]; N], |(_, filter)| noise(filter));
    let own = drivers.iter().flat_map(|(driver, filter)| {
        let mut own = noise(filter);
        if *driver != Driver::Interpolated {
            let both = own.iter_mut().flatten().zip(common.iter().flatten());
            both.for_each(|(own, common)| *own -= common);
        }
        roots(own).into_iter().map(|root| (*driver, root))
    });
    own.collect()
}

/// What errors of these sizes do.
fn combined(sizes: &[f64], effects: &[Effect]) -> Effect {
    let mut sum = [0.0; PARAMETERS];
    for (size, effect) in sizes.iter().zip(effects) {
        add(&mut sum, *size, effect);
    }
    sum
}

/// What noise of each component of an observation does, of errors that are what they are after it.
fn of_observation<const M: usize, const G: usize>(
    gain: &Gain<M, G>,
    of_errors: &[Effect; M],
    of_sum: &[Effect; G],
) -> [Effect; 3] {
    let mut effects = [[0.0; PARAMETERS]; 3];
    for (k, effect) in effects.iter_mut().enumerate() {
        for (of_sum, weight) in of_sum.iter().zip(&gain.rows[k]) {
            add(effect, *weight, of_sum);
        }
        for (of_error, weight) in of_errors.iter().zip(&gain.of_errors[k]) {
            add(effect, -weight, of_error);
        }
    }
    // What was taken in is L⁻¹ of the observation.
    for k in (0..3).rev() {
        let (before, from) = effects.split_at_mut(k);
        from[0].iter_mut().for_each(|x| *x /= gain.root[(k, k)]);
        for (j, effect) in before.iter_mut().enumerate() {
            add(effect, -gain.root[(k, j)], &from[0]);
        }
    }
    effects
}

#[inline]
fn add(sum: &mut Effect, weight: f64, other: &Effect) {
    for k in 0..PARAMETERS {
        sum[k] += weight * other[k];
    }
}
