//! Names and units of the six groups.

use crate::calibration::{Estimate, ParameterVector, parameter_name};
use crate::imu::{InstallationForm, ParameterKind, RATE, Sensor};
use crate::number::stated_axes;

pub(super) use crate::calibration::Group;

impl Group {
    /// Such as `gyro scale factor K`.
    pub fn title(self) -> String {
        format!("{} {}", self.sensor().name(), self.entry().title)
    }

    /// Its title with the unit.
    pub fn titled(self) -> String {
        format!("{}, {}", self.title(), self.unit())
    }

    /// Such as `gyro K`.
    pub fn short(self) -> String {
        let letter = self.entry().title.rsplit(' ').next().unwrap_or_default();
        format!("{} {letter}", self.sensor().name())
    }

    /// Its key in documents, such as `gyro.scale_ppm`.
    pub fn key(self) -> String {
        format!("{}.{}", self.sensor().name(), self.entry().key)
    }

    /// Symbol of the unit.
    pub fn unit(self) -> &'static str {
        self.entry().unit
    }

    /// The unit in normalised SI values of the model.
    pub fn unit_value(self) -> f64 {
        self.entry().value
    }

    /// The displayed value of a parameter: scale factors as deviation from nominal.
    pub fn shown(self, value: f64) -> f64 {
        match self.kind() {
            ParameterKind::Scale => (value - 1.0) / self.unit_value(),
            ParameterKind::Installation | ParameterKind::Bias => value / self.unit_value(),
        }
    }

    /// Root mean square of a vector's entries that were estimated, in the group's unit.
    pub fn rms(self, v: &ParameterVector, estimate: &Estimate) -> Option<f64> {
        let (_, rms) = self.spread(v, &self.estimated(estimate))?;
        Some(rms)
    }

    /// Largest magnitude and RMS of some entries of a vector, in the unit of the group; `None` if there are none.
    pub fn spread(self, v: &ParameterVector, indices: &[usize]) -> Option<(f64, f64)> {
        let values = || indices.iter().map(|&i| (v[i] / self.unit_value()).abs());
        let mean_square = values().map(|x| x * x).sum::<f64>() / indices.len() as f64;
        values()
            .reduce(f64::max)
            .map(|largest| (largest, mean_square.sqrt()))
    }
}

/// A triad in the plural.
pub fn triad_name(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Gyro => "gyros",
        Sensor::Accel => "accelerometers",
    }
}

/// Headings of a table with one column per group, after the row heading.
pub fn group_columns(of_rows: &str) -> Vec<String> {
    let columns = Group::all().map(|group| format!("{}, {}", group.short(), group.unit()));
    std::iter::once(of_rows.to_owned()).chain(columns).collect()
}

/// The suffix of a parameter name, such as `x` or `xy`.
pub fn axis_name(form: InstallationForm, index: usize) -> String {
    parameter_name(form, index)
        .and_then(|name| name.rsplit('.').next().map(str::to_owned))
        .unwrap_or_default()
}

/// The temperature function of a coefficient; `None` for a parameter at the reference.
pub fn function_name(function: Option<usize>) -> String {
    match function {
        None => "at the reference".to_owned(),
        Some(RATE) => "by rate".to_owned(),
        Some(0) => "linear".to_owned(),
        Some(1) => "square".to_owned(),
        Some(2) => "cubic".to_owned(),
        Some(function) => format!("order {}", function + 1),
    }
}

/// A short name for the margin of a figure, such as `gyro E xy`.
pub fn short_name(form: InstallationForm, index: usize) -> String {
    format!("{} {}", Group::of(index).short(), axis_name(form, index))
}

/// The nominal scale factors of a triad, such as `2 062 648 count per second for 1 rad/s`.
pub fn nominal_scale(of: [f64; 3], unit: &str, input: &str) -> String {
    // Outputs that are not rates are stated per second.
    let per = match unit.contains('/') || unit == "g" {
        true => "",
        false => " per second",
    };
    format!("{} {unit}{per} for 1 {input}", stated_axes(of))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_factor_is_shown_as_its_departure_from_nominal() {
        assert!((Group::of(0).shown(1.002) - 2000.0).abs() < 1e-6);
        assert_eq!(short_name(InstallationForm::General, 3), "gyro E xy");
    }
}
