//! Earth's rate in labelled sections. Which way is north is not known, but it is the same way in all sections
//! with one heading, and a turn carries it along.

use std::ops::Range;

use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::attitude::exp;
use crate::earth::ROTATION_RATE;
use crate::recording::LabelledMotion;
use crate::run::Run;
use crate::run::motion::Rest;

/// Turns are followed in steps this long, s: within one a hand turns by a few degrees.
const STEP: f64 = 0.02;

/// A labelled section as far as it is used, and the gyros' mean output over it.
#[derive(Debug, Clone)]
pub struct Section {
    pub samples: Range<usize>,
    pub motion: LabelledMotion,
    pub output: Vector3<f64>,
    pub variance: f64,
}

impl Section {
    pub fn stands(&self) -> bool {
        matches!(self.motion, LabelledMotion::Stands { .. })
    }
}

/// What labels say of Earth's rate, and what they leave open.
pub struct EarthRate {
    /// Mean of what is plumb of it over each section, along body axes.
    pub known: Vec<Vector3<f64>>,
    /// How the means change with what is level of it, for one σ: three rows a section.
    pub errors: DMatrix<f64>,
}

/// Earth's rate along body axes where a section begins.
#[derive(Debug, Clone, Copy)]
struct Direction {
    /// The same for all sections that share it.
    number: usize,
    known: Vector3<f64>,
    /// One σ of what is not.
    spread: Matrix3<f64>,
}

/// The rest in which this sample is.
pub fn rest_at(rests: &[Rest], sample: usize) -> Option<usize> {
    let is_in = |rest: &Rest| rest.dwell.samples.contains(&sample);
    rests.iter().position(is_in)
}

/// Earth's rate over all sections. A turn that begins in a labelled rest begins with that rest's.
pub fn earth_rate(run: &Run, rests: &[Rest], sections: &[Section], hand_sigma: f64) -> EarthRate {
    let directions = directions(run, rests, sections, hand_sigma);
    let numbers = directions.iter().map(|direction| direction.number + 1);
    let columns = 3 * numbers.max().unwrap_or(0);
    let mut errors = DMatrix::zeros(3 * sections.len(), columns);
    let mut known = Vec::new();
    for (k, (section, direction)) in sections.iter().zip(&directions).enumerate() {
        let carried = match section.motion {
            LabelledMotion::Stands { .. } => Matrix3::identity(),
            LabelledMotion::Turns { .. } => mean_turned_back(run, section),
        };
        known.push(carried * direction.known);
        errors
            .fixed_view_mut::<3, 3>(3 * k, 3 * direction.number)
            .copy_from(&(carried * direction.spread));
    }
    EarthRate { known, errors }
}

fn directions(run: &Run, rests: &[Rest], sections: &[Section], hand_sigma: f64) -> Vec<Direction> {
    let rate = run.site.earth_rate_n();
    let mut next = 0;
    let mut stand: Vec<(usize, Direction)> = Vec::new();
    for (k, section) in sections.iter().enumerate() {
        let LabelledMotion::Stands { up } = section.motion else {
            continue;
        };
        let alike = stand
            .iter()
            .find(|(other, _)| share_heading(&sections[*other], section, up, rate.y, hand_sigma));
        let number = alike.map_or(next, |(_, direction)| direction.number);
        next = next.max(number + 1);
        // North is as likely along either level axis.
        let level = Matrix3::identity() - up * up.transpose();
        let direction = Direction {
            number,
            known: up * rate.z,
            spread: level * (rate.y * 0.5f64.sqrt()),
        };
        stand.push((k, direction));
    }
    let of_rest = |rest: usize| {
        let middle = |k: usize| sections[k].samples.start.midpoint(sections[k].samples.end);
        let stands = stand
            .iter()
            .find(|(k, _)| rest_at(rests, middle(*k)) == Some(rest));
        stands.map(|(_, direction)| *direction)
    };
    let mut of_section = |k: usize| match stand.iter().find(|(number, _)| *number == k) {
        Some((_, direction)) => *direction,
        None => rest_at(rests, sections[k].samples.start)
            .and_then(of_rest)
            .unwrap_or_else(|| {
                next += 1;
                // A vector of known length in any direction.
                Direction {
                    number: next - 1,
                    known: Vector3::zeros(),
                    spread: Matrix3::identity() * (ROTATION_RATE / 3.0f64.sqrt()),
                }
            }),
    };
    (0..sections.len()).map(&mut of_section).collect()
}

/// Whether two sections with this axis up have one heading: what is level of Earth's rate is likelier to be
/// the same in both than to have two directions.
fn share_heading(
    one: &Section,
    other: &Section,
    up: Vector3<f64>,
    level: f64,
    hand_sigma: f64,
) -> bool {
    if one.motion != (LabelledMotion::Stands { up }) {
        return false;
    }
    let off = one.output - other.output;
    let off = (off - up * up.dot(&off)).norm_squared();
    // Either is turned about the plumb line by hand.
    let same = one.variance + other.variance + (level * hand_sigma).powi(2);
    let apart = same + level.powi(2);
    // −2 ln of the likelihoods of both level axes.
    off / same + 2.0 * same.ln() <= off / apart + 2.0 * apart.ln()
}

/// Mean over a section of the rotation to its body axes from those at its begin, by nominal scales.
fn mean_turned_back(run: &Run, section: &Section) -> Matrix3<f64> {
    let imu = &run.recording.imu;
    let zero = run.instrument.prior.gyro.bias * imu.period;
    let length = ((STEP / imu.period).round() as usize).max(1);
    let mut attitude = Matrix3::<f64>::identity();
    let mut sum = Matrix3::<f64>::zeros();
    for step in imu.gyro.parts(section.samples.clone(), length) {
        let count = step.len() as f64;
        let half = exp((step.iter().sum::<Vector3<f64>>() - zero * count) * 0.5);
        sum += (attitude * half).transpose() * count;
        attitude *= half * half;
    }
    sum / (section.samples.len() as f64)
}
