//! Differences between recordings of one instrument: parameters from day to day, and mounting.

use nalgebra::{SMatrix, Vector3};

use crate::attitude::exp;
use crate::calibration::parameters::derivatives;
use crate::calibration::{
    Group, PARAMETERS, ParameterMatrix, ParameterVector, from_vector, to_vector,
};
use crate::imu::{InstallationForm, PerSensor, Triad};
use crate::units::ARCSEC;

/// Effect of a rotation of the instrument on its mounting face: derivatives of the recording's parameters.
#[derive(Debug, Clone)]
pub struct Turned {
    /// Derivatives with respect to the common parameters, one column per parameter. The poorly determined mean of all
    /// mountings depends on well-determined quantities, so the relative accuracy of the derivatives must be better than
    /// the ratio of their σ.
    pub by_parameters: ParameterMatrix,
    /// Derivatives with respect to the rotation about each body axis.
    pub by_mounting: SMatrix<f64, PARAMETERS, 3>,
}

/// 1σ of the differences between recordings of one instrument.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct DayToDay {
    /// 1σ of each parameter, normalised; zero if it is common to all.
    pub parameters: ParameterVector,
    /// 1σ of the rotation of the whole instrument on its mounting face, about each body axis, rad.
    pub mounting: f64,
}

/// Deviation of one recording from the common parameters, or the 1σ of this deviation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Difference {
    /// Deviation added to each parameter, normalised.
    pub parameters: ParameterVector,
    /// Rotation vector ψ of the whole instrument on its mounting face, body axes, rad: for an input u along the axes of
    /// the face, the instrument senses `R(ψ)ᵀ u`.
    pub mounting: Vector3<f64>,
}

/// A quantity that differs between recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OwnState {
    /// The difference of a parameter of both triads.
    Parameter(usize),
    /// The rotation about a body axis.
    Mounting(usize),
}

/// The key of the mounting in a campaign's `[day_to_day]`.
const MOUNTING: &str = "mounting_arcsec";
/// Number of iterations that determine a mounting of one degree to a thousandth of a second of arc.
const ROUNDS: usize = 3;

impl DayToDay {
    /// Whether any quantity differs between recordings.
    pub fn any(&self) -> bool {
        self.parameters.amax() > 0.0 || self.mounting > 0.0
    }

    /// The key of a parameter group in `[day_to_day]` of a campaign, and its unit in SI.
    pub fn key(group: Group) -> (String, f64) {
        let entry = group.entry();
        (
            format!("{}_{}", group.sensor().name(), entry.key),
            entry.value,
        )
    }

    /// The keys of `[day_to_day]`.
    pub fn keys() -> Vec<String> {
        let groups = Group::all().map(|group| Self::key(group).0);
        groups.chain([MOUNTING.to_owned()]).collect()
    }

    /// The differences from the values in `[day_to_day]` by key.
    pub fn of_values(value: impl Fn(&str) -> f64) -> Self {
        let mut differ = Self::default();
        for group in Group::all() {
            let (key, unit) = Self::key(group);
            for i in group.parameters(InstallationForm::General) {
                differ.parameters[i] = value(&key) * unit;
            }
        }
        differ.mounting = value(MOUNTING) * ARCSEC;
        differ
    }

    /// The values in `[day_to_day]` with their keys; all parameters of a group have the same value.
    pub fn values(&self) -> impl Iterator<Item = (String, f64)> {
        let of_groups = Group::all().filter_map(|group| {
            let (key, unit) = Self::key(group);
            let first = *group.parameters(InstallationForm::General).first()?;
            Some((key, self.parameters[first] / unit))
        });
        of_groups.chain([(MOUNTING.to_owned(), self.mounting / ARCSEC)])
    }

    /// 1σ of one differing quantity.
    pub(in crate::calibration) fn of(&self, own: OwnState) -> f64 {
        match own {
            OwnState::Parameter(index) => self.parameters[index],
            OwnState::Mounting(_) => self.mounting,
        }
    }

    /// Covariance of the parameters of a recording about the common ones.
    pub(in crate::calibration) fn covariance(&self, common: &PerSensor<Triad>) -> ParameterMatrix {
        let parameters = self.parameters.component_mul(&self.parameters);
        let parameters = ParameterMatrix::from_diagonal(&parameters);
        if self.mounting == 0.0 {
            return parameters;
        }
        let turns = Difference::default().response(common).by_mounting * self.mounting;
        parameters + turns * turns.transpose()
    }
}

impl Difference {
    /// The value of one differing quantity.
    pub(in crate::calibration) fn get(&self, own: OwnState) -> f64 {
        match own {
            OwnState::Parameter(index) => self.parameters[index],
            OwnState::Mounting(axis) => self.mounting[axis],
        }
    }

    pub(in crate::calibration) fn get_mut(&mut self, own: OwnState) -> &mut f64 {
        match own {
            OwnState::Parameter(index) => &mut self.parameters[index],
            OwnState::Mounting(axis) => &mut self.mounting[axis],
        }
    }

    /// The triads in the recording, given the common triads.
    pub fn applied(&self, common: &PerSensor<Triad>) -> PerSensor<Triad> {
        let form = common.gyro.form;
        let triads = from_vector(form, &(to_vector(common) + self.parameters));
        if self.mounting == Vector3::zeros() {
            triads
        } else {
            self.turned(&triads)
        }
    }

    /// Derivatives of the parameters of a recording with respect to the common ones and to its mounting.
    pub(in crate::calibration) fn response(&self, common: &PerSensor<Triad>) -> Turned {
        let before = to_vector(common) + self.parameters;
        let after = |mounting: &Vector3<f64>, parameters: &ParameterVector| {
            let turned = Self {
                mounting: *mounting,
                ..*self
            };
            to_vector(&turned.turned(&from_vector(common.gyro.form, parameters)))
        };
        Turned {
            by_parameters: derivatives(&before, |parameters| after(&self.mounting, parameters)),
            by_mounting: derivatives(&self.mounting, |mounting| after(mounting, &before)),
        }
    }

    /// The mounting that brings the common triads closest to those of a recording.
    pub(in crate::calibration) fn mounting_between(
        common: &PerSensor<Triad>,
        recording: &ParameterVector,
    ) -> Vector3<f64> {
        let mut found = Self::default();
        for _ in 0..ROUNDS {
            let by = found.response(common).by_mounting;
            let off = recording - to_vector(&found.turned(common));
            let step = (by.transpose() * by).cholesky();
            found.mounting +=
                step.map_or_else(Vector3::zeros, |f| f.solve(&(by.transpose() * off)));
        }
        found.mounting
    }

    fn turned(&self, triads: &PerSensor<Triad>) -> PerSensor<Triad> {
        let turn = exp(self.mounting).transpose();
        PerSensor::from_fn(|sensor| {
            let triad = triads.get(sensor);
            Triad::from_sensitivity(triad.form, &(triad.sensitivity() * turn), triad.bias)
        })
    }

    /// The difference a fraction of the way to another.
    pub(in crate::calibration) fn towards(&self, other: &Self, fraction: f64) -> Self {
        Self {
            parameters: self.parameters + (other.parameters - self.parameters) * fraction,
            mounting: self.mounting + (other.mounting - self.mounting) * fraction,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imu::InstallationForm;
    use approx::assert_relative_eq;

    #[test]
    fn an_instrument_that_is_turned_senses_what_its_face_senses_turned_back() {
        let common = PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General));
        let turn = 1e-3f64;
        let difference = Difference {
            mounting: Vector3::new(0.0, 0.0, turn),
            ..Difference::default()
        };
        let recording = difference.applied(&common);
        // Turned about z from x towards y, its y axis sees what lies along x of the face from behind.
        let sensed = recording.accel.output(&Vector3::x());
        let expected = Vector3::new(turn.cos(), -turn.sin(), 0.0);
        assert_relative_eq!(sensed, expected, epsilon = 1e-15);
        let found = Difference::mounting_between(&common, &to_vector(&recording));
        assert_relative_eq!(found, difference.mounting, epsilon = 1e-12);
    }

    #[test]
    fn a_recording_changes_with_what_all_have_in_common_as_its_response_says() {
        let mut common = PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General));
        common.gyro.scale.x = 1.01;
        common.gyro.angles[0] = 0.02;
        let difference = Difference {
            mounting: Vector3::new(2e-3, -1e-3, 3e-3),
            ..Difference::default()
        };
        let by = difference.response(&common).by_parameters;
        let step = ParameterVector::from_fn(|i, _| 1e-5 * (i as f64 + 1.0).sin());
        let moved = from_vector(common.gyro.form, &(to_vector(&common) + step));
        let change =
            to_vector(&difference.applied(&moved)) - to_vector(&difference.applied(&common));
        // Linear to the square of the step; without the turn the change would be off by 3e-8.
        assert_relative_eq!(by * step, change, epsilon = 1e-9);
        assert!((step - change).amax() > 1e-8);
    }
}
