//! Observability: which combinations of parameters a path determined.
//!
//! In units of the prior σ, the prior covariance is a unit sphere. There, the eigenvectors of the
//! posterior covariance are the independently observed directions; the root of an eigenvalue is the
//! remaining part of the prior σ (Ham and Brown 1983, "Observability, eigenvalues, and Kalman
//! filtering", IEEE Trans. AES-19).

mod not_observed;

use faer::{Mat, Side};
use nalgebra::SMatrix;

use crate::calibration::{Estimate, OBSERVED_BELOW, PARAMETERS, ParameterVector, parameter_name};
use crate::imu::InstallationForm;
pub use not_observed::{not_observed, not_observed_by_path, temperature_not_seen};

/// Directions whose remaining σ agree to this part of it form one space, for which the simplest basis may
/// be chosen.
const ALIKE: f64 = 0.01;
/// A component is named if its square is at least this part of the whole.
const NAMED: f64 = 0.1;
/// From this correlation on, an unobserved direction is reported as tied to the attitude.
const TIED: f64 = 0.7;
/// Rotations of a pair of directions below this count as converged, rad.
const SETTLED: f64 = 1e-9;
/// Most rotations of each pair; they converge within ten.
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

/// A combination of parameters, each in units of its prior σ.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// Posterior over prior σ of the combination, from 0 (known) to 1 (not observed).
    pub remaining: f64,
    /// The major components, the largest first and positive; the squares of all sum to one.
    pub parts: Vec<Part>,
    /// Whether the omitted components together exceed one of the major ones.
    pub others: bool,
    /// Components of the initial attitude with errors correlated to that of the combination.
    pub attitude: Vec<AttitudePart>,
}

/// A parameter's share of a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Index of the parameter.
    pub parameter: usize,
    /// Component of the direction, in units of the prior σ.
    pub component: f64,
}

/// A component of the initial attitude that is correlated with a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AttitudePart {
    /// `tilt about East`, `tilt about North` or `heading`.
    pub name: &'static str,
    /// Correlation of its error with the direction's, both true − estimated; heading clockwise.
    pub correlation: f64,
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
        let mut directions: Vec<Direction> = directions
            .iter()
            .map(|v| direction(&estimated, prior_sigma, attitude, v, remaining(v)))
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

    /// Descriptions of unobserved combinations of parameters that are observed individually.
    pub(in crate::calibration) fn combinations(
        &self,
        form: InstallationForm,
        hidden: &[usize],
    ) -> Vec<String> {
        self.unobserved()
            .filter(|d| d.parts.iter().all(|part| !hidden.contains(&part.parameter)))
            .map(|direction| direction.words(form))
            .collect()
    }
}

impl Direction {
    /// A description such as `gyro scale z with gyro bias z` or `gyro installation xy against gyro installation
    /// yx`: `with` for the same sign, `against` for the opposite sign.
    pub fn words(&self, form: InstallationForm) -> String {
        let mut text = String::new();
        let mut say = |sign: f64, name: &str| {
            if !text.is_empty() {
                text.push_str(if sign < 0.0 { " against " } else { " with " });
            }
            text.push_str(name);
        };
        for part in &self.parts {
            let name = parameter_name(form, part.parameter).unwrap_or_default();
            say(part.component, &name.replace('.', " "));
        }
        for part in &self.attitude {
            say(part.correlation, part.name);
        }
        if self.others {
            text.push_str(" and others");
        }
        text
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
    estimated: &[usize],
    prior_sigma: &ParameterVector,
    attitude: &AttitudeCovariance,
    v: &[f64],
    remaining: f64,
) -> Direction {
    let component = |&n: &usize| v[n].abs();
    let mut order: Vec<usize> = (0..v.len()).collect();
    order.sort_by(|a, b| component(b).total_cmp(&component(a)));
    let sign = order.first().map_or(1.0, |&n| v[n].signum());
    let named = |&&n: &&usize| v[n] * v[n] >= NAMED;
    let parts: Vec<Part> = order
        .iter()
        .take_while(named)
        .map(|&n| Part {
            parameter: estimated[n],
            component: sign * v[n],
        })
        .collect();
    let rest = 1.0 - parts.iter().map(|part| part.component.powi(2)).sum::<f64>();
    // φ₀ is the rotation from the computed to the true attitude; heading turns the other way.
    let attitude = [
        ("tilt about East", 1.0),
        ("tilt about North", 1.0),
        ("heading", -1.0),
    ]
    .into_iter()
    .enumerate()
    .map(|(axis, (name, turn))| {
        let of = |(n, &index): (usize, &usize)| v[n] * attitude[(index, axis)] / prior_sigma[index];
        let covariance: f64 = estimated.iter().enumerate().map(of).sum();
        AttitudePart {
            name,
            correlation: sign * turn * covariance / remaining,
        }
    })
    .filter(|part| part.correlation.abs() >= TIED)
    .collect();
    Direction {
        remaining,
        others: rest > NAMED,
        parts,
        attitude,
    }
}

#[cfg(test)]
mod tests;
