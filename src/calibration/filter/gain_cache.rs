//! What filters of parts of dwells do, whatever they are told.
//!
//! Covariance and gain of a Kalman filter depend on which steps and observations follow one another, not on
//! what is observed, and may be had beforehand (Gelb, *Applied Optimal Estimation*, §4.2). At rest they do not depend
//! on the attitude either: East, North and Up, gravity and the Earth's rate are where they always are. So one
//! dwell after the other goes the same course, and what belongs to it is worked out once.

use nalgebra::Matrix3;

use super::rows::{add, whiten};

/// How navigation errors go on in one step, and what `g` and noise add to them. `M` states move.
#[derive(PartialEq)]
pub struct StepModel<const M: usize> {
    /// Covariance of noise.
    pub noise: [[f64; M]; M],
    /// What is not zero of Φ: row, column, value.
    pub transition: Vec<(usize, usize, f64)>,
    /// What the constants of `g` add: row, index in `g`, value.
    pub driven: Vec<(usize, usize, f64)>,
}

/// Courses that parts of dwells have taken: a tree, from where all begin.
pub struct GainCache<const M: usize, const G: usize> {
    models: Vec<StepModel<M>>,
    points: Vec<Point>,
    gains: Vec<Gain<M, G>>,
    /// At each point. Kept apart: on a course that is known only its last one is read.
    known: Vec<Known<M, G>>,
}

/// A point of a course.
struct Point {
    /// What happened since the point before it.
    event: Event,
    /// A point that follows it, and another one that follows the point before it.
    next: Option<usize>,
    beside: Option<usize>,
    /// How an observation was taken in, if that is what happened.
    gain: Option<usize>,
}

#[derive(Clone, Copy, PartialEq)]
enum Event {
    Begin,
    /// A step of this model.
    Step(usize),
    /// Three navigation errors from a state on are observed, each with this variance.
    Observed(usize, f64),
}

/// How an observation is taken in where `g` is given.
pub struct Gain<const M: usize, const G: usize> {
    /// Lower triangular root of its covariance.
    pub root: Matrix3<f64>,
    /// Rows of `g`, whitened by it.
    pub rows: [[f64; G]; 3],
    /// What the whitened observation gains of the navigation errors.
    pub of_errors: [[f64; M]; 3],
    /// Logarithm of the determinant of its covariance.
    pub log_determinant: f64,
}

/// What is known of navigation errors `U g + m` where `g` is given, and of `g`.
#[derive(Clone)]
pub struct Known<const M: usize, const G: usize> {
    /// U
    pub of_given: [[f64; G]; M],
    /// Of m.
    pub covariance: [[f64; M]; M],
    /// Information of `g` by the observations so far, and by nothing else.
    pub information: [[f64; G]; G],
}

/// Points of a usual course: of a hundred steps with two observations each.
const POINTS: usize = 300;
/// So many bytes are kept before a part begins: those of some ten courses.
const MOST: usize = 1 << 23;

impl<const M: usize, const G: usize> GainCache<M, G> {
    /// Where all begin: component `begins[k]` of `g` is the navigation error of state `k`, if any is.
    pub const BEGIN: usize = 0;

    pub fn new(begins: [Option<usize>; M]) -> Self {
        let mut of_given = [[0.0; G]; M];
        for (row, begin) in of_given.iter_mut().zip(begins) {
            if let Some(component) = begin {
                row[component] = 1.0;
            }
        }
        let begin = Point {
            event: Event::Begin,
            next: None,
            beside: None,
            gain: None,
        };
        let mut known = Vec::with_capacity(POINTS);
        known.push(Known {
            of_given,
            covariance: [[0.0; M]; M],
            information: [[0.0; G]; G],
        });
        Self {
            models: Vec::new(),
            points: vec![begin],
            gains: Vec::with_capacity(POINTS),
            known,
        }
    }

    /// Forgets everything where that is too much.
    pub fn tidy(&mut self) {
        if size_of_val(&*self.known) + size_of_val(&*self.gains) > MOST {
            self.models.clear();
            self.gains.clear();
            self.points.truncate(1);
            self.points[Self::BEGIN].next = None;
            self.known.truncate(1);
        }
    }

    /// The number of a model.
    pub fn number(&mut self, model: StepModel<M>) -> usize {
        let known = self.models.iter().position(|known| *known == model);
        known.unwrap_or_else(|| {
            self.models.push(model);
            self.models.len() - 1
        })
    }

    pub fn model(&self, number: usize) -> &StepModel<M> {
        &self.models[number]
    }

    /// What is known at a point.
    pub fn known(&self, point: usize) -> &Known<M, G> {
        &self.known[point]
    }

    /// How the observation of a point was taken in.
    pub fn gain(&self, point: usize) -> Option<&Gain<M, G>> {
        self.points[point].gain.map(|gain| &self.gains[gain])
    }

    /// Where a step leads.
    pub fn step(&mut self, from: usize, model: usize) -> usize {
        let event = Event::Step(model);
        self.reached(from, event).unwrap_or_else(|| {
            let known = self.known[from].propagated(&self.models[model]);
            self.known.push(known);
            self.lead(from, event, None)
        })
    }

    /// Where it leads to take in three navigation errors from a state on, observed with this variance each; `None`
    /// where their covariance is not positive definite.
    pub fn observe(&mut self, from: usize, state: usize, variance: f64) -> Option<usize> {
        let event = Event::Observed(state, variance);
        self.reached(from, event).or_else(|| {
            let gain = self.known[from].gain(state, variance)?;
            self.known.extend_from_within(from..=from);
            if let Some(known) = self.known.last_mut() {
                known.tell(&gain);
            }
            self.gains.push(gain);
            Some(self.lead(from, event, Some(self.gains.len() - 1)))
        })
    }

    /// Where an event led before.
    fn reached(&self, from: usize, event: Event) -> Option<usize> {
        let beside = |&point: &usize| self.points[point].beside;
        let mut followers = std::iter::successors(self.points[from].next, beside);
        followers.find(|&point| self.points[point].event == event)
    }

    fn lead(&mut self, from: usize, event: Event, gain: Option<usize>) -> usize {
        let number = self.points.len();
        let beside = self.points[from].next.replace(number);
        self.points.push(Point {
            event,
            next: None,
            beside,
            gain,
        });
        number
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

    /// Takes in an observation.
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

    fn gains() -> GainCache<9, 12> {
        let begins = [0, 1, 2, 3, 4, 5].map(Some);
        let mut gains = GainCache::new(std::array::from_fn(|k| begins.get(k).copied().flatten()));
        let mut noise = [[0.0; 9]; 9];
        (0..9).for_each(|k| noise[k][k] = 1.0 + k as f64);
        let mut transition: Vec<_> = (0..9).map(|k| (k, k, 1.0)).collect();
        transition.extend([(3, 1, -0.98), (4, 0, 0.98)]);
        gains.number(StepModel {
            noise,
            transition,
            driven: vec![(0, 6, 0.1), (3, 9, 0.1)],
        });
        gains
    }

    /// Through a step and an observation so many times; where each observation leads.
    fn go(gains: &mut GainCache<9, 12>, mut at: usize, times: usize, variance: f64) -> Vec<usize> {
        let each = (0..times).map(|_| {
            let stepped = gains.step(at, 0);
            at = gains
                .observe(stepped, 3, variance)
                .expect("it is positive definite");
            at
        });
        each.collect()
    }

    #[test]
    fn what_is_known_is_the_same_whichever_course_came_before() {
        let mut shared = gains();
        let begin = GainCache::<9, 12>::BEGIN;
        // One course, one that branches off it, and the first again.
        for variances in [
            [(10, 0.5), (5, 0.5)],
            [(10, 0.5), (5, 2.0)],
            [(15, 0.5), (0, 0.0)],
        ] {
            let along = |gains: &mut GainCache<9, 12>| {
                variances.iter().fold(begin, |at, &(times, variance)| {
                    go(gains, at, times, variance).last().copied().unwrap_or(at)
                })
            };
            let mut alone = gains();
            let (point, at) = (along(&mut shared), along(&mut alone));
            let (shared, alone) = (shared.known(point), alone.known(at));
            assert_eq!(shared.of_given, alone.of_given);
            assert_eq!(shared.covariance, alone.covariance);
            assert_eq!(shared.information, alone.information);
        }
    }
}
