//! Missions whose duration suits the grade of the instrument, and their navigation errors with a calibration.

use super::outlook::{Outlook, sigma};
use super::{INTERVAL, Mission, NavigationStudyError, Pair};
use crate::calibration::Estimate;
use crate::earth::{SEMI_MAJOR_AXIS, Site};
use crate::imu::{PerSensor, Triad};
use crate::units::DEGREE;

/// Largest attitude error for which the linear model is valid, rad: beyond it, predicted σ are wrong by more than 1 %.
const SMALL: f64 = DEGREE;
/// Largest position error for which gravity and the frame are those of the true position, relative to the
/// Earth's radius.
const NEAR: f64 = 0.01;
/// Round durations, s: seconds, minutes, hours.
const DURATIONS: [f64; 17] = [
    1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 1800.0, 3600.0, 7200.0,
    14_400.0, 36_000.0, 144_000.0,
];
/// Minimum number of moments of a curve.
const MOMENTS: f64 = 20.0;

impl Mission {
    /// A mission in which the body is stationary and level at a site; its duration suits the grade of the instrument.
    /// The duration is the longest round duration after which the predicted errors of every estimate are still small;
    /// it ranges from seconds (low grade) to hours (navigation grade).
    ///
    /// # Errors
    /// The errors of [`Self::navigate`].
    pub fn suited(site: &Site, estimates: &[&Estimate]) -> Result<Self, NavigationStudyError> {
        let duration = estimates
            .iter()
            .try_fold(f64::INFINITY, |shortest, estimate| {
                Ok::<_, NavigationStudyError>(shortest.min(Self::useful(site, estimate)?))
            })?;
        Ok(Self::lasting(
            site,
            duration.min(DURATIONS[DURATIONS.len() - 1]),
        ))
    }

    /// Stationary and level for `duration` seconds.
    fn lasting(site: &Site, duration: f64) -> Self {
        let interval = INTERVAL.min(duration / MOMENTS);
        Self {
            interval,
            ..Self::standing_level(site, (duration / interval).round() as u32)
        }
    }

    /// The longest round duration after which an estimate's predicted errors are small; the shortest if there is none.
    fn useful(site: &Site, estimate: &Estimate) -> Result<f64, NavigationStudyError> {
        let small = |moment: &Outlook| {
            moment.sigma.is_some_and(|sigma| {
                let attitude = sigma.fixed_rows::<3>(0).amax();
                let position = sigma.fixed_rows::<2>(6).norm();
                attitude <= SMALL && position <= NEAR * SEMI_MAJOR_AXIS
            })
        };
        // A poor calibration shows its errors in much less than forty hours.
        let mut useful = DURATIONS[0];
        for longest in [60.0, 3600.0, DURATIONS[DURATIONS.len() - 1]] {
            let outlook = Self::lasting(site, longest).outlook(estimate, None)?;
            let last = outlook.iter().take_while(|moment| small(moment)).last();
            let last = last.map_or(0.0, |moment| moment.time * (1.0 + 1e-9));
            let whole = DURATIONS
                .into_iter()
                .filter(|&whole| whole <= last.min(longest));
            useful = whole.fold(useful, f64::max);
            if last < longest {
                break;
            }
        }
        Ok(useful)
    }

    /// Navigation errors of an estimate, at the start and after each interval. The truth may have any
    /// misalignment form.
    ///
    /// # Errors
    /// The same errors as [`Self::navigate`].
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
        let moments = exposures.iter().enumerate().map(|(k, exposure)| Outlook {
            time: exposure.time,
            error: actual.get(k).and_then(|moment| moment.error),
            sigma: Some(sigma(&exposure.covariance(&estimate.covariance))),
        });
        Ok(moments.collect())
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
    fn a_mission_suits_the_grade_of_the_poorest_estimate() {
        let site = Site::with_normal_gravity(0.6, 0.0, 0.0);
        let of_bias = |deg_per_h: f64| {
            let mut sigma = ParameterVector::zeros();
            sigma.fixed_rows_mut::<3>(9).fill(deg_per_h * DEG_PER_H);
            Estimate {
                triads: PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General)),
                covariance: ParameterMatrix::from_diagonal(&sigma.component_mul(&sigma)),
            }
        };
        let [navigation, tactical, mems, poor] = [0.003, 1.0, 30.0, 36_000.0].map(of_bias);
        let duration = |estimates: &[&Estimate]| {
            let mission = Mission::suited(&site, estimates).unwrap();
            assert!(mission.intervals >= 20);
            f64::from(mission.intervals) * mission.interval
        };
        // Heading is off by a degree after an hour of 1°/h.
        assert_eq!(duration(&[&navigation]).round(), 144_000.0);
        assert_eq!(duration(&[&tactical]).round(), 1800.0);
        assert_eq!(duration(&[&mems]).round(), 60.0);
        assert!(duration(&[&poor]) < 1.0 + 1e-9);
        assert_eq!(duration(&[&navigation, &mems]).round(), 60.0);
    }

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
            assert_eq!(found.error, expected.error);
            let [found, expected] = [found, expected].map(|of| of.sigma.unwrap());
            assert!((found - expected).amax() <= 1e-3 * found.amax());
        }
        let unknown = mission.outlook(&estimate, None).unwrap();
        assert!(unknown.iter().all(|moment| moment.error.is_none()));
        assert_eq!(unknown[300].sigma, found[300].sigma);
    }
}
