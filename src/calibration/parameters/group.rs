//! The six groups of parameters in reports: scale factor, misalignment and bias of both triads.

use super::{PARAMETERS, parameter_name, sensor_and_parameter};
use crate::calibration::{Estimate, ParameterVector};
use crate::imu::{InstallationForm, ParameterKind, Sensor, Triad};
use crate::units::{ARCSEC, DEG_PER_H, MICRO_G, PPM};

/// Parameters of one triad and kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Group {
    sensor: Sensor,
    kind: ParameterKind,
}

/// Notation for the figures of a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroupEntry {
    /// Kind of parameter, with its letter in the model.
    pub title: &'static str,
    /// Key in files, with the unit.
    pub key: &'static str,
    /// Symbol of the unit.
    pub unit: &'static str,
    /// Size of the unit in the normalised SI values of the model.
    pub value: f64,
}

impl Group {
    /// All six groups, in the order of the parameters.
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

    /// Notation for the figures of the group.
    pub fn entry(self) -> GroupEntry {
        let (title, key, unit, value) = match (self.kind, self.sensor) {
            (ParameterKind::Scale, _) => ("scale factor K", "scale_ppm", "ppm", PPM),
            (ParameterKind::Installation, _) => {
                ("misalignment E", "installation_arcsec", "″", ARCSEC)
            }
            (ParameterKind::Bias, Sensor::Gyro) => ("bias D", "bias_deg_per_h", "°/h", DEG_PER_H),
            (ParameterKind::Bias, Sensor::Accel) => ("bias D", "bias_ug", "µg", MICRO_G),
        };
        GroupEntry {
            title,
            key,
            unit,
            value,
        }
    }

    /// Title, such as `gyro scale factor K`.
    pub fn title(self) -> String {
        format!("{} {}", self.sensor().name(), self.entry().title)
    }

    /// Title with the unit.
    pub fn titled(self) -> String {
        format!("{}, {}", self.title(), self.unit())
    }

    /// Short title, such as `gyro K`.
    pub fn short(self) -> String {
        let letter = self.entry().title.rsplit(' ').next().unwrap_or_default();
        format!("{} {letter}", self.sensor().name())
    }

    /// Key in documents, such as `gyro.scale_ppm`.
    pub fn key(self) -> String {
        format!("{}.{}", self.sensor().name(), self.entry().key)
    }

    /// Symbol of the unit.
    pub fn unit(self) -> &'static str {
        self.entry().unit
    }

    /// Size of the unit in the normalised SI values of the model.
    pub fn unit_value(self) -> f64 {
        self.entry().value
    }

    /// The displayed value of a parameter; a scale factor is displayed as its deviation from nominal.
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

    /// Indices of the parameters of the group in this misalignment form.
    pub fn parameters(self, form: InstallationForm) -> Vec<usize> {
        (0..PARAMETERS)
            .filter(|&index| Self::of(index) == self && parameter_name(form, index).is_some())
            .collect()
    }

    /// Indices of the estimated parameters.
    pub fn estimated(self, estimate: &Estimate) -> Vec<usize> {
        let indices = estimate.estimated();
        indices.filter(|&index| Self::of(index) == self).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_factor_is_shown_as_its_departure_from_nominal() {
        assert!((Group::of(0).shown(1.002) - 2000.0).abs() < 1e-6);
    }

    #[test]
    fn every_parameter_is_in_exactly_one_group_in_every_form() {
        for (form, count) in InstallationForm::ALL.into_iter().zip([24, 24, 18]) {
            let mut all: Vec<usize> = Group::all().flat_map(|g| g.parameters(form)).collect();
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), count);
        }
    }
}
