//! The closed form: static positions with known attitude (Zhao, Jiang, Li 2016, Eqs. 14 and 15; the
//! second line of the printed Eq. 15 says `N_g` where the accelerometer is meant), and what takes its
//! place without a table.

mod both_triads;
mod earth_rate;
mod gravity;
mod labels;
mod least_squares;
mod observed;
mod result;
mod table;

use crate::calibration::checks::finding::Finding;
use crate::calibration::checks::rest_scatter::scatter_at_rest;
use crate::calibration::checks::rounding::{by_rounding, rounded};
use crate::calibration::checks::unexplained::unexplained_residuals;
use crate::calibration::error::CalibrationError;
use crate::calibration::estimate::Estimate;
use crate::calibration::parameters::parameter;
use crate::calibration::problem::Problem;
use crate::earth::Site;
use crate::imu::Sensor;
use crate::run::{Aiding, Dwell};
pub use least_squares::six_position_triad;
#[cfg(test)]
pub use least_squares::{by_position, linear_design};
pub use observed::Position;
pub use result::{ClosedForm, Reference};
pub use table::six_position_of;

/// Calibrates both triads of a run without a filter.
///
/// With a table's log, from its dwells: where they hold the paper's six positions of a triad (Earth
/// rate or gravity along each body axis, both ways) from those, else from all. Without, from labelled
/// sections; without those, from every dwell and turn by gravity alone. Least squares over six
/// positions is the paper's half sums and half differences where they are exactly opposite.
///
/// # Errors
/// [`CalibrationError`] if nothing is at rest. What the positions do not determine keeps its prior.
pub fn six_position(problem: &Problem) -> Result<ClosedForm, CalibrationError> {
    let sections = &problem.run().recording.segments;
    let reference = if problem.model.aiding == Aiding::Table {
        Reference::Table
    } else if sections.iter().any(|s| s.motion.is_some()) {
        Reference::Labels
    } else {
        Reference::Gravity
    };
    six_position_by(reference, problem)
}

/// The same by what the inputs are to be known from; labels need no dwells.
pub fn six_position_by(
    reference: Reference,
    problem: &Problem,
) -> Result<ClosedForm, CalibrationError> {
    let mut closed_form = match reference {
        Reference::Table => {
            let dwells: Vec<Dwell> = problem.dwells().cloned().collect();
            six_position_of(problem, &dwells)
        }
        Reference::Labels => labels::by_labels(problem),
        Reference::Gravity => gravity::by_gravity(problem),
    }?;
    let notes = problem.notes().into_iter();
    let notes = notes.map(Finding::of_recording);
    closed_form.findings.splice(0..0, notes);
    let unexplained = unexplained_residuals(&closed_form.findings);
    closed_form.findings.extend(unexplained);
    closed_form
        .findings
        .extend(scatter_at_rest(problem, &closed_form.estimate.triads));
    let rounding = by_rounding(problem, &closed_form.estimate.triads);
    let covariance = &mut closed_form.estimate.covariance;
    *covariance += rounding;
    let of_rounding = rounded(problem, &rounding, covariance);
    closed_form.findings.extend(of_rounding);
    share_gravity(&mut closed_form.estimate, &problem.run().site);
    Ok(closed_form)
}

/// The accelerometers were told by gravity, so its error is in their scale factors, the same part in all
/// three.
fn share_gravity(estimate: &mut Estimate, site: &Site) {
    let part = (site.gravity_sigma / site.gravity).powi(2);
    let scale = estimate.triads.accel.scale;
    let first = parameter(Sensor::Accel, 0);
    let mut of_scale = estimate.covariance.fixed_view_mut::<3, 3>(first, first);
    of_scale += scale * scale.transpose() * part;
}
