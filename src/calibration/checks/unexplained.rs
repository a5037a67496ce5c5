//! Innovations that no noise figure explains.

use super::finding::Finding;
use super::innovation::{Innovation, Nis};
use crate::calibration::noise::LOG_SIGMA;
use crate::statistics::chi_square_limit;

/// Part of stated figures that are wrong by more than what is still taken for a wrong figure.
const SO_WRONG: f64 = 1e-2;

/// What NIS, or χ² over its degrees of freedom, stays below.
///
/// Noise as stated is wrong by a factor of three at one σ, wherever it is learnt; by so much that NIS, its
/// square, goes beyond the limit, once in a hundred. Beyond, samples and model are of two things.
fn limit() -> f64 {
    let sigmas = chi_square_limit(1.0, 2.0 * SO_WRONG).sqrt();
    (2.0 * LOG_SIGMA * sigmas).exp()
}

/// The finding where innovations are larger than a data sheet's figures can be wrong by.
pub fn unexplained(all: &Nis, innovations: &[Innovation]) -> Option<Finding> {
    let limit = limit();
    let distances = innovations.iter().map(|i| (i.time, i.distance()));
    let worst = distances.max_by(|one, other| one.1.total_cmp(&other.1))?;
    (all.mean > limit).then_some(Finding::Unexplained {
        nis: all.mean,
        limit,
        worst: worst.0,
    })
}

/// The same of a closed form, by what its findings say of residuals: no noise explains what is left even where
/// any one position may be off, and the table's base does not explain it.
pub fn unexplained_residuals(findings: &[Finding]) -> Option<Finding> {
    let limit = limit();
    findings.iter().find_map(|finding| match finding {
        Finding::ResidualsLarge {
            degrees,
            without,
            worst,
            base: None,
            ..
        } => {
            let nis = without / *degrees as f64;
            let worst = worst.first().map_or(0.0, |[begin, _]| *begin);
            (nis > limit).then_some(Finding::Unexplained { nis, limit, worst })
        }
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::checks::innovation::{Observation, consistency};

    fn found(factor: f64) -> bool {
        let innovations: Vec<Innovation> = (0..300)
            .map(|k| Innovation {
                time: f64::from(k),
                observation: Observation::Velocity,
                whitened: [factor; 3],
                accepted: true,
                dwell: 0,
                after_move: false,
            })
            .collect();
        unexplained(&consistency(&innovations).all, &innovations).is_some()
    }

    #[test]
    fn noise_stated_ten_times_too_small_is_a_wrong_figure_and_thirty_times_is_another_instrument() {
        assert!(!found(10.0));
        assert!(found(30.0));
    }
}
