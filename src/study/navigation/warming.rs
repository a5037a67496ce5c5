//! Navigation while the instrument warms up: errors of parameters that change with temperature.

use nalgebra::{DMatrix, SMatrix, Vector3};
use thiserror::Error;

use super::{INTERVAL, Mission, NavigationStudyError, Pair, exposure};
use crate::calibration::result::Calibration;
use crate::calibration::{PARAMETERS, parameter_name, sensor_and_parameter, triads_of};
use crate::imu::{
    InstallationForm, Nominal, PerSensor, ThermalCoefficients, ThermalRange, ThermalState, Triad,
};
use crate::navigation::error_model::STATES;
use crate::navigation::{Instant, Linearisation, Sensitivity};

use super::course::Course;
use super::{Epoch, sensed_errors};

/// How an instrument warms up: `to + (from − to) exp(−t/τ)`.
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

/// A calibration and the truth, one of which at least changes with temperature; both in the general form and in one
/// body frame.
#[derive(Debug, Clone)]
pub struct WarmingPair {
    truth: Changing,
    calibration: Changing,
    /// Covariance of the calibration's parameters, then of its coefficients; none if no σ is claimed.
    covariance: Option<DMatrix<f64>>,
    /// Index among the parameters of both triads and function of each coefficient.
    coefficients: Vec<(usize, usize)>,
}

/// Why calibrations cannot be navigated with while they warm up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum WarmingError {
    /// Another installation form than the general one.
    #[error(
        "calibration and truth must be of the general installation form to be navigated with at a changing temperature; calibrate with --installation general"
    )]
    Form,
    /// Two body frames.
    #[error(
        "calibration and truth must have one body frame to be navigated with at a changing temperature; one is fixed by the table, the other by the accelerometers"
    )]
    Frame,
    /// A temperature outside the range of the calibration or the truth.
    #[error(
        "the temperature leaves the range in which the polynomials of calibration or truth hold; navigate within it"
    )]
    Outside,
    /// A coefficient of what is no parameter.
    #[error("temperature.coefficients names what is no parameter; correct the file")]
    Unknown,
}

/// Triads that change with temperature, normalised.
#[derive(Debug, Clone)]
struct Changing {
    triads: PerSensor<Triad>,
    thermal: Option<(PerSensor<ThermalRange>, PerSensor<ThermalCoefficients>)>,
}

impl Changing {
    fn of(
        record: &Calibration,
        nominal: &PerSensor<Nominal>,
    ) -> Result<(Self, Vec<(usize, usize)>), WarmingError> {
        let general = InstallationForm::General;
        if record.installation_form.is_some_and(|form| form != general) {
            return Err(WarmingError::Form);
        }
        let triads = triads_of(record, nominal, general);
        let Some(of) = &record.temperature else {
            let plain = Self {
                triads,
                thermal: None,
            };
            return Ok((plain, Vec::new()));
        };
        let mut all = PerSensor::<ThermalCoefficients>::default();
        let mut places = Vec::new();
        for coefficient in &of.coefficients {
            let (index, function) = coefficient.place(general).ok_or(WarmingError::Unknown)?;
            let (sensor, of_triad) = sensor_and_parameter(index);
            let factor = nominal.get(sensor).factor(of_triad);
            all.get_mut(sensor)[(of_triad, function)] = coefficient.value / factor;
            places.push((index, function));
        }
        let range = of.range;
        let changing = Self {
            triads,
            thermal: Some((range, all)),
        };
        Ok((changing, places))
    }

    fn state(&self, (temperature, rate): (f64, f64)) -> Option<ThermalState> {
        let (range, _) = self.thermal.as_ref()?;
        Some(PerSensor::from_fn(|sensor| {
            [range.get(sensor).values(temperature, rate); 3]
        }))
    }

    fn at(&self, now: (f64, f64)) -> PerSensor<Triad> {
        let (Some(state), Some((_, coefficients))) = (self.state(now), &self.thermal) else {
            return self.triads;
        };
        PerSensor::from_fn(|sensor| {
            let triad = self.triads.get(sensor);
            triad.warmed(coefficients.get(sensor), state.get(sensor))
        })
    }

    fn holds(&self, temperature: f64) -> bool {
        self.thermal.as_ref().is_none_or(|(range, _)| {
            let all = [range.gyro, range.accel];
            let tolerance = crate::calibration::TEMPERATURE_TOLERANCE;
            all.iter()
                .all(|range| range.contains(temperature, tolerance))
        })
    }
}

impl WarmingPair {
    /// From records.
    ///
    /// # Errors
    /// [`WarmingError`] where they do not fit each other.
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
        let (truth, _) = Changing::of(truth, &nominal)?;
        let (changing, coefficients) = Changing::of(calibration, &nominal)?;
        let covariance = joint_covariance(calibration, &nominal, &coefficients);
        Ok(Self {
            truth,
            calibration: changing,
            covariance,
            coefficients,
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

/// Covariance of parameters and coefficients, normalised; none if no σ is claimed.
fn joint_covariance(
    record: &Calibration,
    nominal: &PerSensor<Nominal>,
    coefficients: &[(usize, usize)],
) -> Option<DMatrix<f64>> {
    if record.covariance.is_empty() {
        return None;
    }
    let general = InstallationForm::General;
    let n = coefficients.len();
    let factor = |index: usize| {
        let (sensor, of_triad) = sensor_and_parameter(index);
        nominal.get(sensor).factor(of_triad)
    };
    let named = |name: &String| {
        (0..PARAMETERS).find(|&i| parameter_name(general, i).as_ref() == Some(name))
    };
    let places: Vec<Option<usize>> = record.parameters.iter().map(named).collect();
    let mut all = DMatrix::zeros(PARAMETERS + n, PARAMETERS + n);
    let known = places.iter().enumerate();
    for (row, i) in known
        .clone()
        .filter_map(|(row, place)| Some((row, (*place)?)))
    {
        for (column, j) in known
            .clone()
            .filter_map(|(column, place)| Some((column, (*place)?)))
        {
            let value = *record.covariance.get(row)?.get(column)?;
            all[(i, j)] = value / (factor(i) * factor(j));
        }
    }
    if let Some(thermal) = &record.temperature {
        for (k, &(of, _)) in coefficients.iter().enumerate() {
            for (l, &(other, _)) in coefficients.iter().enumerate() {
                let value = thermal.covariance.get(k).and_then(|row| row.get(l));
                let value = value.copied().unwrap_or(0.0) / (factor(of) * factor(other));
                all[(PARAMETERS + k, PARAMETERS + l)] = value;
            }
            for (row, place) in places.iter().enumerate() {
                let Some(i) = *place else { continue };
                let value = thermal.cross.get(row).and_then(|row| row.get(k));
                let value = value.copied().unwrap_or(0.0) / (factor(i) * factor(of));
                all[(i, PARAMETERS + k)] = value;
                all[(PARAMETERS + k, i)] = value;
            }
        }
    }
    Some(all)
}

impl Mission {
    /// Navigates while the instrument warms up: errors and their predicted covariance at the start and after each
    /// interval, in which the temperature is that of its middle.
    ///
    /// # Errors
    /// As for [`Self::navigate`].
    pub fn navigate_warming(
        &self,
        pair: &WarmingPair,
        warming: &Warming,
    ) -> Result<Vec<Epoch>, NavigationStudyError> {
        let middle = |interval: u32| warming.at((f64::from(interval) - 0.5) * INTERVAL);
        for interval in 1..=self.intervals {
            let (temperature, _) = middle(interval);
            if !(pair.truth.holds(temperature) && pair.calibration.holds(temperature)) {
                return Err(WarmingError::Outside.into());
            }
        }
        let mut epochs = self.errors_by(&nalgebra::SVector::zeros(), |interval| {
            pair.at(middle(interval)).sensed()
        })?;
        if let Some(covariance) = &pair.covariance {
            let exposures = self.exposure_warming(pair, middle)?;
            for (epoch, by) in epochs.iter_mut().zip(exposures) {
                let predicted = &by * covariance * by.transpose();
                epoch.covariance = Some(SMatrix::from_fn(|i, j| predicted[(i, j)]));
            }
        }
        Ok(epochs)
    }

    /// What errors of parameters, then of coefficients, do to navigation.
    fn exposure_warming(
        &self,
        pair: &WarmingPair,
        middle: impl Fn(u32) -> (f64, f64),
    ) -> Result<Vec<DMatrix<f64>>, NavigationStudyError> {
        let mut course = Course::new(&self.motion);
        let mut functions: Vec<usize> = pair.coefficients.iter().map(|c| c.1).collect();
        functions.sort_unstable();
        functions.dedup();
        let mut constant: Sensitivity = Sensitivity::zeros();
        let mut changing = vec![constant; functions.len()];
        let gather =
            |constant: &Sensitivity, changing: &[Sensitivity], course: &Course, time: f64| {
                let n = pair.coefficients.len();
                let own = exposure(time, constant, &course.here().truth)?.by_parameter;
                let by_function = changing.iter().map(|sensitivity| {
                    Ok(exposure(time, sensitivity, &course.here().truth)?.by_parameter)
                });
                let by_function: Vec<_> =
                    by_function.collect::<Result<_, NavigationStudyError>>()?;
                let mut all = DMatrix::zeros(STATES, PARAMETERS + n);
                for row in 0..STATES {
                    for column in 0..PARAMETERS {
                        all[(row, column)] = own[(row, column)];
                    }
                    for (k, (index, function)) in pair.coefficients.iter().enumerate() {
                        let place = functions.iter().position(|f| f == function);
                        let of = place.and_then(|place| by_function.get(place));
                        all[(row, PARAMETERS + k)] = of.map_or(0.0, |of| of[(row, *index)]);
                    }
                }
                Ok::<_, NavigationStudyError>(all)
            };
        let mut exposures = vec![gather(&constant, &changing, &course, 0.0)?];
        for interval in 1..=self.intervals {
            let now = middle(interval);
            let sensed = sensed_errors(&pair.truth.at(now))?;
            let state = pair.calibration.state(now).unwrap_or_default();
            let time = f64::from(interval) * INTERVAL;
            let linear = |at: &Instant| Linearisation::about(at, &sensed);
            let mut start = linear(course.here());
            course.go(time, 0.0, |stride| {
                let [middle, end] = [&stride.middle, &stride.end].map(linear);
                let all = [&start, &middle, &end];
                constant = Linearisation::follow(&constant, stride.duration, all);
                for (sensitivity, &function) in changing.iter_mut().zip(&functions) {
                    let [a, b, c] = all.map(|linear| of_function(linear, &state, function));
                    *sensitivity =
                        Linearisation::follow(sensitivity, stride.duration, [&a, &b, &c]);
                }
                start = end;
                Ok::<_, NavigationStudyError>(())
            })?;
            exposures.push(gather(&constant, &changing, &course, time)?);
        }
        Ok(exposures)
    }
}

/// What the errors of coefficients of a function do, in this state of all axes alike.
fn of_function(linear: &Linearisation, state: &ThermalState, function: usize) -> Linearisation {
    linear.weighted(|parameter| state.get(sensor_and_parameter(parameter).0)[0][function])
}
