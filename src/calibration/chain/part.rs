//! Reduces a part of a dwell, in which noise at rest is the only disturbance, to whitened equations for the states at
//! the beginning of the part.
//!
//! At rest, the parameters act through three constant rates and three constant specific forces. If these and the states
//! at the beginning (together `g`) are given, only noise remains. A filter of the moving states whitens this noise in
//! each observation. The whitened observations and the states at the end are linear in `g`: together they contain all
//! information of the part (Friedland 1969, "Treatment of bias in recursive filtering", IEEE Trans. Automatic Control
//! 14(4)).
//!
//! In addition to the navigation errors, an attitude is observed: for a recording by hand, the rotation since the body
//! came to rest; after a table move, the attitude error minus the fading settling error of the table.

mod course;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::dynamics::{CONSTANTS, driven_at_rest};
use super::short_rows::{add, factor};
use super::states::{ATTITUDE, NAVIGATION, POSITION, VELOCITY};
use crate::calibration::record::Rest;
use crate::calibration::{BudgetSource, Model, Observation, Stretch};
use crate::navigation::Block;
use course::{Course, Gain, StepModel};

/// The information in a part of a dwell.
pub struct Part {
    /// Rows of `g`.
    pub measured: DMatrix<f64>,
    /// Measured values of these rows, with σ = 1.
    pub values: DVector<f64>,
    /// Sum of squares of the observations that is independent of `g`.
    pub squares: f64,
    /// Log-determinant of the observation covariance.
    pub log_determinant: f64,
    /// Number of scalars that were observed.
    pub count: usize,
    /// States that change within the part, at its end: rows in `g`, offset and covariance.
    pub of_given: DMatrix<f64>,
    pub offset: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

impl Part {
    /// A copy in which all noise variances are multiplied by a factor.
    pub fn dispersed(mut self, factor: f64) -> Self {
        let root = factor.sqrt();
        self.measured /= root;
        self.values /= root;
        self.squares /= factor;
        self.log_determinant += self.count as f64 * factor.ln();
        self.covariance *= factor;
        self
    }
}

/// An observation, whitened by its covariance given `g`.
pub struct Whitened<'a> {
    /// Number of the observation within the part.
    pub number: usize,
    /// The three scalars for `g = 0`, each with σ = 1.
    pub scalars: Vector3<f64>,
    /// Lower triangular root of the covariance of the three components.
    pub root: &'a Matrix3<f64>,
    /// Coefficients of `g` in the three scalars, one row after the other.
    pub rows: &'a [f64],
}

/// Reduces parts of one kind of dwell.
pub trait PartFilter {
    /// Size of `g`.
    fn given(&self) -> usize;

    /// The reduction of a part; `None` if a covariance is not positive definite. The callback `seen` receives each
    /// observation.
    fn reduce(
        &mut self,
        part: (&Rest, &Stretch),
        model: &Model,
        seen: &mut dyn FnMut(Whitened),
    ) -> Option<Part>;
}

/// The filters for this number of changing states: one for parts that follow a move, and one for other parts.
pub fn part_filters(moving: usize) -> [Box<dyn PartFilter>; 2] {
    let begins = begins(moving).into_iter().enumerate();
    if moving == NAVIGATION {
        let settles = (0..3).map(|axis| (ATTITUDE + axis, NAVIGATION + axis));
        [
            Box::new(Course::<12, 12>::new(begins.clone().chain(settles))),
            Box::new(Course::<9, 12>::new(begins)),
        ]
    } else {
        [(); 2].map(|()| -> Box<dyn PartFilter> { Box::new(Course::<12, 15>::new(begins.clone())) })
    }
}

/// Index of the filter of a part.
pub fn filter_of(rest: &Rest) -> usize {
    usize::from(!(rest.first && rest.new_position))
}

/// The states in `g` that change within the part; position is not among them, because nothing in a dwell depends on it.
pub fn begins(moving: usize) -> Vec<usize> {
    let is_position = |state: &usize| (POSITION..POSITION + 3).contains(state);
    (0..moving).filter(|state| !is_position(state)).collect()
}

impl<const M: usize, const G: usize> PartFilter for Course<M, G> {
    fn given(&self) -> usize {
        G
    }

    fn reduce(
        &mut self,
        (rest, stretch): (&Rest, &Stretch),
        model: &Model,
        seen: &mut dyn FnMut(Whitened),
    ) -> Option<Part> {
        let mut events = self.start(rest, model);
        let mut said = Said::<M, G>::nothing();
        for step in &rest.steps {
            said.refer(step.referred);
            self.step(events, step.model);
            events += 1;
            said.mean = self.models[step.model].propagated(&said.mean);
            for number in step.seen.clone() {
                let observed = &rest.seen[number];
                let first = match observed.kind {
                    Observation::Velocity => VELOCITY,
                    _ if M > NAVIGATION => NAVIGATION,
                    Observation::Table | Observation::Attitude => ATTITUDE,
                };
                let variance =
                    stretch.observation_variance(model, observed.kind, observed.readings);
                let gain = self.observe(events, first, variance)?;
                events += 1;
                seen(Whitened {
                    number,
                    scalars: said.observe(gain, first, observed.residual)?,
                    root: &gain.root,
                    rows: gain.rows.as_flattened(),
                });
            }
        }
        let known = self.known(events);
        let rows = factor(known.information, said.vector);
        let (rows, values): (Vec<_>, Vec<_>) = rows.map(|(_, row, value)| (row, value)).unzip();
        let values = DVector::from_vec(values);
        Some(Part {
            measured: matrix(&rows),
            squares: said.squares - values.norm_squared(),
            log_determinant: said.log_determinant,
            values,
            count: 3 * rest.seen.len(),
            of_given: matrix(&known.of_given),
            offset: DVector::from_column_slice(&said.mean),
            covariance: matrix(&known.covariance),
        })
    }
}

impl<const M: usize, const G: usize> Course<M, G> {
    /// Begins a part; returns the number of events so far.
    fn start(&mut self, rest: &Rest, model: &Model) -> usize {
        let settles = M == G;
        let models = rest.models.iter().map(|block| {
            let fading = if settles {
                model.settling(block.duration)
            } else {
                1.0
            };
            step_model::<M, G>(block, model, fading)
        });
        self.begin(models.collect());
        if settles {
            self.widen(0, NAVIGATION, model.settling_variance());
        }
        usize::from(settles)
    }
}

/// Information from the observations of a part so far.
struct Said<const M: usize, const G: usize> {
    /// Mean of the moving states, given `g = 0`.
    mean: [f64; M],
    /// Information on `g` times `g`.
    vector: [f64; G],
    squares: f64,
    log_determinant: f64,
}

impl<const M: usize, const G: usize> Said<M, G> {
    fn nothing() -> Self {
        Self {
            mean: [0.0; M],
            vector: [0.0; G],
            squares: 0.0,
            log_determinant: 0.0,
        }
    }

    /// Converts the errors of attitude, velocity and position to another reference.
    fn refer(&mut self, by: [Vector3<f64>; 3]) {
        let errors = [ATTITUDE, VELOCITY, POSITION].into_iter().zip(by);
        let observed = (M > NAVIGATION).then_some((NAVIGATION, by[0]));
        for (first, by) in errors.chain(observed) {
            (0..3).for_each(|axis| self.mean[first + axis] += by[axis]);
        }
    }

    /// Adds an observation of the states from the given one on; returns the whitened observation.
    fn observe(
        &mut self,
        gain: &Gain<M, G>,
        first: usize,
        residual: Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let expected = Vector3::from_fn(|axis, _| self.mean[first + axis]);
        let scalars = gain.root.solve_lower_triangular(&(residual - expected))?;
        self.squares += scalars.norm_squared();
        self.log_determinant += gain.log_determinant;
        for axis in 0..3 {
            add(&mut self.mean, scalars[axis], &gain.of_errors[axis]);
            add(&mut self.vector, scalars[axis], &gain.rows[axis]);
        }
        Some(scalars)
    }
}

fn matrix<const N: usize>(rows: &[[f64; N]]) -> DMatrix<f64> {
    DMatrix::from_row_slice(rows.len(), N, rows.as_flattened())
}

/// Propagation of the moving states in a step; the difference of the two attitudes fades by a factor.
fn step_model<const M: usize, const G: usize>(
    block: &Block,
    model: &Model,
    fading: f64,
) -> StepModel<M> {
    let driven_by = driven_at_rest(block);
    let own = |row: usize| {
        row.checked_sub(NAVIGATION)
            .map_or(row, |axis| ATTITUDE + axis)
    };
    let of_navigation = block.noise.covariance(&model.process_noise());
    let turning =
        model.turning_at_rest.powi(2) * model.weight(BudgetSource::RotationAtRest) * block.duration;
    let (mut transition, mut driven) = (Vec::new(), Vec::new());
    let mut noise = [[0.0; M]; M];
    for row in 0..M {
        for k in 0..M {
            // The observed attitude follows the change of the attitude.
            let phi = if k >= NAVIGATION {
                fading * f64::from(k == row)
            } else {
                let itself = f64::from(row >= NAVIGATION && own(row) == k);
                block.navigation[(own(row), k)] - fading * itself
            };
            transition.push((row, k, phi));
            let alone = f64::from(row == k && row >= NAVIGATION);
            noise[row][k] = of_navigation[(own(row), own(k))] + alone * turning;
        }
        for k in 0..CONSTANTS {
            driven.push((row, G - CONSTANTS + k, driven_by[(own(row), k)]));
        }
    }
    transition.retain(|&(.., phi)| phi != 0.0);
    driven.retain(|&(.., by)| by != 0.0);
    StepModel {
        noise,
        transition,
        driven,
    }
}
