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
use crate::run::{Dwell, LabelledMotion, MeanOutput, Run};

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
        let mean = |sensor| section.mean(sensor, run);
        match motion {
            LabelledMotion::Stands { up } => {
                let force = up * run.site.gravity;
                let accel = set_by_hand(run, force, mean(Sensor::Accel));
                positions.accel.push(accel);
                // Which way is north is not known, so what is level of Earth rate is noise.
                let earth_rate = run.site.earth_rate_n();
                let mut gyro = set_by_hand(run, up * earth_rate.z, mean(Sensor::Gyro));
                gyro.variance += across(&up) * (0.5 * earth_rate.y.powi(2));
                positions.gyro.push(gyro);
                standing_time += duration;
            }
            LabelledMotion::Turns { axis, angle } => {
                let rate = axis * (angle / duration);
                let mut gyro = set_by_hand(run, rate, mean(Sensor::Gyro));
                let end = (run.segment_sigma / duration).powi(2) + ROTATION_RATE.powi(2);
                gyro.variance.add_scalar_mut(end);
                positions.gyro.push(gyro);
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

/// An input along or about an axis that is within a degree or so of where it should be.
///
/// To first order that turns the input into the other two axes, whose weight is therefore small; along
/// the axis it takes off the second order, which has no weight (no position is better than another) but
/// is in the σ.
fn set_by_hand(run: &Run, input: Vector3<f64>, mean: MeanOutput) -> Position {
    let variance = run.segment_sigma.powi(2);
    Position {
        input,
        output: mean.output,
        variance: across(&input) * variance + Vector3::repeat(mean.variance),
        // Half the sum of two squared angles; its mean square is twice that of one.
        second_order: input.map(|component| 2.0 * (component * variance).powi(2)),
    }
}
