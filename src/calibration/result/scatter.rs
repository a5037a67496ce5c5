//! Scatter of repeated calibrations compared with their stated σ.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::frame::Canonical;
use super::nees::Directions;
use crate::calibration::ParameterVector;

/// Mean and scatter of three or more calibrations, assumed to be of one unchanged instrument
/// and of independent data.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    /// Scatter of each parameter.
    pub parameters: Vec<ParameterScatter>,
    /// Scatter of all parameters with their correlations, over the calibrations that give correlations; `None` if fewer
    /// than two do, or if one has directions without σ, as with three angles.
    pub joint: Option<ChiSquare>,
}

/// Mean and scatter of one parameter, over the calibrations that state a σ for it, or over all if
/// fewer than two do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterScatter {
    /// Index among the parameters of both triads.
    pub index: usize,
    /// Number of calibrations used.
    pub count: usize,
    /// Mean minus the reference's value, weighted by 1/σ²; unweighted without σ.
    pub mean: f64,
    /// 1σ of the weighted mean from the stated σ.
    pub mean_sigma: Option<f64>,
    /// Sample standard deviation.
    pub deviation: f64,
    /// χ² of the scatter about the weighted mean with the stated σ.
    pub chi_square: Option<ChiSquare>,
}

/// A sum of squares that follows a χ² distribution if the stated σ are correct.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChiSquare {
    /// The sum.
    pub value: f64,
    /// Degrees of freedom.
    pub freedom: usize,
    /// Probability of at least this sum: near zero if σ are too small; near one if they are too large.
    pub p: f64,
}

impl ChiSquare {
    /// χ² of a sum with its degrees of freedom; `None` without degrees of freedom.
    pub(crate) fn new(value: f64, freedom: usize) -> Option<Self> {
        let p = ChiSquared::new(freedom as f64).ok()?.sf(value);
        Some(Self { value, freedom, p })
    }
}

pub fn scatter(
    calibrations: &[Canonical],
    reference: &ParameterVector,
    parameters: &[usize],
) -> Scatter {
    Scatter {
        parameters: parameters
            .iter()
            .map(|&index| of_parameter(calibrations, reference, index))
            .collect(),
        joint: joint(calibrations, reference, parameters),
    }
}

fn of_parameter(
    calibrations: &[Canonical],
    reference: &ParameterVector,
    index: usize,
) -> ParameterScatter {
    let all: Vec<(f64, f64)> = calibrations
        .iter()
        .map(|c| {
            let variance = c.covariance.map_or(0.0, |p| p[(index, index)]);
            (c.vector()[index] - reference[index], variance)
        })
        .collect();
    let claimed: Vec<(f64, f64)> = all.iter().copied().filter(|x| x.1 > 0.0).collect();
    let weighted = claimed.len() >= 2;
    let used = if weighted { claimed } else { all };
    let weight = |variance: f64| if weighted { variance.recip() } else { 1.0 };
    let weights: f64 = used.iter().map(|x| weight(x.1)).sum();
    let mean = used.iter().map(|x| x.0 * weight(x.1)).sum::<f64>() / weights;
    let centre = used.iter().map(|x| x.0).sum::<f64>() / used.len() as f64;
    let squares: f64 = used.iter().map(|x| (x.0 - centre).powi(2)).sum();
    let freedom = used.len() - 1;
    ParameterScatter {
        index,
        count: used.len(),
        mean,
        mean_sigma: weighted.then(|| weights.recip().sqrt()),
        deviation: (squares / freedom as f64).sqrt(),
        chi_square: weighted
            .then(|| used.iter().map(|x| (x.0 - mean).powi(2) / x.1).sum())
            .and_then(|value| ChiSquare::new(value, freedom)),
    }
}

/// `Σ (x_k − m)ᵀ P_k⁻¹ (x_k − m)` about the weighted mean `m`.
fn joint(
    calibrations: &[Canonical],
    reference: &ParameterVector,
    parameters: &[usize],
) -> Option<ChiSquare> {
    let given = calibrations.iter().filter(|c| c.correlated);
    let (vectors, covariances): (Vec<_>, Vec<_>) = given
        .filter_map(|c| Some((c.vector(), c.covariance?)))
        .unzip();
    let [first, _, ..] = covariances.as_slice() else {
        return None;
    };
    let estimated = |i: &usize| covariances.iter().all(|p| p[(*i, *i)] > 0.0);
    let indices: Vec<usize> = parameters.iter().copied().filter(estimated).collect();
    let n = indices.len();
    // One unit for all, a parameter's σ in the first calibration, keeps the sums well scaled.
    let unit = DVector::from_fn(n, |i, _| first[(indices[i], indices[i])].sqrt());
    let scale = DMatrix::from_diagonal(&unit);
    let information: Vec<DMatrix<f64>> = covariances
        .iter()
        .map(|p| Some(&scale * Directions::new(p, &indices)?.information()? * &scale))
        .collect::<Option<_>>()?;
    let values: Vec<DVector<f64>> = vectors
        .iter()
        .map(|vector| DVector::from_fn(n, |i, _| (vector - reference)[indices[i]] / unit[i]))
        .collect();
    let pairs = || information.iter().zip(&values);
    let total = information.iter().fold(DMatrix::zeros(n, n), |a, b| a + b);
    let sum = pairs().fold(DVector::zeros(n), |a, (w, x)| a + w * x);
    let mean = total.cholesky()?.solve(&sum);
    let value = pairs().map(|(w, x)| {
        let from_mean = x - &mean;
        from_mean.dot(&(w * &from_mean))
    });
    ChiSquare::new(value.sum(), n * (values.len() - 1))
}

#[cfg(test)]
mod tests {
    use nalgebra::SVector;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::calibration::PARAMETERS;
    use crate::calibration::from_vector;
    use crate::calibration::result::frame::own_nominal;
    use crate::calibration::result::frame::tests::{record, with_covariance};
    use crate::imu::BodyFrame;
    use crate::imu::InstallationForm::General;

    /// Calibrations that scatter by `factor` times the σ that they claim.
    fn drawn(count: usize, factor: f64) -> (Vec<Canonical>, ParameterVector) {
        let record = with_covariance(record(), General);
        let centre = Canonical::new("a", &record, &own_nominal(&record), BodyFrame::Table).unwrap();
        let root = centre.covariance.unwrap().cholesky().unwrap().unpack();
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let draws = (0..count).map(|_| {
            let white = SVector::<f64, PARAMETERS>::from_fn(|_, _| StandardNormal.sample(&mut rng));
            Canonical {
                triads: from_vector(General, &(centre.vector() + root * white * factor)),
                ..centre.clone()
            }
        });
        (draws.collect(), centre.vector())
    }

    #[test]
    fn scatter_of_true_sigma_is_inside_its_interval_and_of_wrong_ones_is_not() {
        let parameters: Vec<usize> = (0..PARAMETERS).collect();
        let p = |factor| {
            let (draws, reference) = drawn(20, factor);
            let joint = scatter(&draws, &reference, &parameters).joint.unwrap();
            assert_eq!(joint.freedom, 24 * 19);
            joint.p
        };
        assert!((0.005..0.995).contains(&p(1.0)));
        assert!(p(1.3) < 1e-6 && p(0.7) > 1.0 - 1e-6);
    }

    #[test]
    fn one_parameter_has_the_mean_and_scatter_of_its_values() {
        let (mut draws, reference) = drawn(3, 0.0);
        let sigma = draws[0].sigma().unwrap()[9];
        for (draw, offset) in draws.iter_mut().zip([-1.0, 0.0, 4.0]) {
            draw.triads.gyro.bias.x += offset * sigma;
        }
        let of = of_parameter(&draws, &reference, 9);
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
        close(of.mean, sigma);
        close(of.mean_sigma.unwrap(), sigma / 3f64.sqrt());
        close(of.deviation, sigma * 7f64.sqrt());
        close(of.chi_square.unwrap().value, 14.0);
        // Abramowitz and Stegun, Eq. 26.4.21 for two degrees of freedom: exp(−χ²/2).
        close(of.chi_square.unwrap().p, (-7f64).exp());
    }

    #[test]
    fn calibrations_without_sigma_have_a_mean_and_no_chi_square() {
        let (mut draws, reference) = drawn(3, 1.0);
        for draw in &mut draws {
            draw.covariance = None;
        }
        let scatter = scatter(&draws, &reference, &[0, 1, 2]);
        assert_eq!(scatter.joint, None);
        assert!(
            scatter
                .parameters
                .iter()
                .all(|p| p.chi_square.is_none() && p.count == 3)
        );
    }
}
