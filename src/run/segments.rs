//! Labelled sections of a record.

use std::ops::Range;
use std::path::Path;

use nalgebra::Vector3;

use super::axes::BodyAxes;
use super::csv_file::CsvFile;
use super::error::RunError;
use super::{Dwell, ImuRecord};
use crate::units::DEGREE;

/// A labelled section of the record.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Stamp of its first row, s.
    pub start: f64,
    /// The first stamp after its last row, s.
    pub end: f64,
    /// Its samples, at least one.
    pub samples: Range<usize>,
    /// `x_up` … `z_down`, `rot_x+360` and the like, or any other text.
    pub label: String,
    /// What the label says of the motion, if anything.
    pub motion: Option<LabelledMotion>,
}

impl Segment {
    /// The section as a dwell, whether it stands or not.
    pub fn as_dwell(&self) -> Dwell {
        Dwell {
            samples: self.samples.clone(),
            position: None,
        }
    }
}

/// What a label says of a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LabelledMotion {
    /// `z_down`: it stands, and this direction along right-front-up is up.
    Stands {
        /// Unit vector.
        up: Vector3<f64>,
    },
    /// `rot_x-360`: it stands, turns about this direction along right-front-up, and stands again.
    Turns {
        /// Unit vector.
        axis: Vector3<f64>,
        /// rad, right-handed.
        angle: f64,
    },
}

impl LabelledMotion {
    /// What a label says, its axes being those of the file.
    fn of_label(label: &str, axes: BodyAxes) -> Option<Self> {
        let axis = |name: &str| {
            let index = ["x", "y", "z"].into_iter().position(|axis| axis == name)?;
            Some(axes.vector(Vector3::ith(index, 1.0)))
        };
        if let Some(turn) = label.strip_prefix("rot_") {
            let (name, angle) = turn.split_at_checked(1)?;
            let angle: f64 = angle.parse().ok()?;
            let turns = angle.is_finite() && angle != 0.0;
            return turns.then_some(Self::Turns {
                axis: axis(name)?,
                angle: angle * DEGREE,
            });
        }
        let (name, way) = label.split_once('_')?;
        let up = match way {
            "up" => axis(name)?,
            "down" => -axis(name)?,
            _ => return None,
        };
        Some(Self::Stands { up })
    }
}

/// Reads the sections of a run with these samples, whose first row has this stamp.
pub(super) fn read(
    file: &Path,
    imu: &ImuRecord,
    first_stamp: f64,
    axes: BodyAxes,
) -> Result<Vec<Segment>, RunError> {
    let mut csv = CsvFile::open(file)?;
    let start_column = csv.column("start")?;
    let end_column = csv.column("end")?;
    let label_column = csv.column("label")?;
    let record = (imu.start, imu.time(imu.len()));
    // Stamps may name either end of a sample, so borders can be out by one, and are rounded.
    let slack = 1.5 * imu.period;
    // The first row at or after a time; times are printed rounded.
    let row = |time: f64| {
        let row = ((time - first_stamp) / imu.period - 0.01).ceil();
        (row.max(0.0) as usize).min(imu.len())
    };
    let mut segments = Vec::new();
    while csv.advance()? {
        let start = csv.number(start_column)?;
        let end = csv.number(end_column)?;
        if end <= start {
            return Err(csv.error_here(
                format_args!("a segment from {start} s to {end} s"),
                "an end after the start",
                "Correct the row.",
            ));
        }
        if start < record.0 - slack || end > record.1 + slack {
            return Err(csv.error_here(
                format_args!("a segment from {start} s to {end} s"),
                format_args!(
                    "times inside the IMU record, {} s to {} s",
                    record.0, record.1
                ),
                "Correct the row.",
            ));
        }
        if row(start) == row(end) {
            return Err(csv.error_here(
                format_args!("no sample from {start} s to {end} s"),
                format_args!("a segment of several samples of {} s", imu.period),
                "Correct or remove the row.",
            ));
        }
        let label = csv.text(label_column)?.to_owned();
        segments.push(Segment {
            start,
            end,
            samples: row(start)..row(end),
            motion: LabelledMotion::of_label(&label, axes),
            label,
        });
    }
    Ok(segments)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_name_axes_of_the_file() {
        let frd = BodyAxes::WORDS[1].1;
        let of = |label| LabelledMotion::of_label(label, frd);
        let up = |up| Some(LabelledMotion::Stands { up });
        assert_eq!(of("x_up"), up(Vector3::y()));
        assert_eq!(of("z_down"), up(Vector3::z()));
        let Some(LabelledMotion::Turns { axis, angle }) = of("rot_z-360") else {
            panic!("no turn");
        };
        assert_eq!(axis * angle, Vector3::z() * (360.0 * DEGREE));
        for other in [
            "still",
            "x_left",
            "w_up",
            "rot_",
            "rot_x",
            "rot_é+90",
            "rot_x+NaN",
            "_up",
        ] {
            assert_eq!(of(other), None, "{other}");
        }
    }
}
