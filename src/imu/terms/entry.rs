//! Description of an error term: its names, units and effect.

use nalgebra::{RowVector3, Vector3};

use crate::imu::Sensor;
use crate::units::DEGREE;

/// Reference rate of the gyros' nonlinearity, 100 °/s, in rad/s.
pub const REFERENCE_RATE: f64 = 100.0 * DEGREE;

/// Motion of the body in a sample, along body axes.
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

/// Names, units and effect of an error term.
pub struct TermEntry {
    /// Name in files and commands.
    pub name: &'static str,
    /// Title in tables of reports.
    pub title: &'static str,
    /// Description in the help of commands.
    pub help: &'static str,
    /// Formula of the term: the quantity that a parameter q adds to specific force f or angular rate w.
    pub adds: &'static str,
    /// Moves or dwells that show the term, if a path does not.
    pub shown_by: &'static str,
    /// The triad whose input the term changes.
    pub sensor: Sensor,
    /// Unit of the parameters in files and reports: its symbol, and its value in SI units.
    pub unit: (&'static str, f64),
    /// SI unit of the parameters.
    pub si_unit: &'static str,
    /// SI unit in D-SI spelling.
    pub d_si_unit: &'static str,
    /// Default 1σ of each parameter, in `unit`: ten
    /// times the value of precise instruments.
    pub usual_sigma: f64,
    /// Largest possible parameter, in SI units. The effect of this parameter equals gravity, or a rate of
    /// [`REFERENCE_RATE`] (larger than in any real instrument).
    pub largest: f64,
    /// Names of the term's parameters in files: the common prefix and the suffixes.
    pub parameters: (&'static str, &'static [&'static str]),
    /// `∂t/∂q` with a column for each parameter, where t(q) is added to the input of the triad, rad/s or m/s².
    pub response: fn(&Sensed, &[f64], &mut Columns),
    /// `t(q)` itself, if t is not linear in the parameters.
    pub added: Option<Added>,
}

/// The quantity that a term with these parameters adds to the input of its triad, rad/s or m/s².
pub type Added = fn(&Sensed, &[f64]) -> Vector3<f64>;

/// The columns of a term in a [`super::TermResponse`].
pub type Columns<'a> = nalgebra::MatrixViewMut3xX<'a, f64>;

/// Fills the columns of a term that has three parameters per axis, each acting on its own axis only.
pub fn set_rows(columns: &mut Columns, row: impl Fn(usize) -> RowVector3<f64>) {
    for axis in 0..columns.ncols() / 3 {
        let mut own = columns.fixed_view_mut::<1, 3>(axis, 3 * axis);
        own.copy_from(&row(axis));
    }
}

/// Suffixes of names, for terms with one parameter per axis.
pub const PER_AXIS: [&str; 3] = [".x", ".y", ".z"];
