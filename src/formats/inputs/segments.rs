//! The file of labelled sections.

use std::path::Path;

use nalgebra::Vector3;

use super::source::Source;
use crate::formats::error::FileError;
use crate::imu::AxisOrder;
use crate::recording::{ImuSamples, LabelledMotion, Segment};
use crate::units::DEGREE;

/// Reads the sections of a run with these samples, with stamps `lag` samples after their start; `notes` receives
/// remarks about the file.
pub fn read(
    file: &Path,
    imu: &ImuSamples,
    lag: f64,
    axes: AxisOrder,
    notes: &mut Vec<String>,
) -> Result<Vec<Segment>, FileError> {
    let mut csv = Source::of_file(file).open()?;
    let start_column = csv.column("start")?;
    let end_column = csv.column("end")?;
    let label_column = csv.column("label")?;
    let record = (imu.start(), imu.end());
    // Stamps may name either end of a sample, so borders can be out by one, and are rounded.
    let slack = 1.5 * imu.period;
    // The first row at or after a time; times are printed rounded.
    let row = |time: f64| {
        let row = (imu.edge(time) - lag - 0.01).ceil();
        (row.max(0.0) as usize).min(imu.len())
    };
    let mut segments = Vec::new();
    while csv.advance()? {
        let start = csv.number(start_column)?;
        let end = csv.number(end_column)?;
        let wrong = |found: &str, expected: String| {
            let found = format_args!("{found} from {start} s to {end} s");
            Err(csv.error_here(found, expected, "Correct or remove the row."))
        };
        if end <= start {
            return wrong("a segment", "an end later than the start".to_owned());
        }
        let (first, last) = record;
        if start < first - slack || end > last + slack {
            let expected = format!("times within the IMU log ({first} s to {last} s)");
            return wrong("a segment", expected);
        }
        if row(start) == row(end) {
            let expected = format!(
                "a segment of several samples (sample period {} s)",
                imu.period
            );
            return wrong("no sample", expected);
        }
        let label = csv.text(label_column)?.into_owned();
        segments.push(Segment {
            start,
            end,
            samples: row(start)..row(end),
            motion: motion_of(&label, axes),
            label,
        });
    }
    // A label that lacks letters is none, which is said elsewhere.
    notes.extend(
        csv.cut_off("turncal used it")
            .filter(|_| label_column + 1 != csv.header().len()),
    );
    Ok(segments)
}

/// Motion stated by a label, in the axes of the file.
fn motion_of(label: &str, axes: AxisOrder) -> Option<LabelledMotion> {
    let axis = |name: &str| {
        let index = ["x", "y", "z"].into_iter().position(|axis| axis == name)?;
        Some(axes.apply(&Vector3::ith(index, 1.0)))
    };
    if let Some(turn) = label.strip_prefix("rot_") {
        let (name, angle) = turn.split_at_checked(1)?;
        let angle: f64 = angle.parse().ok()?;
        let turns = angle.is_finite() && angle != 0.0;
        return turns.then_some(LabelledMotion::Turns {
            axis: axis(name)?,
            angle: angle * DEGREE,
        });
    }
    let (name, way) = label.split_once('_')?;
    let up = match way {
        "up" => axis(name)?,
        "down" => -axis(name)?,
        _ => return None,
    };
    Some(LabelledMotion::Stands { up })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_name_axes_of_the_file() {
        let frd = AxisOrder::FRONT_RIGHT_DOWN;
        let of = |label| motion_of(label, frd);
        let up = |up| Some(LabelledMotion::Stands { up });
        assert_eq!(of("x_up"), up(Vector3::y()));
        assert_eq!(of("z_down"), up(Vector3::z()));
        let Some(LabelledMotion::Turns { axis, angle }) = of("rot_z-360") else {
            panic!("no turn");
        };
        assert_eq!(axis * angle, Vector3::z() * (360.0 * DEGREE));
        for other in [
            "still",
            "x_left",
            "w_up",
            "rot_",
            "rot_x",
            "rot_é+90",
            "rot_x+NaN",
            "_up",
        ] {
            assert_eq!(of(other), None, "{other}");
        }
    }
}
