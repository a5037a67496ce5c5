//! Equations from labels, for an instrument that is placed by hand with each axis up and down and is turned about each
//! axis.
//!
//! The direction of north is unknown but common to all sections with the same heading; turns change it along with the
//! instrument.
//!
//! Source: Ferraris, Grimaldi, Parvis 1995, "Procedure for effortless in-field calibration of
//! three-axial rate gyro and accelerometers", *Sensors and Materials* 7(5), without the gyros'
//! g-sensitivity.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::equations::Common;
use super::positions::{Known, Observed, Position};
use crate::attitude::{exp, skew};
use crate::earth::ROTATION_RATE;
use crate::imu::{PerSensor, Sensor};
use crate::recording::LabelledMotion;
use crate::run::motion::{LabelCheck, Rest, checks};
use crate::run::{Dwell, MeanOutput, Run};

/// Step of the integration of turns, s; within one step, a hand turns by a few degrees.
const STEP: f64 = 0.02;
/// The number of the common error that represents the mean reduction of all inputs by tilts.
const SHORTENED: Common = Common::Unit(usize::MAX);

/// The used part of a labelled section.
#[derive(Debug, Clone)]
pub struct Section {
    pub samples: Range<usize>,
    pub motion: LabelledMotion,
    /// Mean output of each triad.
    pub mean: PerSensor<MeanOutput>,
    /// Start and end, s.
    times: [f64; 2],
}

impl Section {
    pub fn new(run: &Run, samples: Range<usize>, motion: LabelledMotion) -> Self {
        let dwell = Dwell {
            samples: samples.clone(),
            position: None,
        };
        Self {
            samples,
            motion,
            mean: PerSensor::from_fn(|sensor| dwell.mean(sensor, run)),
            times: dwell.times(run),
        }
    }

    pub fn stands(&self) -> bool {
        matches!(self.motion, LabelledMotion::Stands { .. })
    }

    pub fn duration(&self) -> f64 {
        self.times[1] - self.times[0]
    }
}

/// The sections that are used, and the labels of the other sections.
#[derive(Default)]
pub struct Used {
    pub sections: Vec<Section>,
    pub lost: Vec<String>,
    pub contradicted: Vec<LabelCheck>,
}

impl Used {
    pub fn of(run: &Run, rests: &[Rest]) -> Self {
        let mut found = Self::default();
        for check in checks(run, rests) {
            let segment = &check.segment;
            let Some(motion) = segment.motion else {
                continue;
            };
            if run.recording.imu.is_lost(&segment.samples) {
                found.lost.push(format!("`{}`", segment.label));
                continue;
            }
            let used = check.as_labelled.clone();
            // Borders that are a little too wide do no harm.
            let as_stated = used.as_ref() == Some(&segment.samples);
            if check.disagreement.is_some() && !as_stated {
                found.contradicted.push(check);
            }
            let section = used.map(|samples| Section::new(run, samples, motion));
            found.sections.extend(section);
        }
        found
    }
}

/// Mean outputs of both triads for the labelled inputs.
pub fn observed(run: &Run, rests: &[Rest], sections: &[Section]) -> PerSensor<Observed> {
    PerSensor::from_fn(|sensor| Observed {
        sensor,
        noise: *run.instrument.noise.get(sensor),
        known: match sensor {
            Sensor::Gyro => of_gyros(run, rests, sections),
            Sensor::Accel => of_accelerometers(run, sections),
        },
    })
}

/// Gyro positions from all sections. The inputs share the reduction by tilts, the ends of the turns, and Earth rate.
fn of_gyros(run: &Run, rests: &[Rest], sections: &[Section]) -> Vec<Known> {
    let sigma = run.segment_sigma;
    let level = run.site.earth_rate_n().y;
    let directions = directions(run, rests, sections);
    // Numbers after those of the directions: the rests in which turns begin and end, or single ends.
    let first = directions.iter().map(|of| of.number + 1).max().unwrap_or(0);
    let mut ends: Vec<Option<usize>> = Vec::new();
    let mut number_of_end = |sample: usize| {
        let rest = rest_at(rests, sample);
        let known = ends.iter().position(|&end| end.is_some() && end == rest);
        first
            + known.unwrap_or_else(|| {
                ends.push(rest);
                ends.len() - 1
            })
    };
    let known = sections
        .iter()
        .zip(&directions)
        .map(|(section, direction)| {
            let MeanOutput { output, variance } = section.mean.gyro;
            let noise = Vector3::repeat(variance);
            let mut errors = Vec::new();
            let (carried, position) = match section.motion {
                LabelledMotion::Stands { up } => {
                    // A tilt moves part of the horizontal Earth rate to the upward axis, and a rotation about that axis
                    // moves part of it to the other level axis.
                    let tilted = up.component_mul(&up) + across(&up) * 0.5;
                    let noise = noise + tilted * (level * sigma).powi(2);
                    (
                        Matrix3::identity(),
                        set_by_hand(sigma, direction.known, output, noise),
                    )
                }
                LabelledMotion::Turns { axis, angle } => {
                    let carried = mean_turned_back(run, section);
                    let rate = axis * (angle / section.duration()) + carried * direction.known;
                    // Both ends are set by hand. Each is wrong by an angle about the axis of the turn, common to all
                    // turns that begin or end in that position, and by angles across this axis.
                    let of_end = axis * axis.transpose() * (sigma / section.duration());
                    let last = section.samples.end.saturating_sub(1);
                    let begin = number_of_end(section.samples.start);
                    errors.push((Common::Unit(begin), -of_end));
                    errors.push((Common::Unit(number_of_end(last)), of_end));
                    let ends = across(&axis) * (2.0 * (sigma / section.duration()).powi(2));
                    (carried, set_by_hand(sigma, rate, output, noise + ends))
                }
            };
            errors.push((SHORTENED, shortened(&position, sigma)));
            let of_direction = Common::Unit(direction.number);
            errors.push((of_direction, carried * direction.spread));
            Known {
                position,
                times: section.times,
                errors,
            }
        });
    known.collect()
}

/// Accelerometer positions from static sections. The tilt of each position also counts, because misaligned axes project
/// it onto the upward axis. This does not apply to turns, where independent tilts dominate the misalignment estimate.
fn of_accelerometers(run: &Run, sections: &[Section]) -> Vec<Known> {
    let sigma = run.segment_sigma;
    let stands = sections.iter().filter_map(|section| match section.motion {
        LabelledMotion::Stands { up } => Some((section, up)),
        LabelledMotion::Turns { .. } => None,
    });
    let known = stands.enumerate().map(|(number, (section, up))| {
        let MeanOutput { output, variance } = section.mean.accel;
        let force = up * run.site.gravity;
        let position = force_by_hand(sigma, force, output, Vector3::repeat(variance));
        Known {
            times: section.times,
            errors: by_tilts(&position, sigma, number).to_vec(),
            position,
        }
    });
    known.collect()
}

/// Gravity along an axis. It is weighted as if its components along the other two axes were unknown, so the bias of
/// each axis comes from its own two positions, as in half sums. Those components come from [`by_tilts`].
fn force_by_hand(
    sigma: f64,
    force: Vector3<f64>,
    output: Vector3<f64>,
    noise: Vector3<f64>,
) -> Position {
    Position {
        variance: noise + along(sigma, &force),
        weighted: noise + across(&force),
        ..set_by_hand(sigma, force, output, noise)
    }
}

/// An input along or about an axis that is misaligned by about a degree, with this noise.
///
/// To first order, the misplacement rotates the input into the other two axes. Along the axis it reduces the input to
/// second order, by half the sum of two squared angles. The mean of this is σ², the same for all positions
/// ([`shortened`]), with an equal scatter.
fn set_by_hand(
    sigma: f64,
    input: Vector3<f64>,
    output: Vector3<f64>,
    noise: Vector3<f64>,
) -> Position {
    let variance = noise + across(&input) * sigma.powi(2) + along(sigma, &input);
    Position {
        input,
        output,
        variance,
        weighted: variance,
    }
}

/// Variance of the reduction of an input by a tilt.
fn along(sigma: f64, input: &Vector3<f64>) -> Vector3<f64> {
    input.map(|component| (component * sigma.powi(2)).powi(2))
}

/// Squared effect of a small rotation about any axis on each component of an input: the squared magnitude of the other
/// two components.
fn across(input: &Vector3<f64>) -> Vector3<f64> {
    input.map(|component| input.norm_squared() - component.powi(2))
}

/// Mean reduction of an input by tilts of this σ.
fn shortened(position: &Position, sigma: f64) -> Matrix3<f64> {
    let mut shortened = Matrix3::zeros();
    shortened.set_column(0, &(position.input * -sigma.powi(2)));
    shortened
}

/// The mean reduction of an input by tilts, and the tilts about each axis of the position with this number.
fn by_tilts(position: &Position, sigma: f64, number: usize) -> [(Common, Matrix3<f64>); 2] {
    let tilts = skew(position.input) * sigma;
    [
        (SHORTENED, shortened(position, sigma)),
        (Common::Unit(number), tilts),
    ]
}

/// Earth rate along body axes at the start of a section.
#[derive(Debug, Clone, Copy)]
struct Direction {
    /// The part of Earth rate common to all sections.
    number: usize,
    known: Vector3<f64>,
    /// 1σ of the remainder.
    spread: Matrix3<f64>,
}

/// The dwell of this sample.
fn rest_at(rests: &[Rest], sample: usize) -> Option<usize> {
    let is_in = |rest: &Rest| rest.dwell.samples.contains(&sample);
    rests.iter().position(is_in)
}

/// Earth rate at the start of each section. A turn that starts in a labelled dwell uses the Earth rate of that dwell.
fn directions(run: &Run, rests: &[Rest], sections: &[Section]) -> Vec<Direction> {
    let rate = run.site.earth_rate_n();
    let mut next = 0;
    let mut number = || {
        next += 1;
        next - 1
    };
    let mut standing: Vec<(&Section, Direction)> = Vec::new();
    for section in sections {
        let LabelledMotion::Stands { up } = section.motion else {
            continue;
        };
        let mut others = standing.iter();
        let alike =
            others.find(|(other, _)| share_heading(other, section, up, rate.y, run.segment_sigma));
        // North is equally likely along either level axis.
        let level = Matrix3::identity() - up * up.transpose();
        let direction = Direction {
            number: alike.map_or_else(&mut number, |(_, direction)| direction.number),
            known: up * rate.z,
            spread: level * (rate.y * 0.5f64.sqrt()),
        };
        standing.push((section, direction));
    }
    let middle = |of: &Section| of.samples.start.midpoint(of.samples.end);
    let direction = |section: &Section| {
        let rest = rest_at(rests, section.samples.start);
        let found = standing.iter().find(|(other, _)| {
            if section.stands() {
                std::ptr::eq(*other, section)
            } else {
                rest.is_some() && rest_at(rests, middle(other)) == rest
            }
        });
        found
            .map(|(_, direction)| *direction)
            .unwrap_or_else(|| Direction {
                // A vector of known length in any direction.
                number: number(),
                known: Vector3::zeros(),
                spread: Matrix3::identity() * (ROTATION_RATE / 3.0f64.sqrt()),
            })
    };
    sections.iter().map(direction).collect()
}

/// Whether two sections with this axis up have the same heading: a common horizontal Earth rate is more likely than two
/// directions.
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
    let (one, other) = (one.mean.gyro, other.mean.gyro);
    let off = one.output - other.output;
    let off = (off - up * up.dot(&off)).norm_squared();
    // Each section may be rotated by hand about the vertical.
    let same = one.variance + other.variance + (level * hand_sigma).powi(2);
    let apart = same + level.powi(2);
    // −2 ln of the likelihoods of both level axes.
    off / same + 2.0 * same.ln() <= off / apart + 2.0 * apart.ln()
}

/// Mean over a section of the rotation from its initial to its current body axes, with nominal scales.
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

#[cfg(test)]
mod tests {
    use nalgebra::SVector;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::super::positions::Fit;
    use super::*;
    use crate::attitude::exp;
    use crate::calibration::mean_square_interval;
    use crate::imu::{InstallationForm, Noise, ParameterKind, Triad, TriadVector};
    use crate::units::DEGREE;

    /// How an input follows errors, by number.
    type Errors = Vec<(Common, Matrix3<f64>)>;

    /// Squared errors over variances of scale factors, misalignments and biases, from this many sets of
    /// positions that are each off by random tilts.
    fn mean_squares(
        sets: usize,
        tilt: f64,
        errors: fn(usize, &Position, f64) -> Errors,
        make: impl Fn(&mut dyn FnMut(f64) -> Vector3<f64>, &Triad) -> Vec<Position>,
    ) -> [f64; 3] {
        let form = InstallationForm::General;
        let v = [
            1.02, 0.97, 1.01, 0.02, -0.03, 0.01, 0.02, -0.01, 0.03, 0.5, -0.2, 0.1,
        ];
        let truth = Triad::from_vector(form, &TriadVector::from(v));
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let mut sums = [0.0; 3];
        for _ in 0..sets {
            let mut draw = |sigma: f64| {
                let v: SVector<f64, 3> = SVector::from_fn(|_, _| StandardNormal.sample(&mut rng));
                v * sigma
            };
            let positions = make(&mut draw, &truth);
            let known = positions.iter().enumerate().map(|(k, position)| Known {
                position: *position,
                times: [k as f64, k as f64 + 1.0],
                errors: errors(k, position, tilt),
            });
            let observed = Observed {
                sensor: Sensor::Accel,
                noise: Noise::default(),
                known: known.collect(),
            };
            let Fit {
                triad,
                covariance,
                residuals,
                ..
            } = observed.determined(form).unwrap();
            // As the statements say, before residuals widen it.
            let covariance = covariance / residuals.growth().powi(2);
            let error = triad.to_vector() - truth.to_vector();
            for (k, e) in error.iter().enumerate() {
                let place = match Triad::kind(k) {
                    ParameterKind::Scale => 0,
                    ParameterKind::Installation => 1,
                    ParameterKind::Bias => 2,
                };
                let of_kind = [3.0, 6.0, 3.0][place] * sets as f64;
                sums[place] += e.powi(2) / covariance[(k, k)] / of_kind;
            }
        }
        sums
    }

    fn tilted(number: usize, position: &Position, sigma: f64) -> Errors {
        by_tilts(position, sigma, number).to_vec()
    }

    fn only_shortened(_: usize, position: &Position, sigma: f64) -> Errors {
        vec![(SHORTENED, shortened(position, sigma))]
    }

    #[test]
    fn positions_that_a_hand_tilts_are_as_wrong_as_their_sigma_says() {
        const SETS: usize = 400;
        let (tilt, noise) = (2.0 * DEGREE, 2e-3);
        let squares = mean_squares(SETS, tilt, tilted, |draw, truth| {
            let axes = (0..6).map(|k| Vector3::ith(k / 2, if k % 2 == 0 { 9.8 } else { -9.8 }));
            axes.map(|force| {
                let sensed = truth.output(&(exp(draw(tilt)) * force)) + draw(noise);
                force_by_hand(tilt, force, sensed, Vector3::repeat(noise.powi(2)))
            })
            .collect()
        });
        println!("{squares:?}");
        // Of first order in the tilts, and so as normal as they are.
        let (low, high) = mean_square_interval(6 * SETS, 1e-3);
        assert!((low..=high).contains(&squares[1]));
        // Second order: squares of squares; their mean is as stated, but they scatter widely.
        assert!((0.5..1.5).contains(&squares[0]), "scale {}", squares[0]);
        assert!((0.5..1.5).contains(&squares[2]), "bias {}", squares[2]);
    }

    #[test]
    fn turns_about_tilted_axes_are_as_wrong_as_their_sigma_says() {
        const SETS: usize = 400;
        let (tilt, noise, duration) = (2.0 * DEGREE, 1e-4, 4.0);
        let end = tilt / duration;
        let squares = mean_squares(SETS, tilt, only_shortened, |draw, truth| {
            let turns = (0..3).map(|k| Vector3::ith(k, std::f64::consts::TAU / duration));
            let turns: Vec<_> = turns
                .map(|rate| {
                    let turned = exp(draw(tilt)) * rate + draw(end);
                    let output = truth.output(&turned) + draw(noise);
                    let variance = Vector3::repeat(noise.powi(2) + end.powi(2));
                    set_by_hand(tilt, rate, output, variance)
                })
                .collect();
            let rests = (0..6).map(|_| {
                let output = truth.output(&Vector3::zeros()) + draw(noise);
                let variance = Vector3::repeat(noise.powi(2));
                set_by_hand(tilt, Vector3::zeros(), output, variance)
            });
            rests.chain(turns).collect()
        });
        println!("{squares:?}");
        for (squares, of_kind) in squares.into_iter().zip([3, 6, 3]) {
            let (low, high) = mean_square_interval(of_kind * SETS, 1e-3);
            assert!((low..=high).contains(&squares), "{squares} {low} {high}");
        }
    }
}
