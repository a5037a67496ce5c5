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
pub(super) struct StepModel<const M: usize> {
    /// Covariance of noise.
    pub noise: [[f64; M]; M],
    /// What is not zero of Φ: row, column, value.
    pub transition: Vec<(usize, usize, f64)>,
    /// What the constants of `g` add: row, index in `g`, value.
    pub driven: Vec<(usize, usize, f64)>,
}

/// Courses that parts of dwells have taken: a tree, from the begin of any of them on.
pub(super) struct Courses<const M: usize, const G: usize> {
    models: Vec<StepModel<M>>,
    points: Vec<Point<M, G>>,
    observations: Vec<Observation<M, G>>,
}

/// A point of a course.
struct Point<const M: usize, const G: usize> {
    known: Box<Known<M, G>>,
    /// The last observation before it.
    observation: usize,
    /// Where each thing that may happen next leads.
    next: Vec<(Event, usize)>,
}

/// An observation of a course.
struct Observation<const M: usize, const G: usize> {
    /// How it is taken in.
    gain: Gain<M, G>,
    /// Information of `g` by it and all observations before it, and by nothing else.
    information: [[f64; G]; G],
}

#[derive(Clone, Copy, PartialEq)]
enum Event {
    /// A step of this model.
    Step(usize),
    /// Three navigation errors from a state on are observed, each with this variance.
    Observed(usize, f64),
}

/// How an observation is taken in where `g` is given.
pub(super) struct Gain<const M: usize, const G: usize> {
    /// Lower triangular root of its covariance.
    pub root: Matrix3<f64>,
    /// Rows of `g`, whitened by it.
    pub rows: [[f64; G]; 3],
    /// What the whitened observation gains of the navigation errors.
    pub of_errors: [[f64; M]; 3],
}

/// What is known of navigation errors `U g + m` where `g` is given.
#[derive(Clone)]
pub(super) struct Known<const M: usize, const G: usize> {
    /// U
    pub of_given: [[f64; G]; M],
    /// Of m.
    pub covariance: [[f64; M]; M],
}

/// So many bytes of points and observations are kept before a part begins: those of a few courses.
const MOST: usize = 2 << 20;

impl<const M: usize, const G: usize> Courses<M, G> {
    /// Where all begin: component `begins[k]` of `g` is the navigation error of state `k`, if any is.
    pub const BEGIN: usize = 0;

    pub fn new(begins: [Option<usize>; M]) -> Self {
        let mut of_given = [[0.0; G]; M];
        for (row, begin) in of_given.iter_mut().zip(begins) {
            if let Some(component) = begin {
                row[component] = 1.0;
            }
        }
        let known = Known {
            of_given,
            covariance: [[0.0; M]; M],
        };
        Self {
            models: Vec::new(),
            points: vec![Point::new(Box::new(known), 0)],
            observations: vec![Observation::none()],
        }
    }

    /// Forgets what is kept where that is too much.
    pub fn tidy(&mut self) {
        let of_point = size_of::<Point<M, G>>() + size_of::<Known<M, G>>();
        let of_points = self.points.len() * of_point;
        let of_observations = self.observations.len() * size_of::<Observation<M, G>>();
        if of_points + of_observations > MOST {
            self.models.clear();
            self.points.truncate(1);
            self.points[Self::BEGIN].next.clear();
            self.observations.truncate(1);
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

    /// What is known at a point of navigation errors …
    pub fn known(&self, point: usize) -> &Known<M, G> {
        &self.points[point].known
    }

    /// … and of `g`.
    pub fn information(&self, point: usize) -> &[[f64; G]; G] {
        &self.observations[self.points[point].observation].information
    }

    /// How the last observation before a point was taken in.
    pub fn gain(&self, point: usize) -> &Gain<M, G> {
        &self.observations[self.points[point].observation].gain
    }

    /// Where a step leads.
    pub fn step(&mut self, from: usize, model: usize) -> usize {
        self.reached(from, Event::Step(model)).unwrap_or_else(|| {
            let Point {
                known, observation, ..
            } = &self.points[from];
            let known = Box::new(known.propagated(&self.models[model]));
            let to = Point::new(known, *observation);
            self.leads(from, Event::Step(model), to)
        })
    }

    /// Where it leads to take in three navigation errors from a state on, observed with this variance each; `None`
    /// where their covariance is not positive definite.
    pub fn observe(&mut self, from: usize, state: usize, variance: f64) -> Option<usize> {
        let event = Event::Observed(state, variance);
        if let Some(reached) = self.reached(from, event) {
            return Some(reached);
        }
        let mut known = self.points[from].known.clone();
        let gain = known.gain(state, variance)?;
        known.tell(&gain);
        let mut information = *self.information(from);
        for row in &gain.rows {
            for (of_component, weight) in information.iter_mut().zip(row) {
                add(of_component, *weight, row);
            }
        }
        let to = Point::new(known, self.observations.len());
        self.observations.push(Observation { gain, information });
        Some(self.leads(from, event, to))
    }

    fn reached(&self, from: usize, event: Event) -> Option<usize> {
        let next = &self.points[from].next;
        let (_, to) = next.iter().find(|(known, _)| *known == event)?;
        Some(*to)
    }

    fn leads(&mut self, from: usize, event: Event, to: Point<M, G>) -> usize {
        let number = self.points.len();
        self.points.push(to);
        self.points[from].next.push((event, number));
        number
    }
}

impl<const M: usize, const G: usize> Point<M, G> {
    fn new(known: Box<Known<M, G>>, observation: usize) -> Self {
        Self {
            known,
            observation,
            next: Vec::new(),
        }
    }
}

impl<const M: usize, const G: usize> Observation<M, G> {
    /// Nothing is observed.
    fn none() -> Self {
        Self {
            gain: Gain {
                root: Matrix3::identity(),
                rows: [[0.0; G]; 3],
                of_errors: [[0.0; M]; 3],
            },
            information: [[0.0; G]; G],
        }
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
        }
    }
}
