//! Calibration: closed form, coarse start, filter and Gauss–Newton iterations, and what can be said of a
//! result.
//!
//! A [`Problem`] takes runs and [`Options`]; [`estimate`] and [`six_position`] solve it; [`bound`] says what
//! could be had. Nothing here prints, reads files or draws.

mod alone;
mod at_rest;
mod at_temperature;
mod attempt;
mod auxiliary;
mod batch;
mod bound;
mod budget;
mod closed_form;
mod coarse;
mod comparison;
mod correction;
mod curvature;
mod day_to_day;
mod drift;
mod dwell_scatter;
mod error;
mod error_term;
mod error_term_test;
mod estimate;
mod finding;
mod form;
pub(crate) mod frame;
mod gauss_newton;
mod group;
mod innovation;
mod iterations;
mod layout;
mod linearisation;
pub(crate) mod model;
mod mounting;
mod nees;
mod noise;
mod observability;
mod options;
mod outcome;
mod parameters;
mod pass;
mod prior_cause;
mod prior_distance;
mod problem;
mod quality;
mod record;
mod residuals;
mod rest_scatter;
pub mod result;
mod rounding;
mod scatter;
mod schedule;
mod solution;
mod standstill;
mod thermal;
mod thermal_record;
mod together;
mod unexplained;

pub use alone::Alone;
pub use at_rest::{AtRest, AxisAtRest, Second};
pub use at_temperature::TemperatureError;
pub use attempt::Progress;
pub use auxiliary::{
    AUXILIARY, Auxiliary, AuxiliaryKind, AuxiliaryVector, auxiliary_name, auxiliary_vector,
};
pub use batch::batch_estimate;
pub use bound::{Bound, bound, thermal_bound};
pub use budget::{Budget, BudgetPart, BudgetPartRecord, BudgetRecord, BudgetSource, LeftOffRecord};
pub use closed_form::{
    ClosedForm, Position, Reference, six_position, six_position_of, six_position_triad,
};
pub use coarse::{CoarseStart, coarse_start};
pub use comparison::{Comparison, Named, Side, compare};
pub use correction::{Calibrated, Correction, CorrectionError};
pub use day_to_day::{DayToDay, Difference};
pub use dwell_scatter::DwellScatter;
pub use error::{CalibrationError, ComparisonError};
pub use error_term::ErrorTerm;
pub use error_term_test::{ErrorTermTest, LeftOff, Role, test_error_terms};
pub use estimate::Estimate;
pub use finding::{Finding, RecordingDifference};
pub use form::FormTest;
pub use frame::{Canonical, in_body_frame};
pub use gauss_newton::estimate;
pub use group::Group;
pub use innovation::{
    Consistency, Inconsistency, Innovation, Look, Nis, Observation, mean_square_interval,
};
pub use linearisation::{AttitudePrior, Linearisation};
pub use model::Model;
pub use mounting::Mounting;
pub use nees::{Nees, nees};
pub use noise::{NoisePolicy, NoiseReport, NoiseTest, Source, SourceFigures};
pub use observability::{AttitudePart, Direction, Observability, Part};
pub use options::Options;
pub use outcome::{Outcome, Pass};
pub use parameters::{
    OBSERVED_BELOW, PARAMETERS, ParameterMatrix, ParameterVector, from_vector, in_general_form,
    parameter, parameter_name, sensor_and_parameter, to_vector,
};
pub use pass::{Epoch, Own};
pub use prior_cause::PriorCause;
pub use problem::Problem;
pub use quality::{Measures, Quality, Spread};
pub use record::truth_record;
pub use result::{Calibration, Method, triads_of};
pub use scatter::{ChiSquare, ParameterScatter, Scatter};
pub use solution::{Assessment, Solution};
pub use thermal::{Coefficient, Thermal};
pub use thermal_record::{
    CoefficientRecord, RangeRecord, RecordingRecord, TOLERANCE as TEMPERATURE_TOLERANCE,
    ThermalRecord, ValueRecord,
};
pub use together::{Repeatability, TemperatureOptions, Together};
