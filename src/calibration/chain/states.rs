//! The states of the chain.

use crate::calibration::several::day_to_day::OwnState;
use crate::calibration::{Model, PARAMETERS};
use crate::imu::{PerSensor, Sensor};
use crate::run::Aiding;

/// Attitude error φ, `C_computed = (I − [φ×]) C_true`, East-North-Up, rad.
pub const ATTITUDE: usize = 0;
/// Velocity error δV = computed − true, East-North-Up, m/s.
pub const VELOCITY: usize = 3;
/// Position error δp = computed − true, East-North-Up, m.
pub const POSITION: usize = 6;
/// Number of navigation states.
pub const NAVIGATION: usize = 9;

/// Index of each group of states. States that change within a dwell come first: navigation errors, then the rotation at
/// rest.
#[derive(Debug, Clone, PartialEq)]
pub struct States {
    /// Number of states that change within a dwell.
    pub moving: usize,
    /// Error of the table position; `None` without a table.
    pub table: Option<usize>,
    /// Slip of the instrument on the table, about body axes, and of the table on the ground, about East, North and Up;
    /// `None` without a table.
    pub slips: Option<[usize; 2]>,
    /// Deviation of the biases of each triad from their mean.
    pub biases: PerSensor<usize>,
    /// Error of Earth rate; `None` with a table.
    pub earth_rate: Option<usize>,
    /// Gravity error; `None` unless there are several sites.
    pub gravity: Option<usize>,
    /// Disturbance of the magnetic field in a dwell, with a magnetometer.
    pub magnetic: Option<usize>,
    /// State of each quantity that differs between recordings.
    pub own: Vec<(usize, OwnState)>,
    /// Total number of states.
    pub count: usize,
}

impl States {
    /// States of a model, for recordings with one common gravity or several.
    pub fn new(model: &Model, one_gravity: bool) -> Self {
        let by_hand = model.aiding == Aiding::Velocity;
        let mut count = NAVIGATION + if by_hand { 3 } else { 0 };
        let moving = count;
        let mut added = |size: usize| {
            count += size;
            count - size
        };
        let estimated = (0..PARAMETERS).filter(|&i| model.prior_sigma[i] > 0.0);
        let own = estimated.map(OwnState::Parameter);
        let own = own.chain((0..3).map(OwnState::Mounting));
        let own = own.filter(|&own| model.day_to_day.of(own) > 0.0);
        let table = (!by_hand).then(|| added(3));
        let slips = (!by_hand).then(|| [added(3), added(3)]);
        let biases = PerSensor::from_fn(|_: Sensor| added(3));
        let earth_rate = by_hand.then(|| added(3));
        let gravity = (model.gravity_sigma > 0.0 && !one_gravity).then(|| added(1));
        let magnetic = model.magnetic.is_on().then(|| added(3));
        let own = own.map(|own| (added(1), own)).collect();
        Self {
            moving,
            table,
            slips,
            biases,
            earth_rate,
            gravity,
            magnetic,
            own,
            count,
        }
    }

    /// Index of the rotation at rest; `None` with a table.
    pub fn turn(&self) -> Option<usize> {
        (self.moving > NAVIGATION).then_some(NAVIGATION)
    }
}
