//! The closed form from labelled sections: the instrument is put with each axis up and down and turned
//! about each by hand.
//!
//! Source: Ferraris, Grimaldi, Parvis 1995, "Procedure for effortless in-field calibration of
//! three-axial rate gyro and accelerometers", *Sensors and Materials* 7(5), without the gyros'
//! g-sensitivity.

use nalgebra::Vector3;

use super::super::error::CalibrationError;
use super::{ClosedForm, Position, Reference, across, both_triads, unobserved};
use crate::earth::ROTATION_RATE;
use crate::imu::{InstallationForm, PerSensor, Sensor};
use crate::run::{Dwell, LabelledMotion, Run};

/// Both triads from the sections whose labels say how the instrument stands or turns.
pub(super) fn by_labels(run: &Run, form: InstallationForm) -> Result<ClosedForm, CalibrationError> {
    let mut positions = PerSensor::<Vec<Position>>::default();
    let mut turns = 0;
    let mut standing_time = 0.0;
    for segment in &run.segments {
        let Some(motion) = segment.motion.filter(|_| !segment.samples.is_empty()) else {
            continue;
        };
        let section = Dwell {
            samples: segment.samples.clone(),
            position: None,
        };
        let duration = section.samples.len() as f64 * run.imu.period;
        let of_gyro = section.mean(Sensor::Gyro, run);
        let noise = Vector3::repeat(of_gyro.variance);
        match motion {
            LabelledMotion::Stands { up } => {
                let of_accel = section.mean(Sensor::Accel, run);
                let white = Vector3::repeat(of_accel.variance);
                let force = up * run.site.gravity;
                positions.accel.push(Position {
                    // As if nothing were known of how gravity falls on the other two axes: so the bias
                    // of each comes from its own two positions, as in half sums.
                    weighted: white + across(&force),
                    ..set_by_hand(run, force, of_accel.output, white)
                });
                // Which way is north is not known, so what is level of Earth rate is noise.
                let earth_rate = run.site.earth_rate_n();
                let level = across(&up) * (0.5 * earth_rate.y.powi(2));
                let rate = up * earth_rate.z;
                let gyro = set_by_hand(run, rate, of_gyro.output, noise + level);
                positions.gyro.push(gyro);
                standing_time += duration;
            }
            LabelledMotion::Turns { axis, angle } => {
                let rate = axis * (angle / duration);
                let end = (run.segment_sigma / duration).powi(2) + ROTATION_RATE.powi(2);
                let noise = noise.add_scalar(end);
                positions
                    .gyro
                    .push(set_by_hand(run, rate, of_gyro.output, noise));
                turns += 1;
            }
        }
    }
    let undetermined = |sensor| CalibrationError::TooFewSections {
        sensor,
        labels: run.segments.iter().map(|s| s.label.clone()).collect(),
    };
    let estimate = both_triads(&positions, form).map_err(undetermined)?;
    Ok(ClosedForm {
        warnings: unobserved(run, &estimate, Reference::Labels),
        estimate,
        reference: Reference::Labels,
        positions: PerSensor {
            gyro: positions.gyro.len() - turns,
            accel: positions.accel.len(),
        },
        turns,
        standing_time,
    })
}

/// An input along or about an axis that is within a degree or so of where it should be, and this noise.
///
/// To first order that turns the input into the other two axes. Along the axis it takes off the second
/// order: half the sum of two squared angles, whose mean square is twice the fourth power of one's σ.
fn set_by_hand(
    run: &Run,
    input: Vector3<f64>,
    output: Vector3<f64>,
    noise: Vector3<f64>,
) -> Position {
    let turn = run.segment_sigma.powi(2);
    let along = input.map(|component| 2.0 * (component * turn).powi(2));
    let variance = noise + across(&input) * turn + along;
    Position {
        input,
        output,
        variance,
        weighted: variance,
    }
}
