//! States of the filter, which evolve or are reset, and constants, whose effect on the states it propagates, as named
//! groups that depend on the options of a problem. No other file uses indices directly.
//!
//! | states | number | meaning |
//! |---|---|---|
//! | attitude | 3 | φ, `C_computed = (I − [φ×]) C_true`, East-North-Up, rad |
//! | velocity | 3 | δV = computed − true, East-North-Up, m/s |
//! | position | 3 | δp = computed − true, East-North-Up, m |
//! | gravity | 1 | true − stated magnitude of gravity, m/s²; for recordings at several sites, if gravity has a σ |
//! | Earth rate | 3 | true − computed Earth rate along East, North and Up, rad/s; without a table; reset for each stretch with unknown heading |
//! | Gauss–Markov bias | 3 per triad | current deviation of the biases from D, rad/s or m/s²; if the noise figures state one |
//! | recording differences | one per parameter that is not common to all, and 3 for the mounting, rad | difference in this recording, see [`crate::calibration::several::day_to_day::Difference`] |
//! | table position | 3 | τ, error of the current table position, `C_table = (I − [τ×]) C_true`, rad; with a table |
//! | rotation at rest | 3 | increase of φ since the body came to rest, rad; without a table |
//! | initial attitude | 3 | φ at the first sample of the stretch, rad |
//!
//! | constants | number | meaning |
//! |---|---|---|
//! | parameters | up to 24 | δθ = true − estimated, see [`super::parameters`]; those left free by form and body frame |
//! | error terms | one per enabled parameter | true − estimated, see [`crate::imu::Term`] |
//! | temperature | one per enabled coefficient | true − estimated, see [`crate::imu::ThermalModel`] |
//! | gravity | 1 | as above, if all recordings are at one site |
//! | table base | one per enabled axis (East, North, Up) | ε, error of table level and north, `C_table = (I − [ε×]) C_true`, rad; if its σ is stated |
//! | disturbances | 3 each | see [`super::constants::Disturbance`] |
//! | table axes | one per enabled error | tilt, wobble and encoder error of the table axes, see [`crate::turntable::axis_response`], rad |

use crate::calibration::budget::source::BudgetSource;
use crate::calibration::several::day_to_day::OwnState;
use crate::calibration::{Coefficient, Constant, Model, PARAMETERS};
use crate::imu::{PARAMETERS as PER_TRIAD, Sensor, TERM_PARAMETERS};
use crate::run::Aiding;
use crate::turntable::AXIS_ERRORS;

/// Attitude error φ.
pub const ATTITUDE: usize = 0;
/// Velocity error δV.
pub const VELOCITY: usize = 3;
/// Position error δp.
pub const POSITION: usize = 6;
/// Number of navigation states.
pub const NAVIGATION: usize = 9;

/// Index of each group of states, and the list of constants.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Error of gravity, if it is a state.
    pub gravity: Option<usize>,
    /// Earth rate, if it is a state.
    pub earth_rate: Option<usize>,
    /// State, triad and index of the constant part among the triad's parameters of each varying bias.
    pub varying_biases: Vec<(usize, Sensor, usize)>,
    /// State of each quantity that differs between recordings.
    pub own: Vec<(usize, OwnState)>,
    /// Error of the table position, if it is a state.
    pub table_position: Option<usize>,
    /// Increase of the attitude error since the body came to rest, if it is a state.
    pub turn_at_rest: Option<usize>,
    /// Attitude error at the first sample of the stretch.
    pub initial_attitude: usize,
    /// Source of each state: its prior, or the noise that resets it.
    pub sources: Vec<BudgetSource>,
    /// The constants, in the order of their columns.
    pub constants: Vec<Constant>,
}

impl Layout {
    /// Layout of a model, for recordings with one common gravity (`one_gravity`) or several.
    pub fn new(model: &Model, one_gravity: bool) -> Self {
        let mut sources = vec![BudgetSource::InitialAttitude; VELOCITY];
        sources.resize(NAVIGATION, BudgetSource::Place);
        let mut added = |count: usize, source: BudgetSource| {
            let first = sources.len();
            sources.resize(first + count, source);
            first
        };
        let (gravity, by_hand) = (model.gravity_sigma > 0.0, model.aiding == Aiding::Velocity);
        let varies = |sensor: &Sensor| model.noise.get(*sensor).gauss_markov.is_some();
        let triads = Sensor::ALL.into_iter().filter(varies);
        let biases = triads.flat_map(|of| (PER_TRIAD - 3..PER_TRIAD).map(move |k| (of, k)));
        let estimated = (0..PARAMETERS).filter(|&i| model.prior_sigma[i] > 0.0);
        let own = estimated.map(OwnState::Parameter);
        let own = own.chain((0..3).map(OwnState::Mounting));
        let own = own.filter(|&own| model.day_to_day.of(own) > 0.0);
        Self {
            gravity: (gravity && !one_gravity).then(|| added(1, BudgetSource::Gravity)),
            earth_rate: by_hand.then(|| added(3, BudgetSource::Headings)),
            varying_biases: biases
                .map(|(sensor, k)| (added(1, BudgetSource::Wander(sensor)), sensor, k))
                .collect(),
            own: own
                .map(|own| (added(1, BudgetSource::Recording), own))
                .collect(),
            table_position: (model.position_sigma > 0.0)
                .then(|| added(3, BudgetSource::TablePosition)),
            turn_at_rest: by_hand.then(|| added(3, BudgetSource::RotationAtRest)),
            initial_attitude: added(3, BudgetSource::InitialAttitude),
            constants: constants(model, gravity && one_gravity),
            sources,
        }
    }

    /// The parameters of the error terms among the constants.
    pub fn terms(&self) -> impl Iterator<Item = usize> + '_ {
        self.constants.iter().filter_map(|constant| match constant {
            Constant::Term(index) => Some(*index),
            _ => None,
        })
    }
}

/// The constants of a model, including gravity if it is a constant.
pub fn constants(model: &Model, gravity: bool) -> Vec<Constant> {
    let parameters = (0..PARAMETERS).filter(|&i| model.prior_sigma[i] > 0.0);
    let terms = (0..TERM_PARAMETERS).filter(|&k| model.term_sigma[k] > 0.0);
    let thermal = Coefficient::all(model.form, model.thermal.as_deref()).into_iter();
    let base = (0..3).filter(|&axis| model.geometry.base[axis] > 0.0);
    let axes = (0..AXIS_ERRORS).filter(|&k| model.geometry.axes[k] > 0.0);
    let disturbances = model.disturbances.iter();
    let disturbances =
        disturbances.flat_map(|&of| (0..3).map(move |k| Constant::Disturbance(of, k)));
    parameters
        .map(Constant::Parameter)
        .chain(terms.map(Constant::Term))
        .chain(thermal.map(Constant::Thermal))
        .chain(gravity.then_some(Constant::Gravity))
        .chain(base.map(Constant::Base))
        .chain(axes.map(Constant::Axis))
        .chain(disturbances)
        .collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::calibration::{ErrorTerm, Options};
    use crate::imu::Term;
    use crate::run::Run;
    use crate::simulation::Scenario;

    #[test]
    fn what_is_off_is_neither_state_nor_constant() {
        let run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let sizes = |run: &Run, options: Options| {
            let layout = Layout::new(&Model::new(run, &options), true);
            (layout.sources.len(), layout.constants.len())
        };
        let with = |term| sizes(&run, Options::default().with(term));
        assert_eq!(sizes(&run, Options::default()), (9 + 3 + 3, 24));
        assert_eq!(with(ErrorTerm::Instrument(Term::TimeOffset)), (15, 25));
        assert_eq!(with(ErrorTerm::Instrument(Term::SizeEffect)), (15, 30));
        assert_eq!(with(ErrorTerm::GaussMarkovBias), (21, 24));
        assert_eq!(with(ErrorTerm::TableBase), (15, 27));
        let mut level = run.clone();
        level.table.geometry.base = Vector3::new(1e-5, 1e-5, 0.0);
        assert_eq!(sizes(&level, Options::default()), (15, 26));
        // Three parameters fix the body frame.
        let velocity = Options::default().aiding(Aiding::Velocity);
        assert_eq!(sizes(&run, velocity), (9 + 3 + 3 + 3, 21));
    }
}
