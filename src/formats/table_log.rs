//! The turntable's log: readings of the attitude of its mounting face.

use std::path::Path;

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::clock::{Clock, Stamp, Stamps};
use super::error::FileError;
use super::fields::Fields;
use super::instrument::HALF_TURN;
use super::rows::LogRows;
use super::source::Source;
use crate::attitude;
use crate::recording::{ImuSamples, TableLog};
use crate::turntable::{AxisAngles, AxisError, TableAccuracy, TableGeometry, axis_angles};
use crate::units::{ARCSEC, DEGREE};

/// Four components printed to four decimals meet it. What is off by more is no quaternion.
const NORM_TOLERANCE: f64 = 1e-4;

/// No clocks of one run are further apart, ms.
const MINUTE_MS: f64 = 60_000.0;

/// Keys of the 1σ of errors of the axes, in the order of [`AxisError::ALL`].
const AXIS_KEYS: [&str; AxisError::ALL.len()] = [
    "nonorthogonality_sigma_arcsec",
    "wobble_sigma_arcsec",
    "encoder_sigma_arcsec",
];

/// How a row gives `C_b_n`; `C` is a column's name or its index.
pub(super) enum AttitudeColumns<C> {
    /// `[w, x, y, z]`, body right-front-up to East-North-Up.
    Quaternion([C; 4]),
    /// Angles in degrees about the axes of the table, outermost first:
    /// `C_b_n = R(axis₁, outer) R(axis₂, middle) R(axis₃, inner)`.
    Angles(Vec<(C, Vector3<f64>)>),
}

impl<'a> AttitudeColumns<&'a str> {
    fn of_fields(table: &Fields<'a>, columns: &Fields<'a>) -> Result<Self, FileError> {
        let axes = table.get("axes").or_else(|| columns.get("axes"));
        match (columns.get("quaternion"), columns.get("angles"), axes) {
            (Some(quaternion), None, None) => {
                let names = quaternion.texts()?.try_into().map_err(|_| {
                    quaternion.error("four columns, in the order w, x, y, z", "Name all four.")
                })?;
                Ok(Self::Quaternion(names))
            }
            (None, Some(angles), Some(axes)) => {
                let names = angles.texts()?;
                let letters = axes.texts()?;
                if names.is_empty() || names.len() != letters.len() {
                    return Err(angles.error(
                        format_args!(
                            "an angle for each of {} axes, outermost first",
                            letters.len()
                        ),
                        "Complete `angles` or `axes`.",
                    ));
                }
                let pairs = names.into_iter().zip(letters).map(|(name, letter)| {
                    let axis = match letter {
                        "x" => Vector3::x(),
                        "y" => Vector3::y(),
                        "z" => Vector3::z(),
                        _ => {
                            return Err(axes.error(
                            "`x`, `y` or `z` for each axis",
                            "Name the axis about which the table turns when all angles are zero.",
                        ));
                        }
                    };
                    Ok((name, axis))
                });
                Ok(Self::Angles(pairs.collect::<Result<_, FileError>>()?))
            }
            (None, Some(_), None) => Err(table.missing("axes", "the axes of the angles")),
            (Some(quaternion), _, _) => Err(quaternion.error(
                "either a quaternion or angles with their axes",
                "Remove one of them.",
            )),
            (None, None, _) => {
                Err(columns.missing("quaternion", "the columns of a quaternion or of `angles`"))
            }
        }
    }

    fn find(&self, csv: &mut LogRows) -> Result<AttitudeColumns<usize>, FileError> {
        Ok(match self {
            Self::Quaternion([w, x, y, z]) => AttitudeColumns::Quaternion([
                csv.column(w)?,
                csv.column(x)?,
                csv.column(y)?,
                csv.column(z)?,
            ]),
            Self::Angles(angles) => AttitudeColumns::Angles(
                angles
                    .iter()
                    .map(|&(name, axis)| Ok((csv.column(name)?, axis)))
                    .collect::<Result<_, FileError>>()?,
            ),
        })
    }
}

impl AttitudeColumns<usize> {
    fn reading(&self, csv: &LogRows) -> Result<UnitQuaternion<f64>, FileError> {
        match self {
            &Self::Quaternion([w, x, y, z]) => {
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
            Self::Angles(angles) => {
                let mut c_b_n = Matrix3::identity();
                for &(column, axis) in angles {
                    c_b_n *= attitude::exp(axis * (csv.number(column)? * DEGREE));
                }
                Ok(attitude::quaternion(&c_b_n))
            }
        }
    }

    /// The angles of the axes; none for a quaternion.
    fn axes(&self, csv: &LogRows) -> Result<Option<AxisAngles>, FileError> {
        let Self::Angles(angles) = self else {
            return Ok(None);
        };
        let axes: Result<Vec<_>, FileError> = angles
            .iter()
            .map(|&(column, axis)| Ok((axis, csv.number(column)? * DEGREE)))
            .collect();
        Ok(Some(axis_angles(axes?)))
    }
}

/// What `run.toml` says of the file.
pub(super) struct TableLogFile<'a> {
    pub source: Source<'a>,
    pub clock: Clock<'a>,
    pub attitude: AttitudeColumns<&'a str>,
    pub accuracy: TableAccuracy,
}

impl<'a> TableLogFile<'a> {
    /// Reads the fields of `[turntable]`, if it is there; remarks on those without effect go to
    /// `notes`.
    pub fn of_fields(
        top: &Fields<'a>,
        directory: &Path,
        notes: &mut Vec<String>,
    ) -> Result<Option<Self>, FileError> {
        let known = [
            "file",
            "stream",
            "salvage",
            "columns",
            "time_unit",
            "sample_period_s",
            "axes",
            "position_sigma_arcsec",
            "reading_sigma_arcsec",
            "level_sigma_arcsec",
            "north_sigma_arcsec",
            AXIS_KEYS[0],
            AXIS_KEYS[1],
            AXIS_KEYS[2],
            "time_sigma_ms",
        ];
        let Some(fields) = top.table("turntable", &known)? else {
            return Ok(None);
        };
        let columns = fields.need_table(
            "columns",
            &["time", "quaternion", "angles", "axes"],
            "the names of the columns",
        )?;
        columns.need("time", "the name of a column")?;
        let clock = Clock::of_fields(&fields, &columns)?;
        let attitude = AttitudeColumns::of_fields(&fields, &columns)?;
        if let Some(field) = fields.get("time_sigma_ms") {
            field.positive_to(MINUTE_MS)?;
            notes.push("turntable.time_sigma_ms is read but has no effect yet.".to_owned());
        }
        let optional = |name| -> Result<f64, FileError> {
            let field = fields.get(name);
            let field = field
                .map(|field| field.positive_to(HALF_TURN))
                .transpose()?;
            Ok(field.unwrap_or(0.0) * ARCSEC)
        };
        let mut axes = TableGeometry::default().axes;
        for (kind, key) in AxisError::ALL.into_iter().zip(AXIS_KEYS) {
            match (&attitude, fields.get(key)) {
                (AttitudeColumns::Angles(angles), Some(_)) => {
                    axes += kind.of_table(angles.len(), optional(key)?);
                }
                (AttitudeColumns::Quaternion(_), Some(field)) => {
                    return Err(field.error(
                        "it with `angles` only, for a quaternion does not tell the axes apart",
                        "Remove it, or give the angles of the table's axes.",
                    ));
                }
                (_, None) => (),
            }
        }
        let level = optional("level_sigma_arcsec")?;
        let geometry = TableGeometry {
            base: Vector3::new(level, level, optional("north_sigma_arcsec")?),
            axes,
        };
        let sigma = |name| -> Result<f64, FileError> {
            let field = fields.need(name, "a 1σ in seconds of arc")?;
            Ok(field.positive_to(HALF_TURN)? * ARCSEC)
        };
        Ok(Some(Self {
            source: Source::of_fields(&fields, directory, None)?,
            clock,
            attitude,
            accuracy: TableAccuracy {
                position_sigma: sigma("position_sigma_arcsec")?,
                reading_sigma: sigma("reading_sigma_arcsec")?,
                geometry,
            },
        }))
    }

    /// Reads the log of a run with these samples; what the file leaves open goes to `notes`.
    pub fn read(&self, imu: &ImuSamples, notes: &mut Vec<String>) -> Result<TableLog, FileError> {
        let mut csv = self.source.open()?;
        let mut stamps = self.clock.start(&mut csv)?;
        let columns = self.attitude.find(&mut csv)?;

        let mut attitude: Vec<UnitQuaternion<f64>> = Vec::new();
        let mut axes = Vec::new();
        while csv.advance()? && !csv.may_be_cut() {
            let reading = columns.reading(&csv)?;
            match stamps.look(&csv)? {
                // A row twice says nothing new.
                Stamp::Again(place) if attitude[place - 1] == reading => {}
                Stamp::Again(_) => return Err(Stamps::same(&csv)),
                Stamp::New(place) => {
                    attitude.insert(place, reading);
                    if let Some(angles) = columns.axes(&csv)? {
                        axes.insert(place, angles);
                    }
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
