//! A quantity that is constant throughout a recording.

use crate::calibration::budget::source::BudgetSource;
use crate::calibration::model::{USUAL_LEVEL, USUAL_NORTH, usual_axis_error};
use crate::calibration::parameters::auxiliary::OF_AXES;
use crate::calibration::{Coefficient, ErrorTerm, Model};
use crate::earth::ROTATION_RATE;
use crate::imu::Term;
use crate::turntable::{AxisError, TABLE_GEOMETRY};
use crate::units::DEGREE;

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
    /// Deviation of Earth rate from its value at the stated latitude, by axis: East, North, Up.
    EarthRate(usize),
    /// A constant of the magnetometer or its field, by its index.
    Magnetic(usize),
}

impl Constant {
    /// The source of its prior in the uncertainty budget.
    pub fn source(self) -> BudgetSource {
        match self {
            Self::Parameter(_) => BudgetSource::Prior,
            Self::EarthRate(_) => BudgetSource::EarthRate,
            Self::Magnetic(_) => BudgetSource::Magnetometer,
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

    /// Index among the auxiliary parameters, if the constant is one of them.
    pub fn auxiliary(self) -> Option<usize> {
        match self {
            Self::Base(axis) => Some(axis),
            Self::Axis(index) => Some(OF_AXES + index),
            Self::Term(index) => Some(TABLE_GEOMETRY + index),
            _ => None,
        }
    }

    /// The error term to which the constant belongs, if any.
    pub fn error_term(self) -> Option<ErrorTerm> {
        match self {
            Self::Term(index) => Term::of(index).map(ErrorTerm::Instrument),
            Self::Base(_) => Some(ErrorTerm::TableBase),
            Self::Axis(index) => AxisError::of(index).map(ErrorTerm::TableAxes),
            _ => None,
        }
    }

    /// Prior 1σ of a constant or, if the constant may be absent, its typical magnitude; zero if the constant is off.
    pub fn sigma(self, model: &Model) -> f64 {
        let stated = match self {
            Self::Parameter(index) => model.prior_sigma[index],
            Self::Term(index) => model.term_sigma[index],
            Self::Thermal(of) => {
                let thermal = model.thermal.as_deref();
                thermal.map_or(0.0, |thermal| of.of(&thermal.sigma))
            }
            Self::Gravity => model.gravity_sigma,
            Self::Base(axis) => model.geometry.base[axis],
            Self::Axis(index) => model.geometry.axes[index],
            Self::EarthRate(_) => 0.0,
            Self::Magnetic(index) => model.magnetic.sigma[index],
        };
        if stated > 0.0 {
            return stated;
        }
        match self {
            // A stated latitude is easily wrong by a degree.
            Self::EarthRate(_) if model.may_be_elsewhere => ROTATION_RATE * DEGREE,
            _ => {
                let term = self.error_term();
                let term = term.filter(|term| model.may_have.contains(term));
                term.map_or(0.0, |term| self.usual_size(term, model))
            }
        }
    }

    /// Typical magnitude as a parameter of an error term.
    fn usual_size(self, term: ErrorTerm, model: &Model) -> f64 {
        match (term, self) {
            (ErrorTerm::Instrument(of), _) => of.usual_size(&model.noise),
            (_, Self::Base(2)) => USUAL_NORTH,
            (_, Self::Base(_)) => USUAL_LEVEL,
            (ErrorTerm::TableAxes(kind), Self::Axis(index)) => {
                let usual = usual_axis_error(kind, model.position_sigma);
                kind.of_table(model.table_axes, usual)[index]
            }
            _ => 0.0,
        }
    }
}
