//! Observability: which combinations of parameters a path determined.
//!
//! In units of the prior σ, the prior covariance is a unit sphere. In these units, the eigenvectors of the posterior
//! covariance are the independently observed directions, and the root of each eigenvalue is the remaining part of the
//! prior σ (Ham and Brown 1983, "Observability, eigenvalues, and Kalman filtering", IEEE Trans. AES-19).

mod not_observed;

use std::collections::BTreeMap;

use faer::{Mat, Side};
use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

use crate::calibration::{Estimate, OBSERVED_BELOW, PARAMETERS, ParameterVector, parameter_name};
use crate::imu::InstallationForm;
pub use not_observed::{not_observed, not_observed_by_path, temperature_not_seen};

/// Directions whose remaining σ agree within this fraction form one space; its simplest basis may be chosen.
const ALIKE: f64 = 0.01;
/// A component is listed if its square is at least this fraction of the whole.
const NAMED: f64 = 0.1;
/// From this correlation on, an unobserved direction is reported as tied to the attitude.
const TIED: f64 = 0.7;
/// Rotations of a pair of directions below this count as converged, rad.
const SETTLED: f64 = 1e-9;
/// Maximum number of rotations of each pair; they converge within ten.
const SWEEPS: usize = 100;

/// Covariance of each parameter error δθ with each component of the initial attitude error φ₀ in
/// units of its σ, East-North-Up.
pub type AttitudeCovariance = SMatrix<f64, PARAMETERS, 3>;

/// Independent directions of the parameters, the least observed first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Observability {
    /// One direction for each estimated parameter.
    pub directions: Vec<Direction>,
}

/// A combination of parameters, each in units of its prior σ, with its observability in a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Direction {
    /// Posterior σ of the combination divided by its prior σ, from 0 (known) to 1 (not observed).
    pub remaining: f64,
    /// A description such as `gyro scale z with gyro bias z` or `gyro misalignment xy against gyro misalignment yx`:
    /// `with` means that the parameters (and the initial attitude that is correlated with them) have the same sign,
    /// `against` that they have opposite signs.
    pub words: String,
    /// Names and components of the major parameters in the combination; the largest component is positive, and the
    /// squares of all components sum to one.
    pub parts: BTreeMap<String, f64>,
}

impl Observability {
    /// Observability of an estimate, relative to the prior σ of its parameters.
    pub(in crate::calibration) fn new(
        estimate: &Estimate,
        prior_sigma: &ParameterVector,
        attitude: &AttitudeCovariance,
    ) -> Self {
        let estimated: Vec<usize> = estimate.estimated().collect();
        let n = estimated.len();
        let scaled = Mat::from_fn(n, n, |i, j| {
            let (i, j) = (estimated[i], estimated[j]);
            estimate.covariance[(i, j)] / (prior_sigma[i] * prior_sigma[j])
        });
        let finite = (0..n).all(|j| (0..n).all(|i| scaled[(i, j)].is_finite()));
        let Some(eigen) = finite
            .then(|| scaled.self_adjoint_eigen(Side::Lower).ok())
            .flatten()
        else {
            return Self::default();
        };
        let columns = (0..n).map(|k| (0..n).map(|i| eigen.U()[(i, k)]).collect());
        let mut directions: Vec<Vec<f64>> = columns.collect();
        let remaining = |v: &[f64]| {
            let variance: f64 = (0..n)
                .flat_map(|j| (0..n).map(move |i| (i, j)))
                .map(|(i, j)| v[i] * scaled[(i, j)] * v[j])
                .sum();
            variance.max(0.0).sqrt()
        };
        directions.reverse();
        for alike in
            directions.chunk_by_mut(|a, b| remaining(a) - remaining(b) <= ALIKE * remaining(a))
        {
            simplify(alike);
        }
        let of = (estimate.form(), &estimated[..]);
        let mut directions: Vec<Direction> = directions
            .iter()
            .map(|v| direction(of, prior_sigma, attitude, v, remaining(v)))
            .collect();
        directions.sort_by(|a, b| b.remaining.total_cmp(&a.remaining));
        Self { directions }
    }

    /// Directions that the run did not observe.
    pub fn unobserved(&self) -> impl Iterator<Item = &Direction> {
        self.directions
            .iter()
            .take_while(|direction| direction.remaining > OBSERVED_BELOW)
    }

    /// Descriptions of unobserved combinations of parameters, without these parameters.
    pub(in crate::calibration) fn combinations(&self, hidden: &[String]) -> Vec<String> {
        self.unobserved()
            .filter(|direction| !direction.parts.keys().any(|name| hidden.contains(name)))
            .map(|direction| direction.words.clone())
            .collect()
    }
}

/// Rotates directions within the space that they span to maximise the fourth powers of their components,
/// so that each has few components (quartimax: Neuhaus and Wrigley 1954, "The quartimax method", Brit. J.
/// Stat. Psych. 7).
fn simplify(directions: &mut [Vec<f64>]) {
    for _ in 0..SWEEPS {
        let mut largest = 0f64;
        for second in 1..directions.len() {
            let (before, rest) = directions.split_at_mut(second);
            for first in before {
                let pairs = || first.iter().zip(&rest[0]);
                let (sine, cosine) = pairs().fold((0.0, 0.0), |(sine, cosine), (x, y)| {
                    let (u, v) = (x * x - y * y, 2.0 * x * y);
                    (sine + 2.0 * u * v, cosine + u * u - v * v)
                });
                let turn = 0.25 * f64::atan2(sine, cosine);
                largest = largest.max(turn.abs());
                let (s, c) = turn.sin_cos();
                for (x, y) in first.iter_mut().zip(&mut rest[0]) {
                    (*x, *y) = (c * *x + s * *y, c * *y - s * *x);
                }
            }
        }
        if largest < SETTLED {
            break;
        }
    }
}

fn direction(
    (form, estimated): (InstallationForm, &[usize]),
    prior_sigma: &ParameterVector,
    attitude: &AttitudeCovariance,
    v: &[f64],
    remaining: f64,
) -> Direction {
    let component = |&n: &usize| v[n].abs();
    let mut order: Vec<usize> = (0..v.len()).collect();
    order.sort_by(|a, b| component(b).total_cmp(&component(a)));
    let sign = order.first().map_or(1.0, |&n| v[n].signum());
    let major = order.iter().take_while(|&&n| v[n] * v[n] >= NAMED);
    let named = major.filter_map(|&n| Some((parameter_name(form, estimated[n])?, sign * v[n])));
    let parts: Vec<(String, f64)> = named.collect();
    let rest = 1.0 - parts.iter().map(|part| part.1.powi(2)).sum::<f64>();
    // φ₀ is the rotation from the computed to the true attitude; heading has the opposite sense.
    let tied = [
        ("tilt about East", 1.0),
        ("tilt about North", 1.0),
        ("heading", -1.0),
    ];
    let tied = tied.into_iter().enumerate().map(|(axis, (name, turn))| {
        let of = |(n, &index): (usize, &usize)| v[n] * attitude[(index, axis)] / prior_sigma[index];
        let covariance: f64 = estimated.iter().enumerate().map(of).sum();
        (name.to_owned(), sign * turn * covariance / remaining)
    });
    let tied = tied.filter(|(_, correlation)| correlation.abs() >= TIED);
    let mut words = String::new();
    for (name, sign) in parts.iter().cloned().chain(tied) {
        words += match sign < 0.0 {
            _ if words.is_empty() => "",
            true => " against ",
            false => " with ",
        };
        words += &name
            .replace('.', " ")
            .replace("installation", "misalignment");
    }
    if rest > NAMED {
        words += " and others";
    }
    Direction {
        remaining,
        words,
        parts: parts.into_iter().collect(),
    }
}

#[cfg(test)]
mod tests;
