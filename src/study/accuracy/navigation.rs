//! Navigation accuracy of the calibrations: position errors after 40 h of navigation from perfect alignment (as in the
//! paper), compared with the σ predicted from the filter covariance.

use nalgebra::{Matrix2, SMatrix, Vector2};
use statrs::distribution::{Binomial, DiscreteCDF};
use statrs::function::erf::erf;

use super::figures::Squares;
use super::{Figures, Trial};
use crate::calibration::{PARAMETERS, ParameterMatrix, ParameterVector};
use crate::imu::{InstallationForm, PerSensor};
use crate::models;
use crate::models::{ModelError, Place};
use crate::simulation::Scenario;
use crate::study::StudyError;
use crate::study::navigation::{FORTY_HOURS, INTERVAL, Mission, Motion};

/// The trajectory of the moving mission.
const TRAJECTORY: &str = "flight";
/// Probability outside the interval of a count, half on each side.
const OUTSIDE: f64 = 0.01;

/// Motion of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Journey {
    /// Stationary and level at the site of the scenario, heading North.
    Standing,
    /// The embedded trajectory `flight`, moved to the latitude of the site.
    Flight,
}

/// Horizontal position errors, computed minus true, east and north in m, at the end of a mission.
#[derive(Debug, Clone, PartialEq)]
pub struct Position {
    /// Error of the filter, with its predicted covariance.
    pub filter: Option<(Vector2<f64>, Matrix2<f64>)>,
    /// Covariance of the bound.
    pub bound: Matrix2<f64>,
    /// Error of the closed form in its own time.
    pub closed_form: Option<Vector2<f64>>,
    /// Error of the closed form in the filter's time.
    pub closed_form_in_equal_time: Option<Vector2<f64>>,
}

/// Navigation accuracy of the calibrations in one mission.
#[derive(Debug, Clone, PartialEq)]
pub struct NavigationAccuracy {
    /// Motion of the body.
    pub journey: Journey,
    /// Position errors of every run, in order.
    pub positions: Vec<Position>,
    /// Horizontal position errors in m; the σ and the bound are the square roots of the traces of their covariances.
    pub figures: Figures,
    /// Containment in each of [`Region::ALL`]; empty if no run gave an estimate with a regular covariance.
    pub containment: Vec<Containment>,
}

/// A region defined by the predicted covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Region {
    /// East within ±1σ.
    East,
    /// North within ±1σ.
    North,
    /// The east and north errors are within the ellipse of this many σ.
    Ellipse(f64),
}

/// Number of runs with errors within a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Containment {
    /// The region.
    pub region: Region,
    /// Number of runs with errors within the region.
    pub within: usize,
    /// Number of runs.
    pub runs: usize,
    /// 99 % interval of the number of runs within the region if the covariance is correct (binomial).
    pub interval: (usize, usize),
}

/// Linear model of a mission. It is computed once, because the model of one instrument is valid for all instruments of
/// its grade.
pub struct Way {
    journey: Journey,
    by_parameter: SMatrix<f64, 2, PARAMETERS>,
}

impl Journey {
    /// All journeys, in the order in which results list them.
    pub const ALL: [Self; 2] = [Self::Standing, Self::Flight];

    fn mission(self, scenario: &Scenario) -> Result<Mission, ModelError> {
        let site = &scenario.site;
        Ok(match self {
            Self::Standing => Mission::standing_level(site, FORTY_HOURS),
            Self::Flight => {
                let (trajectory, _) = models::trajectory(TRAJECTORY, &Place::Embedded)?;
                Mission {
                    motion: Motion::Moving(trajectory.at_latitude(site.latitude)),
                    intervals: FORTY_HOURS,
                    interval: INTERVAL,
                }
            }
        })
    }
}

impl Way {
    /// The model of a mission.
    pub(super) fn of(journey: Journey, scenario: &Scenario) -> Result<Self, StudyError> {
        let nominal = PerSensor::from_fn(|sensor| {
            let prior = scenario.instrument.prior(sensor, &scenario.installation);
            prior.mean(InstallationForm::General)
        });
        let exposures = journey.mission(scenario)?.exposure(&nominal)?;
        let end = exposures.last();
        Ok(Self {
            journey,
            by_parameter: end.map_or_else(SMatrix::zeros, |end| end.position()),
        })
    }

    /// Navigation accuracy of the calibrations of these runs.
    pub(super) fn worth(self, trials: &[Trial]) -> NavigationAccuracy {
        let positions: Vec<Position> = trials.iter().map(|trial| self.of_trial(trial)).collect();
        let filtered: Vec<_> = positions.iter().filter_map(|p| p.filter).collect();
        NavigationAccuracy {
            journey: self.journey,
            figures: Figures::new(positions.iter().map(Position::squares)),
            containment: Region::ALL
                .into_iter()
                .filter_map(|region| Containment::new(region, &filtered))
                .collect(),
            positions,
        }
    }

    fn of_trial(&self, trial: &Trial) -> Position {
        let covariance =
            |of: &ParameterMatrix| self.by_parameter * of * self.by_parameter.transpose();
        let closed = trial.closed_form.each_ref();
        let [own, equal] = closed.map(|error| Some(self.position(error.as_ref()?)));
        Position {
            filter: { trial.filtered.as_ref() }
                .map(|f| (self.position(&f.error), covariance(&f.covariance))),
            bound: covariance(&trial.bound_covariance),
            closed_form: own,
            closed_form_in_equal_time: equal,
        }
    }

    /// Position error from parameter errors, estimate minus truth; the linear model uses the opposite sign.
    fn position(&self, error: &ParameterVector) -> Vector2<f64> {
        -self.by_parameter * error
    }
}

impl Position {
    fn squares(&self) -> Squares {
        let square = |error: Vector2<f64>| error.norm_squared();
        Squares {
            filter: self.filter.map(|(error, _)| square(error)),
            claimed: self.filter.map(|(_, covariance)| covariance.trace()),
            bound: self.bound.trace(),
            closed_form: self.closed_form.map(square),
            closed_form_in_equal_time: self.closed_form_in_equal_time.map(square),
        }
    }
}

fn whitened(error: &Vector2<f64>, covariance: &Matrix2<f64>) -> Option<Vector2<f64>> {
    covariance.cholesky()?.l().solve_lower_triangular(error)
}

impl Region {
    /// All regions, in the order in which results list them.
    pub const ALL: [Self; 4] = [
        Self::East,
        Self::North,
        Self::Ellipse(1.0),
        Self::Ellipse(2.45),
    ];

    /// Probability of an error within the region, if the covariance is correct.
    pub fn probability(self) -> f64 {
        match self {
            Self::East | Self::North => erf(0.5f64.sqrt()),
            Self::Ellipse(sigmas) => 1.0 - (-0.5 * sigmas * sigmas).exp(),
        }
    }

    fn holds(self, error: &Vector2<f64>, covariance: &Matrix2<f64>) -> Option<bool> {
        let whitened = whitened(error, covariance)?;
        Some(match self {
            Self::East => error.x.powi(2) <= covariance.m11,
            Self::North => error.y.powi(2) <= covariance.m22,
            Self::Ellipse(sigmas) => whitened.norm() <= sigmas,
        })
    }
}

impl Containment {
    fn new(region: Region, errors: &[(Vector2<f64>, Matrix2<f64>)]) -> Option<Self> {
        let held = errors
            .iter()
            .filter_map(|(error, covariance)| region.holds(error, covariance));
        let held: Vec<bool> = held.collect();
        let runs = held.len();
        let binomial = Binomial::new(region.probability(), runs as u64).ok()?;
        let at = |p: f64| binomial.inverse_cdf(p) as usize;
        (runs > 0).then(|| Self {
            region,
            within: held.into_iter().filter(|&held| held).count(),
            runs,
            interval: (at(0.5 * OUTSIDE), at(1.0 - 0.5 * OUTSIDE)),
        })
    }

    /// Whether the number of runs within the region is inside its interval.
    pub fn as_claimed(&self) -> bool {
        (self.interval.0..=self.interval.1).contains(&self.within)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::{from_vector, to_vector};
    use crate::imu::Triad;
    use crate::study::navigation::{NavigationStudyError, Pair};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// East 3 m, north 4 m, correlated.
    fn covariance() -> Matrix2<f64> {
        Matrix2::new(9.0, 6.0, 6.0, 16.0)
    }

    fn of_all(errors: &[(Vector2<f64>, Matrix2<f64>)]) -> [Containment; 4] {
        Region::ALL.map(|region| Containment::new(region, errors).unwrap())
    }

    #[test]
    fn errors_are_counted_in_each_region_that_holds_them() {
        // Errors of 1σ in both are inside the 1.2σ ellipse along the correlation, and outside
        // the 1.9σ ellipse across it.
        let errors = [
            (0.0, 0.0),
            (2.9, 3.9),
            (2.9, -3.9),
            (-3.1, 0.0),
            (0.0, -4.1),
            (6.0, 8.0),
            (-6.0, 8.0),
        ];
        let errors = errors.map(|(east, north)| (Vector2::new(east, north), covariance()));
        let counted = of_all(&errors);
        assert_eq!(counted.map(|c| c.within), [4, 4, 1, 6]);
        assert!(counted.iter().all(|c| c.runs == 7));
    }

    #[test]
    fn true_covariances_hold_errors_as_often_as_claimed_and_half_of_them_do_not() {
        let mut rng = ChaCha8Rng::seed_from_u64(12);
        let root = covariance().cholesky().unwrap().l();
        let mut errors: Vec<_> = (0..500)
            .map(|_| root * Vector2::from_fn(|_, _| rng.sample::<f64, _>(StandardNormal)))
            .map(|error| (error, covariance()))
            .collect();
        assert!(of_all(&errors).iter().all(Containment::as_claimed));
        for (_, covariance) in &mut errors {
            *covariance *= 0.5;
        }
        assert!(!of_all(&errors).iter().any(Containment::as_claimed));
    }

    #[test]
    fn an_interval_leaves_half_a_per_cent_on_each_side() {
        let errors = vec![(Vector2::zeros(), covariance()); 200];
        for Containment {
            region, interval, ..
        } in of_all(&errors)
        {
            let binomial = Binomial::new(region.probability(), 200).unwrap();
            let (low, high) = (interval.0 as u64, interval.1 as u64);
            assert!(binomial.cdf(low) >= 0.005 && binomial.cdf(low - 1) < 0.005);
            assert!(binomial.sf(high) <= 0.005 && binomial.sf(high - 1) > 0.005);
        }
        let probabilities = Region::ALL.map(Region::probability);
        let expected = [0.682_689, 0.682_689, 0.393_469, 0.950_275];
        for (found, expected) in probabilities.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{found}");
        }
    }

    #[test]
    fn a_covariance_that_is_singular_says_nothing() {
        let errors = [(Vector2::zeros(), Matrix2::zeros())];
        assert_eq!(Containment::new(Region::East, &errors), None);
    }

    #[test]
    fn a_way_leads_where_navigation_with_the_estimate_does() {
        let scenario = Scenario::load("demo").unwrap();
        let way = Way::of(Journey::Standing, &scenario).unwrap();
        let form = InstallationForm::General;
        let truth = PerSensor::from_fn(|_| Triad::ideal(form));
        let error = ParameterVector::from_fn(|i, _| 1e-8 * (1.0 + i as f64).sin());
        let pair = Pair {
            truth,
            calibration: from_vector(form, &(to_vector(&truth) + error)),
            covariance: None,
        };
        let mission = Journey::Standing.mission(&scenario).unwrap();
        let end = mission.errors(&pair).unwrap().pop().unwrap();
        let expected = end.error.unwrap().position.xy();
        let apart = way.position(&error) - expected;
        assert!(
            expected.norm() > 1000.0 && apart.norm() < 0.02 * expected.norm(),
            "{apart}"
        );
    }

    #[test]
    fn a_site_at_a_pole_is_refused_and_one_in_the_south_flown_from() {
        let mut scenario = Scenario::load("demo").unwrap();
        scenario.site.latitude = -1.2;
        assert!(Way::of(Journey::Standing, &scenario).is_ok());
        scenario.site.latitude = std::f64::consts::FRAC_PI_2;
        for journey in Journey::ALL {
            let way = Way::of(journey, &scenario);
            assert!(matches!(
                way,
                Err(StudyError::Navigation(NavigationStudyError::NearPole(_)))
            ));
        }
    }
}
