//! The state vector of the filter: named groups, made from what a problem has on. No other file knows an
//! index.
//!
//! | group | states | meaning |
//! |---|---|---|
//! | attitude | 3 | φ, `C_computed = (I − [φ×]) C_true`, East-North-Up, rad |
//! | velocity | 3 | δV = computed − true, East-North-Up, m/s |
//! | position | 3 | δp = computed − true, East-North-Up, m |
//! | parameters | up to 24 | δθ = true − estimated, see [`super::parameters`]; those that form and body frame leave free |
//! | error terms | one for each parameter that is on | true − estimated, see [`crate::imu::Term`] |
//! | temperature | one for each coefficient that is on | true − estimated, see [`crate::imu::ThermalModel`] |
//! | gravity | 1 | true − stated magnitude of gravity, m/s²; where it has a σ |
//! | Gauss–Markov bias | 3 a triad | what its biases are off D now, rad/s or m/s²; where noise figures state one |
//! | of the recording | one for each parameter that is not common to all, and 3 of its mounting, rad | by how much it differs in this recording, see [`crate::calibration::several::day_to_day::Difference`] |
//! | table position | 3 | τ, error of the current table position, `C_table = (I − [τ×]) C_true`, rad; with a table |
//! | turn at rest | 3 | what φ has become more since the body came to rest, rad; without a table |
//! | initial attitude | 3 | φ at the first sample of the stretch, kept as constants, rad |
//! | table base | one for each of East, North, Up that is on | ε, error of the table's level and north, `C_table = (I − [ε×]) C_true`, rad; where a σ of it is stated |
//! | table axes | one for each error that is on | tilt, wobble and encoder error of the table's axes, see [`crate::turntable::axis_response`], rad |

use super::budget::source::BudgetSource;
use super::model::Model;
use super::parameters::PARAMETERS;
use super::parameters::auxiliary::OF_AXES;
use super::parameters::error_term::ErrorTerm;
use crate::calibration::several::day_to_day::OwnState;
use crate::calibration::several::thermal::Coefficient;
use crate::imu::{PARAMETERS as PER_TRIAD, Sensor, TERM_PARAMETERS, Term};
use crate::run::Aiding;
use crate::turntable::{AXIS_ERRORS, AxisError, TABLE_GEOMETRY};

/// Attitude error φ.
pub const ATTITUDE: usize = 0;
/// Velocity error δV.
pub const VELOCITY: usize = 3;
/// Position error δp.
pub const POSITION: usize = 6;
/// Number of navigation states, the only ones that move with the body.
pub const NAVIGATION: usize = 9;

impl Constant {
    /// What is known of it before.
    pub fn source(self) -> BudgetSource {
        match self {
            Self::Parameter(_) => BudgetSource::Prior,
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
            Self::Parameter(_) | Self::Thermal(_) | Self::Gravity => None,
        }
    }

    /// The error term that it is of, if it is of one.
    pub fn error_term(self) -> Option<ErrorTerm> {
        match self {
            Self::Term(index) => Term::of(index).map(ErrorTerm::Instrument),
            Self::Base(_) => Some(ErrorTerm::TableBase),
            Self::Axis(index) => AxisError::of(index).map(ErrorTerm::TableAxes),
            Self::Parameter(_) | Self::Thermal(_) | Self::Gravity => None,
        }
    }
}

/// Where each group of states is.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// The parameter of both triads that each state from [`NAVIGATION`] on is.
    parameters: Vec<usize>,
    /// The parameter of the error terms that each of the states after them is.
    terms: Vec<usize>,
    /// Whether gravity's error is a state.
    gravity: bool,
    thermal: Vec<Coefficient>,
    /// Triad and axis of each bias that varies.
    varying: Vec<(Sensor, usize)>,
    /// What each state of the recording is.
    own: Vec<OwnState>,
    /// Whether the table's position error is a state.
    table: bool,
    /// Whether the turn at rest is.
    turn: bool,
    /// The axis of East-North-Up about which each error of the table's base is.
    base: Vec<usize>,
    /// The error of the table's axes that each state is.
    axes: Vec<usize>,
    /// Constants that are no states: the filter carries what they do to it.
    columns: Vec<Constant>,
}

/// What is the same throughout a recording.
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
}

impl Layout {
    pub fn new(model: &Model) -> Self {
        let varies = |sensor: &Sensor| model.noise.get(*sensor).gauss_markov.is_some();
        let triads = Sensor::ALL.into_iter().filter(varies);
        Self {
            parameters: (0..PARAMETERS)
                .filter(|&i| model.prior_sigma[i] > 0.0)
                .collect(),
            terms: (0..TERM_PARAMETERS)
                .filter(|&k| model.term_sigma[k] > 0.0)
                .collect(),
            thermal: Coefficient::all(model.form, model.thermal.as_deref()),
            gravity: model.gravity_sigma > 0.0,
            varying: triads
                .flat_map(|sensor| (0..3).map(move |axis| (sensor, axis)))
                .collect(),
            own: (0..PARAMETERS)
                .filter(|&i| model.prior_sigma[i] > 0.0)
                .map(OwnState::Parameter)
                .chain((0..3).map(OwnState::Mounting))
                .filter(|&own| model.day_to_day.of(own) > 0.0)
                .collect(),
            table: model.position_sigma > 0.0,
            turn: model.aiding == Aiding::Velocity,
            base: (0..3)
                .filter(|&axis| model.geometry.base[axis] > 0.0)
                .collect(),
            axes: (0..AXIS_ERRORS)
                .filter(|&k| model.geometry.axes[k] > 0.0)
                .collect(),
            columns: Vec::new(),
        }
    }

    /// The same with all constants as columns: the filter is left with what moves and what is drawn anew, as gravity is
    /// at another site unless there is one of it.
    pub fn reduced(self, one_gravity: bool) -> Self {
        let driving = self.driving();
        let driving = driving.filter(|&of| one_gravity || of != Constant::Gravity);
        let base = self.base.iter().map(|&axis| Constant::Base(axis));
        let axes = self.axes.iter().map(|&k| Constant::Axis(k));
        Self {
            columns: driving.chain(base).chain(axes).collect(),
            parameters: Vec::new(),
            terms: Vec::new(),
            thermal: Vec::new(),
            gravity: self.gravity && !one_gravity,
            base: Vec::new(),
            axes: Vec::new(),
            ..self
        }
    }

    /// The constants that are states and drive navigation errors, in their order.
    pub fn driving(&self) -> impl Iterator<Item = Constant> + '_ {
        let parameters = self
            .parameters
            .iter()
            .map(|&index| Constant::Parameter(index));
        let terms = self.terms.iter().map(|&index| Constant::Term(index));
        let thermal = self.thermal.iter().map(|&of| Constant::Thermal(of));
        let gravity = self.gravity.then_some(Constant::Gravity);
        parameters.chain(terms).chain(thermal).chain(gravity)
    }

    /// Constants that are no states.
    pub fn columns(&self) -> &[Constant] {
        &self.columns
    }

    /// The parameters of the error terms that are states or columns.
    pub fn terms_on(&self) -> impl Iterator<Item = usize> + '_ {
        let columns = self.columns.iter().filter_map(|column| match column {
            Constant::Term(index) => Some(*index),
            _ => None,
        });
        self.terms.iter().copied().chain(columns)
    }

    /// Number of states.
    pub fn size(&self) -> usize {
        self.axes_begin() + self.axes.len()
    }

    /// State and index among [`PARAMETERS`] of each estimated parameter.
    pub fn parameters(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        placed(NAVIGATION, &self.parameters)
    }

    /// State and index among [`TERM_PARAMETERS`] of each parameter of the error terms that are on.
    pub fn terms(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        placed(self.terms_begin(), &self.terms)
    }

    /// State of each coefficient of temperature that is on.
    pub fn thermal(&self) -> impl Iterator<Item = (usize, Coefficient)> + '_ {
        placed(self.thermal_begin(), &self.thermal)
    }

    /// State of each thing that is not common to all recordings.
    pub fn own(&self) -> impl Iterator<Item = (usize, OwnState)> + '_ {
        placed(self.own_begin(), &self.own)
    }

    /// Error of gravity, if it is a state.
    pub fn gravity(&self) -> Option<usize> {
        self.gravity.then(|| self.gravity_begin())
    }

    /// State, triad and index of the constant part among the triad's parameters of each varying bias.
    pub fn varying_biases(&self) -> impl Iterator<Item = (usize, Sensor, usize)> + '_ {
        let states = placed(self.varying_begin(), &self.varying);
        states.map(|(state, (sensor, axis))| (state, sensor, PER_TRIAD - 3 + axis))
    }

    /// The states that are the same constants throughout a recording.
    pub fn constants(&self) -> impl Iterator<Item = usize> + use<> {
        (NAVIGATION..self.varying_begin()).chain(self.base_begin()..self.size())
    }

    /// Error of the table's position, if it is a state.
    pub fn table_position(&self) -> Option<usize> {
        self.table.then(|| self.dwell_begin())
    }

    /// What the attitude error has become more since the body came to rest, if it is a state.
    pub fn turn_at_rest(&self) -> Option<usize> {
        self.turn.then(|| self.dwell_begin())
    }

    /// Attitude error at the first sample of the stretch.
    pub fn initial_attitude(&self) -> usize {
        self.dwell_begin() + 3 * usize::from(self.table || self.turn)
    }

    /// State and axis of each error of the table's base.
    pub fn table_base(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        placed(self.base_begin(), &self.base)
    }

    /// State and index among [`AXIS_ERRORS`] of each error of the table's axes.
    pub fn table_axes(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        placed(self.axes_begin(), &self.axes)
    }

    /// What draws anew a state that is no constant, or is known of it before.
    pub fn source(&self, state: usize) -> BudgetSource {
        let within =
            |first: Option<usize>| first.is_some_and(|first| (first..first + 3).contains(&state));
        let mut varying = self.varying_biases();
        if let Some((_, sensor, _)) = varying.find(|&(varying, ..)| varying == state) {
            return BudgetSource::wander(sensor);
        }
        match state {
            VELOCITY..NAVIGATION => BudgetSource::Place,
            _ if within(self.table_position()) => BudgetSource::TablePosition,
            _ if within(self.turn_at_rest()) => BudgetSource::RotationAtRest,
            _ if self.gravity() == Some(state) => BudgetSource::Gravity,
            _ if self.own().any(|(own, _)| own == state) => BudgetSource::Recording,
            _ => BudgetSource::InitialAttitude,
        }
    }

    fn terms_begin(&self) -> usize {
        NAVIGATION + self.parameters.len()
    }

    fn thermal_begin(&self) -> usize {
        self.terms_begin() + self.terms.len()
    }

    fn gravity_begin(&self) -> usize {
        self.thermal_begin() + self.thermal.len()
    }

    fn varying_begin(&self) -> usize {
        self.gravity_begin() + usize::from(self.gravity)
    }

    fn own_begin(&self) -> usize {
        self.varying_begin() + self.varying.len()
    }

    fn dwell_begin(&self) -> usize {
        self.own_begin() + self.own.len()
    }

    fn base_begin(&self) -> usize {
        self.initial_attitude() + 3
    }

    fn axes_begin(&self) -> usize {
        self.base_begin() + self.base.len()
    }
}

fn placed<T: Copy>(begin: usize, members: &[T]) -> impl Iterator<Item = (usize, T)> + '_ {
    (begin..).zip(members.iter().copied())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::calibration::{ErrorTerm, Options};
    use crate::imu::Term;
    use crate::simulation::Scenario;

    #[test]
    fn what_is_off_has_no_state() {
        let run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let size = |options: Options| Layout::new(&Model::new(&run, &options)).size();
        let plain = size(Options::default());
        assert_eq!(plain, 9 + 24 + 3 + 3);
        let with = |term| size(Options::default().with(term)) - plain;
        assert_eq!(with(ErrorTerm::Instrument(Term::TimeOffset)), 1);
        assert_eq!(with(ErrorTerm::Instrument(Term::SizeEffect)), 6);
        assert_eq!(with(ErrorTerm::GaussMarkovBias), 6);
        assert_eq!(with(ErrorTerm::TableBase), 3);
        let mut level = run.clone();
        level.table.geometry.base = Vector3::new(1e-5, 1e-5, 0.0);
        let level = Layout::new(&Model::new(&level, &Options::default()));
        assert_eq!(level.size(), plain + 2);
        // Three parameters fix the body frame.
        let velocity = size(Options::default().aiding(Aiding::Velocity));
        assert_eq!(velocity, 9 + 21 + 3 + 3);
    }
}
