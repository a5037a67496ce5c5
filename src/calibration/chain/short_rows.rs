//! Short rows of numbers with a length known at compile time.

use nalgebra::Matrix3;

/// `sum += weight row`
#[inline]
pub fn add<const N: usize>(sum: &mut [f64; N], weight: f64, row: &[f64; N]) {
    for k in 0..N {
        sum[k] += weight * row[k];
    }
}

/// Multiplies rows by `L⁻¹`.
pub fn whiten<const N: usize>(root: &Matrix3<f64>, rows: &mut [[f64; N]; 3]) {
    for k in 0..3 {
        let (before, from) = rows.split_at_mut(k);
        for (j, row) in before.iter().enumerate() {
            add(&mut from[0], -root[(k, j)], row);
        }
        let scale = root[(k, k)].recip();
        from[0].iter_mut().for_each(|x| *x *= scale);
    }
}

/// Rows r, each with a value v, such that `Σ rᵀ r` is this matrix and `Σ rᵀ v` is this vector. Each row comes with the
/// component that it eliminates: Cholesky factorisation with pivoting on the largest remaining diagonal element, until
/// only rounding remains (Golub and Van Loan, *Matrix Computations*, 4th ed., §4.2.8).
pub fn factor<const N: usize>(
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
        // Components eliminated earlier are exactly zero.
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
