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

/// Courses that parts of dwells have taken: a tree, from the begin of any of them on.
pub struct Courses<const M: usize, const G: usize> {
    models: Vec<StepModel<M>>,
    points: Vec<Point<M, G>>,
    gains: Vec<Gain<M, G>>,
}

/// A point of a course.
struct Point<const M: usize, const G: usize> {
    /// The point before it, and what happened since.
    from: usize,
    event: Event,
    /// How the last observation before it is taken in.
    gain: usize,
    /// A point that follows it, and another one that follows the point before it.
    next: Option<usize>,
    beside: Option<usize>,
    /// What is known there. It goes on with the course; where one ends it stays.
    known: Option<Box<Known<M, G>>>,
    end: bool,
}

#[derive(Clone, Copy, PartialEq)]
enum Event {
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

/// So many bytes of points and gains are kept before a part begins: those of a few courses.
const MOST: usize = 1 << 20;

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
            information: [[0.0; G]; G],
        };
        let begin = Point {
            from: Self::BEGIN,
            event: Event::Step(0),
            gain: 0,
            next: None,
            beside: None,
            known: Some(Box::new(known)),
            end: true,
        };
        Self {
            models: Vec::new(),
            points: vec![begin],
            gains: vec![Gain::none()],
        }
    }

    /// Forgets what is kept where that is too much.
    pub fn tidy(&mut self) {
        let of_points = self.points.len() * size_of::<Point<M, G>>();
        let known = self.points.iter().filter(|point| point.known.is_some());
        let of_known = known.count() * size_of::<Known<M, G>>();
        let of_gains = self.gains.len() * size_of::<Gain<M, G>>();
        if of_points + of_known + of_gains > MOST {
            self.models.clear();
            self.points.truncate(1);
            self.points[Self::BEGIN].next = None;
            self.gains.truncate(1);
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

    /// What is known where a course ends.
    pub fn end(&mut self, point: usize) -> &Known<M, G> {
        self.points[point].end = true;
        self.known(point)
    }

    /// How the last observation before a point was taken in.
    pub fn gain(&self, point: usize) -> &Gain<M, G> {
        &self.gains[self.points[point].gain]
    }

    /// Where a step leads.
    pub fn step(&mut self, from: usize, model: usize) -> usize {
        let event = Event::Step(model);
        self.reached(from, event).unwrap_or_else(|| {
            let gain = self.points[from].gain;
            self.leads(from, event, gain)
        })
    }

    /// Where it leads to take in three navigation errors from a state on, observed with this variance each; `None`
    /// where their covariance is not positive definite.
    pub fn observe(&mut self, from: usize, state: usize, variance: f64) -> Option<usize> {
        let event = Event::Observed(state, variance);
        if let Some(reached) = self.reached(from, event) {
            return Some(reached);
        }
        let gain = self.known(from).gain(state, variance)?;
        self.gains.push(gain);
        Some(self.leads(from, event, self.gains.len() - 1))
    }

    fn reached(&self, from: usize, event: Event) -> Option<usize> {
        let mut point = self.points[from].next;
        while let Some(number) = point {
            let Point {
                event: of_point,
                beside,
                ..
            } = &self.points[number];
            if *of_point == event {
                return point;
            }
            point = *beside;
        }
        None
    }

    fn leads(&mut self, from: usize, event: Event, gain: usize) -> usize {
        let number = self.points.len();
        let beside = self.points[from].next.replace(number);
        self.points.push(Point {
            from,
            event,
            gain,
            next: None,
            beside,
            known: None,
            end: false,
        });
        number
    }

    /// What is known at a point.
    fn known(&mut self, point: usize) -> &Known<M, G> {
        let known = match self.points[point].known.take() {
            Some(known) => known,
            None => self.brought(point),
        };
        self.points[point].known.insert(known)
    }

    /// What is known at a point, brought there from the last before it where it is kept.
    fn brought(&mut self, point: usize) -> Box<Known<M, G>> {
        let mut way = Vec::new();
        let mut at = point;
        let mut known = loop {
            if let Some(known) = self.points[at].leave() {
                break known;
            }
            way.push(at);
            at = self.points[at].from;
        };
        for at in way.into_iter().rev() {
            match self.points[at].event {
                Event::Step(model) => known.propagate(&self.models[model]),
                Event::Observed(..) => known.tell(self.gain(at)),
            }
        }
        known
    }
}

impl<const M: usize, const G: usize> Point<M, G> {
    /// What is known there, to go on with.
    fn leave(&mut self) -> Option<Box<Known<M, G>>> {
        match self.end {
            true => self.known.clone(),
            false => self.known.take(),
        }
    }
}

impl<const M: usize, const G: usize> Gain<M, G> {
    /// Nothing is observed.
    fn none() -> Self {
        Self {
            root: Matrix3::identity(),
            rows: [[0.0; G]; 3],
            of_errors: [[0.0; M]; 3],
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
        self.of_given = of_given;
        self.covariance = covariance;
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
            for (of_component, weight) in self.information.iter_mut().zip(row) {
                add(of_component, *weight, row);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn courses() -> Courses<9, 12> {
        let begins = [0, 1, 2, 3, 4, 5].map(Some);
        let mut courses = Courses::new(std::array::from_fn(|k| begins.get(k).copied().flatten()));
        let mut noise = [[0.0; 9]; 9];
        (0..9).for_each(|k| noise[k][k] = 1.0 + k as f64);
        let mut transition: Vec<_> = (0..9).map(|k| (k, k, 1.0)).collect();
        transition.extend([(3, 1, -0.98), (4, 0, 0.98)]);
        courses.number(StepModel {
            noise,
            transition,
            driven: vec![(0, 6, 0.1), (3, 9, 0.1)],
        });
        courses
    }

    /// Through a step and an observation so many times; where each observation leads.
    fn go(courses: &mut Courses<9, 12>, mut at: usize, times: usize, variance: f64) -> Vec<usize> {
        let each = (0..times).map(|_| {
            let stepped = courses.step(at, 0);
            at = courses
                .observe(stepped, 3, variance)
                .expect("it is positive definite");
            at
        });
        each.collect()
    }

    #[test]
    fn what_is_known_is_the_same_whichever_course_came_before() {
        let mut shared = courses();
        let long = go(&mut shared, Courses::<9, 12>::BEGIN, 20, 0.5);
        shared.end(long[19]);
        // One that branches off where nothing is kept any more, and one that ends on the way.
        let branch = go(&mut shared, long[9], 5, 2.0)[4];
        for (point, variances) in [
            (branch, [(10, 0.5), (5, 2.0)]),
            (long[14], [(15, 0.5), (0, 0.0)]),
        ] {
            let mut alone = courses();
            let mut at = Courses::<9, 12>::BEGIN;
            for (times, variance) in variances {
                at = go(&mut alone, at, times, variance)
                    .last()
                    .copied()
                    .unwrap_or(at);
            }
            let (shared, alone) = (shared.end(point).clone(), alone.end(at).clone());
            assert_eq!(shared.of_given, alone.of_given);
            assert_eq!(shared.covariance, alone.covariance);
            assert_eq!(shared.information, alone.information);
        }
    }
}
