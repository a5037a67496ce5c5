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

/// What axes are called by which a table turns when all its angles are zero.
pub(super) const LETTERS: [(&str, Vector3<f64>); 3] = [
    ("x", Vector3::new(1.0, 0.0, 0.0)),
    ("y", Vector3::new(0.0, 1.0, 0.0)),
    ("z", Vector3::new(0.0, 0.0, 1.0)),
];
/// Keys of the 1σ of errors of the axes, in the order of [`AxisError::ALL`].
pub(super) const AXIS_KEYS: [&str; AxisError::ALL.len()] = [
    "nonorthogonality_sigma_arcsec",
    "wobble_sigma_arcsec",
    "encoder_sigma_arcsec",
];

/// How a row gives `C_b_n`, and where the table's axes stand; `C` is a column's name or its index.
pub(super) struct AttitudeColumns<C> {
    /// `[w, x, y, z]`, body right-front-up to East-North-Up.
    quaternion: Option<[C; 4]>,
    /// Angles in degrees about the axes of the table, outermost first. Without a quaternion the attitude is
    /// `C_b_n = R(axis₁, outer) R(axis₂, middle) R(axis₃, inner)`.
    angles: Vec<(C, Vector3<f64>)>,
}

impl<'a> AttitudeColumns<&'a str> {
    fn of_fields(table: &Fields<'a>, columns: &Fields<'a>) -> Result<Self, FileError> {
        let axes = table.get("axes").or_else(|| columns.get("axes"));
        let quaternion = columns.get("quaternion").map(|quaternion| {
            let names = quaternion.texts()?.try_into();
            names.map_err(|_| {
                quaternion.error("four columns, in the order w, x, y, z", "Name all four.")
            })
        });
        let quaternion = quaternion.transpose()?;
        let angles = match (columns.get("angles"), axes) {
            (Some(angles), Some(axes)) => {
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
                    let axis = LETTERS.iter().find(|(known, _)| *known == letter);
                    let (_, axis) = axis.ok_or_else(|| {
                        axes.error(
                            "`x`, `y` or `z` for each axis",
                            "Name the axis about which the table turns when all angles are zero.",
                        )
                    })?;
                    Ok((name, *axis))
                });
                pairs.collect::<Result<_, FileError>>()?
            }
            (Some(_), None) => return Err(table.missing("axes", "the axes of the angles")),
            (None, Some(axes)) => {
                return Err(axes.error(
                    "it beside the columns of `angles`",
                    "Name the columns of the angles, or remove the axes.",
                ));
            }
            (None, None) if quaternion.is_none() => {
                return Err(
                    columns.missing("quaternion", "the columns of a quaternion or of `angles`")
                );
            }
            (None, None) => Vec::new(),
        };
        Ok(Self { quaternion, angles })
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

    /// The angles of the axes; none where a quaternion stands alone.
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
fn geometry(fields: &Fields, angles: usize) -> Result<TableGeometry, FileError> {
    let optional = |name| -> Result<f64, FileError> {
        let field = fields.get(name);
        let field = field
            .map(|field| field.positive_to(HALF_TURN))
            .transpose()?;
        Ok(field.unwrap_or(0.0) * ARCSEC)
    };
    let mut axes = TableGeometry::default().axes;
    for (kind, key) in AxisError::ALL.into_iter().zip(AXIS_KEYS) {
        match fields.get(key) {
            Some(field) if angles == 0 => {
                return Err(field.error(
                        "it with `angles` only, for a quaternion does not tell the axes apart",
                        "Remove it, or give the angles of the table's axes, alone or beside the quaternion.",
                    ));
            }
            Some(_) => axes += kind.of_table(angles, optional(key)?),
            None => (),
        }
    }
    let level = optional("level_sigma_arcsec")?;
    Ok(TableGeometry {
        base: Vector3::new(level, level, optional("north_sigma_arcsec")?),
        axes,
    })
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
        let geometry = geometry(&fields, attitude.angles.len())?;
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
