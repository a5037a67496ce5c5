//! The coarse start: where the filter begins, not what it knows. The filter's prior stays its own.

mod equations;
mod gravity;
mod heading;
mod shared_noise;
mod table;
mod turns;

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use crate::attitude::exp;
use crate::calibration::checks::drift::drift;
use crate::calibration::checks::finding::Finding;
use crate::calibration::error::CalibrationError;
use crate::calibration::estimate::Estimate;
use crate::calibration::linearisation::{AttitudePrior, Linearisation, singular};
use crate::calibration::noise::{ByHand, NoisePolicy};
use crate::calibration::parameters::{ParameterMatrix, from_vector};
use crate::calibration::problem::Problem;
use crate::imu::{ParameterKind, Sensor, TermVector};
use turns::Turned;

/// So many equations, of a hundred dwells, leave no noise to parameters; their covariance is factorised whole, which takes
/// the cube of their number.
const MOST_EQUATIONS: usize = 600;
/// Points of linearisation at which noise is learnt, at most.
const ROUNDS: usize = 6;

/// Where the filter begins.
#[derive(Debug, Clone, PartialEq)]
pub struct CoarseStart {
    /// The first point of linearisation.
    pub at: Linearisation,
    /// What is known of the initial attitude of each stretch.
    pub attitudes: Vec<AttitudePrior>,
    /// Whether the noise of the gyros hides Earth rate, so that the heading may be any.
    pub hidden: bool,
    /// What a hand adds to the noise that is stated, where that was called for.
    pub(in crate::calibration) by_hand: Option<ByHand>,
}

impl CoarseStart {
    /// The same with the headings of these stretches in the other three quadrants.
    pub(in crate::calibration) fn other_headings(&self, of: Range<usize>) -> [Self; 3] {
        [1, 2, 3].map(|quadrant| {
            let turn = exp(Vector3::z() * (FRAC_PI_2 * f64::from(quadrant)));
            let mut turned = self.clone();
            for attitude in &mut turned.at.initial_attitudes[of.clone()] {
                *attitude = turn * *attitude;
            }
            for attitude in &mut turned.attitudes[of.clone()] {
                attitude.mean = turn * attitude.mean;
            }
            turned
        })
    }
}

/// Both triads and the initial attitudes by least squares over whole dwells and moves.
///
/// With a table, its attitudes are known. Without, accelerometers follow from `|f| = g` over the
/// dwells, gyros from the direction of gravity before and after each move, and gyro biases together
/// with the heading from the rates at rest.
///
/// # Errors
/// [`CalibrationError`] if there is no dwell, or data and prior do not fit each other.
pub fn coarse_start(problem: &Problem) -> Result<CoarseStart, CalibrationError> {
    enough(problem)?;
    if let Some(attitudes) = attitudes_of_table(problem) {
        return Ok(CoarseStart {
            at: Linearisation::new(
                table::from_table(problem)?,
                TermVector::zeros(),
                attitudes.iter().map(|attitude| attitude.mean).collect(),
            ),
            attitudes,
            hidden: false,
            by_hand: None,
        });
    }
    let (
        Turned {
            at, heading_sigma, ..
        },
        by_hand,
    ) = calibrated_as_held(problem)?;
    let gravity = problem.stretches().iter().map(|s| s.run.site.gravity);
    let attitudes = at.initial_attitudes.iter().zip(&heading_sigma).zip(gravity);
    let of_alignment = |((attitude, &sigma), gravity): ((&Matrix3<f64>, &f64), f64)| {
        AttitudePrior::of_alignment(*attitude, sigma, &problem.model, gravity)
    };
    Ok(CoarseStart {
        attitudes: attitudes.map(of_alignment).collect(),
        at,
        hidden: heading_sigma.into_iter().any(AttitudePrior::hides),
        by_hand,
    })
}

/// What is known of the initial attitude of each stretch.
pub fn initial_attitudes(problem: &Problem) -> Result<Vec<AttitudePrior>, CalibrationError> {
    match attitudes_of_table(problem) {
        Some(attitudes) => enough(problem).map(|()| attitudes),
        None => Ok(coarse_start(problem)?.attitudes),
    }
}

fn attitudes_of_table(problem: &Problem) -> Option<Vec<AttitudePrior>> {
    let stretches = problem.stretches().iter();
    stretches
        .map(|stretch| stretch.attitude_of_table())
        .collect()
}

/// Both triads by gravity alone, as a result of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct ByGravity {
    pub estimate: Estimate,
    /// Of how far the data bring the estimate from a prior that is right.
    pub distance: ParameterMatrix,
    /// What a hand adds to the noise that is stated, where the data show that.
    pub by_hand: Option<ByHand>,
    /// Residuals beyond chance, by which the covariance was widened, and a drift that they follow.
    pub ringing: Vec<Finding>,
}

/// The coarse start without a table, with its covariance.
pub fn by_gravity(problem: &Problem) -> Result<ByGravity, CalibrationError> {
    enough(problem)?;
    let (turned, by_hand) = calibrated_as_held(problem)?;
    let prior = from_vector(problem.model.form, &problem.model.prior_mean);
    let singular = || singular(&prior);
    let equations = &turned.equations;
    let residuals = equations
        .residuals(&turned.shared(problem))
        .ok_or_else(singular)?;
    let growth = residuals.growth();
    let (groups, times) = turns::dwells_and_moves(problem);
    let worst = residuals.worst(&groups);
    let mut of_equation = vec![0.0; groups.iter().map(Vec::len).sum()];
    for (group, [begin, end]) in groups.iter().zip(&times) {
        for &equation in group {
            of_equation[equation] = 0.5 * (begin + end);
        }
    }
    let kinds = [ParameterKind::Scale, ParameterKind::Bias];
    let changing = Sensor::ALL.map(|sensor| kinds.map(|kind| equations.changing(sensor, kind)));
    let drift = drift(
        &residuals,
        changing.as_flattened(),
        &of_equation,
        worst.without,
    );
    // Weights count against those of the prior: σ of all data grow where those of the prior shrink.
    let scale = growth.unwrap_or(1.0);
    let turned = match growth {
        None => turned,
        Some(growth) => {
            let mut model = match &by_hand {
                Some(by_hand) => by_hand.model(problem),
                None => problem.model.clone(),
            };
            model.prior_sigma /= growth;
            calibrated(&problem.with_model(model))?
        }
    };
    let shared = turned.shared(problem);
    let Turned { at, equations, .. } = turned;
    let covariance = equations.covariance(&shared).ok_or_else(singular)?;
    let distance = equations.covariance_of_distance(&shared);
    Ok(ByGravity {
        estimate: Estimate {
            triads: at.triads,
            covariance: covariance * scale.powi(2),
        },
        distance: distance.ok_or_else(singular)? * scale.powi(2),
        by_hand,
        ringing: growth
            .map(|growth| {
                let times = worst.groups.iter().map(|&k| times[k]).collect();
                residuals.large("both triads", growth, (times, worst.without), None)
            })
            .into_iter()
            .chain(drift)
            .collect(),
    })
}

/// Both triads and attitudes by gravity, from the accelerometers by its magnitude.
fn calibrated(problem: &Problem) -> Result<Turned, CalibrationError> {
    turns::triads_and_attitudes(problem, &gravity::accelerometers(problem)?)
}

/// The same with what a hand adds to the noise that is stated, where the data show that and residuals cannot.
fn calibrated_as_held(problem: &Problem) -> Result<(Turned, Option<ByHand>), CalibrationError> {
    let stated = calibrated(problem)?;
    if stated.equations.count() > MOST_EQUATIONS {
        return Ok((stated, None));
    }
    // Residuals tell noise of all equations, where there are enough of them; else only the prior does.
    let residuals = stated.equations.residuals(&stated.shared(problem));
    let tell = residuals.is_none_or(|residuals| residuals.growth().is_some());
    if tell || problem.options.noise == NoisePolicy::Stated {
        return Ok((stated, None));
    }
    let likeliest = |turned: &Turned, used: &ByHand| {
        let shared = turned.shared(problem);
        let (errors, mut covariance) = turned.equations.before_data(&shared)?;
        let parts = turned.equations.by_hand();
        used.taken_from(&mut covariance, &parts);
        ByHand::likeliest(&errors, &covariance, &parts).filter(|found| !found.is_none())
    };
    let with = |by_hand: &ByHand| calibrated(&problem.with_model(by_hand.model(problem)));
    let Some(mut by_hand) = likeliest(&stated, &ByHand::default()) else {
        return Ok((stated, None));
    };
    // What equations are linearised at follows noise, and noise that.
    for _ in 0..ROUNDS {
        // What noise on trial leads nowhere with is not the noise of this record.
        let Ok(turned) = with(&by_hand) else {
            return Ok((stated, None));
        };
        match likeliest(&turned, &by_hand) {
            None => return Ok((stated, None)),
            Some(here) if here.is_like(&by_hand) => return Ok((turned, Some(here))),
            Some(here) => by_hand = here,
        }
    }
    Ok(match with(&by_hand) {
        Ok(turned) => (turned, Some(by_hand)),
        Err(_) => (stated, None),
    })
}

fn enough(problem: &Problem) -> Result<(), CalibrationError> {
    match problem.dwells().count() {
        0 => Err(CalibrationError::NoDwells),
        _ => Ok(()),
    }
}
