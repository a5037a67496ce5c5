//! Navigation during warm-up: errors of parameters that change with temperature.

use nalgebra::{DMatrix, Vector3};
use thiserror::Error;

use super::{Exposure, Mission, NavigationStudyError, Outlook, Pair, outlook, sensed_errors};
use crate::calibration::result::Calibration;
use crate::calibration::{
    Estimate, TEMPERATURE_TOLERANCE, Thermal, from_vector, sensor_and_parameter, triads_of,
};
use crate::imu::{InstallationForm, Nominal, PerSensor, ThermalState, Triad};
use crate::navigation::error_model::STATES;
use crate::navigation::{ErrorMatrix, ErrorVector, Instant, Linearisation, Sensitivity};

/// Warm-up of an instrument: `to + (from − to) exp(−t/τ)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Warming {
    /// Temperature at the start, °C.
    pub from: f64,
    /// Temperature that it approaches, °C.
    pub to: f64,
    /// τ, s.
    pub time_constant: f64,
}

impl Warming {
    /// Temperature in °C and its rate in K/s at a time in s.
    fn at(&self, time: f64) -> (f64, f64) {
        let left = (self.from - self.to) * (-time / self.time_constant).exp();
        (self.to + left, -left / self.time_constant)
    }
}

/// A calibration and the truth, of which at least one depends on temperature; both in the general form and in one
/// body frame.
#[derive(Debug, Clone)]
pub struct WarmingPair {
    truth: Changing,
    calibration: Changing,
}

/// Errors of navigation during warm-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum WarmingError {
    /// The installation form is not general.
    #[error(
        "navigation at a changing temperature needs a calibration and a truth in the general installation form; \
         calibrate with --installation general"
    )]
    Form,
    /// The body frames differ.
    #[error(
        "navigation at a changing temperature needs a calibration and a truth in the same body frame, but the table \
         defines one and the accelerometers the other"
    )]
    Frame,
    /// A temperature outside the range of the calibration or the truth.
    #[error(
        "the temperature leaves the range in which the polynomials of calibration or truth are valid; stay within it"
    )]
    Outside,
    /// A covariance or a coefficient has an unknown parameter name.
    #[error(
        "the covariance or temperature.coefficients has an unknown parameter name; correct the file"
    )]
    Unknown,
}

/// An estimate that may depend on temperature, normalised.
#[derive(Debug, Clone)]
struct Changing {
    estimate: Estimate,
    thermal: Option<Thermal>,
}

impl Changing {
    fn of(record: &Calibration, nominal: &PerSensor<Nominal>) -> Result<Self, WarmingError> {
        let general = InstallationForm::General;
        if record.installation_form.is_some_and(|form| form != general) {
            return Err(WarmingError::Form);
        }
        let covariance = record.covariance_by(nominal);
        let thermal = record.thermal(nominal);
        Ok(Self {
            estimate: Estimate {
                triads: triads_of(record, nominal, general),
                covariance: covariance.ok_or(WarmingError::Unknown)?,
            },
            thermal: thermal.map_err(|_| WarmingError::Unknown)?,
        })
    }

    fn state(&self, (temperature, rate): (f64, f64)) -> ThermalState {
        let thermal = self.thermal.as_ref();
        let state = thermal.map(|thermal| thermal.model.range.everywhere(temperature, rate));
        state.unwrap_or_default()
    }

    fn at(&self, now: (f64, f64)) -> PerSensor<Triad> {
        let Estimate { triads, covariance } = &self.estimate;
        self.thermal.as_ref().map_or(*triads, |thermal| {
            let (change, _) = thermal.at(&self.state(now), covariance);
            from_vector(self.estimate.form(), &(self.estimate.vector() + change))
        })
    }

    fn holds(&self, temperature: f64) -> bool {
        self.thermal.as_ref().is_none_or(|thermal| {
            let PerSensor { gyro, accel } = thermal.model.range;
            [gyro, accel]
                .iter()
                .all(|range| range.contains(temperature, TEMPERATURE_TOLERANCE))
        })
    }
}

impl WarmingPair {
    /// A pair from records.
    ///
    /// # Errors
    /// [`WarmingError`] if they are not compatible.
    pub fn of_records(
        calibration: &Calibration,
        truth: &Calibration,
    ) -> Result<Self, WarmingError> {
        if calibration.body_frame != truth.body_frame {
            return Err(WarmingError::Frame);
        }
        let nominal = PerSensor {
            gyro: Nominal(Vector3::from(truth.gyro.scale)),
            accel: Nominal(Vector3::from(truth.accel.scale)),
        };
        Ok(Self {
            truth: Changing::of(truth, &nominal)?,
            calibration: Changing::of(calibration, &nominal)?,
        })
    }

    fn at(&self, now: (f64, f64)) -> Pair {
        Pair {
            truth: self.truth.at(now),
            calibration: self.calibration.at(now),
            covariance: None,
        }
    }
}

impl Mission {
    /// Navigates during warm-up: errors and their predicted covariance at the start and after each
    /// interval. The temperature of an interval is that at its middle.
    ///
    /// # Errors
    /// As for [`Self::navigate`].
    pub fn navigate_warming(
        &self,
        pair: &WarmingPair,
        warming: &Warming,
    ) -> Result<Vec<Outlook>, NavigationStudyError> {
        let middle = |interval: u32| warming.at((f64::from(interval) - 0.5) * self.interval);
        for interval in 1..=self.intervals {
            let (temperature, _) = middle(interval);
            if !(pair.truth.holds(temperature) && pair.calibration.holds(temperature)) {
                return Err(WarmingError::Outside.into());
            }
        }
        let mut moments = self.errors_by(&ErrorVector::zeros(), |interval| {
            pair.at(middle(interval)).sensed()
        })?;
        let Changing { estimate, thermal } = &pair.calibration;
        if estimate.estimated().next().is_none() {
            return Ok(moments);
        }
        let own = self.exposure_warming(pair, &middle, None)?;
        let of_parameters = own.iter().map(|by| by.covariance(&estimate.covariance));
        let mut covariances: Vec<ErrorMatrix> = of_parameters.collect();
        if let Some(thermal) = thermal {
            let coefficients = thermal.coefficients.iter();
            let mut functions: Vec<usize> = coefficients.map(|c| c.function).collect();
            functions.sort_unstable();
            functions.dedup();
            let by_function = functions
                .iter()
                .map(|&f| self.exposure_warming(pair, &middle, Some(f)));
            let by_function: Vec<_> = by_function.collect::<Result<_, _>>()?;
            for (k, (covariance, own)) in covariances.iter_mut().zip(&own).enumerate() {
                let mut by = DMatrix::zeros(STATES, thermal.coefficients.len());
                for (mut column, of) in by.column_iter_mut().zip(&thermal.coefficients) {
                    let place = functions.partition_point(|&function| function < of.function);
                    column.copy_from(&by_function[place][k].by_parameter.column(of.index()));
                }
                let crossed = own.by_parameter * &thermal.cross * by.transpose();
                let added =
                    &crossed + crossed.transpose() + &by * &thermal.covariance * by.transpose();
                *covariance += ErrorMatrix::from_fn(|i, j| added[(i, j)]);
            }
        }
        for (moment, covariance) in moments.iter_mut().zip(&covariances) {
            moment.sigma = Some(outlook::sigma(covariance));
        }
        Ok(moments)
    }

    /// Sensitivity of navigation to the parameters, or to their coefficients of one function.
    fn exposure_warming(
        &self,
        pair: &WarmingPair,
        middle: &impl Fn(u32) -> (f64, f64),
        function: Option<usize>,
    ) -> Result<Vec<Exposure>, NavigationStudyError> {
        self.exposure_by(Sensitivity::zeros(), |interval| {
            let now = middle(interval);
            let (sensed, state) = (
                sensed_errors(&pair.truth.at(now))?,
                pair.calibration.state(now),
            );
            Ok(move |at: &Instant| {
                let linear = Linearisation::about(at, &sensed);
                match function {
                    None => linear,
                    // All axes are alike.
                    Some(function) => linear.weighted(|parameter| {
                        state.get(sensor_and_parameter(parameter).0)[0][function]
                    }),
                }
            })
        })
    }
}
