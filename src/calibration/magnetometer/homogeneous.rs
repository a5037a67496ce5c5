//! Homogeneous least squares, robust against outliers.

use nalgebra::{DMatrix, DVector};

use crate::statistics::median;

/// Rounds of reweighting.
const ROUNDS: usize = 10;
/// Degrees of freedom of the weights (Student's t), so that disturbed dwells do not bend the start.
const FREEDOM: f64 = 6.0;
/// Median of χ² with three degrees of freedom.
const MEDIAN: f64 = 2.366;
/// The least determined combination must be this many times better known than noise explains.
const DETERMINED: f64 = 5.0;

/// The vector of length one that makes all rows smallest, reweighted against outliers; `None` if another makes them
/// nearly as small.
pub fn homogeneous(rows: &[DMatrix<f64>]) -> Option<DVector<f64>> {
    let n = rows.first()?.ncols();
    let mut weights = vec![1.0; rows.len()];
    let mut found = None;
    for _ in 0..ROUNDS {
        let mut normal = DMatrix::zeros(n, n);
        for (rows, weight) in rows.iter().zip(&weights) {
            normal.gemm_tr(*weight, rows, rows, 1.0);
        }
        let eigen = normal.symmetric_eigen();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let [least, next] = [order[0], order[1]].map(|k| eigen.eigenvalues[k].max(0.0));
        let largest = eigen.eigenvalues.max();
        let solution = eigen.eigenvectors.column(order[0]).into_owned();
        let squares = rows.iter().map(|rows| (rows * &solution).norm_squared());
        let squares: Vec<f64> = squares.collect();
        let scale = median(&mut squares.clone())? / MEDIAN;
        let is_unique = next > DETERMINED.powi(2) * least && next > 1e-6 * largest;
        found = is_unique.then_some(solution);
        if scale == 0.0 {
            break;
        }
        let weight = |square: &f64| (FREEDOM + 3.0) / (FREEDOM + square / scale);
        weights = squares.iter().map(weight).collect();
    }
    found
}
