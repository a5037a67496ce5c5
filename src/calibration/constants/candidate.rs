//! Constants that may be absent.

use super::constant::Constant;
use crate::calibration::{Coefficient, ErrorTerm, Model, PARAMETERS};
use crate::imu::{ParameterKind, Sensor, TERM_PARAMETERS, Triad};
use crate::magnetic::MAGNETIC;
use crate::turntable::AXIS_ERRORS;

/// Constants that are absent or present together, with one size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Candidate {
    /// An error term, or several that have the same effect on most paths.
    Term(ErrorTerm),
    /// A latitude that differs from the stated one.
    EarthRate,
    /// A function of temperature for all parameters of one kind.
    Order(Sensor, ParameterKind, usize),
}

impl Candidate {
    /// The candidate to which a constant belongs; `None` if the constant is certain.
    pub fn of(constant: Constant, model: &Model) -> Option<Self> {
        match constant {
            Constant::EarthRate(_) => Some(Self::EarthRate),
            Constant::Thermal(of) => Some(Self::Order(
                of.sensor,
                Triad::kind(of.parameter),
                of.function,
            )),
            _ => {
                let term = constant.error_term()?;
                let may_be_absent = model.may_have.contains(&term);
                may_be_absent.then(|| Self::Term(term.alike()))
            }
        }
    }
}

impl Constant {
    /// The constants of a model; those that may be absent are last. `gravity` states whether gravity is one of the
    /// constants.
    pub fn all(model: &Model, gravity: bool) -> Vec<Self> {
        let parameters = (0..PARAMETERS).filter(|&i| model.prior_sigma[i] > 0.0);
        let parameters = parameters.map(Self::Parameter);
        let terms = (0..TERM_PARAMETERS).map(Self::Term);
        let table = (0..3).map(Self::Base);
        let table = table.chain((0..AXIS_ERRORS).map(Self::Axis));
        let rate = (0..3).map(Self::EarthRate);
        let thermal = Coefficient::all(model.form, model.thermal.as_deref()).into_iter();
        let magnetic = (0..MAGNETIC).map(Self::Magnetic);
        let beside = terms.chain(table).chain(rate).chain(magnetic);
        let beside = beside.chain(thermal.map(Self::Thermal));
        let beside = beside.filter(|constant| constant.sigma(model) > 0.0);
        let (known, candidates): (Vec<Self>, Vec<Self>) =
            beside.partition(|&constant| Candidate::of(constant, model).is_none());
        let gravity = (gravity && model.gravity_sigma > 0.0).then_some(Self::Gravity);
        let known = parameters.chain(gravity).chain(known);
        known.chain(candidates).collect()
    }
}
