//! Names and units of the quantities of a lot.

use crate::calibration::Word;
use crate::imu::{AXES, InstallationForm, Sensor};
use crate::lot::{Against, Lot, Quantity, Sample, Spread, Trend, Verdict};
use crate::report::prelude::*;

/// Such as `gyro K x` or `gyro noise x`.
pub fn title(quantity: Quantity) -> String {
    match quantity {
        Quantity::Parameter(index) => short_name(InstallationForm::General, index),
        Quantity::Noise(sensor, axis) => format!("{} noise {}", sensor.name(), AXES[axis]),
    }
}

/// Its unit: symbol, name in files, size in SI.
fn unit(quantity: Quantity) -> (&'static str, &'static str, f64) {
    match quantity {
        Quantity::Parameter(index) => {
            let of = Group::of(index).entry();
            let (_, name) = of.key.split_once('_').unwrap_or_default();
            (of.unit, name, of.value)
        }
        Quantity::Noise(Sensor::Gyro, _) => ("°/√h", "deg_per_sqrt_h", DEG_PER_SQRT_H),
        Quantity::Noise(Sensor::Accel, _) => ("µg/√Hz", "ug_per_sqrt_hz", MICRO_G_PER_SQRT_HZ),
    }
}

/// Symbol of its unit.
pub fn symbol(quantity: Quantity) -> &'static str {
    unit(quantity).0
}

/// Its unit as a name in files.
pub fn unit_key(quantity: Quantity) -> &'static str {
    unit(quantity).1
}

/// Value and σ in that unit.
pub fn shown(quantity: Quantity, of: Sample) -> (f64, f64) {
    let (.., unit) = unit(quantity);
    match quantity {
        Quantity::Parameter(index) => (Group::of(index).shown(of.value), of.sigma / unit),
        Quantity::Noise(..) => {
            let density = of.value.exp() / unit;
            (density, density * of.sigma)
        }
    }
}

/// A difference of values in the unit of [`spread_symbol`].
pub fn shown_spread(quantity: Quantity, spread: f64) -> f64 {
    match quantity {
        Quantity::Parameter(index) => spread / Group::of(index).unit_value(),
        // Of a logarithm.
        Quantity::Noise(..) => 100.0 * spread,
    }
}

/// Unit of differences between units.
pub fn spread_symbol(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Parameter(_) => symbol(quantity),
        Quantity::Noise(..) => "%",
    }
}

/// A trend in a sentence.
pub fn change(quantity: Quantity, trend: &Trend) -> String {
    let (what, unit) = match trend.against {
        Against::Serial => ("the serial number", "per number"),
        Against::Date => ("the date", "a day"),
    };
    let [slope, own] = [trend.slope, trend.sigma].map(|of| shown_spread(quantity, of));
    format!(
        "{} changes with {what}: {} {} {unit} (p = {}).",
        title(quantity),
        plus_minus(slope, own),
        spread_symbol(quantity),
        chance(trend.p)
    )
}

/// A spread with its σ, or its upper limit.
pub fn spread(quantity: Quantity, of: &Spread) -> String {
    let shown = |x: f64| shown_spread(quantity, x);
    match of.sigma {
        Some(own) if of.interval.0 > 0.0 => plus_minus(shown(of.value), shown(own)),
        _ if of.interval.1 > 0.0 => format!("< {}", sigma(shown(of.interval.1))),
        // The scatter is less than the units' σ alone make.
        _ => "0".to_owned(),
    }
}

/// Quantities shown together: heading, names and quantities. First the parameter groups, then the noise of each triad.
pub fn together(lot: &Lot) -> Vec<(String, Vec<String>, Vec<Quantity>)> {
    let those = |is: &dyn Fn(Quantity) -> bool| -> Vec<Quantity> {
        let all = lot.statistics.iter().map(|of| of.quantity);
        all.filter(|&quantity| is(quantity)).collect()
    };
    let groups = Group::all().map(|group| {
        let quantities =
            those(&|q| matches!(q, Quantity::Parameter(index) if Group::of(index) == group));
        let names = quantities.iter().map(|quantity| {
            let title = title(*quantity);
            title.rsplit(' ').next().unwrap_or_default().to_owned()
        });
        (group.titled(), names.collect(), quantities)
    });
    let noises = Sensor::ALL.map(|sensor| {
        let quantities = those(&|q| matches!(q, Quantity::Noise(of, _) if of == sensor));
        let unit = quantities.first().map_or("", |q| symbol(*q));
        let heading = format!("{} noise at rest, {unit}", sensor.name());
        (heading, AXES.map(String::from).to_vec(), quantities)
    });
    groups.chain(noises).collect()
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
