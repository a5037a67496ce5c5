//! A turntable, its path, and its attitude at any time.
//!
//! `C_b_n = C_base R(axis₁, a₁) R(axis₂, a₂) … C_mount`, axes from the outermost to the innermost. The errors of a
//! turntable are of two kinds. Errors that the table does not know (level, north, non-orthogonality, wobble, encoder
//! errors that repeat with angle) change the true attitude but not the reading; see [`Imperfection`]. Errors of the
//! reading (position error and reading noise) are added in the places where readings are simulated.

mod chain;
mod geometry;
mod motion;
mod path;
mod profile;
mod table;

pub use chain::Kinematics;
pub use geometry::{
    AXIS_ERRORS, AxisAngles, AxisError, AxisResponse, PHASES, TABLE_GEOMETRY, TableGeometry,
    across, axis_angles, axis_response, phases, table_geometry_name,
};
pub use motion::Motion;
pub use path::{AxesStep, BodyStep, Moves, Path, Rotation};
pub use profile::{Profile, Turned};
pub use table::{Axis, AxisImperfection, Imperfection, Table, TableAccuracy, TableErrors};

/// Errors of a table that cannot follow a path.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TableError {
    /// A list of angles does not fit the table.
    #[error("{place}: {found} angles for a table with {expected} axes; give one angle per axis")]
    AxisCount {
        /// Place in the path where the list occurs.
        place: String,
        /// Number of angles.
        found: usize,
        /// Number of axes.
        expected: usize,
    },
    /// A move is faster than an axis allows.
    #[error(
        "step {step}: {what} of {found:.4} {unit} is above the {limit:.4} {unit} of the {axis} axis; slow the step down"
    )]
    Limit {
        /// Number of the step, counted from one.
        step: usize,
        /// `rate` or `acceleration`.
        what: &'static str,
        /// Requested value.
        found: f64,
        /// Allowed value.
        limit: f64,
        /// Unit of both.
        unit: &'static str,
        /// Name of the axis.
        axis: String,
    },
    /// A rotation cannot be completed in its time.
    #[error(
        "step {step}: {angle_deg:.3}° in {duration:.2} s exceeds the acceleration of the axis; allow {needed:.2} s or more"
    )]
    Hurried {
        /// Number of the step, counted from one.
        step: usize,
        /// Angle in degrees.
        angle_deg: f64,
        /// Time given, s.
        duration: f64,
        /// Time needed, s.
        needed: f64,
    },
    /// There are axis errors, but the path does not state how the axes turn.
    #[error(
        "the path turns about body axes, which does not define the table angles; use a table without \
         non-orthogonality, wobble and encoder harmonics, or a path in table axes"
    )]
    AxesUnknown,
}
