//! Paths of a sensor turned by hand, stated as a list of moves.

use nalgebra::{Matrix3, Vector3};

use crate::attitude::exp;
use crate::imu::AxisOrder;
use crate::recording::LabelledMotion;
use crate::turntable::{BodyStep, Moves, Path, Rotation};
use crate::units::DEGREE;

/// Duration of each dwell, s.
const DWELL: f64 = 10.0;
/// Mean rate of a turn without its start and end, rad/s.
const RATE: f64 = 45.0 * DEGREE;
/// Additional time for the start and end of a turn, s.
const START_AND_END: f64 = 1.0;
/// Angular acceleration at the start and end of a turn, rad/s².
const ACCELERATION: f64 = 90.0 * DEGREE;

/// A path from words separated by commas: `x_up` … `z_down` for an axis that points up or down, `turn x 90` for a
/// right-handed turn about a body axis in degrees. Each dwell lasts 10 s.
///
/// # Errors
/// A message with the first word that is neither a position nor a turn.
pub fn path_by_hand(words: &str) -> Result<Path, String> {
    let rotations = words.split(',').map(|word| rotation(word.trim()));
    let mut rotations = rotations.collect::<Result<Vec<_>, _>>()?.into_iter();
    let mut attitude = Matrix3::identity();
    let mut steps = Vec::new();
    // The path starts at the first position.
    if let Some(first @ Rotation::Point { .. }) = rotations.as_slice().first().copied() {
        attitude = exp(first.vector(&attitude));
        rotations.next();
    }
    let start = attitude;
    for rotation in rotations {
        let vector = rotation.vector(&attitude);
        attitude *= exp(vector);
        steps.push(BodyStep {
            rotation,
            duration: START_AND_END + vector.norm() / RATE,
            acceleration: ACCELERATION,
            dwell: DWELL,
        });
    }
    Ok(Path {
        first_dwell: DWELL,
        moves: Moves::Body { start, steps },
    })
}

fn rotation(word: &str) -> Result<Rotation, String> {
    let parts: Vec<&str> = word.split_whitespace().collect();
    let label = match parts[..] {
        ["turn", axis, angle] => format!("rot_{axis}{angle}"),
        _ => word.to_owned(),
    };
    match LabelledMotion::of_label(&label, AxisOrder::IDENTITY) {
        Some(LabelledMotion::Stands { up }) => Ok(Rotation::Point {
            axis: up,
            along: Vector3::z(),
        }),
        Some(LabelledMotion::Turns { axis, angle }) => Ok(Rotation::By(axis * angle)),
        None => Err(format!(
            "found `{word}`, expected x_up, x_down, y_up … z_down, or a turn in degrees such as `turn x 90`"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_become_positions_and_turns_and_the_first_position_is_the_start() {
        let path = path_by_hand("y_down, turn x 90, z_up").unwrap();
        let Moves::Body { start, steps } = path.moves else {
            panic!("of the body");
        };
        assert!((start.transpose() * Vector3::z() + Vector3::y()).norm() < 1e-12);
        assert_eq!(
            steps[0].rotation,
            Rotation::By(Vector3::x() * (90.0 * DEGREE))
        );
        assert!((steps[0].duration - 3.0).abs() < 1e-12);
        assert_eq!(steps.len(), 2);
        for wrong in [
            "w_up",
            "x_left",
            "turn x",
            "turn x 0",
            "turn x nan",
            "turn 90 x",
            "",
        ] {
            let message = path_by_hand(&format!("x_up, {wrong}")).unwrap_err();
            assert!(message.contains(&format!("found `{wrong}`")), "{message}");
        }
    }
}
