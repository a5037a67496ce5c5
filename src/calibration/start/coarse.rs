//! The coarse start: the linearisation point of the first pass. The coarse start does not change the prior of the
//! filter.

use nalgebra::Matrix3;

use super::earth_rate::{add_rates, gyro_bias_at_rest, gyrocompass};
use super::equations::{Equations, gauss_newton};
use super::gravity::{AtRest, Chain, add_magnitude, events, up};
use super::table;
use crate::attitude::level;
use crate::calibration::noise::ByHand;
use crate::calibration::{
    AttitudePrior, CalibrationError, Linearisation, NoisePolicy, ParameterVector, Problem,
    from_vector, to_vector,
};
use crate::earth::Site;
use crate::imu::{Sensor, TermVector};

/// Number of equations (a hundred dwells) above which parameters cannot absorb noise.
const MOST_EQUATIONS: usize = 600;
/// Maximum number of linearisation points at which noise is estimated.
const NOISE_ROUNDS: usize = 6;
/// A smaller step (1 ppm, 0.2″, and the same number in rad/s or m/s²) ends an iteration.
const SMALL: f64 = 1e-6;
/// Attitudes, heading and gyros are estimated alternately. Scale factor errors of several percent need four rounds with
/// the gyros alone.
const ROUNDS_OF_GYROS: usize = 4;
/// Total number of rounds; the later ones include the accelerometers.
const ROUNDS: usize = 8;

/// Starting point of the filter.
#[derive(Debug, Clone, PartialEq)]
pub struct CoarseStart {
    /// The first linearisation point.
    pub at: Linearisation,
    /// Prior of the initial attitude of each stretch.
    pub attitudes: Vec<AttitudePrior>,
    /// Noise added by hand motion, if requested.
    pub(in crate::calibration) by_hand: Option<ByHand>,
}

impl CoarseStart {
    /// A copy of the problem with the hand noise found at the start; `None` if there is no such noise.
    pub fn by_hand<'a>(&self, problem: &Problem<'a>) -> Option<Problem<'a>> {
        let by_hand = self.by_hand.as_ref()?;
        Some(problem.with_model(by_hand.model(problem)))
    }
}

/// Estimates both triads and the initial attitudes by least squares over whole dwells and moves.
///
/// With a table, the attitudes are known. Without a table, the accelerometers follow from `|f| = g` in the dwells, the
/// gyros from the gravity direction before and after each move, and gyro biases and heading from the rates at rest.
///
/// # Errors
/// Returns [`CalibrationError`] if there is no dwell, or data and prior contradict each other.
pub fn coarse_start(problem: &Problem) -> Result<CoarseStart, CalibrationError> {
    let dwells = dwells(problem)?;
    if let Some(attitudes) = attitudes_of_table(problem) {
        let mut first = from_vector(problem.model.form, &problem.model.prior_mean);
        first.gyro.bias = gyro_bias_at_rest(&dwells);
        // Equations with constant parameters fail for an instrument that warms up: a bias that drifts for an hour adds
        // up to radians.
        let smallest = ParameterVector::repeat(SMALL);
        let triads = match problem.model.thermal {
            Some(_) => first,
            None => gauss_newton(first, &smallest, |triads| {
                table::carried(problem, triads)?.step()
            })?,
        };
        let means = attitudes.iter().map(|attitude| attitude.mean).collect();
        return Ok(CoarseStart {
            at: Linearisation::new(triads, TermVector::zeros(), means),
            attitudes,
            by_hand: None,
        });
    }
    let (turned, by_hand) = calibrated_as_held(problem, &dwells)?;
    let Turned {
        at, heading_sigma, ..
    } = turned;
    let sites = problem.stretches().iter().map(|s| &s.run.site);
    let attitudes = at.initial_attitudes.iter().zip(&heading_sigma).zip(sites);
    let of_alignment = |((attitude, &sigma), site): ((&Matrix3<f64>, &f64), &Site)| {
        AttitudePrior::of_alignment(*attitude, sigma, &problem.model, site)
    };
    Ok(CoarseStart {
        attitudes: attitudes.map(of_alignment).collect(),
        at,
        by_hand,
    })
}

/// Prior of the initial attitude of each stretch.
pub fn initial_attitudes(problem: &Problem) -> Result<Vec<AttitudePrior>, CalibrationError> {
    match attitudes_of_table(problem) {
        Some(attitudes) => dwells(problem).map(|_| attitudes),
        None => Ok(coarse_start(problem)?.attitudes),
    }
}

fn attitudes_of_table(problem: &Problem) -> Option<Vec<AttitudePrior>> {
    let stretches = problem.stretches().iter();
    stretches
        .map(|stretch| stretch.attitude_of_table())
        .collect()
}

/// The dwells of each stretch; an error if there are no dwells.
pub fn dwells(problem: &Problem) -> Result<Vec<Vec<AtRest>>, CalibrationError> {
    let dwells = AtRest::all(problem);
    match dwells.iter().flatten().count() {
        0 => Err(CalibrationError::NoDwells),
        _ => Ok(dwells),
    }
}

/// Estimate of both triads and of attitudes, from gravity and the rates at rest.
pub struct Turned {
    /// The triads, and the attitude at the first sample of each stretch.
    pub at: Linearisation,
    /// 1σ of each heading, rad.
    heading_sigma: Vec<f64>,
    /// The equations of the estimate, linearised at the triads and attitudes.
    pub equations: Equations,
}

/// Estimates both triads and attitudes from gravity and Earth rate. The accelerometers alone come first, from the
/// magnitude of gravity.
pub fn calibrated(problem: &Problem, dwells: &[Vec<AtRest>]) -> Result<Turned, CalibrationError> {
    let model = &problem.model;
    let prior = from_vector(model.form, &model.prior_mean);
    let triads = gauss_newton(prior, &ParameterVector::repeat(SMALL), |triads| {
        let mut equations = Equations::of_triads(model, triads, &[Sensor::Accel]);
        add_magnitude(&mut equations, problem, dwells, triads)?;
        equations.step()
    })?;
    let first = dwells
        .iter()
        .map(|dwells| Ok(level(&up(&triads, &dwells[0])?)));
    let first = first.collect::<Result<_, CalibrationError>>()?;
    let mut at = Linearisation::new(triads, TermVector::zeros(), first);
    at.triads.gyro.bias = gyro_bias_at_rest(dwells);
    for round in 0..ROUNDS {
        let sensors = if round < ROUNDS_OF_GYROS {
            &[Sensor::Gyro][..]
        } else {
            &Sensor::ALL
        };
        let step = turned(problem, dwells, &mut at, sensors)?
            .equations
            .step()?;
        at.triads = from_vector(model.form, &(to_vector(&at.triads) + step));
    }
    turned(problem, dwells, &mut at, &Sensor::ALL)
}

/// Attitudes, headings and gyro biases for these triads, and the equations there.
///
/// The accelerometers are estimated together with the gyros, because the magnitude of gravity alone hardly determines
/// their misalignments if every dwell has an axis nearly up or down. Over a move between two dwells, the gyros must
/// carry the gravity direction observed before it to that observed after it; at rest they must sense Earth rate.
fn turned(
    problem: &Problem,
    dwells: &[Vec<AtRest>],
    at: &mut Linearisation,
    sensors: &[Sensor],
) -> Result<Turned, CalibrationError> {
    let (model, stretches) = (&problem.model, problem.stretches());
    let starts = at.initial_attitudes.iter().zip(stretches).zip(dwells);
    let chains = starts
        .map(|((first, stretch), dwells)| Chain::new(model, stretch, dwells, &at.triads, first));
    let chains = chains.collect::<Result<Vec<_>, _>>()?;
    let (headings, bias) = gyrocompass(model, stretches, dwells, &chains, &at.triads)?;
    let attitudes = chains.iter().zip(&headings);
    let attitudes = attitudes.map(|(chain, heading)| heading.turn * chain.attitudes[0]);
    at.initial_attitudes = attitudes.collect();
    at.triads.gyro.bias += at.triads.gyro.sensitivity() * bias;
    let mut equations = Equations::of_triads(model, &at.triads, sensors);
    if sensors.contains(&Sensor::Accel) {
        add_magnitude(&mut equations, problem, dwells, &at.triads)?;
    }
    for (k, (chain, heading)) in chains.iter().zip(&headings).enumerate() {
        let of_stretch = (&stretches[k], &dwells[k][..]);
        chain.add(&mut equations, of_stretch, heading);
        add_rates(
            &mut equations,
            model,
            of_stretch,
            chain,
            &at.triads,
            heading,
        )?;
    }
    equations.events = events(problem, dwells);
    equations.correlated = true;
    Ok(Turned {
        at: at.clone(),
        heading_sigma: headings.iter().map(|heading| heading.sigma).collect(),
        equations,
    })
}

/// The estimate with the noise added by hand motion, if the data show this noise but the residuals do not.
fn calibrated_as_held(
    problem: &Problem,
    dwells: &[Vec<AtRest>],
) -> Result<(Turned, Option<ByHand>), CalibrationError> {
    let stated = calibrated(problem, dwells)?;
    if stated.equations.rows.len() > MOST_EQUATIONS {
        return Ok((stated, None));
    }
    // If there are enough equations, the residuals show the noise of all of them; otherwise, only the prior does.
    let solution = stated.equations.solved();
    let tell = solution.is_none_or(|solution| solution.residuals.are_large());
    if tell || problem.options.noise == NoisePolicy::Stated {
        return Ok((stated, None));
    }
    let likeliest = |turned: &Turned, used: &ByHand| {
        let (errors, mut covariance) = turned.equations.before_data();
        let parts = turned.equations.by_hand();
        used.taken_from(&mut covariance, &parts);
        ByHand::likeliest(&errors, &covariance, &parts).filter(|found| !found.is_none())
    };
    let with = |by_hand: &ByHand| calibrated(&problem.with_model(by_hand.model(problem)), dwells);
    let Some(mut by_hand) = likeliest(&stated, &ByHand::default()) else {
        return Ok((stated, None));
    };
    // The linearisation point depends on the noise, and the noise on the linearisation point.
    for _ in 0..NOISE_ROUNDS {
        // If the estimate fails with a trial noise, this is not the noise of the recording.
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
