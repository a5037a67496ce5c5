//! The six groups in which an engineer reads a calibration, each with the unit it is spoken of in.

use crate::calibration::outcome::{Estimate, parameter_name};
use crate::calibration::states::{PARAMETERS, ParameterVector, sensor_and_parameter};
use crate::imu::{InstallationForm, ParameterKind, Sensor, Triad};
use crate::units;

/// Parameters of one triad and kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Group {
    sensor: Sensor,
    kind: ParameterKind,
}

impl Group {
    /// All six, in the order of the parameters.
    pub fn all() -> impl Iterator<Item = Self> {
        Sensor::ALL
            .into_iter()
            .flat_map(|sensor| ParameterKind::ALL.map(|kind| Self { sensor, kind }))
    }

    /// The group of a parameter.
    pub fn of(index: usize) -> Self {
        let (sensor, of_triad) = sensor_and_parameter(index);
        Self {
            sensor,
            kind: Triad::kind(of_triad),
        }
    }

    /// The triad.
    pub fn sensor(self) -> Sensor {
        self.sensor
    }

    /// The kind of its parameters.
    pub fn kind(self) -> ParameterKind {
        self.kind
    }

    /// Indices of its parameters in this form.
    pub fn parameters(self, form: InstallationForm) -> Vec<usize> {
        (0..PARAMETERS)
            .filter(|&index| Self::of(index) == self && parameter_name(form, index).is_some())
            .collect()
    }

    /// Indices of those that were estimated.
    pub fn estimated(self, estimate: &Estimate) -> Vec<usize> {
        let indices = estimate.estimated();
        indices.filter(|&index| Self::of(index) == self).collect()
    }

    /// Such as `gyro scale factor K`.
    pub fn title(self) -> String {
        let kind = match self.kind {
            ParameterKind::Scale => "scale factor K",
            ParameterKind::Installation => "installation E",
            ParameterKind::Bias => "bias D",
        };
        format!("{} {kind}", self.sensor.name())
    }

    /// Symbol of the unit.
    pub fn unit(self) -> &'static str {
        match (self.kind, self.sensor) {
            (ParameterKind::Scale, _) => "ppm",
            (ParameterKind::Installation, _) => "″",
            (ParameterKind::Bias, Sensor::Gyro) => "°/h",
            (ParameterKind::Bias, Sensor::Accel) => "µg",
        }
    }

    /// The unit in the model's normalised SI values.
    pub fn unit_value(self) -> f64 {
        match (self.kind, self.sensor) {
            (ParameterKind::Scale, _) => units::PPM,
            (ParameterKind::Installation, _) => units::ARCSEC,
            (ParameterKind::Bias, Sensor::Gyro) => units::DEG_PER_H,
            (ParameterKind::Bias, Sensor::Accel) => units::MICRO_G,
        }
    }

    /// What a reader is shown for a parameter's value: scale factors as departure from nominal.
    pub fn shown(self, value: f64) -> f64 {
        match self.kind {
            ParameterKind::Scale => (value - 1.0) / self.unit_value(),
            ParameterKind::Installation | ParameterKind::Bias => value / self.unit_value(),
        }
    }

    /// Largest magnitude and root mean square of some of a vector's entries, in the group's unit;
    /// `None` if there are none.
    pub fn spread(self, v: &ParameterVector, indices: &[usize]) -> Option<(f64, f64)> {
        let values = || indices.iter().map(|&i| (v[i] / self.unit_value()).abs());
        let mean_square = values().map(|x| x * x).sum::<f64>() / indices.len() as f64;
        values()
            .reduce(f64::max)
            .map(|largest| (largest, mean_square.sqrt()))
    }
}

/// The end of a parameter's name, such as `x` or `xy`.
pub fn axis_name(form: InstallationForm, index: usize) -> String {
    parameter_name(form, index)
        .and_then(|name| name.rsplit('.').next().map(str::to_owned))
        .unwrap_or_default()
}

/// A short name for a figure's margin, such as `gyro E xy`.
pub fn short_name(form: InstallationForm, index: usize) -> String {
    let Group { sensor, kind } = Group::of(index);
    let letter = match kind {
        ParameterKind::Scale => 'K',
        ParameterKind::Installation => 'E',
        ParameterKind::Bias => 'D',
    };
    format!("{} {letter} {}", sensor.name(), axis_name(form, index))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_is_in_exactly_one_group_in_every_form() {
        for (form, count) in InstallationForm::ALL.into_iter().zip([24, 24, 18]) {
            let mut all: Vec<usize> = Group::all().flat_map(|g| g.parameters(form)).collect();
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), count);
        }
    }

    #[test]
    fn a_scale_factor_is_shown_as_its_departure_from_nominal() {
        assert!((Group::of(0).shown(1.002) - 2000.0).abs() < 1e-6);
        assert_eq!(short_name(InstallationForm::General, 3), "gyro E xy");
    }
}
