//! Names and units of the quantities of a comparison.

use crate::prelude::*;
use crate::terms;
use turncal::calibration::{AuxiliaryKind, Word};
use turncal::imu::{AXES, InstallationForm, Sensor};
use turncal::lot::{Lot, Quantity, Sample, Spread, Verdict};
use turncal::magnetic::MATRIX;

/// Title of a quantity, such as `gyro K x` or `gyro noise x`.
pub fn title(quantity: Quantity) -> String {
    match quantity {
        Quantity::Parameter(index) => short_name(InstallationForm::General, index),
        Quantity::Auxiliary(_) => quantity.name(),
        Quantity::Noise(sensor, axis) => format!("{} noise {}", sensor.name(), AXES[axis]),
        Quantity::Magnetic(_) => quantity
            .name()
            .replace(".bias.", " hard iron ")
            .replace('.', " "),
    }
}

/// Unit: symbol, name in files, size in SI.
fn unit(quantity: Quantity) -> (&'static str, &'static str, f64) {
    match quantity {
        Quantity::Parameter(index) => {
            let of = Group::of(index).entry();
            let (_, name) = of.key.split_once('_').unwrap_or_default();
            (of.unit, name, of.value)
        }
        Quantity::Auxiliary(index) => {
            let of = AuxiliaryKind::of(index).map(|kind| terms::unit(kind.error_term()));
            let (symbol, size) = of.unwrap_or(("", 1.0));
            (symbol, symbol, size)
        }
        Quantity::Noise(Sensor::Gyro, _) => ("°/√h", "deg_per_sqrt_h", DEG_PER_SQRT_H),
        Quantity::Noise(Sensor::Accel, _) => ("µg/√Hz", "ug_per_sqrt_hz", MICRO_G_PER_SQRT_HZ),
        // The files state the unit.
        Quantity::Magnetic(_) => ("", "", 1.0),
    }
}

/// Symbol of the unit of a quantity.
pub fn symbol(lot: &Lot, quantity: Quantity) -> String {
    of_magnetometer(lot, quantity).unwrap_or_else(|| unit(quantity).0.to_owned())
}

/// The unit as it is written in names of fields in files.
pub fn unit_key(lot: &Lot, quantity: Quantity) -> String {
    of_magnetometer(lot, quantity).unwrap_or_else(|| unit(quantity).1.to_owned())
}

/// The unit of a quantity of the magnetometer.
fn of_magnetometer(lot: &Lot, quantity: Quantity) -> Option<String> {
    let [of_matrix, of_bias] = lot.magnetic_unit.as_ref()?;
    match quantity {
        Quantity::Magnetic(k) if k < MATRIX => Some(of_matrix.clone()),
        Quantity::Magnetic(_) => Some(of_bias.clone()),
        _ => None,
    }
}

/// Value and σ in the unit of the quantity; for a scale factor, the value is the deviation from nominal.
pub fn shown(quantity: Quantity, of: Sample) -> (f64, f64) {
    let value = match quantity {
        Quantity::Parameter(index) => Group::of(index).shown(of.value),
        _ => in_unit(quantity, of.value),
    };
    (value, in_unit(quantity, of.sigma))
}

/// A difference of values, in the unit of the quantity.
pub fn in_unit(quantity: Quantity, of: f64) -> f64 {
    of / unit(quantity).2
}

/// A difference with its σ, if there is one, in the unit of the quantity.
pub fn difference(quantity: Quantity, of: Sample) -> String {
    plus_minus(in_unit(quantity, of.value), in_unit(quantity, of.sigma))
}

/// A spread, or its upper limit if it is not significant.
pub fn spread(quantity: Quantity, of: &Spread) -> String {
    match of.interval {
        (low, _) if low > 0.0 => sigma(in_unit(quantity, of.value)),
        (_, high) if high > 0.0 => format!("< {}", sigma(in_unit(quantity, high))),
        // The scatter is smaller than expected from the σ of the units alone.
        _ => "0".to_owned(),
    }
}

/// Quantities shown together.
pub struct Together {
    /// Heading of the quantities, with their unit.
    pub heading: String,
    /// The name of each quantity below the heading.
    pub names: Vec<String>,
    /// The quantities.
    pub quantities: Vec<Quantity>,
}

/// The parameter groups, then the noise of each triad and the magnetometer, if any calibration has them.
pub fn together(lot: &Lot) -> Vec<Together> {
    let those = |heading: String, is: &dyn Fn(Quantity) -> bool| {
        let quantities: Vec<Quantity> = lot.quantities().filter(|of| is(*of)).collect();
        let name = |of: &Quantity| of.name().rsplit('.').next().unwrap_or_default().to_owned();
        Together {
            heading,
            names: quantities.iter().map(name).collect(),
            quantities,
        }
    };
    let groups = Group::all().map(|group| {
        let is =
            |of: Quantity| matches!(of, Quantity::Parameter(index) if Group::of(index) == group);
        those(group.titled(), &is)
    });
    let noises = Sensor::ALL.map(|sensor| {
        let unit = symbol(lot, Quantity::Noise(sensor, 0));
        let is = |of: Quantity| matches!(of, Quantity::Noise(own, _) if own == sensor);
        those(format!("{} noise at rest, {unit}", sensor.name()), &is)
    });
    let kinds = [("matrix", true), ("hard iron", false)].into_iter();
    let magnetic = kinds.zip(lot.magnetic_unit.iter().flatten());
    let magnetic = magnetic.map(|((name, of_matrix), unit)| {
        let is = |of: Quantity| matches!(of, Quantity::Magnetic(k) if (k < MATRIX) == of_matrix);
        those(format!("mag {name}, {unit}"), &is)
    });
    let all = groups.chain(noises).chain(magnetic);
    all.filter(|of| !of.quantities.is_empty()).collect()
}

/// Number of limits over all units that are exceeded, met or undecided.
pub fn verdict(lot: &Lot) -> Option<(Word, String)> {
    let specification = lot.specification.as_ref()?;
    let all = || lot.rows.iter().flat_map(|row| &row.checks);
    let number = |verdict| all().filter(|check| check.verdict == verdict).count();
    let [passed, open, failed] = [Verdict::Pass, Verdict::NotDecided, Verdict::Fail].map(number);
    let word = match (failed, open + lot.failures().count()) {
        (0, 0) => Word::Pass,
        (0, _) => Word::Undecided,
        _ => Word::Fail,
    };
    let words = format!(
        "{failed} of {} limits exceeded, {passed} met, {open} undecided ({} % confidence each)",
        all().count(),
        100.0 * specification.confidence
    );
    Some((word, words))
}
