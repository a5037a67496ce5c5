//! The turntable's log: readings of the attitude of its mounting face.

use std::path::Path;

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::source::{Source, clock};
use crate::attitude;
use crate::formats::clock::{Clock, Stamp};
use crate::formats::error::FileError;
use crate::formats::rows::LogRows;
use crate::formats::schema::{AXIS_ERRORS, Angle, Document, TableColumns, TurntableFile};
use crate::recording::{ImuSamples, TableLog};
use crate::turntable::{AxisAngles, AxisError, TableAccuracy, TableGeometry, axis_angles};
use crate::units::{ARCSEC, DEGREE};

/// Four components printed to four decimals meet it. What is off by more is no quaternion.
const NORM_TOLERANCE: f64 = 1e-4;

/// What axes are called by which a table turns when all its angles are zero.
pub const LETTERS: [(&str, Vector3<f64>); 3] = [
    ("x", Vector3::new(1.0, 0.0, 0.0)),
    ("y", Vector3::new(0.0, 1.0, 0.0)),
    ("z", Vector3::new(0.0, 0.0, 1.0)),
];
/// How a row gives `C_b_n`, and where the table's axes stand; `C` is a column's name or its index.
pub struct AttitudeColumns<C> {
    /// `[w, x, y, z]`, body right-front-up to East-North-Up.
    quaternion: Option<[C; 4]>,
    /// Angles in degrees about the axes of the table, outermost first. Without a quaternion the attitude is
    /// `C_b_n = R(axis₁, outer) R(axis₂, middle) R(axis₃, inner)`.
    angles: Vec<(C, Vector3<f64>)>,
}

impl<'a> AttitudeColumns<&'a str> {
    fn of_fields(document: Document, table: &'a TurntableFile) -> Result<Self, FileError> {
        let TableColumns {
            quaternion, angles, ..
        } = &table.columns;
        let axes = table.axes.as_ref().or(table.columns.axes.as_ref());
        let path = |name: &str| match (name, &table.axes) {
            ("axes", Some(_)) => "turntable.axes".to_owned(),
            _ => format!("turntable.columns.{name}"),
        };
        let angles = match (angles, axes) {
            (Some(names), Some(letters)) if names.is_empty() || names.len() != letters.len() => {
                return Err(document.wrong(
                    &path("angles"),
                    format_args!(
                        "an angle for each of {} axes, outermost first",
                        letters.len()
                    ),
                    "Complete `angles` or `axes`.",
                ));
            }
            (Some(names), Some(letters)) => {
                let pairs = names.iter().zip(letters).map(|(name, letter)| {
                    let axis = LETTERS.iter().find(|(known, _)| known == letter);
                    axis.map(|(_, axis)| (name.as_str(), *axis))
                });
                pairs.collect::<Option<_>>().ok_or_else(|| {
                    document.wrong(
                        &path("axes"),
                        "`x`, `y` or `z` for each axis",
                        "Name the axis about which the table turns when all angles are zero.",
                    )
                })?
            }
            (Some(_), None) => {
                return Err(document.missing("turntable.axes", "the axes of the angles"));
            }
            (None, Some(_)) => {
                return Err(document.wrong(
                    &path("axes"),
                    "it beside the columns of `angles`",
                    "Name the columns of the angles, or remove the axes.",
                ));
            }
            (None, None) if quaternion.is_none() => {
                return Err(document.missing(
                    &path("quaternion"),
                    "the columns of a quaternion or of `angles`",
                ));
            }
            (None, None) => Vec::new(),
        };
        let quaternion = quaternion.as_ref();
        Ok(Self {
            quaternion: quaternion.map(|names| names.0.each_ref().map(String::as_str)),
            angles,
        })
    }

    fn find(&self, csv: &mut LogRows) -> Result<AttitudeColumns<usize>, FileError> {
        let quaternion = self.quaternion.map(|names| {
            let [w, x, y, z] = names.map(|name| csv.column(name));
            Ok::<_, FileError>([w?, x?, y?, z?])
        });
        let angles = self.angles.iter();
        Ok(AttitudeColumns {
            quaternion: quaternion.transpose()?,
            angles: angles
                .map(|&(name, axis)| Ok((csv.column(name)?, axis)))
                .collect::<Result<_, FileError>>()?,
        })
    }
}

impl AttitudeColumns<usize> {
    fn reading(&self, csv: &LogRows) -> Result<UnitQuaternion<f64>, FileError> {
        let Some([w, x, y, z]) = self.quaternion else {
            let mut c_b_n = Matrix3::identity();
            for &(column, axis) in &self.angles {
                c_b_n *= attitude::exp(axis * (csv.number(column)? * DEGREE));
            }
            return Ok(attitude::quaternion(&c_b_n));
        };
        let quaternion = Quaternion::new(
            csv.number(w)?,
            csv.number(x)?,
            csv.number(y)?,
            csv.number(z)?,
        );
        let norm = quaternion.norm();
        if (norm - 1.0).abs() > NORM_TOLERANCE {
            return Err(csv.error_here(
                format_args!("a quaternion of norm {norm:.6}"),
                format_args!("1 within {NORM_TOLERANCE}"),
                "Correct the row, or the order of columns in run.toml: w, x, y, z.",
            ));
        }
        Ok(UnitQuaternion::from_quaternion(quaternion))
    }

    /// The angles of the axes; `None` if there is only a quaternion.
    fn axes(&self, csv: &LogRows) -> Result<Option<AxisAngles>, FileError> {
        let axes: Result<Vec<_>, FileError> = self
            .angles
            .iter()
            .map(|&(column, axis)| Ok((axis, csv.number(column)? * DEGREE)))
            .collect();
        Ok(Some(axes?).filter(|axes| !axes.is_empty()).map(axis_angles))
    }
}

/// What `[turntable]` states of the errors of a table with this number of angles.
fn geometry(
    document: Document,
    fields: &TurntableFile,
    angles: usize,
) -> Result<TableGeometry, FileError> {
    let sigma = |stated: Option<Angle>| stated.map_or(0.0, |sigma| sigma.0 * ARCSEC);
    let mut axes = TableGeometry::default().axes;
    let stated = AXIS_ERRORS.into_iter().zip(fields.axis_errors());
    for (kind, (key, stated)) in AxisError::ALL.into_iter().zip(stated) {
        if stated.is_some() && angles == 0 {
            return Err(document.wrong(
                &format!("turntable.{key}"),
                "it with `angles` only, for a quaternion does not tell the axes apart",
                "Remove it, or give the angles of the table's axes, alone or with the quaternion.",
            ));
        }
        axes += kind.of_table(angles, sigma(stated));
    }
    let level = sigma(fields.level_sigma_arcsec);
    Ok(TableGeometry {
        base: Vector3::new(level, level, sigma(fields.north_sigma_arcsec)),
        axes,
    })
}

/// What `run.toml` says of the file.
pub struct TableLogFile<'a> {
    pub source: Source<'a>,
    pub clock: Clock<'a>,
    pub attitude: AttitudeColumns<&'a str>,
    pub accuracy: TableAccuracy,
}

impl<'a> TableLogFile<'a> {
    /// Of the fields of `[turntable]`; remarks on those without effect go to `notes`.
    pub fn of_fields(
        document: Document,
        fields: &'a TurntableFile,
        directory: &Path,
        notes: &mut Vec<String>,
    ) -> Result<Self, FileError> {
        let stated = (fields.time_unit, fields.sample_period_s);
        let attitude = AttitudeColumns::of_fields(document, fields)?;
        if fields.time_sigma_ms.is_some() {
            notes.push("turntable.time_sigma_ms is read but has no effect yet.".to_owned());
        }
        Ok(Self {
            source: Source::of_fields(directory, &fields.file, &fields.stream, fields.salvage),
            clock: clock(document, "turntable", Some(&fields.columns.time), stated)?,
            accuracy: TableAccuracy {
                position_sigma: fields.position_sigma_arcsec.0 * ARCSEC,
                reading_sigma: fields.reading_sigma_arcsec.0 * ARCSEC,
                geometry: geometry(document, fields, attitude.angles.len())?,
            },
            attitude,
        })
    }

    /// Reads the log of a run with these samples; what the file leaves open goes to `notes`.
    pub fn read(&self, imu: &ImuSamples, notes: &mut Vec<String>) -> Result<TableLog, FileError> {
        let mut csv = self.source.open()?;
        let mut stamps = self.clock.start(&mut csv)?.without_bursts();
        let columns = self.attitude.find(&mut csv)?;

        let mut attitude: Vec<UnitQuaternion<f64>> = Vec::new();
        let mut axes = Vec::new();
        while csv.advance()? && !csv.may_be_cut() {
            let reading = columns.reading(&csv)?;
            // A row twice says nothing new.
            if let Stamp::New(place) = stamps.take(&csv, |other| attitude[other] == reading)? {
                attitude.insert(place, reading);
                if let Some(angles) = columns.axes(&csv)? {
                    axes.insert(place, angles);
                }
            }
        }
        notes.extend(csv.cut_off("It is left out"));
        notes.extend(stamps.notes(csv.file(), 0));
        attitude.shrink_to_fit();
        axes.shrink_to_fit();
        let time: Vec<f64> = stamps.of_rows.iter().map(|&(time, _)| time).collect();
        let (first, last) = match time.as_slice() {
            [first, .., last] => (*first, *last),
            _ => {
                return Err(csv.error(
                    "a single reading or none",
                    "at least 2",
                    "Log the table over the whole run, or remove [turntable].",
                ));
            }
        };
        let (start, end) = (imu.start(), imu.end());
        if last < start || first > end {
            return Err(csv.error(
                format_args!("readings from {first} s to {last} s"),
                format_args!("times that overlap the IMU record, {start} s to {end} s"),
                "Bring both files to one clock.",
            ));
        }
        Ok(TableLog {
            time,
            attitude,
            axes,
        })
    }
}
