//! Constants that may be absent.

use crate::calibration::{Constant, ErrorTerm, Model};
use crate::imu::{ParameterKind, Sensor, Triad};

/// Constants that are absent or present together, with one size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Candidate {
    /// An error term, or several that have the same effect on most paths.
    Term(ErrorTerm),
    /// A latitude that is not the stated one.
    EarthRate,
    /// A function of temperature in all parameters of a kind.
    Order(Sensor, ParameterKind, usize),
}

impl Candidate {
    /// The candidate to which a constant belongs; `None` if it is known to be there.
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
