//! How the parameters of further terms are spoken of.

use super::number::{sigma, three_digits, value};
use crate::calibration::outcome::Further;
use crate::imu::Term;

/// One parameter, each number as it is shown.
pub(super) struct Row {
    /// The term in words.
    pub title: &'static str,
    /// Whether it is the term's first.
    pub first: bool,
    /// The name that files use, such as `accel.second_order.x`.
    pub name: String,
    /// Its end, such as `x`.
    pub axis: String,
    pub value: String,
    pub sigma: String,
    pub unit: &'static str,
    pub prior: String,
    /// Posterior over prior σ.
    pub remaining: f64,
}

fn title(term: Term) -> &'static str {
    match term {
        Term::AccelSecondOrder => "accel second order",
        Term::AccelAsymmetry => "accel asymmetry",
        Term::SizeEffect => "accel lever arm",
        Term::TimeOffset => "accel time offset",
        Term::GSensitivity => "gyro g-sensitivity",
    }
}

/// Every parameter that was estimated.
pub(super) fn rows(further: &Further) -> Vec<Row> {
    let row = |k: usize| {
        let (term, name) = (Term::of(k)?, Term::parameter_name(k)?);
        let (unit, in_si) = term.unit();
        let (posterior, prior) = (further.sigma[k], further.prior_sigma[k]);
        let axis = name.rsplit('.').next().filter(|end| end.len() <= 2);
        Some(Row {
            title: title(term),
            first: k == term.parameters().start,
            axis: axis.unwrap_or_default().to_owned(),
            value: value(further.values[k] / in_si, posterior / in_si),
            sigma: sigma(posterior / in_si),
            unit,
            prior: three_digits(prior / in_si),
            remaining: posterior / prior,
            name,
        })
    };
    further.estimated().filter_map(row).collect()
}
