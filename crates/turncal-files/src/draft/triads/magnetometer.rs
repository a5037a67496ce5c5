//! The magnetometer of a log, found by the names of its columns.

use nalgebra::Vector3;

use super::{Triad, is_gravity, is_uneven, turns_as_a_field, uneven};
use crate::Sheet;
use crate::draft::name::{Name, by_stem};
use crate::quantity::units_of_field;
use turncal::calibration::{Ellipsoid, ellipsoid};
use turncal::recording::{MAGNETIC_COUNT, Magnetometer, finest_step};
use turncal::statistics::median;

/// Magnitude of the field of the Earth, T, within a factor of two in any place.
const FIELD: f64 = 45e-6;
/// A magnitude that varies by less than this fraction, beyond its rounding, is constant.
const CONSTANT: f64 = 1e-3;
/// Maximum number of values of a file without names that are compared with an ellipsoid.
const MOST_VALUES: usize = 4096;

/// The columns of a magnetometer, and the unit of its values.
#[derive(Debug, Clone, PartialEq)]
pub struct MagnetometerColumns {
    pub columns: [usize; 3],
    pub unit: &'static str,
    /// Whether the file states the unit.
    pub is_stated: bool,
    /// What shows that the columns are those of a magnetometer.
    pub shown_by: ShownBy,
}

/// Evidence for a magnetometer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShownBy {
    /// Names of the columns or of the stream.
    Names,
    /// The values lie about an ellipsoid.
    Ellipsoid,
    /// Moreover, the values turn with the gyros.
    Turns,
}

impl MagnetometerColumns {
    /// The first complete triad, preferably one with a unit; its values may be in few of the rows.
    pub fn find(sheet: &Sheet, names: &[Name]) -> Option<Self> {
        let is = |k: &usize| names[*k].is_magnetic() && sheet.varies(*k);
        let candidates: Vec<usize> = (0..names.len()).filter(is).collect();
        let all = by_stem(names, &candidates);
        let unit = |triad: &[usize; 3]| names[triad[0]].unit.and_then(|unit| word(unit.word));
        let columns = all.into_iter().min_by_key(|triad| unit(triad).is_none())?;
        match unit(&columns) {
            None => Self::by_size(sheet, columns),
            Some(unit) => Some(Self {
                columns,
                unit,
                is_stated: true,
                shown_by: ShownBy::Names,
            }),
        }
    }

    /// The triad of a stream that is named as a magnetometer and has only three columns beside its time.
    pub fn alone(sheet: &Sheet, time: &str) -> Option<Self> {
        let is = |k: &usize| sheet.names[*k] != time && sheet.varies(*k);
        let columns: Vec<usize> = (0..sheet.names.len()).filter(is).collect();
        Self::by_size(sheet, columns.try_into().ok()?)
    }

    /// The three columns of a file without names, if their values lie about an ellipsoid around zero and are not those of
    /// accelerometers, whose magnitude is usually that of gravity: a unit of accelerometers, or whole numbers, shows it.
    pub fn of_bare(sheet: &Sheet) -> Option<Self> {
        let columns: [usize; 3] = (0..sheet.names.len()).collect::<Vec<_>>().try_into().ok()?;
        let is_bare = |k: &usize| sheet.names[*k] == (k + 1).to_string() && sheet.varies(*k);
        let is_whole = columns
            .iter()
            .all(|&k| sheet.columns[k].iter().all(|of| of.fract() == 0.0));
        let is_even = !is_uneven(&sheet.columns, &columns);
        let may_be_gravity = is_even && (is_whole || is_gravity(&sheet.columns, &columns));
        if !columns.iter().all(is_bare) || may_be_gravity {
            return None;
        }
        surface(&sheet.columns, &columns)?;
        let found = Self::by_size(sheet, columns)?;
        Some(Self {
            shown_by: ShownBy::Ellipsoid,
            ..found
        })
    }

    /// Three neighbouring columns without names, except those `taken`, that lie about an ellipsoid and turn with the gyros
    /// as a field does that is not along gravity; `None` if several do. Also returns the accelerometers, which are the
    /// found columns if they show gravity and the accelerometers without names a field.
    pub fn by_turns(
        sheet: &Sheet,
        taken: &[usize],
        (gyro, accel): (&Triad, &Triad),
    ) -> Option<(Self, Triad)> {
        let columns = &sheet.columns;
        let is_bare = |k: usize| sheet.names[k] == (k + 1).to_string() && sheet.varies(k);
        let is_taken = |k: &usize| taken.iter().chain(gyro).chain(accel).any(|of| of == k);
        let all = (0..sheet.names.len().saturating_sub(2)).map(|k| [k, k + 1, k + 2]);
        let is_free = |of: &Triad| of.iter().all(|k| is_bare(*k) && !is_taken(k));
        let all: Vec<Triad> = all.filter(is_free).collect();
        let is_field = |of: &&Triad| {
            !is_computed(sheet, of)
                && surface(columns, of).is_some()
                && turns_as_a_field(columns, [*gyro, *accel, **of], all.len())
        };
        let mut fields = all.iter().filter(is_field);
        let field = fields.next().filter(|_| fields.next().is_none())?;
        // Gravity has a known size and, about zero, an even magnitude.
        let is_likelier = is_gravity(columns, field) && !is_gravity(columns, accel);
        let is_exchanged = accel.iter().all(|&k| is_bare(k))
            && is_likelier
            && uneven(columns, field) < uneven(columns, accel);
        let [field, accel] = if is_exchanged {
            [accel, field]
        } else {
            [field, accel]
        };
        let found = Self {
            shown_by: ShownBy::Turns,
            ..Self::by_size(sheet, *field)?
        };
        Some((found, *accel))
    }

    /// These columns, in the unit in which their values are most like the field of the Earth.
    fn by_size(sheet: &Sheet, columns: [usize; 3]) -> Option<Self> {
        let value = |row| Vector3::from(columns.map(|k| sheet.columns[k][row])).norm();
        let sizes = (0..sheet.rows()).map(value).filter(|size| *size > 0.0);
        let size = median(&mut sizes.collect::<Vec<_>>())?;
        let off = |(_, per_tesla): &(&str, f64)| (size / per_tesla / FIELD).ln().abs();
        let (word, _) = units_of_field().min_by(|one, other| off(one).total_cmp(&off(other)))?;
        Some(Self {
            columns,
            // Both have one size; a file of milligauss would say so.
            unit: if word == "mG" { "count" } else { word },
            is_stated: false,
            shown_by: ShownBy::Names,
        })
    }

    /// The reason for the unit.
    pub fn why(&self) -> &'static str {
        match self.shown_by {
            ShownBy::Names if self.is_stated => "stated in the file",
            ShownBy::Names => "with this unit, the values are most like the field of the Earth",
            ShownBy::Ellipsoid => {
                "the values lie about an ellipsoid (false-alarm rate 0.1 %), and with this unit they are most like the \
                 field of the Earth; check this"
            }
            ShownBy::Turns => {
                "the values lie about an ellipsoid and turn with the gyros (false-alarm rate 0.1 % each), and with this \
                 unit they are most like the field of the Earth; check this"
            }
        }
    }
}

/// The ellipsoid about which the values of three columns lie.
pub fn surface(columns: &[Vec<f64>], triad: &Triad) -> Option<Ellipsoid> {
    let mut log = Magnetometer::new("count", MAGNETIC_COUNT);
    let rows = columns.first().map_or(0, Vec::len);
    for row in (0..rows).step_by(rows.div_ceil(MOST_VALUES).max(1)) {
        log.push(row as f64, Vector3::from(triad.map(|k| columns[k][row])));
    }
    ellipsoid(&log).filter(Ellipsoid::is_surface)
}

/// Whether a vector has one magnitude in all rows, as rows of an orientation matrix and a computed direction of gravity.
fn is_computed(sheet: &Sheet, columns: &Triad) -> bool {
    let norm = |row| Vector3::from(columns.map(|k| sheet.columns[k][row])).norm();
    let first = norm(0);
    let step = columns.map(|k| finest_step(&sheet.columns[k]));
    let rounding = Vector3::from(step).norm();
    (0..sheet.rows()).all(|row| (norm(row) - first).abs() < rounding + CONSTANT * first)
}

/// The unit of a column with this unit; gauss may be spelled like the unit of accelerometers.
fn word(of_column: &'static str) -> Option<&'static str> {
    let word = match of_column {
        "g" => "G",
        "mg" => "mG",
        other => other,
    };
    units_of_field()
        .map(|(name, _)| name)
        .find(|name| *name == word)
}
