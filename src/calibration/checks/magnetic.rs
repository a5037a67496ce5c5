//! Checks of the magnetometer: whether it is determined, and whether the field is that of one place on the Earth.

use nalgebra::Vector3;
use serde_json::json;

use crate::calibration::magnetometer::{Alone, PARTS};
use crate::calibration::{
    Ellipsoid, Finding, FindingKind as Kind, MagneticEstimate, Outcome, Problem, Source,
};
use crate::magnetic::MAGNETIC;
use crate::number::three_digits;
use crate::statistics::{FALSE_ALARM, chi_square_limit};
use crate::units::DEGREE;

/// Disturbance of the field, as a fraction of its magnitude, above which it depends on the place: 1 µT of 50 µT.
const VARIES: f64 = 0.02;
/// Index of the inclination among the constants of a magnetometer.
const INCLINATION: usize = MAGNETIC - 1;

/// All findings on the magnetometer.
pub fn magnetic(problem: &Problem, outcome: &Outcome) -> Vec<Finding> {
    if !problem.model.magnetic.is_on() {
        return Vec::new();
    }
    let Some(found) = &outcome.magnetic else {
        return vec![not_observed()];
    };
    let each = [varies(problem, outcome), unlikely(problem, found)];
    each.into_iter().flatten().collect()
}

/// Findings on a magnetometer without gyros.
pub fn alone(problem: &Problem, found: Option<&Alone>) -> Vec<Finding> {
    if !problem.model.magnetic.is_on() {
        return Vec::new();
    }
    let Some(found) = found else {
        return vec![not_observed()];
    };
    let (square, freedom) = found.squares;
    let ratio = three_digits((square / freedom).sqrt());
    let text = format!(
        "The field or its angle to gravity changes from dwell to dwell by {ratio} times the noise, so the field depends \
         on the place where the instrument is held. turncal widened the σ of the magnetometer by this factor. Record \
         away from steel and currents, and keep the instrument at one place."
    );
    let is_large = square > chi_square_limit(freedom, FALSE_ALARM);
    let figures = json!({ "chi_square": square, "freedom": freedom });
    let varies = is_large.then(|| Finding::new(Kind::FieldVaries, text, figures));
    let each = [varies, unlikely(problem, &found.estimate)];
    each.into_iter().flatten().collect()
}

/// Findings on a magnetometer that was calibrated from its own values.
pub fn of_ellipsoid(found: &Ellipsoid) -> Vec<Finding> {
    let percent = three_digits(100.0 * found.residual);
    let text = format!(
        "The magnitude of the corrected field varies by {percent} % (RMS). The field depends on the place where the \
         sensor is held, or the sensor was near steel or a current; the σ include the variation. Record away from steel \
         and currents, and turn the sensor at one place."
    );
    let varies = Finding::new(
        Kind::FieldVaries,
        text,
        json!({ "residual": found.residual }),
    );
    let around = |part: &Vector3<f64>| format!("({:+.1}, {:+.1}, {:+.1})", part.x, part.y, part.z);
    let around: Vec<String> = found.unseen.iter().map(around).collect();
    let text = format!(
        "The field did not point into {} of {PARTS} equal parts of the sphere along the axes of the sensor: those around \
         {}. There the calibration rests on the shape of an ellipsoid; the σ include this only if the sensor is linear. \
         Turn the sensor also so that the field points there.",
        around.len(),
        around.join(", ")
    );
    let uncovered = Finding::new(
        Kind::SphereNotCovered,
        text,
        json!({ "unseen": around.len() }),
    );
    let text = "The values do not determine the matrix of the magnetometer, so the corrected field may be wrong in \
                every direction; the σ show the axes. Turn the sensor about all axes, so that the field points into all \
                directions.";
    let unknown = Finding::new(Kind::MagnetometerNotObserved, text.to_owned(), json!({}));
    let each = [
        (found.residual > VARIES).then_some(varies),
        (!around.is_empty()).then_some(uncovered),
        (!found.estimate.is_shown()).then_some(unknown),
    ];
    each.into_iter().flatten().collect()
}

fn not_observed() -> Finding {
    let text = "The dwells do not determine the magnetometer, so turncal did not calibrate it. Add dwells with each axis up \
                and down, away from steel and currents.";
    Finding::new(Kind::MagnetometerNotObserved, text.to_owned(), json!({}))
}

/// The finding, if the field depends on the place where the instrument is held.
fn varies(problem: &Problem, outcome: &Outcome) -> Option<Finding> {
    let mut sources = outcome.noise.sources.iter();
    let disturbance = sources.find(|of| of.source == Source::MagneticDisturbance)?;
    let size = disturbance.used * disturbance.source.unit().1 / problem.model.magnetic.magnitude[0];
    let percent = three_digits(100.0 * size);
    let text = format!(
        "The magnetic field changes from dwell to dwell by {percent} % of its magnitude (1σ per axis), so it depends on \
         the place where the instrument is held. The σ of the magnetometer include the change. Record away from steel \
         and currents, and keep the instrument at one place."
    );
    (size > VARIES).then(|| Finding::new(Kind::FieldVaries, text, json!({ "size": size })))
}

/// The finding, if the inclination contradicts the model of the Earth's field.
fn unlikely(problem: &Problem, found: &MagneticEstimate) -> Option<Finding> {
    let prior = &problem.model.magnetic;
    let is_of_model = prior.knows_magnitude();
    let values = found.triad.vector();
    let off = values[INCLINATION] - prior.mean[INCLINATION];
    // The estimate contains the prior, so the difference has the prior variance minus that of the estimate.
    let variance = prior.sigma[INCLINATION].powi(2) - found.sigma()[INCLINATION].powi(2);
    let limit = chi_square_limit(1.0, FALSE_ALARM);
    let square = off * off / variance;
    let [inclination, model] = [values[INCLINATION], prior.mean[INCLINATION]].map(|of| of / DEGREE);
    let text = format!(
        "The field at the site has an inclination of {inclination:.1}°, but the World Magnetic Model has {model:.1}°. A \
         building or a vehicle then also changes its magnitude, so the scale factors of the magnetometer are less \
         accurate than stated. Record outdoors, or leave out the date in [meta] (χ² {square:.0}; limit {limit:.0})."
    );
    let figures = json!({ "inclination_deg": inclination, "model_deg": model });
    let contradicts = is_of_model && variance > 0.0 && square > limit;
    contradicts.then(|| Finding::new(Kind::FieldUnlikely, text, figures))
}
