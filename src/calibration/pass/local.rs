//! A filter of a part of a dwell alone.
//!
//! At rest the parameters act through three rates and three specific forces that do not change, and the
//! table through three angles. Given these and the navigation errors at the begin, together `g`, only noise
//! is left: a small filter of navigation errors that are known when it begins takes it out of each
//! observation. What is left of the observations is linear in `g` and white, so all of them together are one
//! measurement of `g`, and the errors at the end are linear in `g`, too. Nothing is lost: it is the filter
//! of all states with its steps in another order (Friedland 1969, "Treatment of bias in recursive
//! filtering", IEEE Trans. Automatic Control 14(4)).

use nalgebra::{Matrix3, Vector3};

use super::measurement::ScalarInnovation;

/// How navigation errors go on in one step, and what `g` and noise add to them. `M` states move.
pub(super) struct StepModel<const M: usize> {
    /// What is not zero of Φ: row, column, value.
    pub transition: Vec<(usize, usize, f64)>,
    /// What the constants of `g` add: row, index in `g`, value.
    pub driven: Vec<(usize, usize, f64)>,
    /// Covariance of noise.
    pub noise: [[f64; M]; M],
}

/// An observation of three components: navigation errors from `state` on, minus components of `g`.
pub(super) struct Observed {
    pub state: usize,
    /// The first of the components of `g` that it is less by.
    pub minus: Option<usize>,
    pub residual: Vector3<f64>,
    /// Of each component.
    pub variance: f64,
}

/// Navigation errors `U g + m` with covariance P where `g` is given, and what is known of `g`: `M` states
/// move, `G` is the size of `g`.
pub(super) struct Local<const M: usize, const G: usize> {
    of_given: [[f64; G]; M],
    mean: [f64; M],
    covariance: [[f64; M]; M],
    given: Given<G>,
    information: Information<G>,
}

/// Mean of `g` and a root of its covariance, `Σ r rᵀ` over these: what is known of `g` may shrink by twelve
/// orders of magnitude from one observation to the next, and a root keeps twice the digits (Potter's form,
/// Bierman 1977, *Factorization Methods for Discrete Sequential Estimation*, §II.5).
pub(super) struct Given<const G: usize> {
    mean: [f64; G],
    roots: [[f64; G]; G],
}

impl<const G: usize> Given<G> {
    /// Exactly this.
    pub fn certain() -> Self {
        Self {
            mean: [0.0; G],
            roots: [[0.0; G]; G],
        }
    }

    pub fn new(mean: [f64; G], covariance: [[f64; G]; G]) -> Self {
        let mut roots = [[0.0; G]; G];
        let factor = factor(covariance, [0.0; G]);
        for (root, (_, row, _)) in roots.iter_mut().zip(factor) {
            *root = row;
        }
        Self { mean, roots }
    }
}

/// What observations say of `g` by themselves.
struct Information<const G: usize> {
    matrix: [[f64; G]; G],
    vector: [f64; G],
}

/// An innovation, and what taking it in needs.
#[derive(Clone)]
pub(super) struct Look<const M: usize, const G: usize> {
    /// In units of its own σ, its components independent.
    pub whitened: Vector3<f64>,
    /// Lower triangular root of its covariance, on the diagonal.
    pub sigma: Vector3<f64>,
    /// Lower triangular root of the covariance of the observation where `g` is given.
    pub root: Matrix3<f64>,
    /// Given `g`: rows of `g` and residuals, whitened, and what they gain of the navigation errors.
    pub rows: [[f64; G]; 3],
    residual: Vector3<f64>,
    pub gain: [[f64; M]; 3],
    /// The rows times the roots of what is known of `g`.
    by_roots: [[f64; G]; 3],
}

/// What a part of a dwell comes to.
pub(super) struct Outcome {
    /// Rows of `g`, each with what it measures, of σ 1.
    pub measured: Vec<(Vec<f64>, f64)>,
    /// Navigation errors at the end: rows of `g`, offset, covariance.
    pub of_given: Vec<Vec<f64>>,
    pub offset: Vec<f64>,
    pub covariance: Vec<Vec<f64>>,
}

impl<const M: usize, const G: usize> Local<M, G> {
    /// Begins where component `begins[k]` of `g` is the navigation error of state `k`, if any is.
    pub fn new(given: Given<G>, begins: [Option<usize>; M]) -> Self {
        let mut of_given = [[0.0; G]; M];
        for (row, begin) in of_given.iter_mut().zip(begins) {
            if let Some(component) = begin {
                row[component] = 1.0;
            }
        }
        Self {
            of_given,
            mean: [0.0; M],
            covariance: [[0.0; M]; M],
            given,
            information: Information {
                matrix: [[0.0; G]; G],
                vector: [0.0; G],
            },
        }
    }

    /// Errors of a state become more by a known amount.
    pub fn refer(&mut self, state: usize, by: f64) {
        self.mean[state] += by;
    }

    pub fn propagate(&mut self, model: &StepModel<M>) {
        let (mut of_given, mut mean) = ([[0.0; G]; M], [0.0; M]);
        let mut half = [[0.0; M]; M];
        for &(row, column, phi) in &model.transition {
            add(&mut of_given[row], phi, &self.of_given[column]);
            mean[row] += phi * self.mean[column];
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
        self.mean = mean;
        self.covariance = covariance;
    }

    /// The innovation of an observation; `None` if it is not finite or its covariance not positive definite.
    pub fn look(&self, observed: &Observed) -> Option<Look<M, G>> {
        let states = [0, 1, 2].map(|axis| observed.state + axis);
        let mut rows = states.map(|state| self.of_given[state]);
        let mut gain = states.map(|state| self.covariance[state]);
        let mut residual = Vector3::zeros();
        for axis in 0..3 {
            if let Some(minus) = observed.minus {
                rows[axis][minus + axis] -= 1.0;
            }
            residual[axis] = observed.residual[axis] - self.mean[states[axis]];
        }
        let own = Matrix3::from_fn(|row, column| gain[row][states[column]])
            + Matrix3::from_diagonal_element(observed.variance);
        let root = own.cholesky()?.l();
        whiten(&root, &mut rows);
        whiten(&root, &mut gain);
        root.solve_lower_triangular_mut(&mut residual);

        let by_roots = rows.map(|row| std::array::from_fn(|k| dot(&row, &self.given.roots[k])));
        let of_given = Matrix3::from_fn(|row, column| dot(&by_roots[row], &by_roots[column]))
            + Matrix3::identity();
        let root_of_given = of_given.cholesky()?.l();
        let expected = Vector3::from_fn(|row, _| dot(&rows[row], &self.given.mean));
        let whitened = root_of_given.solve_lower_triangular(&(residual - expected))?;
        whitened.norm_squared().is_finite().then_some(Look {
            whitened,
            sigma: root.diagonal().component_mul(&root_of_given.diagonal()),
            root,
            rows,
            residual,
            gain,
            by_roots,
        })
    }

    /// Takes an innovation in.
    pub fn take(&mut self, look: &Look<M, G>) {
        for k in 0..3 {
            let (row, gain, residual) = (&look.rows[k], &look.gain[k], look.residual[k]);
            for state in 0..M {
                add(&mut self.of_given[state], -gain[state], row);
                self.mean[state] += gain[state] * residual;
                add(&mut self.covariance[state], -gain[state], gain);
            }
            for (component, weight) in row.iter().enumerate() {
                add(&mut self.information.matrix[component], *weight, row);
                self.information.vector[component] += weight * residual;
            }
        }
        self.given.take(look.rows, look.residual, look.by_roots);
    }

    /// Rows of what is measured of `g`, each with the component that it took out: the rows after it have
    /// none of that.
    pub fn measured(self) -> Vec<(usize, [f64; G])> {
        let Information { matrix, vector } = self.information;
        let rows = factor(matrix, vector);
        rows.map(|(pivot, row, _)| (pivot, row)).collect()
    }

    pub fn outcome(self) -> Outcome {
        Outcome {
            measured: self.information.rows(),
            of_given: self.of_given.map(Vec::from).into(),
            offset: self.mean.into(),
            covariance: self.covariance.map(Vec::from).into(),
        }
    }
}

impl<const M: usize, const G: usize> Look<M, G> {
    pub fn scalars(&self) -> [ScalarInnovation; 3] {
        [0, 1, 2].map(|k| ScalarInnovation {
            innovation: self.whitened[k] * self.sigma[k],
            variance: self.sigma[k].powi(2),
        })
    }
}

impl<const G: usize> Given<G> {
    /// Takes in three independent scalars of σ 1: rows of `g`, residuals, and the rows times the roots.
    fn take(&mut self, rows: [[f64; G]; 3], residual: Vector3<f64>, mut by_roots: [[f64; G]; 3]) {
        for k in 0..3 {
            let (now, later) = by_roots.split_at_mut(k + 1);
            let of_now = &now[k];
            let variance = dot(of_now, of_now) + 1.0;
            let innovation = residual[k] - dot(&rows[k], &self.mean);
            let mut gain = [0.0; G];
            for (root, weight) in self.roots.iter().zip(of_now) {
                add(&mut gain, weight / variance, root);
            }
            add(&mut self.mean, innovation, &gain);
            let part = 1.0 / (1.0 + variance.sqrt().recip());
            for (root, weight) in self.roots.iter_mut().zip(of_now) {
                add(root, -part * weight, &gain);
            }
            for row in later {
                let common = dot(row, of_now) / variance;
                add(row, -part * common, of_now);
            }
        }
    }
}

impl<const G: usize> Information<G> {
    /// Rows of `g` with what each measures, of σ 1, that say the same.
    fn rows(self) -> Vec<(Vec<f64>, f64)> {
        let rows = factor(self.matrix, self.vector);
        rows.map(|(_, row, value)| (row.into(), value)).collect()
    }
}

/// Roots r of a covariance, `Σ r rᵀ` over these.
pub(super) fn roots<const N: usize>(covariance: [[f64; N]; N]) -> Vec<[f64; N]> {
    let rows = factor(covariance, [0.0; N]);
    rows.map(|(_, row, _)| row).collect()
}

/// Rows r with `Σ rᵀ r` this matrix and, with a value v each, `Σ rᵀ v` this vector, each after the component
/// that it takes out: Cholesky's
/// factorisation, the largest of what is left first, until rounding is all that is left (Golub and Van Loan,
/// *Matrix Computations*, 4th ed., §4.2.8).
fn factor<const N: usize>(
    mut matrix: [[f64; N]; N],
    mut vector: [f64; N],
) -> impl Iterator<Item = (usize, [f64; N], f64)> {
    let diagonal: [f64; N] = std::array::from_fn(|k| matrix[k][k]);
    let mut left: Vec<usize> = (0..N).filter(|&k| diagonal[k] > 0.0).collect();
    std::iter::from_fn(move || {
        let part = |k: usize| matrix[k][k] / diagonal[k];
        let largest = |&a: &usize, &b: &usize| part(left[a]).total_cmp(&part(left[b]));
        let place = (0..left.len()).max_by(largest)?;
        if part(left[place]) < N as f64 * f64::EPSILON {
            return None;
        }
        let pivot = left.swap_remove(place);
        let root = matrix[pivot][pivot].sqrt();
        let mut row = [0.0; N];
        // What was taken out before is exactly nothing.
        for &component in left.iter().chain([&pivot]) {
            row[component] = matrix[pivot][component] / root;
        }
        let value = vector[pivot] / root;
        for &component in &left {
            let weight = row[component];
            add(&mut matrix[component], -weight, &row);
            vector[component] -= weight * value;
        }
        Some((pivot, row, value))
    })
}

/// `sum += weight others`
#[inline]
fn add<const N: usize>(sum: &mut [f64; N], weight: f64, others: &[f64; N]) {
    for k in 0..N {
        sum[k] += weight * others[k];
    }
}

#[inline]
fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `L⁻¹` times rows.
fn whiten<const N: usize>(root: &Matrix3<f64>, rows: &mut [[f64; N]; 3]) {
    for k in 0..3 {
        let (before, from) = rows.split_at_mut(k);
        for (j, row) in before.iter().enumerate() {
            add(&mut from[0], -root[(k, j)], row);
        }
        from[0].iter_mut().for_each(|x| *x /= root[(k, k)]);
    }
}
