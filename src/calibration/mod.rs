//! Calibration: closed form, coarse start, filter and Gauss–Newton iterations, and the checks of a result.
//!
//! A [`Problem`] takes runs and [`Options`]; [`estimate`] and [`six_position`] solve it; [`bound`] gives the Cramér–Rao
//! bound. This module does not print, read files or draw.

#[cfg(test)]
mod chain;
mod checks;
mod constants;
mod filter;
mod record;
mod reduction;
mod several;
mod start;

mod bound;
mod budget;
mod error;
mod estimate;
mod estimator;
mod gauss_newton;
mod layout;
mod linearisation;
pub mod model;
mod noise;
mod options;
mod outcome;
mod parameters;
mod pass;
mod problem;
pub mod result;
mod solution;
mod solved;

// Most files of this module import their common types from here.
pub use bound::{Bound, TermLeftOff, bound, bound_with_parts, terms_left_off};
pub use budget::{Budget, BudgetPart, BudgetPartRecord, BudgetRecord, BudgetSource, LeftOffRecord};
pub use checks::cause::{Cause, FoundCause};
pub use checks::dwell_scatter::DwellScatter;
pub use checks::error_term_test::{ErrorTermTest, Role, UnmodelledEffect, test_error_terms};
pub use checks::finding::Finding;
pub use checks::finding::kind::{Kind as FindingKind, Level};
pub use checks::finding::verdict::{Verdict, Word};
pub use checks::form::FormTest;
pub use checks::innovation::{Consistency, Innovation, Nis, Observation, mean_square_interval};
pub use checks::observability::{Direction, Observability};
pub use checks::quality::{DwellResidual, Measures, Quality, Spread};
pub use checks::recordings::RecordingDifference;
use constants::{Constant, Known, Posterior, Prior};
pub use constants::{Disturbance, DisturbanceKind};
pub use error::{CalibrationError, ComparisonError};
pub use estimate::Estimate;
pub use estimator::estimate;
pub use gauss_newton::Pass;
use gauss_newton::{Iterated, iterate};
pub use gauss_newton::{Progress, UNWATCHED};
use layout::{ATTITUDE, Layout, NAVIGATION, POSITION, VELOCITY};
pub use linearisation::{AttitudePrior, Linearisation};
pub use model::Model;
pub use noise::{NoisePolicy, NoiseReport, NoiseTest, Source, SourceFigures};
pub use options::Options;
pub use outcome::Outcome;
pub use parameters::auxiliary::{
    AUXILIARY, Auxiliary, AuxiliaryKind, AuxiliaryVector, auxiliary_name, auxiliary_vector,
};
pub use parameters::error_term::ErrorTerm;
pub use parameters::group::Group;
pub use parameters::{
    OBSERVED_BELOW, PARAMETERS, ParameterMatrix, ParameterVector, from_vector, in_general_form,
    parameter, parameter_index, parameter_name, sensor_and_parameter, stacked, to_vector,
};
use pass::{Gate, PassResult, pass};
pub use problem::Problem;
use problem::Stretch;
pub use reduction::{Epoch, Own};
use reduction::{Reduction, Script};
pub use result::at_temperature::TemperatureError;
pub use result::correction::{Calibrated, Correction, CorrectionError};
pub use result::frame::{Canonical, Named, in_body_frame};
pub use result::nees::{Nees, nees};
pub use result::record::truth_record;
pub use result::thermal_record::{
    CoefficientRecord, RecordingRecord, TOLERANCE as TEMPERATURE_TOLERANCE, ThermalRecord,
    ValueRecord,
};
pub use result::{Calibration, Method, triads_of};
pub use several::at_rest::{AtRest, MeanAtRest};
pub use several::day_to_day::{DayToDay, Difference};
pub use several::thermal::{Coefficient, Thermal};
pub use several::{Repeatability, TemperatureOptions, Together};
pub use solution::{Assessment, Solution};
pub use solved::SeparateEstimate;
use solved::Solved;
pub use start::closed_form::{ClosedForm, Reference, six_position, six_position_of};
pub use start::coarse::{CoarseStart, coarse_start};
pub use start::mounting::orders_of_gyros;
pub use start::mounting::{Contradiction, Mounting, Sensitivity};
pub use start::positions::{Position, six_position_triad};
