//! Turntables and their paths.

use std::num::NonZeroU16;

use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

use super::{ModelError, Place, Room, text};
use crate::attitude::from_pitch_roll_heading;
use crate::earth::Site;
use crate::turntable::{AxesStep, Axis, BodyStep, Moves, Path, Rotation, Table, TableErrors};
use crate::units::{ARCSEC, DEGREE};
use turncal_input::{Finite, NonNegative, Positive};

/// Finds and reads a turntable; returns it with its name.
///
/// # Errors
/// Returns an error if the model does not exist or is malformed.
pub fn turntable(name_or_path: &str, named_in: &Place) -> Result<(Table, String), ModelError> {
    let text = text(Room::Turntable, name_or_path, named_in)?;
    let file: TableFile = text.parse()?;
    let axes = file.axis.into_iter().map(|axis| Axis {
        name: axis.name,
        direction: axis.direction.0,
        max_rate: axis.max_rate_deg_per_s.0 * DEGREE,
        max_acceleration: axis.max_acceleration_deg_per_s2.0 * DEGREE,
    });
    let errors = file.errors;
    let table = Table {
        axes: axes.collect(),
        mount: attitude(file.mount_deg),
        errors: TableErrors {
            position: errors.position_arcsec.0 * ARCSEC,
            reading: errors.reading_arcsec.0 * ARCSEC,
            level: errors.level_arcsec.0 * ARCSEC,
            north: errors.north_arcsec.0 * ARCSEC,
            nonorthogonality: errors.nonorthogonality_arcsec.0 * ARCSEC,
            wobble: errors.wobble_arcsec.0 * ARCSEC,
            wobble_harmonics: errors.wobble_harmonics_arcsec.0 * ARCSEC,
            encoder_harmonics: errors.encoder_harmonics_arcsec.0 * ARCSEC,
        },
    };
    if table.axes.is_empty() {
        return Err(
            text.inconsistent("a table without axes; add one [[axis]] per axis, outermost first")
        );
    }
    Ok((table, text.name()))
}

/// Finds and reads a path; returns it with its name. Directions such as `earth-rate` are those at the site.
///
/// # Errors
/// Returns an error if the model does not exist or is malformed.
pub fn path(
    name_or_path: &str,
    named_in: &Place,
    site: &Site,
) -> Result<(Path, String), ModelError> {
    let text = text(Room::Path, name_or_path, named_in)?;
    let file: PathFile = text.parse()?;
    let moves = match (file.axes, file.body) {
        (Some(moves), None) => moves.in_radians(),
        (None, Some(moves)) => {
            let moves = moves.in_radians(site);
            moves.map_err(|message| text.inconsistent(message))?
        }
        _ => {
            return Err(text.inconsistent(
                "expected either [axes] or [body], depending on which axes the path turns about",
            ));
        }
    };
    Ok((
        Path {
            first_dwell: file.first_dwell_s.0,
            moves,
        },
        text.name(),
    ))
}

fn radians(degrees: &[Finite]) -> Vec<f64> {
    degrees.iter().map(|angle| angle.0 * DEGREE).collect()
}

fn attitude(pitch_roll_heading: [Finite; 3]) -> Matrix3<f64> {
    let [pitch, roll, heading] = pitch_roll_heading.map(|angle| angle.0 * DEGREE);
    from_pitch_roll_heading(pitch, roll, heading)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TableFile {
    #[serde(default)]
    mount_deg: [Finite; 3],
    #[serde(default)]
    errors: ErrorsFile,
    axis: Vec<AxisFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisFile {
    name: String,
    direction: DirectionFile,
    max_rate_deg_per_s: Positive,
    max_acceleration_deg_per_s2: Positive,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct ErrorsFile {
    position_arcsec: NonNegative,
    reading_arcsec: NonNegative,
    level_arcsec: NonNegative,
    north_arcsec: NonNegative,
    nonorthogonality_arcsec: NonNegative,
    wobble_arcsec: NonNegative,
    wobble_harmonics_arcsec: NonNegative,
    encoder_harmonics_arcsec: NonNegative,
}

/// A coordinate axis or any other direction, as a unit vector.
#[derive(Clone, Copy, Deserialize)]
#[serde(try_from = "[f64; 3]")]
struct DirectionFile(Vector3<f64>);

impl TryFrom<[f64; 3]> for DirectionFile {
    type Error = &'static str;

    fn try_from(components: [f64; 3]) -> Result<Self, Self::Error> {
        Vector3::from(components)
            .try_normalize(1e-6)
            .filter(|unit| unit.iter().all(|component| component.is_finite()))
            .map(Self)
            .ok_or("expected three components, not all zero")
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PathFile {
    first_dwell_s: NonNegative,
    axes: Option<AxesFile>,
    body: Option<BodyFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxesFile {
    start_deg: Vec<Finite>,
    rate_deg_per_s: Positive,
    acceleration_deg_per_s2: Positive,
    dwell_s: NonNegative,
    /// Number of repetitions of the steps.
    #[serde(default = "once")]
    repeat: NonZeroU16,
    steps: Vec<AxesStepFile>,
}

fn once() -> NonZeroU16 {
    NonZeroU16::MIN
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxesStepFile {
    turn_deg: Vec<Finite>,
    rate_deg_per_s: Option<Positive>,
    dwell_s: Option<NonNegative>,
}

impl AxesFile {
    fn in_radians(&self) -> Moves {
        let step = |step: &AxesStepFile| AxesStep {
            angles: radians(&step.turn_deg),
            rate: step.rate_deg_per_s.unwrap_or(self.rate_deg_per_s).0 * DEGREE,
            acceleration: self.acceleration_deg_per_s2.0 * DEGREE,
            dwell: step.dwell_s.unwrap_or(self.dwell_s).0,
        };
        Moves::Axes {
            start: radians(&self.start_deg),
            steps: (0..self.repeat.get())
                .flat_map(|_| self.steps.iter().map(step))
                .collect(),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BodyFile {
    start_pitch_roll_heading_deg: [Finite; 3],
    acceleration_deg_per_s2: Positive,
    move_s: Positive,
    dwell_s: NonNegative,
    steps: Vec<BodyStepFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BodyStepFile {
    turn_deg: Option<[Finite; 3]>,
    point: Option<BodyAxis>,
    along: Option<Direction>,
    move_s: Option<Positive>,
    dwell_s: Option<NonNegative>,
}

/// A body axis such as `-x`, as a unit vector.
#[derive(Clone, Copy, Deserialize)]
#[serde(try_from = "String")]
struct BodyAxis(Vector3<f64>);

impl TryFrom<String> for BodyAxis {
    type Error = &'static str;

    fn try_from(name: String) -> Result<Self, Self::Error> {
        let (sign, bare) = match name.strip_prefix('-') {
            Some(bare) => (-1.0, bare),
            None => (1.0, name.as_str()),
        };
        let axis = ["x", "y", "z"].iter().position(|known| *known == bare);
        let axis = axis.ok_or("expected one of x, y, z, -x, -y, -z")?;
        Ok(Self(Vector3::ith(axis, sign)))
    }
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Direction {
    East,
    North,
    Up,
    EarthRate,
}

impl BodyFile {
    fn in_radians(&self, site: &Site) -> Result<Moves, String> {
        let step = |(number, step): (usize, &BodyStepFile)| {
            let rotation = match (step.turn_deg, step.point, step.along) {
                (Some(vector), None, None) => {
                    Rotation::By(Vector3::from(vector.map(|angle| angle.0 * DEGREE)))
                }
                (None, Some(axis), Some(direction)) => Rotation::Point {
                    axis: axis.0,
                    along: direction.unit_vector(site),
                },
                _ => {
                    return Err(format!(
                        "step {number}: expected either turn_deg, or point and along"
                    ));
                }
            };
            Ok(BodyStep {
                rotation,
                duration: step.move_s.unwrap_or(self.move_s).0,
                acceleration: self.acceleration_deg_per_s2.0 * DEGREE,
                dwell: step.dwell_s.unwrap_or(self.dwell_s).0,
            })
        };
        Ok(Moves::Body {
            start: attitude(self.start_pitch_roll_heading_deg),
            steps: (1..).zip(&self.steps).map(step).collect::<Result<_, _>>()?,
        })
    }
}

impl Direction {
    fn unit_vector(self, site: &Site) -> Vector3<f64> {
        match self {
            Self::East => Vector3::x(),
            Self::North => Vector3::y(),
            Self::Up => Vector3::z(),
            Self::EarthRate => site.earth_rate_n().normalize(),
        }
    }
}
