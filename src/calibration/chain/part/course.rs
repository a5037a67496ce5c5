//! Covariances and gains along the steps and observations of a part.
//!
//! Covariances and gains depend on the sequence of steps and observations, not on the observed values (Gelb, *Applied
//! Optimal Estimation*, §4.2). At rest they do not depend on the attitude either, because gravity and Earth rate are
//! constant in East-North-Up. Most parts therefore repeat the sequence of the preceding part.

use nalgebra::Matrix3;

use crate::calibration::chain::short_rows::{add, whiten};

/// Propagation of the moving states in one step, with the effect of `g` and noise.
#[derive(PartialEq)]
pub struct StepModel<const M: usize> {
    /// Covariance of the noise.
    pub noise: [[f64; M]; M],
    /// Nonzero elements of Φ: row, column, value.
    pub transition: Vec<(usize, usize, f64)>,
    /// Effect of the constants of `g`: row, place in `g`, value.
    pub driven: Vec<(usize, usize, f64)>,
}

/// The filter state is kept once per this many events, and recomputed in between: a gain needs a sixth of the memory of
/// a state.
const KEPT: usize = 32;

/// The sequence of a part. The next part reuses this sequence as far as the two sequences agree.
pub struct Course<const M: usize, const G: usize> {
    pub models: Vec<StepModel<M>>,
    /// All events, with the gains of observations.
    events: Vec<(Event, Option<Gain<M, G>>)>,
    /// Filter states before the first event and after every `KEPT` others.
    kept: Vec<Known<M, G>>,
    /// Filter state after the last event.
    last: Known<M, G>,
}

#[derive(Clone, Copy, PartialEq)]
enum Event {
    /// A step with this model.
    Step(usize),
    /// Observation of three states from the given one on, each with this variance.
    Observed(usize, f64),
    /// Addition of this variance to three states from the given one on.
    Widened(usize, f64),
}

/// Gain of an observation for given `g`.
pub struct Gain<const M: usize, const G: usize> {
    /// Lower triangular root of the covariance of the observation.
    pub root: Matrix3<f64>,
    /// Rows in `g`, whitened by this root.
    pub rows: [[f64; G]; 3],
    /// Gain of the moving states from the whitened observation.
    pub of_errors: [[f64; M]; 3],
    pub log_determinant: f64,
}

/// States `U g + m` that change within the part, for given `g`, and the information on `g`.
#[derive(Clone)]
pub struct Known<const M: usize, const G: usize> {
    /// Matrix U.
    pub of_given: [[f64; G]; M],
    /// Covariance of m.
    pub covariance: [[f64; M]; M],
    pub information: [[f64; G]; G],
}

impl<const M: usize> StepModel<M> {
    /// The mean after the step.
    pub fn propagated(&self, before: &[f64; M]) -> [f64; M] {
        let mut mean = [0.0; M];
        for &(row, column, phi) in &self.transition {
            mean[row] += phi * before[column];
        }
        mean
    }
}

impl<const M: usize, const G: usize> Course<M, G> {
    /// Components of `g`, each with the moving state whose initial value it is.
    pub fn new(begins: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut known = Known {
            of_given: [[0.0; G]; M],
            covariance: [[0.0; M]; M],
            information: [[0.0; G]; G],
        };
        for (component, state) in begins {
            known.of_given[state][component] = 1.0;
        }
        Self {
            models: Vec::new(),
            events: Vec::new(),
            kept: vec![known.clone()],
            last: known,
        }
    }

    /// Starts a part with these models; stored events with other models are dropped.
    pub fn begin(&mut self, models: Vec<StepModel<M>>) {
        let pairs = self.models.iter().zip(&models);
        let alike = pairs.take_while(|(one, other)| one == other).count();
        let other = |of: &Event| matches!(of, Event::Step(model) if *model >= alike);
        if let Some(first) = self.events.iter().position(|(event, _)| other(event)) {
            self.back_to(first);
        }
        self.models = models;
    }

    /// Adds a step after this number of events.
    pub fn step(&mut self, from: usize, model: usize) {
        let event = Event::Step(model);
        if !self.is_next(from, event) {
            self.back_to(from);
            self.last.propagate(&self.models[model]);
            self.add(event, None);
        }
    }

    /// Adds a variance to three states after this number of events.
    pub fn widen(&mut self, from: usize, first: usize, variance: f64) {
        let event = Event::Widened(first, variance);
        if !self.is_next(from, event) {
            self.back_to(from);
            self.last.widen(first, variance);
            self.add(event, None);
        }
    }

    /// The gain of an observation of three states after this number of events; `None` if their covariance is not
    /// positive definite.
    pub fn observe(&mut self, from: usize, first: usize, variance: f64) -> Option<&Gain<M, G>> {
        let event = Event::Observed(first, variance);
        if !self.is_next(from, event) {
            self.back_to(from);
            let gain = self.last.gain(first, variance)?;
            self.last.update(&gain);
            self.add(event, Some(gain));
        }
        self.events[from].1.as_ref()
    }

    /// The filter state after this number of events.
    pub fn known(&self, at: usize) -> Known<M, G> {
        if at == self.events.len() {
            return self.last.clone();
        }
        let mut known = self.kept[at / KEPT].clone();
        for event in &self.events[at / KEPT * KEPT..at] {
            match event {
                (Event::Step(model), _) => known.propagate(&self.models[*model]),
                (Event::Widened(first, variance), _) => known.widen(*first, *variance),
                (Event::Observed(..), gain) => {
                    gain.iter().for_each(|gain| known.update(gain));
                }
            }
        }
        known
    }

    fn is_next(&self, from: usize, event: Event) -> bool {
        self.events.get(from).is_some_and(|next| next.0 == event)
    }

    fn back_to(&mut self, at: usize) {
        if at < self.events.len() {
            self.last = self.known(at);
            self.events.truncate(at);
            self.kept.truncate(at / KEPT + 1);
        }
    }

    fn add(&mut self, event: Event, gain: Option<Gain<M, G>>) {
        self.events.push((event, gain));
        if self.events.len().is_multiple_of(KEPT) {
            self.kept.push(self.last.clone());
        }
    }
}

impl<const M: usize, const G: usize> Known<M, G> {
    fn propagate(&mut self, model: &StepModel<M>) {
        let mut of_given = [[0.0; G]; M];
        let mut half = [[0.0; M]; M];
        for &(row, column, phi) in &model.transition {
            add(&mut of_given[row], phi, &self.of_given[column]);
            add(&mut half[row], phi, &self.covariance[column]);
        }
        for &(row, component, by) in &model.driven {
            of_given[row][component] += by;
        }
        let mut covariance = model.noise;
        for (row, sum) in covariance.iter_mut().enumerate() {
            for &(at, column, phi) in &model.transition {
                sum[at] += phi * half[row][column];
            }
        }
        (self.of_given, self.covariance) = (of_given, covariance);
    }

    fn widen(&mut self, first: usize, variance: f64) {
        (first..first + 3).for_each(|state| self.covariance[state][state] += variance);
    }

    fn gain(&self, first: usize, variance: f64) -> Option<Gain<M, G>> {
        let states = [0, 1, 2].map(|axis| first + axis);
        let mut rows = states.map(|state| self.of_given[state]);
        let mut of_errors = states.map(|state| self.covariance[state]);
        let own = Matrix3::from_fn(|row, column| of_errors[row][states[column]])
            + Matrix3::from_diagonal_element(variance);
        let root = own.cholesky()?.l();
        whiten(&root, &mut rows);
        whiten(&root, &mut of_errors);
        Some(Gain {
            log_determinant: 2.0 * root.diagonal().map(f64::ln).sum(),
            root,
            rows,
            of_errors,
        })
    }

    fn update(&mut self, gain: &Gain<M, G>) {
        for (row, of_errors) in gain.rows.iter().zip(&gain.of_errors) {
            for (state, gain) in of_errors.iter().enumerate() {
                add(&mut self.of_given[state], -gain, row);
                add(&mut self.covariance[state], -gain, of_errors);
            }
            for (of_component, weight) in self.information.iter_mut().zip(row) {
                add(of_component, *weight, row);
            }
        }
    }
}
