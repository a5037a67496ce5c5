//! Trajectories to navigate along.

use serde::Deserialize;

use super::{ModelError, Place, Room, text};
use crate::navigation::{Change, Segment, Start, Trajectory};
use crate::units::DEGREE;
use turncal_input::{Finite, NonNegative, Positive};

/// Finds and reads a trajectory; returns it with its name.
///
/// # Errors
/// Returns an error if the trajectory does not exist, is malformed or cannot be followed.
pub fn trajectory(
    name_or_path: &str,
    named_in: &Place,
) -> Result<(Trajectory, String), ModelError> {
    let text = text(Room::Trajectory, name_or_path, named_in)?;
    let file: TrajectoryFile = text.parse()?;
    let start = Start {
        latitude: file.start.latitude_deg.0 * DEGREE,
        longitude: file.start.longitude_deg.0 * DEGREE,
        height: file.start.height_m.0,
        heading: file.start.heading_deg.0 * DEGREE,
        speed: file.start.speed_m_s.0,
    };
    let segments = file.segment.iter().map(|s| s.with(&file.moves)).collect();
    let trajectory = Trajectory::new(start, file.moves.banks, segments)
        .map_err(|error| text.inconsistent(error.to_string()))?;
    Ok((trajectory, text.name()))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TrajectoryFile {
    start: StartFile,
    moves: MovesFile,
    segment: Vec<SegmentFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StartFile {
    latitude_deg: Finite,
    longitude_deg: Finite,
    height_m: Finite,
    heading_deg: Finite,
    speed_m_s: NonNegative,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MovesFile {
    banks: bool,
    turn_rate_deg_per_s: Positive,
    turn_acceleration_deg_per_s2: Positive,
    acceleration_m_s2: Positive,
    jerk_m_s3: Positive,
    climb_rate_m_s: Positive,
    climb_acceleration_m_s2: Positive,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SegmentFile {
    #[serde(default)]
    duration_s: NonNegative,
    #[serde(default)]
    turn_deg: Finite,
    turn_rate_deg_per_s: Option<Positive>,
    speed_m_s: Option<NonNegative>,
    acceleration_m_s2: Option<Positive>,
    height_m: Option<Finite>,
    climb_rate_m_s: Option<Positive>,
}

impl SegmentFile {
    fn with(&self, usual: &MovesFile) -> Segment {
        let rate = |own: Option<Positive>, usual: Positive| own.unwrap_or(usual).0;
        Segment {
            duration: self.duration_s.0,
            turn: Change {
                amount: self.turn_deg.0 * DEGREE,
                rate: rate(self.turn_rate_deg_per_s, usual.turn_rate_deg_per_s) * DEGREE,
                acceleration: usual.turn_acceleration_deg_per_s2.0 * DEGREE,
            },
            speed: self.speed_m_s.map(|speed| Change {
                amount: speed.0,
                rate: rate(self.acceleration_m_s2, usual.acceleration_m_s2),
                acceleration: usual.jerk_m_s3.0,
            }),
            height: self.height_m.map(|height| Change {
                amount: height.0,
                rate: rate(self.climb_rate_m_s, usual.climb_rate_m_s),
                acceleration: usual.climb_acceleration_m_s2.0,
            }),
        }
    }
}
