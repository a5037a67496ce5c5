//! Cache of covariances and gains of filters of parts of dwells: they do not depend on the data.
//!
//! Covariance and gain of a Kalman filter depend on the sequence of steps and observations, not on the observed values,
//! and can be computed in advance (Gelb, *Applied Optimal Estimation*, §4.2). At rest, they do not depend on the
//! attitude either, because gravity and Earth rate are constant in East-North-Up. So most dwells repeat the sequence of
//! the previous one.

use nalgebra::Matrix3;

use super::rows::{add, whiten};

/// Propagation of navigation errors in one step, with the effect of `g` and noise. `M` states move.
#[derive(PartialEq)]
pub struct StepModel<const M: usize> {
    /// Covariance of noise.
    pub noise: [[f64; M]; M],
    /// Nonzero elements of Φ: row, column, value.
    pub transition: Vec<(usize, usize, f64)>,
    /// Effect of the constants of `g`: row, index in `g`, value.
    pub driven: Vec<(usize, usize, f64)>,
}

/// The sequence of a part of a dwell, reused as far as the next one repeats it.
pub struct GainCache<const M: usize, const G: usize> {
    pub models: Vec<StepModel<M>>,
    pub course: Vec<Point<M, G>>,
}

/// What is known after an event of a sequence.
pub struct Point<const M: usize, const G: usize> {
    /// The event that led to it.
    event: Event,
    pub known: Known<M, G>,
    /// Gain, if the event was an observation.
    pub gain: Option<Gain<M, G>>,
}

#[derive(Clone, Copy, PartialEq)]
enum Event {
    Begin,
    /// A step of this model.
    Step(usize),
    /// Three navigation errors are observed, starting at this state, each with this variance.
    Observed(usize, f64),
}

/// Gain of an observation for given `g`.
pub struct Gain<const M: usize, const G: usize> {
    /// Lower triangular root of its covariance.
    pub root: Matrix3<f64>,
    /// Rows of `g`, whitened by it.
    pub rows: [[f64; G]; 3],
    /// Gain of the navigation errors from the whitened observation.
    pub of_errors: [[f64; M]; 3],
    /// Logarithm of the determinant of its covariance.
    pub log_determinant: f64,
}

/// Covariance of navigation errors `U g + m` for given `g`, and information on `g`.
#[derive(Clone)]
pub struct Known<const M: usize, const G: usize> {
    /// U
    pub of_given: [[f64; G]; M],
    /// Covariance of m.
    pub covariance: [[f64; M]; M],
    /// Information on `g` from the observations so far only.
    pub information: [[f64; G]; G],
}

impl<const M: usize, const G: usize> GainCache<M, G> {
    /// Index of the common start.
    pub const BEGIN: usize = 0;

    /// Component `k` of `g` is the error of the moving state `begins[k]` at the start of a part.
    pub fn new(begins: &[usize]) -> Self {
        let mut known = Known {
            of_given: [[0.0; G]; M],
            covariance: [[0.0; M]; M],
            information: [[0.0; G]; G],
        };
        for (component, &state) in begins.iter().enumerate() {
            known.of_given[state][component] = 1.0;
        }
        Self {
            models: Vec::new(),
            course: vec![Point {
                event: Event::Begin,
                known,
                gain: None,
            }],
        }
    }

    /// Starts a part with these models; results for other models are dropped.
    pub fn begin(&mut self, models: Vec<StepModel<M>>) {
        let pairs = self.models.iter().zip(&models);
        let alike = pairs.take_while(|(one, other)| one == other).count();
        let other = |of: &Point<M, G>| matches!(of.event, Event::Step(model) if model >= alike);
        let first = self.course.iter().position(other);
        self.course.truncate(first.unwrap_or(self.course.len()));
        self.models = models;
    }

    /// The point after a step.
    pub fn step(&mut self, from: usize, model: usize) -> usize {
        let event = Event::Step(model);
        if !self.is_next(from, event) {
            let known = self.course[from].known.propagated(&self.models[model]);
            self.lead(from, event, known, None);
        }
        from + 1
    }

    /// The point after an observation of three navigation errors, starting at `state`, each with this variance; `None`
    /// if their covariance is not positive definite.
    pub fn observe(&mut self, from: usize, state: usize, variance: f64) -> Option<usize> {
        let event = Event::Observed(state, variance);
        if !self.is_next(from, event) {
            let mut known = self.course[from].known.clone();
            let gain = known.gain(state, variance)?;
            known.tell(&gain);
            self.lead(from, event, known, Some(gain));
        }
        Some(from + 1)
    }

    fn is_next(&self, from: usize, event: Event) -> bool {
        let next = self.course.get(from + 1);
        next.is_some_and(|point| point.event == event)
    }

    fn lead(&mut self, from: usize, event: Event, known: Known<M, G>, gain: Option<Gain<M, G>>) {
        self.course.truncate(from + 1);
        self.course.push(Point { event, known, gain });
    }
}

impl<const M: usize, const G: usize> Known<M, G> {
    fn propagated(&self, model: &StepModel<M>) -> Self {
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
        Self {
            of_given,
            covariance,
            information: self.information,
        }
    }

    fn gain(&self, state: usize, variance: f64) -> Option<Gain<M, G>> {
        let states = [0, 1, 2].map(|axis| state + axis);
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

    /// Updates with an observation.
    fn tell(&mut self, gain: &Gain<M, G>) {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> StepModel<9> {
        let mut noise = [[0.0; 9]; 9];
        (0..9).for_each(|k| noise[k][k] = 1.0 + k as f64);
        let mut transition: Vec<_> = (0..9).map(|k| (k, k, 1.0)).collect();
        transition.extend([(3, 1, -0.98), (4, 0, 0.98)]);
        StepModel {
            noise,
            transition,
            driven: vec![(0, 6, 0.1), (3, 9, 0.1)],
        }
    }

    fn gains() -> GainCache<9, 12> {
        GainCache::new(&[0, 1, 2, 3, 4, 5])
    }

    /// Through a step and an observation this many times; where the last one leads.
    fn go(gains: &mut GainCache<9, 12>, from: usize, times: usize, variance: f64) -> usize {
        (0..times).fold(from, |at, _| {
            let stepped = gains.step(at, 0);
            let observed = gains.observe(stepped, 3, variance);
            observed.expect("it is positive definite")
        })
    }

    #[test]
    fn what_is_known_is_the_same_whichever_course_came_before() {
        let mut shared = gains();
        // One course, one that branches off it, and the first again.
        for variances in [
            [(10, 0.5), (5, 0.5)],
            [(10, 0.5), (5, 2.0)],
            [(15, 0.5), (0, 0.0)],
        ] {
            let along = |gains: &mut GainCache<9, 12>| {
                gains.begin(vec![model()]);
                let begin = GainCache::<9, 12>::BEGIN;
                let each = variances.iter();
                each.fold(begin, |at, &(times, variance)| {
                    go(gains, at, times, variance)
                })
            };
            let mut alone = gains();
            let (point, at) = (along(&mut shared), along(&mut alone));
            let (shared, alone) = (&shared.course[point].known, &alone.course[at].known);
            assert_eq!(shared.of_given, alone.of_given);
            assert_eq!(shared.covariance, alone.covariance);
            assert_eq!(shared.information, alone.information);
        }
    }
}
