//! Tests for results that must not be used, because the iterations did not converge or no noise figure explains the
//! residuals.

use serde_json::json;

use crate::calibration::sizes::LOG_SIGMA;
use crate::calibration::{Finding, FindingKind as Kind, Innovation, Nis, Outcome, Problem};
use crate::number::three_digits;
use crate::statistics::chi_square_limit;

/// Probability that a stated figure is wrong by more than the accepted limit.
const SO_WRONG: f64 = 1e-2;

/// Residuals above this fraction of gravity, or of a turn, do not occur in any sensor.
const ABSURD: f64 = 0.01;

/// Limit of NIS, or of χ² over its degrees of freedom.
///
/// 1σ of a stated noise figure is a factor of three, as everywhere in noise estimation. In one case in a hundred, its
/// error squared exceeds this limit of NIS. Beyond that, the samples do not match the model.
fn limit() -> f64 {
    let sigmas = chi_square_limit(1.0, 2.0 * SO_WRONG).sqrt();
    (2.0 * LOG_SIGMA * sigmas).exp()
}

/// The finding, if the iterations of the filter did not converge.
pub fn not_converged(outcome: &Outcome) -> Option<Finding> {
    let passes = outcome.passes.len();
    let step = outcome
        .passes
        .last()
        .map_or(f64::NAN, |pass| pass.largest_step);
    let text = format!(
        "Not converged: in the last of {passes} passes, a parameter still changed by {step:.2} σ. Do not use the values or \
         σ. Check scale, units and axes in run.toml with turncal check."
    );
    let figures = json!({ "passes": passes, "largest_step_sigma": step });
    let is_finite = outcome.estimate.covariance.iter().all(|of| of.is_finite());
    (!outcome.converged || !is_finite).then(|| Finding::new(Kind::NotConverged, text, figures))
}

/// The finding, if residuals are too large for any sensor: in half of the dwells or moves they exceed a hundredth of
/// gravity or of a turn.
pub fn absurd(problem: &Problem, outcome: &Outcome) -> Option<Finding> {
    let residuals = outcome.residuals(problem).ok()?;
    let names = [
        "|f| − g is {} of gravity",
        "the direction of gravity after a move is wrong by {} of a turn",
    ];
    let pairs = names.into_iter().zip(residuals.middle());
    let worst = pairs.filter_map(|(name, middle)| middle.map(|middle| (name, middle)));
    let (name, middle) = worst.max_by(|one, other| one.1.total_cmp(&other.1))?;
    let percent = format!("{} %", three_digits(100.0 * middle));
    let text = format!(
        "Calibration rejected: in the median dwell, {}, which is more than the error of any calibrated \
         sensor. Do not use \
         the values or σ. Check units, axes and rate in run.toml with turncal check.",
        name.replace("{}", &percent)
    );
    let figures = json!({ "median": middle, "limit": ABSURD });
    (middle > ABSURD).then(|| Finding::new(Kind::Unexplained, text, figures))
}

/// The finding, if the innovations are larger than wrong data-sheet values can explain.
pub fn unexplained(all: &Nis, innovations: &[Innovation]) -> Option<Finding> {
    let distances = innovations.iter().map(|i| (i.time, i.distance()));
    let worst = distances.max_by(|one, other| one.1.total_cmp(&other.1))?;
    rejected("NIS", all.mean, worst.0)
}

/// The finding for a closed form, derived from the findings on its residuals.
pub fn unexplained_residuals(findings: &[Finding]) -> Option<Finding> {
    let large = |finding: &&Finding| finding.is(Kind::ResidualsLarge);
    findings.iter().filter(large).find_map(|finding| {
        let figure = |name: &str| finding.figures[name].as_f64();
        let nis = figure("chi_square")? / figure("degrees")?;
        let begin = finding.figures["worst"][0][0].as_f64();
        rejected("χ² over its degrees of freedom", nis, begin.unwrap_or(0.0))
    })
}

/// The finding, if this mean square exceeds the limit; the largest square is at this time, s.
fn rejected(name: &str, nis: f64, worst: f64) -> Option<Finding> {
    let limit = limit();
    let text = format!(
        "Calibration rejected: {name} is {nis:.0}, far larger than any wrong noise figure could cause (limit \
         {limit:.0}). The largest residual is at {worst:.1} s: look there for lost, repeated or wrapped rows, a bump \
         or a wrong table position."
    );
    let figures = json!({ "nis": nis, "limit": limit, "worst": worst });
    (nis > limit).then(|| Finding::new(Kind::Unexplained, text, figures))
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
                sigma: [1.0; 3],
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
