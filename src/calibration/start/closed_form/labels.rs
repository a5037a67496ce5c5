//! The closed form from labelled sections: the instrument is put with each axis up and down and turned
//! about each by hand.
//!
//! Source: Ferraris, Grimaldi, Parvis 1995, "Procedure for effortless in-field calibration of
//! three-axial rate gyro and accelerometers", *Sensors and Materials* 7(5), without the gyros'
//! g-sensitivity.

use std::ops::Range;

use nalgebra::{DMatrix, Vector3};

use super::both_triads::both_triads;
use super::earth_rate::{Section, earth_rate, rest_at};
use super::least_squares::across;
use super::observed::{Observed, Position};
use super::result::{ClosedForm, Reference, hidden};
use crate::attitude::skew;
use crate::calibration::checks::labels;
use crate::calibration::error::CalibrationError;
use crate::calibration::problem::Problem;
use crate::imu::{PerSensor, Sensor};
use crate::recording::LabelledMotion;
use crate::run::motion::{self, ContradictedLabel, Rest};
use crate::run::{Dwell, Run};

/// Both triads from the sections whose labels say how the instrument stands or turns.
pub fn by_labels(problem: &Problem) -> Result<ClosedForm, CalibrationError> {
    let run: &Run = problem.run();
    let rests = motion::rests(run);
    let Used {
        sections,
        lost,
        contradicted,
    } = used_sections(run, &rests);
    if sections.is_empty() && contradicted.is_empty() {
        return Err(CalibrationError::NoSections {
            labels: run.recording.labels(),
        });
    }
    if sections.is_empty() {
        return Err(CalibrationError::LabelsContradicted { contradicted });
    }
    let observed = PerSensor {
        gyro: of_gyros(run, &rests, &sections),
        accel: of_accelerometers(run, &sections),
    };
    let (estimate, mut findings) = both_triads(&observed, problem)?;
    findings.extend(hidden(&problem.model, &estimate, Reference::Labels));
    findings.extend(labels::contradicted(&contradicted));
    findings.extend(labels::lost(&lost));
    let standing: Vec<&Section> = sections.iter().filter(|s| s.stands()).collect();
    let samples: usize = standing.iter().map(|section| section.samples.len()).sum();
    Ok(ClosedForm {
        noise: None,
        findings,
        estimate,
        reference: Reference::Labels,
        positions: PerSensor::from_fn(|_| standing.len()),
        turns: sections.len() - standing.len(),
        standing_time: samples as f64 * run.recording.imu.period,
    })
}

/// The sections that are used, and why others are not.
struct Used {
    sections: Vec<Section>,
    lost: Vec<String>,
    contradicted: Vec<ContradictedLabel>,
}

fn used_sections(run: &Run, rests: &[Rest]) -> Used {
    let mut found = Used {
        sections: Vec::new(),
        lost: Vec::new(),
        contradicted: Vec::new(),
    };
    for check in motion::checks(run, rests) {
        let segment = &check.segment;
        let Some(motion) = segment.motion else {
            continue;
        };
        if run.recording.imu.is_lost(&segment.samples) {
            found.lost.push(format!("`{}`", segment.label));
            continue;
        }
        let used = check.as_labelled();
        // Borders that are drawn a little wide do no harm.
        let as_stated = used.as_ref() == Some(&segment.samples);
        if let Some(said) = check.disagreement().filter(|_| !as_stated) {
            found.contradicted.push(ContradictedLabel {
                label: segment.label.clone(),
                start: segment.start,
                said,
                used: used.is_some(),
            });
        }
        let Some(samples) = used else {
            continue;
        };
        let of_gyro = dwell(&samples).mean(Sensor::Gyro, run);
        found.sections.push(Section {
            samples,
            motion,
            output: of_gyro.output,
            variance: of_gyro.variance,
        });
    }
    found
}

fn dwell(samples: &Range<usize>) -> Dwell {
    Dwell {
        samples: samples.clone(),
        position: None,
    }
}

fn of_gyros(run: &Run, rests: &[Rest], sections: &[Section]) -> Observed {
    let sigma = run.segment_sigma;
    let level = run.site.earth_rate_n().y;
    let earth = earth_rate(run, rests, sections, sigma);
    let positions = sections.iter().zip(&earth.known).map(|(section, known)| {
        let noise = Vector3::repeat(section.variance);
        match section.motion {
            LabelledMotion::Stands { up } => {
                // A tilt brings some of what is level of Earth's rate to the axis that is up, and a turn about
                // that axis some to the other one that is level.
                let tilted = up.component_mul(&up) + across(&up) * 0.5;
                let noise = noise + tilted * (level * sigma).powi(2);
                set_by_hand(sigma, *known, section.output, noise)
            }
            LabelledMotion::Turns { axis, angle } => {
                let duration = section.samples.len() as f64 * run.recording.imu.period;
                let rate = axis * (angle / duration) + known;
                let ends = across(&axis) * (2.0 * (sigma / duration).powi(2));
                set_by_hand(sigma, rate, section.output, noise + ends)
            }
        }
    });
    let positions: Vec<Position> = positions.collect();
    let times = sections.iter().map(|s| dwell(&s.samples).times(run));
    let errors = [
        shortened(&positions, sigma),
        earth.errors,
        by_ends(run, rests, sections),
    ];
    Observed {
        errors: side_by_side(&errors),
        ..Observed::over(positions, times.collect(), &run.instrument.noise.gyro)
    }
}

fn of_accelerometers(run: &Run, sections: &[Section]) -> Observed {
    let sigma = run.segment_sigma;
    let (mut positions, mut times) = (Vec::new(), Vec::new());
    for section in sections {
        let LabelledMotion::Stands { up } = section.motion else {
            continue;
        };
        let stands = dwell(&section.samples);
        let of_accel = stands.mean(Sensor::Accel, run);
        let white = Vector3::repeat(of_accel.variance);
        let force = up * run.site.gravity;
        positions.push(force_by_hand(sigma, force, of_accel.output, white));
        times.push(stands.times(run));
    }
    Observed {
        errors: by_tilts(&positions, sigma),
        ..Observed::over(positions, times, &run.instrument.noise.accel)
    }
}

/// What the positions between which it is turned are off by about the turn's axis. Both ends of a turn are
/// set by hand, and a position in which one turn ends and another begins is off by one angle in both.
fn by_ends(run: &Run, rests: &[Rest], sections: &[Section]) -> DMatrix<f64> {
    let mut places: Vec<Option<usize>> = Vec::new();
    let mut column_of = |sample: usize| {
        let rest = rest_at(rests, sample);
        let known = places.iter().position(|&p| p.is_some() && p == rest);
        known.unwrap_or_else(|| {
            places.push(rest);
            places.len() - 1
        })
    };
    let mut errors = DMatrix::zeros(3 * sections.len(), 6 * sections.len());
    for (k, section) in sections.iter().enumerate() {
        let LabelledMotion::Turns { axis, .. } = section.motion else {
            continue;
        };
        let duration = section.samples.len() as f64 * run.recording.imu.period;
        let off = axis * axis.transpose() * (run.segment_sigma / duration);
        let last = section.samples.end.saturating_sub(1);
        for (sample, sign) in [(section.samples.start, -1.0), (last, 1.0)] {
            let column = 3 * column_of(sample);
            let mut of_end = errors.fixed_view_mut::<3, 3>(3 * k, column);
            of_end += off * sign;
        }
    }
    errors
}

fn side_by_side(parts: &[DMatrix<f64>]) -> DMatrix<f64> {
    let rows = parts.first().map_or(0, DMatrix::nrows);
    let columns = parts.iter().flat_map(|part| part.column_iter());
    let values: Vec<f64> = columns
        .flat_map(|c| c.iter().copied().collect::<Vec<_>>())
        .collect();
    let columns: usize = parts.iter().map(DMatrix::ncols).sum();
    DMatrix::from_vec(rows, columns, values)
}

/// Gravity along an axis. It is weighted as if nothing were known of how it falls on the other two axes:
/// so the bias of each comes from its own two positions, as in half sums. What falls there is of [`by_tilts`].
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

/// Variance of what a tilt takes off an input.
fn along(sigma: f64, input: &Vector3<f64>) -> Vector3<f64> {
    input.map(|component| (component * sigma.powi(2)).powi(2))
}

/// An input along or about an axis that is within a degree or so of where it should be, and this noise.
///
/// To first order that turns the input into the other two axes. Along the axis it takes off the second
/// order: half the sum of two squared angles. That is the square of σ in the mean, the same for all
/// positions ([`shortened`]), and scatters by as much.
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

/// What tilts of this σ take off all inputs in the mean.
fn shortened(positions: &[Position], sigma: f64) -> DMatrix<f64> {
    let inputs = positions.iter().flat_map(|p| <[f64; 3]>::from(p.input));
    DMatrix::from_iterator(3 * positions.len(), 1, inputs) * -sigma.powi(2)
}

/// The same, and then what each position is tilted by about each axis, for misaligned axes bring that to
/// the one that is up. Not so of turns: tilts of their own make what is found of misalignment there.
fn by_tilts(positions: &[Position], sigma: f64) -> DMatrix<f64> {
    let count = positions.len();
    let mut errors = shortened(positions, sigma).resize_horizontally(1 + 3 * count, 0.0);
    for (k, position) in positions.iter().enumerate() {
        let turned = skew(position.input) * sigma;
        errors
            .fixed_view_mut::<3, 3>(3 * k, 1 + 3 * k)
            .copy_from(&turned);
    }
    errors
}

#[cfg(test)]
mod tests {
    use nalgebra::SVector;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::super::least_squares::{Fit, determined};
    use super::*;
    use crate::attitude::exp;
    use crate::calibration::mean_square_interval;
    use crate::imu::{InstallationForm, ParameterKind, Triad, TriadVector};
    use crate::units::DEGREE;

    /// Squared errors over variances of scale factors, installation and biases, from this many sets of
    /// positions that are each off by random tilts.
    fn mean_squares(
        sets: usize,
        tilt: f64,
        errors: fn(&[Position], f64) -> DMatrix<f64>,
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
            let observed = Observed {
                errors: errors(&positions, tilt),
                ..Observed::independent(&positions)
            };
            let Fit {
                triad, covariance, ..
            } = determined(&observed, form).unwrap();
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

    #[test]
    fn positions_that_a_hand_tilts_are_as_wrong_as_their_sigma_says() {
        const SETS: usize = 400;
        let (tilt, noise) = (2.0 * DEGREE, 2e-3);
        let squares = mean_squares(SETS, tilt, by_tilts, |draw, truth| {
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
        // Of second order: squares of squares, whose mean is as stated but spreads widely.
        assert!((0.5..1.5).contains(&squares[0]), "scale {}", squares[0]);
        assert!((0.5..1.5).contains(&squares[2]), "bias {}", squares[2]);
    }

    #[test]
    fn turns_about_tilted_axes_are_as_wrong_as_their_sigma_says() {
        const SETS: usize = 400;
        let (tilt, noise, duration) = (2.0 * DEGREE, 1e-4, 4.0);
        let end = tilt / duration;
        let squares = mean_squares(SETS, tilt, shortened, |draw, truth| {
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
