//! Least-squares fit of the change of specific force caused by turns.

use nalgebra::{SMatrix, SVector};

/// Indices of three columns.
pub type Triad = [usize; 3];

/// One, f, w and the products of f and w.
const TERMS: usize = 16;
/// Factor s, s w₀, s c and s w₀ × c.
const UNKNOWNS: usize = 10;

/// All orders of the gyro axes about x, y and z, with their signs. Of two opposite orders, only one is included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Order([(usize, f64); 3]);

impl Order {
    /// The first order is that in which the columns are written.
    pub fn all() -> impl Iterator<Item = Self> {
        let orders = [
            [0, 1, 2],
            [1, 2, 0],
            [2, 0, 1],
            [0, 2, 1],
            [2, 1, 0],
            [1, 0, 2],
        ];
        let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
        orders.into_iter().flat_map(move |[x, y, z]| {
            signs
                .into_iter()
                .map(move |[of_y, of_z]| Self([(x, 1.0), (y, of_y), (z, of_z)]))
        })
    }

    pub fn is_plain(&self) -> bool {
        self.0 == [(0, 1.0), (1, 1.0), (2, 1.0)]
    }

    /// Returns these columns in this order.
    pub fn of(&self, triad: &Triad) -> [(usize, f64); 3] {
        self.0.map(|(axis, sign)| (triad[axis], sign))
    }

    /// The terms that multiply the unknowns in the change of an axis.
    fn terms(&self, axis: usize) -> [[(usize, f64); 2]; UNKNOWNS] {
        let force = |axis: usize| 1 + axis;
        let rate = |axis: usize| (4 + self.0[axis].0, self.0[axis].1);
        let product = |of: usize, by: usize| (7 + 3 * of + self.0[by].0, self.0[by].1);
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut terms = [[(0, 0.0); 2]; UNKNOWNS];
        let minus = |(place, sign): (usize, f64)| (place, -sign);
        terms[0] = [minus(product(last, next)), product(next, last)];
        terms[1 + next][0] = (force(last), 1.0);
        terms[1 + last][0] = (force(next), -1.0);
        terms[4 + last][0] = rate(next);
        terms[4 + next][0] = minus(rate(last));
        terms[7 + axis][0] = (0, 1.0);
        terms
    }
}

/// Sums, over all windows, of the products of the terms with each other and with the changes.
pub struct Moments {
    terms: SMatrix<f64, TERMS, TERMS>,
    changes: [SVector<f64, TERMS>; 3],
    squares: [f64; 3],
}

/// Remaining fractions of the squared changes after the fit.
pub struct Ratios {
    pub of_axes: [f64; 3],
    pub of_all: f64,
}

impl Moments {
    /// Computes the sums from the means of the columns in each window and in the next one; `None` if both triads have
    /// too few windows.
    pub fn new(means: &[Vec<f64>], windows: &[usize], gyro: Triad, accel: Triad) -> Option<Self> {
        let scale = |triad: Triad| {
            let values = triad
                .iter()
                .flat_map(|&k| windows.iter().map(move |&at| means[k][at]));
            let known = values.filter(|value| value.is_finite());
            known.map(|value| value * value).sum::<f64>().sqrt().recip()
        };
        let scales = [scale(gyro), scale(accel)];
        let root = (windows.len() as f64).sqrt();
        let mut found = Self {
            terms: SMatrix::zeros(),
            changes: [SVector::zeros(); 3],
            squares: [0.0; 3],
        };
        let mut count = 0;
        for &at in windows {
            let middle = |k: usize| 0.5 * root * (means[k][at] + means[k][at + 1]);
            let w = gyro.map(|k| scales[0] * middle(k));
            let f = accel.map(|k| scales[1] * middle(k));
            let change = accel.map(|k| means[k][at + 1] - means[k][at]);
            let mut terms = SVector::<f64, TERMS>::zeros();
            terms[0] = 1.0;
            for of in 0..3 {
                (terms[1 + of], terms[4 + of]) = (f[of], w[of]);
                (0..3).for_each(|by| terms[7 + 3 * of + by] = f[of] * w[by]);
            }
            if !(terms.sum() + change.iter().sum::<f64>()).is_finite() {
                continue;
            }
            count += 1;
            found.terms.ger(1.0, &terms, &terms, 1.0);
            let sums = found.changes.iter_mut().zip(&mut found.squares);
            for ((sum, square), change) in sums.zip(change) {
                sum.axpy(change, &terms, 1.0);
                *square += change.powi(2);
            }
        }
        (3 * count > UNKNOWNS && found.squares.iter().all(|of| *of > 0.0)).then_some(found)
    }

    /// The fractions of the squared changes that turns with this order of axes do not explain.
    pub fn ratios(&self, order: &Order) -> Option<Ratios> {
        let mut normal = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
        let mut right = SVector::<f64, UNKNOWNS>::zeros();
        let mut of_axes = [(SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros(), right); 3];
        for (axis, (square, product)) in of_axes.iter_mut().enumerate() {
            let terms = order.terms(axis);
            let used = || {
                terms
                    .iter()
                    .enumerate()
                    .flat_map(|(row, of)| of.iter().map(move |of| (row, of)))
            };
            for (row, &(place, sign)) in used().filter(|(_, of)| of.1 != 0.0) {
                product[row] += sign * self.changes[axis][place];
                for (column, &(other, by)) in used() {
                    square[(row, column)] += sign * by * self.terms[(place, other)];
                }
            }
            normal += *square;
            right += *product;
        }
        // Unknowns that no turn shows stay near zero.
        let ridge = 1e-9 * normal.diagonal().max();
        (0..UNKNOWNS).for_each(|k| normal[(k, k)] += ridge);
        let solved = normal.cholesky()?.solve(&right);
        let rest = |axis: usize| {
            let (square, product) = &of_axes[axis];
            let rest =
                self.squares[axis] - 2.0 * solved.dot(product) + solved.dot(&(square * solved));
            rest.max(1e-9 * self.squares[axis])
        };
        let rests = [0, 1, 2].map(rest);
        Some(Ratios {
            of_axes: [0, 1, 2].map(|axis| rests[axis] / self.squares[axis]),
            of_all: rests.iter().sum::<f64>() / self.squares.iter().sum::<f64>(),
        })
    }
}
