//! How a term is called, and what it does.

use nalgebra::{RowVector3, Vector3};

use crate::imu::Sensor;
use crate::units::DEGREE;

/// Rate at which nonlinearity of the gyros is stated, 100 °/s, in rad/s.
pub const REFERENCE_RATE: f64 = 100.0 * DEGREE;

/// How a body moves in a sample, along body axes.
#[derive(Debug, Clone, Copy)]
pub struct Sensed {
    /// Angular rate against inertial space, rad/s.
    pub rate: Vector3<f64>,
    /// Angular rate against the Earth, rad/s.
    pub rate_over_earth: Vector3<f64>,
    /// Angular acceleration, rad/s².
    pub angular_acceleration: Vector3<f64>,
    /// Specific force, m/s².
    pub force: Vector3<f64>,
}

/// How a term is called, and what it does.
pub struct TermEntry {
    /// The name that files and commands use.
    pub name: &'static str,
    /// In tables of reports.
    pub title: &'static str,
    /// In the help of commands.
    pub help: &'static str,
    /// What a parameter q adds to specific force f or angular rate w.
    pub adds: &'static str,
    /// Whose input it changes.
    pub sensor: Sensor,
    /// The unit of its parameters in files and reports: its symbol, and its value in SI.
    pub unit: (&'static str, f64),
    /// Their SI unit.
    pub si_unit: &'static str,
    /// The same as D-SI spells it.
    pub d_si_unit: &'static str,
    /// 1σ of each parameter where nothing better is known, in `unit`: ten
    /// times what precise instruments have.
    pub usual_sigma: f64,
    /// A parameter beyond this makes of gravity, or of a turn at [`REFERENCE_RATE`], as much again, as no
    /// instrument does, in SI.
    pub largest: f64,
    /// The names of its parameters in files: what all begin with, and how each ends.
    pub parameters: (&'static str, &'static [&'static str]),
    /// `∂t/∂q`, t(q) being what it adds to the input of its triad in rad/s or m/s²: a column for each parameter.
    pub response: fn(&Sensed, &[f64], &mut Columns),
    /// `t(q)` itself, where that is not in proportion to its parameters.
    pub added: Option<Added>,
}

/// What a term adds to the input of its triad at these parameters, rad/s or m/s².
pub type Added = fn(&Sensed, &[f64]) -> Vector3<f64>;

/// The columns of a term in a [`super::TermResponse`].
pub type Columns<'a> = nalgebra::MatrixViewMut3xX<'a, f64>;

/// Fills the columns of a term that has three parameters on each axis, which act on no other.
pub fn set_rows(columns: &mut Columns, row: impl Fn(usize) -> RowVector3<f64>) {
    for axis in 0..columns.ncols() / 3 {
        let mut own = columns.fixed_view_mut::<1, 3>(axis, 3 * axis);
        own.copy_from(&row(axis));
    }
}

/// Ends of the names of one parameter per axis.
pub const PER_AXIS: [&str; 3] = [".x", ".y", ".z"];
