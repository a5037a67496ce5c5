//! Start from an ellipsoid through the outputs, turned so that the field has one inclination.

use nalgebra::{DMatrix, DVector, Matrix3, Vector2, Vector3};

use super::at_rest::AtRest;
use crate::magnetic::MagneticTriad;
use crate::recording::MagneticMean;

/// Smallest singular value of the equations, relative to the largest.
const DETERMINED: f64 = 1e-4;

/// The ellipsoid `|L⁻¹(N − D)| = 1` through the outputs by linear least squares, with L lower triangular; with gravity,
/// turned into the body axes. `None` if the outputs do not determine it.
pub fn ellipsoid(rests: &[AtRest], with_gravity: bool) -> Option<MagneticTriad> {
    let (middle, size) = MagneticMean::scatter(rests.iter().map(|of| of.mean))?;
    let values: Vec<Vector3<f64>> = rests
        .iter()
        .map(|of| (of.mean.output - middle) / size)
        .collect();
    let row = |v: &Vector3<f64>| {
        [
            v.x * v.x,
            v.y * v.y,
            v.z * v.z,
            2.0 * v.x * v.y,
            2.0 * v.x * v.z,
            2.0 * v.y * v.z,
            2.0 * v.x,
            2.0 * v.y,
            2.0 * v.z,
        ]
    };
    let rows = DMatrix::from_fn(values.len(), 9, |k, column| row(&values[k])[column]);
    let solved = least_squares(rows, &DVector::repeat(values.len(), 1.0))?;
    let quadric = Matrix3::new(
        solved[0], solved[3], solved[4], solved[3], solved[1], solved[5], solved[4], solved[5],
        solved[2],
    );
    let linear = Vector3::new(solved[6], solved[7], solved[8]);
    let centre = -(quadric.try_inverse()? * linear);
    let scale = 1.0 + centre.dot(&(quadric * centre));
    let lower = (quadric / scale).try_inverse()?.cholesky()?.l();
    let mut triad = MagneticTriad {
        matrix: lower * size,
        bias: middle + centre * size,
        angles: Vector2::zeros(),
    };
    if with_gravity {
        let inverse = lower.try_inverse()?;
        let fields = values.iter().map(|value| inverse * (value - centre));
        let (turn, inclination) = turned(&fields.collect::<Vec<_>>(), rests)?;
        triad.matrix *= turn.transpose();
        triad.angles.y = inclination;
    }
    Some(triad)
}

/// The rotation R, and the inclination I, with `up · R field = −sin I` in all dwells.
fn turned(fields: &[Vector3<f64>], rests: &[AtRest]) -> Option<(Matrix3<f64>, f64)> {
    let ups = rests
        .iter()
        .filter_map(|rest| Some(rest.up.as_ref()?.direction));
    let ups: Vec<Vector3<f64>> = ups.collect();
    let rows = DMatrix::from_fn(fields.len(), 10, |k, column| match column {
        9 => 1.0,
        _ => ups[k][column / 3] * fields[k][column % 3],
    });
    let svd = rows.svd(false, true);
    let order = svd.singular_values.argmin().0;
    let last = svd.v_t?.row(order).transpose();
    let free = Matrix3::from_fn(|i, j| last[3 * i + j]);
    let sign = free.determinant().signum();
    let of_turn = (free * sign).svd(true, true);
    let scale = of_turn.singular_values.mean();
    let turn = of_turn.u? * of_turn.v_t?;
    let sine = (sign * last[9] / scale).clamp(-1.0, 1.0);
    (scale > 0.0).then(|| (turn, sine.asin()))
}

/// Linear least squares; `None` if the rows do not determine the solution.
fn least_squares(rows: DMatrix<f64>, values: &DVector<f64>) -> Option<DVector<f64>> {
    if rows.nrows() < rows.ncols() {
        return None;
    }
    let svd = rows.svd(true, true);
    let [least, largest] = [svd.singular_values.min(), svd.singular_values.max()];
    let is_determined = least > DETERMINED * largest;
    is_determined.then(|| svd.solve(values, 0.0).ok()).flatten()
}
