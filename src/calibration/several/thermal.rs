//! Estimated temperature dependence of the parameters: coefficients of [`crate::imu::ThermalModel`].

use nalgebra::{DMatrix, DVector};

use crate::calibration::{PARAMETERS, ParameterMatrix, ParameterVector, parameter};
use crate::imu::{
    InstallationForm, PerSensor, Sensor, THERMAL_FUNCTIONS, ThermalCoefficients, ThermalModel,
    ThermalState, Triad,
};

/// A coefficient of a parameter's temperature dependence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Coefficient {
    /// The triad.
    pub sensor: Sensor,
    /// Index among the triad's parameters.
    pub parameter: usize,
    /// Index among [`THERMAL_FUNCTIONS`].
    pub function: usize,
    /// The axis whose temperature is used.
    pub axis: usize,
}

impl Coefficient {
    /// The enabled coefficients of a model.
    pub(in crate::calibration) fn all(
        form: InstallationForm,
        model: Option<&ThermalModel>,
    ) -> Vec<Self> {
        let on = model.into_iter().flat_map(ThermalModel::on);
        on.filter_map(|(sensor, parameter, function)| {
            let axis = Triad::axis(form, parameter)?;
            Some(Self {
                sensor,
                parameter,
                function,
                axis,
            })
        })
        .collect()
    }

    /// Index of the parameter among those of both triads.
    pub fn index(&self) -> usize {
        parameter(self.sensor, self.parameter)
    }

    /// Factor from an error of the coefficient to the error of its parameter in this state.
    pub(in crate::calibration) fn weight(&self, state: &ThermalState) -> f64 {
        state.get(self.sensor)[self.axis][self.function]
    }

    /// Value of the coefficient among these coefficients.
    pub(in crate::calibration) fn of(&self, all: &PerSensor<ThermalCoefficients>) -> f64 {
        all.get(self.sensor)[(self.parameter, self.function)]
    }

    pub(in crate::calibration) fn of_mut<'a>(
        &self,
        all: &'a mut PerSensor<ThermalCoefficients>,
    ) -> &'a mut f64 {
        &mut all.get_mut(self.sensor)[(self.parameter, self.function)]
    }
}

/// Estimated coefficients with their covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct Thermal {
    /// Temperature ranges and prior σ.
    pub model: ThermalModel,
    /// The coefficient to which each estimate belongs.
    pub coefficients: Vec<Coefficient>,
    /// The estimates, normalised like the parameters.
    pub values: DVector<f64>,
    /// Covariance of the values.
    pub covariance: DMatrix<f64>,
    /// Covariance of the parameters of both triads (rows) with the values.
    pub cross: DMatrix<f64>,
}

impl Thermal {
    /// The coefficients of both triads; zero if the function is off.
    pub fn coefficients(&self) -> PerSensor<ThermalCoefficients> {
        let mut all = PerSensor::<ThermalCoefficients>::default();
        for (coefficient, value) in self.coefficients.iter().zip(&self.values) {
            *coefficient.of_mut(&mut all) = *value;
        }
        all
    }

    /// Returns, for a thermal state, the deviation of the parameters of both triads from the values at the reference
    /// and the covariance of the parameters, given the covariance at the reference.
    pub fn at(
        &self,
        state: &ThermalState,
        covariance: &ParameterMatrix,
    ) -> (ParameterVector, ParameterMatrix) {
        let n = self.coefficients.len();
        let mut by = DMatrix::zeros(PARAMETERS, n);
        for (k, coefficient) in self.coefficients.iter().enumerate() {
            by[(coefficient.index(), k)] = coefficient.weight(state);
        }
        let change = &by * &self.values;
        let cross = &self.cross * by.transpose();
        let own = &by * &self.covariance * by.transpose();
        let at = ParameterMatrix::from_fn(|i, j| {
            covariance[(i, j)] + cross[(i, j)] + cross[(j, i)] + own[(i, j)]
        });
        (ParameterVector::from_fn(|i, _| change[i]), at)
    }

    /// Number of enabled temperature functions of this parameter (zero if it does not change with temperature), and
    /// whether its rate term is enabled.
    pub fn order(&self, index: usize) -> (usize, bool) {
        let of = |c: &&Coefficient| c.index() == index;
        let functions = self.coefficients.iter().filter(of).map(|c| c.function + 1);
        let (mut order, mut rate) = (0, false);
        for function in functions {
            match function {
                THERMAL_FUNCTIONS => rate = true,
                _ => order = order.max(function),
            }
        }
        (order, rate)
    }
}
