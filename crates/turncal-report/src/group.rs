//! Names and units of the six groups.

use turncal::calibration::parameter_name;
use turncal::imu::{InstallationForm, RATE, Sensor};
use turncal::number::{TIMES, readable, stated_axes, three_digits};

pub use turncal::calibration::Group;

/// The name of a triad in the plural.
pub fn triad_name(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Gyro => "gyros",
        Sensor::Accel => "accelerometers",
    }
}

/// A count with its noun, such as `3 turns` or `no findings`.
pub fn several(count: usize, name: &str) -> String {
    match count {
        0 => format!("no {name}s"),
        1 => format!("one {name}"),
        n => format!("{n} {name}s"),
    }
}

/// A time in a readable unit.
pub fn duration(seconds: f64) -> String {
    let (unit, size) = readable(&TIMES, seconds);
    format!("{} {unit}", three_digits(seconds / size))
}

/// A body axis in the direction of this component, such as `−x`.
pub fn signed_axis(axis: char, component: f64) -> String {
    let minus = if component < 0.0 { "−" } else { "" };
    format!("{minus}{axis}")
}

/// Headings of a table with one column per group, after the row heading.
pub fn group_columns(of_rows: &str) -> Vec<String> {
    let columns = Group::all().map(|group| format!("{}, {}", group.short(), group.unit()));
    std::iter::once(of_rows.to_owned()).chain(columns).collect()
}

/// The last part of a parameter name, such as `x` or `xy`.
pub fn axis_name(form: InstallationForm, index: usize) -> String {
    parameter_name(form, index)
        .and_then(|name| name.rsplit('.').next().map(str::to_owned))
        .unwrap_or_default()
}

/// The temperature function of a coefficient.
pub fn function_name(function: usize) -> String {
    match function {
        RATE => "by rate".to_owned(),
        0 => "linear".to_owned(),
        1 => "square".to_owned(),
        2 => "cubic".to_owned(),
        _ => format!("order {}", function + 1),
    }
}

/// A short name for the margin of a figure, such as `gyro E xy`.
pub fn short_name(form: InstallationForm, index: usize) -> String {
    format!("{} {}", Group::of(index).short(), axis_name(form, index))
}

/// The nominal scale factors of a triad, such as `2 062 648 count per second for 1 rad/s`.
pub fn nominal_scale(of: [f64; 3], unit: &str, input: &str) -> String {
    // Outputs that are not rates are stated per second.
    let per = if unit.contains('/') || unit == "g" {
        ""
    } else {
        " per second"
    };
    format!("{} {unit}{per} for 1 {input}", stated_axes(of))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nouns_agree_with_their_number() {
        let counted = [0, 1, 2].map(|count| several(count, "dwell"));
        assert_eq!(counted, ["no dwells", "one dwell", "2 dwells"]);
    }

    #[test]
    fn a_parameter_has_a_short_name_for_margins() {
        assert_eq!(short_name(InstallationForm::General, 3), "gyro E xy");
    }
}
