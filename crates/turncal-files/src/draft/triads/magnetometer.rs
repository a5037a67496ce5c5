//! The magnetometer of a log, found by the names of its columns.

use nalgebra::Vector3;

use crate::Sheet;
use crate::draft::name::{Name, by_stem};
use crate::quantity::units_of_field;
use turncal::statistics::median;

/// Magnitude of the field of the Earth, T, within a factor of two in any place.
const FIELD: f64 = 45e-6;

/// The columns of a magnetometer, and the unit of its values.
#[derive(Debug, Clone, PartialEq)]
pub struct MagnetometerColumns {
    pub columns: [usize; 3],
    pub unit: &'static str,
    /// Whether the file states the unit.
    pub is_stated: bool,
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
            }),
        }
    }

    /// The triad of a stream that is named as a magnetometer and has only three columns beside its time.
    pub fn alone(sheet: &Sheet, time: &str) -> Option<Self> {
        let is = |k: &usize| sheet.names[*k] != time && sheet.varies(*k);
        let columns: Vec<usize> = (0..sheet.names.len()).filter(is).collect();
        Self::by_size(sheet, columns.try_into().ok()?)
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
        })
    }

    /// The reason for the unit.
    pub fn why(&self) -> &'static str {
        if self.is_stated {
            "stated in the file"
        } else {
            "with this unit, the values are most like the field of the Earth"
        }
    }
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
