//! Scale, signs and order of the gyros' axes by gravity's direction: how its changes from rest to rest lie to
//! what they say.

use std::ops::Range;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::gravity::{ANY_SCALE, ASKEW, Gravity};
use super::least_squares::{Equation, Fit, cost, fit, fit_at};
use super::motion::{PART, mean, means};
use super::rests::{Rests, TOLERANCE};
use crate::attitude::{exp, skew};
use crate::imu::{AxisOrder, PerSensor};
use crate::statistics::{FALSE_ALARM, chi_square_limit, median};
use crate::units::DEGREE;

/// Output of one chip is straight to this part, 1σ, as data sheets of such chips state (MPU-6050, section 6.1: 0.2 %): a
/// scale found at large rates is none at small ones.
const LINEAR: f64 = 2e-3;
/// Length of the steps over which gyros are added up, s.
const STEP: f64 = 0.02;
/// Length of those over which gravity's direction is followed, s.
const FOLLOWED: f64 = 0.08;
/// Specific force within this part of gravity shows its direction.
const NEAR_GRAVITY: f64 = 0.1;
/// What half of the moves may be off by, rad: more is none of these axes.
const NEAR: f64 = 8.0 * DEGREE;
/// Changes of direction below this tell nothing, rad.
const ENOUGH: f64 = 20.0 * DEGREE;
/// Other axes and scales must be worse by this factor.
const RIVAL: f64 = 2.0;
/// Scales within this factor are the same.
const SAME: f64 = 1.25;
/// A first guess may be wrong by this factor, for a hand shakes more than it turns …
const SEARCHED: f64 = 8.0;
/// … and is bettered from starts so far apart: from half of it on the least one is reached.
const APART: f64 = 1.1;
/// So many moves, those after which gravity lies most otherwise, tell orders of axes from one another …
const TELLING: usize = 12;
/// … and so few do not.
const FEWEST: usize = 3;

/// A zero that wanders by 0.1 °/s turns no further than what moves may be off by in this time, s.
const LONGEST: f64 = 60.0;

/// Logarithms of the angles of a unit about each axis, then how far the axes are askew.
const PARAMETERS: usize = 9;
type Parameters = SVector<f64, PARAMETERS>;

/// How the gyros' columns lie to the accelerometers'.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axes {
    /// Of each axis of the accelerometers the column that turns about it …
    pub columns: [usize; 3],
    /// … and the file's quantity a row for one rad a row, negative where it turns the other way.
    pub scale: Vector3<f64>,
    /// Of what is common to the scales, relative.
    pub sigma: f64,
    /// Whether the axes differ by more than those of one chip.
    pub by_axis: bool,
    pub moves: usize,
}

impl Axes {
    /// None where the moves do not tell one order and scale from all others.
    pub fn find(
        samples: &PerSensor<Vec<Vector3<f64>>>,
        rests: &Rests,
        gravity: &Gravity,
        period: f64,
    ) -> Option<Self> {
        let steps = |seconds: f64| ((seconds / period).round() as usize).max(1);
        let moves: Vec<Move> = rests
            .rows
            .windows(2)
            .filter(|pair| pair[0].end < pair[1].start)
            .filter(|pair| ((pair[1].start - pair[0].end) as f64) * period < LONGEST)
            .map(|pair| Move::between(samples, [&pair[0], &pair[1]], gravity, steps(STEP)))
            .collect();
        // A hand that shakes hides which axis is which from step to step, but not how far they turn.
        let first = step_by_step(samples, rests, gravity, steps(FOLLOWED))?;
        let reach = (SEARCHED.ln() / APART.ln()).ceil() as i32;
        let telling = telling(&moves);
        if telling.len() < FEWEST {
            return None;
        }
        let mut tried: Vec<(f64, f64, AxisOrder)> = Vec::new();
        for of in AxisOrder::all() {
            for k in -reach..=reach {
                let angle = first * APART.powi(k);
                tried.push((off(&telling, &(of.matrix() * angle)), angle, of));
            }
        }
        let &(_, angle, of) = tried.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        let (found, by_axis) = bettered(&moves, angle, &of.matrix())?;
        let angles = Vector3::from_fn(|axis, _| angle * found.at[axis].exp());
        let least = off(&telling, &(matrix(&found.at, angle) * of.matrix()));
        let common = angles.map(f64::ln).mean().exp();
        let common_part = Parameters::from_fn(|k, _| if k < 3 { 1.0 / 3.0 } else { 0.0 });
        let rival = tried
            .iter()
            .filter(|(_, other, order)| {
                *order != of || !(SAME.recip()..SAME).contains(&(other / common))
            })
            .map(|(off, ..)| *off)
            .fold(f64::INFINITY, f64::min);
        (least < NEAR && rival > NEAR.max(RIVAL * least)).then_some(Self {
            columns: of.source,
            scale: Vector3::from_fn(|axis, _| of.sign(axis) / angles[axis]),
            sigma: LINEAR.hypot(common_part.dot(&(found.covariance * common_part)).sqrt()),
            by_axis,
            moves: moves.len(),
        })
    }

    /// Angle in rad of a unit in a row, if all axes turn one way.
    pub fn angle(&self) -> Option<f64> {
        let size = self.scale.abs().map(f64::ln).mean().exp().recip();
        let sign = self.scale.map(f64::signum);
        (self.columns == [0, 1, 2] && sign.min() == sign.max()).then_some(size * sign.x)
    }

    /// Whether the columns are in the order of the accelerometers' and turn as theirs do.
    pub fn agree(&self) -> bool {
        self.columns == [0, 1, 2] && self.scale.min() > 0.0
    }
}

/// A motion between two rests.
struct Move {
    before: Vector3<f64>,
    after: Vector3<f64>,
    /// Sums of gyro rows.
    steps: Vec<Vector3<f64>>,
}

impl Move {
    fn between(
        samples: &PerSensor<Vec<Vector3<f64>>>,
        rests: [&Range<usize>; 2],
        gravity: &Gravity,
        length: usize,
    ) -> Self {
        let zeros = rests.map(|rows| mean(&samples.gyro[rows.clone()]));
        let zero = 0.5 * (zeros[0] + zeros[1]);
        let step =
            |rows: &[Vector3<f64>]| rows.iter().sum::<Vector3<f64>>() - zero * rows.len() as f64;
        let [before, after] =
            rests.map(|rows| gravity.direction(&mean(&samples.accel[rows.clone()])));
        Self {
            before,
            after,
            steps: samples.gyro[rests[0].end..rests[1].start]
                .chunks(length)
                .map(step)
                .collect(),
        }
    }

    /// Gravity's direction after it, if rows turn by this.
    fn turned(&self, angle: &Matrix3<f64>) -> Vector3<f64> {
        let turn = |up: Vector3<f64>, step: &Vector3<f64>| exp(-(angle * step)) * up;
        self.steps.iter().fold(self.before, turn)
    }

    /// What the direction after it is off by along both ways across it.
    fn equations(
        &self,
        at: &Parameters,
        first: f64,
        order: &Matrix3<f64>,
    ) -> [Equation<PARAMETERS>; 2] {
        let askew = askew(at);
        let angles = Vector3::from_fn(|axis, _| first * at[axis].exp());
        let mut up = self.before;
        let mut changes = SMatrix::<f64, 3, PARAMETERS>::zeros();
        for step in &self.steps {
            let plain = (order * step).component_mul(&angles);
            // What changes during a step is turned by half of it, before and after.
            let half = exp(-0.5 * (askew * plain));
            let middle = half * up;
            up = half * middle;
            changes = half * (half * changes);
            let turned = |k: usize| match k {
                0..3 => askew.column(k) * plain[k],
                _ => Vector3::ith(OFF_DIAGONAL[k - 3].0, plain[OFF_DIAGONAL[k - 3].1]),
            };
            for (k, mut column) in changes.column_iter_mut().enumerate() {
                column += half * middle.cross(&turned(k));
            }
        }
        let across = self
            .after
            .cross(&Vector3::ith(self.after.iamin(), 1.0))
            .normalize();
        let off = up - self.after;
        [across, self.after.cross(&across)].map(|along| Equation {
            residual: along.dot(&off),
            row: changes.tr_mul(&along),
        })
    }
}

const OFF_DIAGONAL: [(usize, usize); 6] = [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)];

fn askew(at: &Parameters) -> Matrix3<f64> {
    let mut matrix = Matrix3::identity();
    for (k, place) in OFF_DIAGONAL.into_iter().enumerate() {
        matrix[place] = at[3 + k];
    }
    matrix
}

/// Rows in the accelerometers' order to angles.
fn matrix(at: &Parameters, first: f64) -> Matrix3<f64> {
    let angles = Vector3::from_fn(|axis, _| first * at[axis].exp());
    askew(at) * Matrix3::from_diagonal(&angles)
}

/// Those after which gravity lies most otherwise.
fn telling(moves: &[Move]) -> Vec<&Move> {
    let turned = |carry: &&Move| carry.before.dot(&carry.after);
    let mut telling: Vec<&Move> = moves.iter().collect();
    telling.sort_by(|a, b| turned(a).total_cmp(&turned(b)));
    telling.retain(|carry| carry.before.angle(&carry.after) > ENOUGH);
    telling.truncate(TELLING);
    telling
}

/// What half of the moves are off by at most, rad.
fn off(moves: &[&Move], angle: &Matrix3<f64>) -> f64 {
    let of = |carry: &&Move| carry.turned(angle).angle(&carry.after);
    let mut angles: Vec<f64> = moves.iter().map(of).collect();
    median(&mut angles).unwrap_or(f64::INFINITY)
}

/// The likeliest scales and askewness of axes in an order, and whether they are those of several chips.
fn bettered(moves: &[Move], first: f64, order: &Matrix3<f64>) -> Option<(Fit<PARAMETERS>, bool)> {
    let equations = |at: &Parameters| -> Vec<Equation<PARAMETERS>> {
        let of = |carry: &Move| carry.equations(at, first, order);
        moves.iter().flat_map(of).collect()
    };
    let (of_one, of_several) = (prior(TOLERANCE), prior(ANY_SCALE));
    let one = fit(Parameters::zeros(), &of_one, PART, equations)?;
    let Some(several) = fit(one.at, &of_several, PART, equations) else {
        return Some((one, false));
    };
    // Two accounts are held against each other at one σ.
    let sigma = several.sigma;
    let cost_of = |prior: &_, at: &Parameters| cost(&equations(at), sigma, prior, at);
    let gain = fit_at(one.at, &of_one, sigma, equations)
        .map(|one| cost_of(&of_one, &one.at) - cost_of(&of_several, &several.at));
    Some(match gain {
        Some(gain) if gain < chi_square_limit(2.0, FALSE_ALARM) => (one, false),
        _ => (several, true),
    })
}

/// Of scales about a common one of any size, and of axes that are not askew.
fn prior(spread: f64) -> SMatrix<f64, PARAMETERS, PARAMETERS> {
    let mut information = SMatrix::zeros();
    for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
        let own = if a == b { 1.0 } else { 0.0 };
        information[(a, b)] = (own - 1.0 / 3.0) / spread.powi(2) + 1.0 / (3.0 * ANY_SCALE.powi(2));
    }
    for k in 3..PARAMETERS {
        information[(k, k)] = ASKEW.powi(-2);
    }
    information
}

/// How far a unit of the gyros turns, by least squares of `ḟ = f × M ω` for M wherever |f| is that of gravity.
fn step_by_step(
    samples: &PerSensor<Vec<Vector3<f64>>>,
    rests: &Rests,
    gravity: &Gravity,
    length: usize,
) -> Option<f64> {
    let zero = Vector3::from_fn(|axis, _| {
        let mut values: Vec<f64> = rests.means.gyro.iter().map(|mean| mean[axis]).collect();
        median(&mut values).unwrap_or(0.0)
    });
    let gyro = means(&samples.gyro, length);
    let accel: Vec<Vector3<f64>> = means(&samples.accel, length)
        .iter()
        .map(|output| gravity.correction * (output - gravity.zero))
        .collect();
    let mut information = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
    let mut right = Parameters::zeros();
    for (rate, force) in gyro.windows(3).zip(accel.windows(3)) {
        if force.iter().any(|f| (f.norm() - 1.0).abs() > NEAR_GRAVITY) {
            continue;
        }
        let angle = (0.5 * (rate[0] + rate[2]) + rate[1] - 2.0 * zero) * length as f64;
        let change = force[2].normalize() - force[0].normalize();
        let across = skew(force[1].normalize());
        let rows = across.kronecker(&angle.transpose());
        information += rows.transpose() * rows;
        right += rows.tr_mul(&change);
    }
    let found = information.cholesky()?.solve(&right);
    Some(found.norm() / 3f64.sqrt()).filter(|angle| *angle > 0.0 && angle.is_finite())
}
