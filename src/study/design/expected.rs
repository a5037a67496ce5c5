//! Expected σ of a path in a setting.

use crate::calibration::{CalibrationError, Estimate, Journey, Leg, Problem, coarse_start};
use crate::study::path::{PathError, PathStudy};
use crate::turntable::Path;

/// The setting along a path.
pub fn along(setting: &PathStudy, path: Path) -> Result<PathStudy, PathError> {
    let scenario = setting.scenario.clone().along(path, "designed");
    Ok(PathStudy {
        scenario: scenario.map_err(PathError::Words)?,
        ..setting.clone()
    })
}

/// Expected σ of a path; with automatic terms, if every term that may be absent has its usual size.
pub fn expected(study: &PathStudy) -> Result<Estimate, PathError> {
    let (run, truth, terms) = study.record()?;
    let problem = Problem::new(&run, &study.options);
    let start = coarse_start(&problem)?.attitudes;
    let at = (&truth, &terms);
    let mut journey = Journey::new(&problem, at);
    for leg in Leg::all(&problem, at, &start)? {
        journey.go(&leg, 1.0)?;
    }
    let duration = run.recording.imu.duration();
    let undetermined = CalibrationError::Diverged { time: duration };
    Ok(journey.estimate(&truth).ok_or(undetermined)?)
}
