//! The turntable log: attitude readings of its mounting face.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::schema::TurntableFile;
use crate::schema::instrument::Fields;
use turncal::attitude;
use turncal::recording::{ImuSamples, TableLog};
use turncal::turntable::{AxisAngles, TableAccuracy, TableGeometry, axis_angles};
use turncal::units::{ARCSEC, DEGREE};
use turncal_input::{Angle, FileError};
use turncal_logs::Source;
use turncal_logs::clock::{Clock, Stamp};
use turncal_logs::rows::LogRows;

/// Tolerance of the norm, met by four components with four decimals; larger deviations are not quaternions.
const NORM_TOLERANCE: f64 = 1e-4;

/// Names of the rotation axes when all angles are zero.
pub const LETTERS: [(&str, Vector3<f64>); 3] = [
    ("x", Vector3::new(1.0, 0.0, 0.0)),
    ("y", Vector3::new(0.0, 1.0, 0.0)),
    ("z", Vector3::new(0.0, 0.0, 1.0)),
];
/// Columns for `C_b_n` and the axis angles.
pub struct AttitudeColumns<'a> {
    /// Columns of a quaternion `[w, x, y, z]`, body right-front-up to East-North-Up, if any, followed by angles in
    /// degrees, outermost first.
    names: Vec<&'a str>,
    /// The axes of the angles. Without a quaternion, the attitude is `C_b_n = R(axis₁, outer) R(axis₂, middle) R(axis₃,
    /// inner)`.
    axes: Vec<Vector3<f64>>,
}

impl AttitudeColumns<'_> {
    /// Attitude in a row, with columns at these indices, and axis angles; `None` if there is only a quaternion.
    fn reading(
        &self,
        csv: &LogRows,
        places: &[usize],
    ) -> Result<(UnitQuaternion<f64>, Option<AxisAngles>), FileError> {
        let values = places.iter().map(|&place| csv.number(place));
        let values: Vec<f64> = values.collect::<Result<_, FileError>>()?;
        let (quaternion, angles) = values.split_at(values.len() - self.axes.len());
        let angles = self.axes.iter().zip(angles);
        let angles = angles.map(|(axis, angle)| (*axis, angle * DEGREE));
        let angles: Vec<_> = angles.collect();
        let &[w, x, y, z] = quaternion else {
            let turn = |of: Matrix3<f64>, (axis, angle): &(Vector3<f64>, f64)| {
                of * attitude::exp(axis * *angle)
            };
            let c_b_n = angles.iter().fold(Matrix3::identity(), turn);
            return Ok((attitude::quaternion(&c_b_n), Some(axis_angles(angles))));
        };
        let quaternion = Quaternion::new(w, x, y, z);
        let norm = quaternion.norm();
        if (norm - 1.0).abs() > NORM_TOLERANCE {
            let found = format_args!("a quaternion with norm {norm:.6}");
            let expected = format_args!("norm 1 within {NORM_TOLERANCE}");
            let advice = "Correct the row or the column order in run.toml (w, x, y, z).";
            return Err(csv.error_here(found, expected, advice));
        }
        let angles = Some(angles).filter(|angles| !angles.is_empty());
        let attitude = UnitQuaternion::from_quaternion(quaternion);
        Ok((attitude, angles.map(axis_angles)))
    }
}

impl<'a> Fields<'a> {
    /// Settings in `[turntable]`, if present.
    pub fn table_log(&mut self) -> Result<Option<TableLogFile<'a>>, FileError> {
        let Some(fields) = &self.run.turntable else {
            return Ok(None);
        };
        let stated = (fields.time_unit.as_ref(), fields.sample_period_s);
        let attitude = self.attitude(fields)?;
        let settling = fields.settling_sigma_arcsec;
        if fields.time_sigma_ms.is_some() {
            let note = "turntable.time_sigma_ms currently has no effect.";
            self.notes.push(note.to_owned());
        }
        Ok(Some(TableLogFile {
            source: self.source(&fields.file, &fields.stream, fields.salvage),
            clock: self.clock("turntable", Some(&fields.columns.time), stated)?,
            accuracy: TableAccuracy {
                position_sigma: fields.position_sigma_arcsec.0 * ARCSEC,
                reading_sigma: fields.reading_sigma_arcsec.0 * ARCSEC,
                settling_sigma: settling.map_or(0.0, |sigma| sigma.0 * ARCSEC),
                geometry: self.geometry(fields, attitude.axes.len())?,
            },
            attitude,
        }))
    }

    fn attitude(&self, table: &'a TurntableFile) -> Result<AttitudeColumns<'a>, FileError> {
        let columns = &table.columns;
        let (path, axes) = match &table.axes {
            Some(axes) => ("turntable.axes", Some(axes)),
            None => ("turntable.columns.axes", columns.axes.as_ref()),
        };
        let names = columns.angles.as_deref().unwrap_or_default();
        let letters = axes.map_or(&[][..], Vec::as_slice);
        if names.len() != letters.len() {
            let of_angles = "turntable.columns.angles";
            let path = if names.is_empty() { path } else { of_angles };
            let expected = "one angle column per axis, outermost axis first";
            let advice = "Complete `angles` or `axes`.";
            return Err(self.document.wrong(path, expected, advice));
        }
        if names.is_empty() && columns.quaternion.is_none() {
            let path = "turntable.columns.quaternion";
            let meaning = "columns for `quaternion` or for `angles`";
            return Err(self.document.missing(path, meaning));
        }
        let axis = |letter: &String| LETTERS.iter().find(|(known, _)| known == letter);
        let axes = letters.iter().map(|letter| Some(axis(letter)?.1));
        let Some(axes) = axes.collect() else {
            let expected = "`x`, `y` or `z` for each axis";
            let advice = "For each angle, name the axis about which it turns the table when all angles are zero.";
            return Err(self.document.wrong(path, expected, advice));
        };
        let quaternion = columns.quaternion.iter().flat_map(|names| &names.0);
        let names = quaternion.chain(names).map(String::as_str).collect();
        Ok(AttitudeColumns { names, axes })
    }

    /// Stated errors of a table with this number of angles.
    fn geometry(&self, fields: &TurntableFile, angles: usize) -> Result<TableGeometry, FileError> {
        let sigma = |stated: Option<Angle>| stated.map_or(0.0, |sigma| sigma.0 * ARCSEC);
        let mut axes = TableGeometry::default().axes;
        for (kind, key, stated) in fields.axis_errors() {
            if stated.is_some() && angles == 0 {
                let path = format!("turntable.{key}");
                let expected =
                    "`angles` in the table log, because a quaternion does not separate the axes";
                let advice =
                    "Remove it, or add the angles of the table axes; the quaternion may stay.";
                return Err(self.document.wrong(&path, expected, advice));
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

/// Log settings in `run.toml`.
pub struct TableLogFile<'a> {
    pub source: Source<'a>,
    pub clock: Clock<'a>,
    pub attitude: AttitudeColumns<'a>,
    pub accuracy: TableAccuracy,
}

impl TableLogFile<'_> {
    /// Reads the table log of a run with these samples; `notes` receives remarks about the file.
    pub fn read(&self, imu: &ImuSamples, notes: &mut Vec<String>) -> Result<TableLog, FileError> {
        let mut csv = self.source.open()?;
        let mut stamps = self.clock.start(&mut csv)?.without_bursts();
        let places = self.attitude.names.iter().map(|name| csv.column(name));
        let places: Vec<usize> = places.collect::<Result<_, FileError>>()?;
        let mut attitude: Vec<UnitQuaternion<f64>> = Vec::new();
        let mut axes = Vec::new();
        while csv.advance()? && !csv.may_be_cut() {
            let (reading, angles) = self.attitude.reading(&csv, &places)?;
            // A repeated row adds no information.
            if let Stamp::New(place) = stamps.take(&csv, |other| attitude[other] == reading)? {
                attitude.insert(place, reading);
                if let Some(angles) = angles {
                    axes.insert(place, angles);
                }
            }
        }
        notes.extend(csv.left_out());
        notes.extend(csv.cut_off("turncal ignored it"));
        notes.extend(stamps.notes(csv.file(), 0));
        attitude.shrink_to_fit();
        axes.shrink_to_fit();
        let time: Vec<f64> = stamps.of_rows.iter().map(|&(time, _)| time).collect();
        let [first, .., last] = time.as_slice() else {
            let advice = "Log the table during the whole run, or remove [turntable].";
            return Err(csv.error("fewer than 2 readings", "at least 2", advice));
        };
        let (start, end) = (imu.start(), imu.end());
        if *last < start || *first > end {
            let found = format_args!("readings from {first} s to {last} s");
            let expected =
                format_args!("times that overlap those of the IMU log ({start} s to {end} s)");
            return Err(csv.error(found, expected, "Convert both files to the same clock."));
        }
        Ok(TableLog {
            time,
            attitude,
            axes,
        })
    }
}
