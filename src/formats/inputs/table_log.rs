//! The turntable's log: readings of the attitude of its mounting face.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::source::Source;
use crate::attitude;
use crate::formats::clock::{Clock, Stamp};
use crate::formats::error::FileError;
use crate::formats::rows::LogRows;
use crate::formats::schema::instrument::Fields;
use crate::formats::schema::{AXIS_ERRORS, Angle, TurntableFile};
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

impl AttitudeColumns<&str> {
    fn find(&self, csv: &mut LogRows) -> Result<AttitudeColumns<usize>, FileError> {
        let quaternion = self.quaternion.map(|names| {
            let [w, x, y, z] = names.map(|name| csv.column(name));
            Ok::<_, FileError>([w?, x?, y?, z?])
        });
        let angles = self.angles.iter();
        let angles = angles.map(|&(name, axis)| Ok((csv.column(name)?, axis)));
        Ok(AttitudeColumns {
            angles: angles.collect::<Result<_, FileError>>()?,
            quaternion: quaternion.transpose()?,
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

impl<'a> Fields<'a> {
    /// What `[turntable]` says, if it is there.
    pub fn table_log(&mut self) -> Result<Option<TableLogFile<'a>>, FileError> {
        let Some(fields) = &self.run.turntable else {
            return Ok(None);
        };
        let stated = (fields.time_unit, fields.sample_period_s);
        let attitude = self.attitude(fields)?;
        if fields.time_sigma_ms.is_some() {
            let note = "turntable.time_sigma_ms is read but has no effect yet.";
            self.notes.push(note.to_owned());
        }
        Ok(Some(TableLogFile {
            source: self.source(&fields.file, &fields.stream, fields.salvage),
            clock: self.clock("turntable", Some(&fields.columns.time), stated)?,
            accuracy: TableAccuracy {
                position_sigma: fields.position_sigma_arcsec.0 * ARCSEC,
                reading_sigma: fields.reading_sigma_arcsec.0 * ARCSEC,
                geometry: self.geometry(fields, attitude.angles.len())?,
            },
            attitude,
        }))
    }

    fn attitude(&self, table: &'a TurntableFile) -> Result<AttitudeColumns<&'a str>, FileError> {
        let columns = &table.columns;
        let (path, axes) = match &table.axes {
            Some(axes) => ("turntable.axes", Some(axes)),
            None => ("turntable.columns.axes", columns.axes.as_ref()),
        };
        let wrong = |path, expected: &str, advice| Err(self.document.wrong(path, expected, advice));
        let missing = |path, meaning| Err(self.document.missing(path, meaning));
        let angles = match (&columns.angles, axes) {
            (Some(names), Some(letters)) if names.is_empty() || names.len() != letters.len() => {
                let count = letters.len();
                return wrong(
                    "turntable.columns.angles",
                    &format!("an angle for each of {count} axes, outermost first"),
                    "Complete `angles` or `axes`.",
                );
            }
            (Some(names), Some(letters)) => {
                let pairs = names.iter().zip(letters).map(|(name, letter)| {
                    let axis = LETTERS.iter().find(|(known, _)| known == letter);
                    axis.map(|(_, axis)| (name.as_str(), *axis))
                });
                let Some(pairs) = pairs.collect() else {
                    return wrong(
                        path,
                        "`x`, `y` or `z` for each axis",
                        "Name the axis about which the table turns when all angles are zero.",
                    );
                };
                pairs
            }
            (Some(_), None) => return missing("turntable.axes", "the axes of the angles"),
            (None, Some(_)) => {
                return wrong(
                    path,
                    "it beside the columns of `angles`",
                    "Name the columns of the angles, or remove the axes.",
                );
            }
            (None, None) if columns.quaternion.is_none() => {
                let meaning = "the columns of a quaternion or of `angles`";
                return missing("turntable.columns.quaternion", meaning);
            }
            (None, None) => Vec::new(),
        };
        let names = columns.quaternion.as_ref();
        Ok(AttitudeColumns {
            quaternion: names.map(|names| names.0.each_ref().map(String::as_str)),
            angles,
        })
    }

    /// What is stated of the errors of a table with this number of angles.
    fn geometry(&self, fields: &TurntableFile, angles: usize) -> Result<TableGeometry, FileError> {
        let sigma = |stated: Option<Angle>| stated.map_or(0.0, |sigma| sigma.0 * ARCSEC);
        let mut axes = TableGeometry::default().axes;
        let stated = AXIS_ERRORS.into_iter().zip(fields.axis_errors());
        for (kind, (key, stated)) in AxisError::ALL.into_iter().zip(stated) {
            if stated.is_some() && angles == 0 {
                return Err(self.document.wrong(
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
}

/// What `run.toml` says of the file.
pub struct TableLogFile<'a> {
    pub source: Source<'a>,
    pub clock: Clock<'a>,
    pub attitude: AttitudeColumns<&'a str>,
    pub accuracy: TableAccuracy,
}

impl TableLogFile<'_> {
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
