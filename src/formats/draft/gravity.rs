//! Zero and scale of accelerometers from gravity at rest, which has one size whichever way it lies.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::least_squares::{Equation, Fit, cost, fit, fit_at};
use super::motion::PART;
use super::rests::TOLERANCE;
use crate::statistics::{FALSE_ALARM, chi_square_limit, median};
use crate::units::{DEGREE, STANDARD_GRAVITY};

/// Axes of one chip are askew by about this, 1σ.
pub(super) const ASKEW: f64 = 2.0 * DEGREE;
/// Axes of several chips may be as different as this, 1σ of the logarithm.
pub(super) const ANY_SCALE: f64 = 2.0;
/// Zero of a register that is made to say nothing at zero, 1σ, g.
const ABOUT_ZERO: f64 = 1.0 / STANDARD_GRAVITY;
/// Zero of one that is not, 1σ, g: as good as anywhere.
const ANYWHERE: f64 = 1e3;

/// Logarithms of the scales, askewness, zero in units of the first scale.
const PARAMETERS: usize = 9;
type Parameters = SVector<f64, PARAMETERS>;

/// What gravity shows of accelerometers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Gravity {
    /// What the axes say at zero, the file's quantity a row, where it is not what they are made to say …
    pub own_zero: Option<Vector3<f64>>,
    /// … with its largest σ.
    pub zero_sigma: f64,
    /// For one g.
    pub scale: Vector3<f64>,
    /// Of what is common to the scales, relative.
    pub sigma: f64,
    /// Whether the axes differ by more than those of one chip.
    pub by_axis: bool,
    /// Rests it was found from.
    pub rests: usize,
    /// Output above its zero to g.
    pub correction: Matrix3<f64>,
    pub zero: Vector3<f64>,
}

impl Gravity {
    /// From the mean outputs at rests, above what registers are made to say at zero. None where zero is neither
    /// there nor shown by the rests.
    pub fn find(rests: &[Vector3<f64>]) -> Option<Self> {
        let account = |own_zero, by_axis| Sphere::fit(rests, own_zero, by_axis);
        let chosen = likelier(account(false, false), account(true, false), rests, 3.0);
        let own_zero = chosen.as_ref().is_some_and(|sphere| sphere.own_zero);
        let chosen = likelier(chosen, account(own_zero, true), rests, 2.0)?;
        let zero_sigma = chosen.zero_sigma();
        if chosen.own_zero && zero_sigma > ABOUT_ZERO * chosen.size {
            return None;
        }
        let zero = chosen.zero();
        let mean = Parameters::from_fn(|k, _| if k < 3 { 1.0 / 3.0 } else { 0.0 });
        Some(Self {
            own_zero: chosen.own_zero.then_some(zero),
            zero_sigma,
            scale: chosen.scale(),
            sigma: mean.dot(&(chosen.fit.covariance * mean)).sqrt(),
            by_axis: chosen.by_axis,
            rests: rests.len(),
            correction: chosen.correction(),
            zero,
        })
    }

    /// Direction of gravity, of this output.
    pub fn direction(&self, output: &Vector3<f64>) -> Vector3<f64> {
        (self.correction * (output - self.zero)).normalize()
    }
}

/// The simpler account, unless one with so many parameters more is likelier by more than chance.
fn likelier(
    simple: Option<Sphere>,
    other: Option<Sphere>,
    rests: &[Vector3<f64>],
    parameters: f64,
) -> Option<Sphere> {
    match (simple, other) {
        (Some(simple), Some(other)) if !other.beats(&simple, rests, parameters) => Some(simple),
        (simple, other) => other.or(simple),
    }
}

/// Axes that sense one g at every rest.
#[derive(Debug, Clone)]
struct Sphere {
    /// Whether zero may be anywhere.
    own_zero: bool,
    /// Whether the scales of the axes may differ by more than those of one chip.
    by_axis: bool,
    /// The unit of scales and zero.
    size: f64,
    fit: Fit<PARAMETERS>,
    prior: SMatrix<f64, PARAMETERS, PARAMETERS>,
}

impl Sphere {
    fn fit(rests: &[Vector3<f64>], own_zero: bool, by_axis: bool) -> Option<Self> {
        let zero = if own_zero { ANYWHERE } else { ABOUT_ZERO };
        let spread = if by_axis { ANY_SCALE } else { TOLERANCE };
        let prior = prior(spread, zero);
        let about = |centre: &Vector3<f64>| {
            let mut sizes: Vec<f64> = rests.iter().map(|rest| (rest - centre).norm()).collect();
            median(&mut sizes).filter(|size| *size > 0.0)
        };
        let mut best: Option<(f64, Self)> = None;
        // Far from its zero the problem has valleys of its own; the sphere by linear equations is near.
        for centre in [Some(Vector3::zeros()), centre(rests)]
            .into_iter()
            .flatten()
        {
            let Some(size) = about(&centre) else { continue };
            let start = Parameters::from_fn(|k, _| if k < 6 { 0.0 } else { centre[k - 6] / size });
            let Some(fit) = fit(start, &prior, PART, |at| equations(rests, size, at)) else {
                continue;
            };
            let sphere = Self {
                own_zero,
                by_axis,
                size,
                fit,
                prior,
            };
            // The better of two is that with the lesser cost at one σ.
            let sigma = best
                .as_ref()
                .map_or(sphere.fit.sigma, |(sigma, _)| sigma.min(sphere.fit.sigma));
            let better = best.as_ref().is_none_or(|(_, other)| {
                sphere.cost_at(rests, sigma) < other.cost_at(rests, sigma)
            });
            if better {
                best = Some((sigma, sphere));
            }
        }
        best.map(|(_, sphere)| sphere)
    }

    fn cost_at(&self, rests: &[Vector3<f64>], sigma: f64) -> f64 {
        let equations = equations(rests, self.size, &self.fit.at);
        cost(&equations, sigma, &self.prior, &self.fit.at)
    }

    /// Whether it is likelier than a simpler account, which leaves out so many parameters, by more than chance.
    fn beats(&self, simple: &Self, rests: &[Vector3<f64>], parameters: f64) -> bool {
        let sigma = self.fit.sigma;
        let of_simple = |at: &Parameters| equations(rests, simple.size, at);
        let Some(fit) = fit_at(simple.fit.at, &simple.prior, sigma, of_simple) else {
            return true;
        };
        let gain =
            cost(&of_simple(&fit.at), sigma, &simple.prior, &fit.at) - self.cost_at(rests, sigma);
        gain > chi_square_limit(parameters, FALSE_ALARM)
    }

    fn scale(&self) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.size * self.fit.at[axis].exp())
    }

    fn zero(&self) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.size * self.fit.at[6 + axis])
    }

    fn zero_sigma(&self) -> f64 {
        let variance = |axis: usize| self.fit.covariance[(6 + axis, 6 + axis)];
        self.size * (0..3).map(variance).fold(0.0, f64::max).sqrt()
    }

    fn correction(&self) -> Matrix3<f64> {
        askew(&self.fit.at) * Matrix3::from_diagonal(&self.scale().map(f64::recip))
    }
}

/// Of the parameters about a common scale of any size and a zero at zero.
fn prior(spread: f64, zero: f64) -> SMatrix<f64, PARAMETERS, PARAMETERS> {
    let mut information = SMatrix::zeros();
    for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
        let own = if a == b { 1.0 } else { 0.0 };
        information[(a, b)] = (own - 1.0 / 3.0) / spread.powi(2) + 1.0 / (3.0 * ANYWHERE.powi(2));
    }
    for axis in 0..3 {
        information[(3 + axis, 3 + axis)] = ASKEW.powi(-2);
        information[(6 + axis, 6 + axis)] = zero.powi(-2);
    }
    information
}

fn askew(at: &Parameters) -> Matrix3<f64> {
    let [xy, xz, yz] = [at[3], at[4], at[5]];
    Matrix3::new(1.0, xy, xz, xy, 1.0, yz, xz, yz, 1.0)
}

/// What each rest says beyond one g.
fn equations(rests: &[Vector3<f64>], size: f64, at: &Parameters) -> Vec<Equation<PARAMETERS>> {
    let askew = askew(at);
    let of = |rest: &Vector3<f64>| {
        let scaled =
            Vector3::from_fn(|axis, _| (rest[axis] / size - at[6 + axis]) * (-at[axis]).exp());
        let force = askew * scaled;
        let up = force.normalize();
        let along = askew.tr_mul(&up);
        let mut row = Parameters::zeros();
        for axis in 0..3 {
            row[axis] = -along[axis] * scaled[axis];
            row[6 + axis] = -along[axis] * (-at[axis]).exp();
        }
        for (k, (a, b)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            row[3 + k] = up[a] * scaled[b] + up[b] * scaled[a];
        }
        Equation {
            residual: force.norm() - 1.0,
            row,
        }
    };
    rests.iter().map(of).collect()
}

/// Centre of the sphere on which points lie, by `|a|² = 2 b·a + c`; none if they lie in a plane.
fn centre(points: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let middle = super::motion::mean(points);
    let (mut information, mut right) = (SMatrix::<f64, 4, 4>::zeros(), SVector::<f64, 4>::zeros());
    for point in points {
        let from = point - middle;
        let row = (2.0 * from).push(1.0);
        information += row * row.transpose();
        right += row * from.norm_squared();
    }
    let solved = information.cholesky()?.solve(&right);
    Some(middle + solved.xyz()).filter(|centre| centre.iter().all(|value| value.is_finite()))
}
