//! What error terms that are not estimated leave in an estimate.

use crate::calibration::{ParameterMatrix, ParameterVector};

/// 1σ of what an error term that is not estimated changes each parameter by: in no covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnmodelledEffect {
    /// Where its own parameters have their usual σ around zero.
    pub usual: ParameterVector,
    /// RMS where they are also as the record shows them.
    pub shown: ParameterVector,
}

/// A term as an explanation of what a record shows.
pub struct Explanation {
    /// ln of the likelihood with it, and with others that are on, over that without any.
    pub ln_likelihood_ratio: f64,
    /// The same over that with the others alone.
    pub of_term: f64,
    /// Mean square by which all of them change the parameters.
    pub added: ParameterMatrix,
}

/// What the covariance of an estimate lacks for error terms that are not estimated and for which the data speak;
/// absent if they speak for none of `tried`.
///
/// With a term the estimate would be `θ + Δ`, with the covariance `P + P_b`; so the mean square error of `θ` is
/// `P + P_b + Δ Δᵀ`. Explanations, and that there is none, count as much as each is likely (Hoeting, Madigan,
/// Raftery, Volinsky 1999, "Bayesian model averaging: a tutorial", Statistical Science 14(4)). Before the data it
/// has the same probability that there is a term as that there is none, and all terms have the same. A term that
/// the data make less likely than it was counts as none.
pub fn seen_and_left_off(explanations: &[Explanation], tried: usize) -> Option<ParameterMatrix> {
    let spoken_for = explanations.iter().filter(|of| of.of_term > 0.0);
    let spoken_for: Vec<&Explanation> = spoken_for.collect();
    let none = (tried as f64).ln();
    let ratios = spoken_for.iter().map(|of| of.ln_likelihood_ratio);
    let best = ratios.reduce(f64::max)?.max(none);
    let weighed = spoken_for.iter().map(|of| {
        let weight = (of.ln_likelihood_ratio - best).exp();
        (weight, of.added * weight)
    });
    let (weights, sum) = weighed.fold(
        ((none - best).exp(), ParameterMatrix::zeros()),
        |(weights, sum), (weight, added)| (weights + weight, sum + added),
    );
    Some(sum / weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// One parameter misses by 3 with a term for which the data speak, and by 100 with one against which they do.
    #[test]
    fn explanations_count_as_much_as_each_is_likely() {
        let of = |ratio: f64, squared: f64| Explanation {
            ln_likelihood_ratio: ratio.ln(),
            of_term: ratio.ln(),
            added: ParameterMatrix::from_diagonal_element(squared),
        };
        let added = seen_and_left_off(&[of(10.0, 9.0), of(0.5, 1e4)], 5);
        assert_relative_eq!(
            added.unwrap()[(0, 0)],
            9.0 * 10.0 / 15.0,
            max_relative = 1e-12
        );
        // Where one is beyond doubt what it does is all that counts.
        let added = seen_and_left_off(&[of(1e300, 9.0), of(10.0, 1e4)], 5);
        assert_relative_eq!(added.unwrap()[(0, 0)], 9.0, max_relative = 1e-12);
        assert_eq!(seen_and_left_off(&[of(0.5, 1e4)], 5), None);
    }
}
