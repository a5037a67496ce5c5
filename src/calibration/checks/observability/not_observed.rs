//! Findings on quantities that the data do not determine: parameters, combinations of parameters, the heading,
//! temperature dependence.

use serde_json::json;

use crate::calibration::{
    AuxiliaryKind, ErrorTerm, Finding, FindingKind as Kind, Level, OBSERVED_BELOW, Outcome,
    auxiliary_name, parameter_name,
};
use crate::imu::Term;
use crate::units::DEGREE;

/// All findings on quantities that the path of a filter's run does not determine.
///
/// Parameters that are far from their prior count as determined, because this distance shows that the prior is wrong.
pub fn not_observed_by_path(outcome: &Outcome, far: Option<&Finding>) -> Vec<Finding> {
    let (form, hidden) = (outcome.estimate.form(), outcome.unobserved().into_iter());
    let mut parameters: Vec<String> = hidden.filter_map(|i| parameter_name(form, i)).collect();
    let together = outcome.observability.combinations(&parameters);
    if let Some(far) = far.and_then(|far| far.figures["parameters"].as_array()) {
        parameters.retain(|name| !far.iter().any(|far| far == name));
    }
    let is_asked = |term: ErrorTerm| {
        let mut candidates = outcome.terms.iter().filter(|of| of.present < 1.0);
        candidates.all(|of| of.term != term)
    };
    let constants = outcome
        .auxiliary
        .unobserved()
        .filter(|&index| AuxiliaryKind::of(index).is_some_and(|kind| is_asked(kind.error_term())));
    let even = is_asked(ErrorTerm::Instrument(Term::AccelAsymmetry))
        && outcome.auxiliary.even_terms_inseparable();
    let findings = [
        not_observed("this path", parameters),
        combinations(together),
        (!outcome.heading_observed()).then(|| heading(outcome.attitude_sigma.z)),
        constants_not_observed(constants.filter_map(auxiliary_name).collect()),
        even.then(even_terms),
        temperature_not_seen(unseen_temperature(outcome)),
    ];
    findings.into_iter().flatten().collect()
}

/// Parameters whose linear change with temperature is hardly known beyond its usual size.
fn unseen_temperature(outcome: &Outcome) -> Vec<String> {
    let Some(thermal) = &outcome.thermal else {
        return Vec::new();
    };
    let linear = thermal.coefficients.iter().enumerate();
    let unseen = linear.filter(|(k, of)| {
        let usual = of.of(&thermal.model.sigma);
        of.function == 0 && thermal.covariance[(*k, *k)].sqrt() > OBSERVED_BELOW * usual
    });
    let form = outcome.estimate.form();
    let names = unseen.filter_map(|(_, of)| parameter_name(form, of.index()));
    names.collect()
}

/// The finding on parameters that kept more than half of their prior σ, if any.
pub fn not_observed(by: &str, parameters: Vec<String>) -> Option<Finding> {
    let has = |group: &str| parameters.iter().any(|name| name.starts_with(group));
    let remedies = [
        (
            "gyro.scale",
            "turns of at least 90° about each of these axes",
        ),
        (
            "gyro.installation",
            "turns of at least 90° about the other axes",
        ),
        ("gyro.bias", "longer dwells with other axes up"),
        ("accel", "dwells with each axis up and each axis down"),
    ];
    let remedies = remedies.iter().filter(|(group, _)| has(group));
    let remedies: Vec<&str> = remedies.map(|(_, remedy)| *remedy).collect();
    let text = format!(
        "Not determined by {by} (σ is still more than half of the prior σ): {}. turncal kept the stated values; do \
         not use them as calibrated values. Add {}.",
        listed(&parameters),
        remedies.join(", and ")
    );
    let figures = json!({ "by": by, "parameters": parameters });
    (!parameters.is_empty()).then(|| Finding::new(Kind::NotObserved, text, figures))
}

/// The finding on requested constants of the table and of error terms, if any.
fn constants_not_observed(constants: Vec<String>) -> Option<Finding> {
    let text = format!(
        "This path does not determine these constants of the table or of error terms, which keep their stated \
         values: {}. The σ of K, E and D include the uncertainty of these constants. Add dwells at other table \
         angles, or leave these terms out.",
        listed(&constants)
    );
    let figures = json!({ "by": "this path", "parameters": constants });
    let finding = || Finding::new(Kind::NotObserved, text, figures).at(Level::Note);
    (!constants.is_empty()).then(finding)
}

/// The finding on parameters whose temperature dependence the recordings do not show, if any.
pub fn temperature_not_seen(parameters: Vec<String>) -> Option<Finding> {
    let text = format!(
        "The temperature dependence of these parameters is unknown: {}. Their σ are valid only at the recorded \
         temperatures. To determine this dependence, record turns at more temperatures.",
        listed(&parameters)
    );
    let figures = json!({ "parameters": parameters });
    (!parameters.is_empty()).then(|| Finding::new(Kind::TemperatureNotSeen, text, figures))
}

/// The finding on unobserved combinations of parameters that are observed individually, if any.
fn combinations(combinations: Vec<String>) -> Option<Finding> {
    let text = format!(
        "This path determines each of these parameters, but not their combination: {}. Add positions or turns in \
         which these parameters have different effects.",
        combinations.join("; ")
    );
    let figures = json!({ "combinations": combinations });
    let any = !combinations.is_empty();
    any.then(|| Finding::new(Kind::CombinationsNotObserved, text, figures))
}

/// The finding on the heading, with its 1σ after the run, rad.
fn heading(sigma_rad: f64) -> Finding {
    let sigma_deg = sigma_rad / DEGREE;
    // A larger σ is that of a uniformly distributed angle and gives no information.
    let known = if sigma_deg < 90.0 {
        format!(" (σ = {sigma_deg:.1}°)")
    } else {
        String::new()
    };
    let text = format!(
        "The heading could not be determined{known}: the gyros are too noisy to sense Earth rate, or their biases \
         mask it. The other parameters were estimated nevertheless. If you need the heading, log a turntable or make the \
         dwells longer."
    );
    let figures = json!({ "sigma_rad": sigma_rad });
    Finding::new(Kind::HeadingNotObserved, text, figures)
}

/// The finding that second order and asymmetry of the accelerometers cannot be distinguished.
fn even_terms() -> Finding {
    let text = "The second-order and asymmetry terms of the accelerometers have the same effect in dwells with an \
        axis up or down. Add dwells at about 45°, or leave one of the two terms out of --with.";
    Finding::new(Kind::EvenTermsInseparable, text.to_owned(), json!(null))
}

/// Parameters by sensor and kind, such as `gyro scale x, y; accel bias z`.
fn listed(names: &[String]) -> String {
    let group = |name: &String| name.rsplit_once('.').map(|(group, _)| group.to_owned());
    let groups = names.chunk_by(|one, other| group(one) == group(other));
    let of_group = |names: &[String]| match names[0].rsplit_once('.') {
        Some((group, _)) => {
            let axes = names.iter().filter_map(|name| name.rsplit('.').next());
            let axes: Vec<&str> = axes.collect();
            format!(
                "{} {}",
                group
                    .replace('.', " ")
                    .replace("installation", "misalignment"),
                axes.join(", ")
            )
        }
        None => names.join(", "),
    };
    groups.map(of_group).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_listed_by_sensor_and_kind() {
        let names = ["gyro.scale.x", "gyro.scale.y", "accel.bias.z"].map(str::to_owned);
        assert_eq!(listed(&names), "gyro scale x, y; accel bias z");
        assert_eq!(listed(&[]), "");
    }
}
