//! What a calibration makes of a mission where the truth may not be known.

use nalgebra::SVector;

use super::{Mission, NavigationStudyError, Pair};
use crate::calibration::Estimate;
use crate::imu::{PerSensor, Triad};
use crate::navigation::NavigationError;
use crate::navigation::error_model::STATES;

/// What is known of the navigation error at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlook {
    /// Time since the start, s.
    pub time: f64,
    /// Its 1σ predicted from the calibration's covariance, in the order of
    /// [`NavigationError::to_vector`].
    pub sigma: SVector<f64, STATES>,
    /// The actual error; none where the truth is not known.
    pub error: Option<NavigationError>,
}

impl Mission {
    /// What an estimate leads to, at the start and after each interval. The truth may have any
    /// installation form.
    ///
    /// # Errors
    /// As for [`Self::navigate`].
    pub fn outlook(
        &self,
        estimate: &Estimate,
        truth: Option<&PerSensor<Triad>>,
    ) -> Result<Vec<Outlook>, NavigationStudyError> {
        let estimate = estimate.in_general_form();
        let actual = truth.map(|&truth| {
            self.errors(&Pair {
                truth,
                calibration: estimate.triads,
                covariance: None,
            })
        });
        let actual = actual.transpose()?.unwrap_or_default();
        let exposures = self.exposure(&estimate.triads)?;
        Ok(exposures
            .iter()
            .enumerate()
            .map(|(k, exposure)| {
                let spread = exposure.by_parameter * estimate.covariance;
                let variance = |i: usize| spread.row(i).dot(&exposure.by_parameter.row(i));
                Outlook {
                    time: exposure.time,
                    sigma: SVector::from_fn(|i, _| variance(i).max(0.0).sqrt()),
                    error: actual.get(k).map(|moment| moment.error),
                }
            })
            .collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::{ParameterMatrix, ParameterVector};
    use crate::calibration::{from_vector, to_vector};
    use crate::earth::Site;
    use crate::imu::InstallationForm;
    use crate::units::{DEG_PER_H, DEGREE, PPM};

    #[test]
    fn an_outlook_is_what_the_general_form_navigates_to_whatever_the_form_of_the_estimate() {
        let mission = Mission::standing_level(&Site::with_normal_gravity(0.6, 0.0, 100.0), 300);
        let form = InstallationForm::SixAngle;
        let sigma = ParameterVector::repeat(0.01 * DEG_PER_H);
        let mut vector = to_vector(&PerSensor::from_fn(|_| Triad::ideal(form)));
        vector[0] += 300.0 * PPM;
        vector.fixed_rows_mut::<6>(3).fill(0.1 * DEGREE);
        let estimate = Estimate {
            triads: from_vector(form, &vector),
            covariance: ParameterMatrix::from_diagonal(&sigma.component_mul(&sigma)),
        };
        let general = estimate.in_general_form();
        let truth = from_vector(
            InstallationForm::General,
            &(to_vector(&general.triads) + sigma),
        );
        let found = mission.outlook(&estimate, Some(&truth)).unwrap();
        let expected = mission
            .navigate(&Pair {
                truth,
                calibration: general.triads,
                covariance: Some(general.covariance),
            })
            .unwrap();
        for (found, expected) in found.iter().zip(&expected) {
            assert_eq!(found.error, Some(expected.error));
            let apart = found.sigma - expected.sigma().unwrap();
            assert!(apart.amax() <= 1e-3 * found.sigma.amax());
        }
        let unknown = mission.outlook(&estimate, None).unwrap();
        assert!(unknown.iter().all(|moment| moment.error.is_none()));
        assert_eq!(unknown[300].sigma, found[300].sigma);
    }
}
