//! The constants of a recording, with their prior and posterior.

mod candidate;
mod known;
mod posterior;
mod prior;

use crate::calibration::budget::source::BudgetSource;
use crate::calibration::parameters::auxiliary::OF_AXES;
use crate::calibration::{Coefficient, ErrorTerm, Model, PARAMETERS};
use crate::imu::{TERM_PARAMETERS, Term};
use crate::turntable::{AXIS_ERRORS, AxisError, TABLE_GEOMETRY};
pub use candidate::Candidate;
pub use known::{Known, Sites, triangle};
pub use posterior::{Posterior, of_parameters};
pub use prior::Prior;

/// A quantity that is constant throughout a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Constant {
    /// A parameter of both triads, by its index.
    Parameter(usize),
    /// A parameter of the error terms, by its index.
    Term(usize),
    Thermal(Coefficient),
    Gravity,
    /// An error of the table's base, by its axis.
    Base(usize),
    /// An error of the table's axes, by its index.
    Axis(usize),
    /// Deviation of Earth rate from that at the stated latitude, by its axis: East, North, Up.
    EarthRate(usize),
}

impl Constant {
    /// The constants of a model, those that may be absent last; `gravity`: whether gravity is a constant.
    pub fn all(model: &Model, gravity: bool) -> Vec<Self> {
        let parameters = (0..PARAMETERS).filter(|&i| model.prior_sigma[i] > 0.0);
        let parameters = parameters.map(Self::Parameter);
        let terms = (0..TERM_PARAMETERS).map(Self::Term);
        let table = (0..3).map(Self::Base);
        let table = table.chain((0..AXIS_ERRORS).map(Self::Axis));
        let rate = (0..3).map(Self::EarthRate);
        let thermal = Coefficient::all(model.form, model.thermal.as_deref()).into_iter();
        let beside = terms.chain(table).chain(rate);
        let beside = beside.chain(thermal.map(Self::Thermal));
        let beside = beside.filter(|constant| model.sigma(*constant) > 0.0);
        let (known, candidates): (Vec<Self>, Vec<Self>) =
            beside.partition(|&constant| Candidate::of(constant, model).is_none());
        let gravity = (gravity && model.gravity_sigma > 0.0).then_some(Self::Gravity);
        let known = parameters.chain(gravity).chain(known);
        known.chain(candidates).collect()
    }

    /// The budget source of its prior.
    pub fn source(self) -> BudgetSource {
        match self {
            Self::Parameter(_) => BudgetSource::Prior,
            Self::EarthRate(_) => BudgetSource::EarthRate,
            Self::Term(index) => Term::of(index).map_or(BudgetSource::Prior, BudgetSource::Term),
            Self::Thermal(_) => BudgetSource::Temperature,
            Self::Gravity => BudgetSource::Gravity,
            Self::Base(2) => BudgetSource::TableNorth,
            Self::Base(_) => BudgetSource::TableLevel,
            Self::Axis(index) => match AxisError::of(index) {
                Some(AxisError::Tilt) => BudgetSource::TableSquareness,
                Some(AxisError::Wobble) => BudgetSource::TableWobble,
                _ => BudgetSource::TableEncoder,
            },
        }
    }

    /// Its index among the auxiliary parameters, if it is one.
    pub fn auxiliary(self) -> Option<usize> {
        match self {
            Self::Base(axis) => Some(axis),
            Self::Axis(index) => Some(OF_AXES + index),
            Self::Term(index) => Some(TABLE_GEOMETRY + index),
            _ => None,
        }
    }

    /// The error term to which it belongs, if any.
    pub fn error_term(self) -> Option<ErrorTerm> {
        match self {
            Self::Term(index) => Term::of(index).map(ErrorTerm::Instrument),
            Self::Base(_) => Some(ErrorTerm::TableBase),
            Self::Axis(index) => AxisError::of(index).map(ErrorTerm::TableAxes),
            _ => None,
        }
    }
}

/// The temperature coefficients among constants, with their positions in the list.
pub fn coefficients(constants: &[Constant]) -> impl Iterator<Item = (usize, Coefficient)> + '_ {
    let places = constants.iter().enumerate();
    places.filter_map(|(place, constant)| match constant {
        Constant::Thermal(coefficient) => Some((place, *coefficient)),
        _ => None,
    })
}

/// The parameters of both triads among constants: position in the list, and parameter index.
pub fn parameters(constants: &[Constant]) -> impl Iterator<Item = (usize, usize)> + '_ {
    let places = constants.iter().enumerate();
    places.filter_map(|(place, constant)| match constant {
        Constant::Parameter(index) => Some((place, *index)),
        _ => None,
    })
}
