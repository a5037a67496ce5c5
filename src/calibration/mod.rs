//! Calibration: closed form, coarse start, chain of dwells with the sizes of all effects, and the checks of a result.
//!
//! A [`Problem`] is made from runs and [`Options`]; [`estimate`] and [`six_position`] solve it; [`bound`] gives the
//! Cramér–Rao bound. This module does not print, read files or draw.

mod chain;
mod checks;
mod constants;
mod record;
mod several;
mod sizes;
mod start;

mod bound;
mod budget;
mod error;
mod estimate;
mod estimator;
mod iterations;
mod leg;
mod linearisation;
mod magnetometer;
pub mod model;
mod noise;
mod options;
mod outcome;
mod parameters;
mod passes;
mod problem;
pub mod result;
mod solution;

// Most files of this module import their common types from here.
pub use bound::{Bound, TermLeftOff, bound, bound_without_moves, terms_left_off};
pub use budget::{
    Budget, BudgetPart, BudgetPartRecord, BudgetRecord, BudgetSource, coverage_factor,
};
pub use chain::Slip;
pub use checks::event::{Event, EventKind};
pub use checks::finding::Finding;
pub use checks::finding::kind::{Kind as FindingKind, Level};
pub use checks::finding::verdict::{Verdict, Word};
pub use checks::form::FormTest;
pub use checks::innovation::{Consistency, Innovation, Nis, Observation, mean_square_interval};
pub use checks::observability::{Direction, Observability};
pub use checks::quality::{DwellResidual, Measures, Quality, Spread};
pub use checks::recordings::RecordingDifference;
pub use checks::term::TermEvidence;
use constants::{Candidate, Constant, Known, Posterior, Prior, of_parameters};
pub use error::{CalibrationError, ComparisonError};
pub use estimate::{Epoch, Estimate};
pub use estimator::estimate;
pub use leg::{Journey, Leg, Terms};
pub use linearisation::{AttitudePrior, Linearisation};
pub use magnetometer::{Ellipsoid, MagneticEstimate, MagneticMatrix, MagneticPrior, ellipsoid};
pub use model::Model;
pub use noise::{NoisePolicy, NoiseReport, NoiseTest, Source, SourceFigures};
pub use options::Options;
pub use outcome::{Outcome, Own};
pub use parameters::auxiliary::{
    AUXILIARY, Auxiliary, AuxiliaryKind, AuxiliaryVector, auxiliary_name, auxiliary_vector,
};
pub use parameters::error_term::ErrorTerm;
pub use parameters::group::Group;
pub use parameters::{
    OBSERVED_BELOW, PARAMETERS, ParameterMatrix, ParameterVector, from_vector, in_general_form,
    parameter, parameter_index, parameter_name, sensor_and_parameter, stacked, to_vector,
};
pub use passes::{Pass, Progress, UNWATCHED};
pub use problem::Problem;
use problem::Stretch;
use record::Script;
pub use result::at_temperature::TemperatureError;
pub use result::correction::{Calibrated, Correction, CorrectionError};
pub use result::frame::{Canonical, Named, in_body_frame};
pub use result::magnetic::{EllipsoidRecord, FieldRecord, MagRecord, MagSigma};
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
pub use several::{Repeatability, SeparateEstimate, TemperatureOptions, Together};
pub use solution::{Assessment, Solution};
pub use start::closed_form::{ClosedForm, Reference, six_position, six_position_of};
pub use start::coarse::{CoarseStart, coarse_start};
pub use start::mounting::orders_of_gyros;
pub use start::mounting::{Contradiction, Mounting, Sensitivity};
pub use start::positions::{Position, six_position_triad};
