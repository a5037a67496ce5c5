//! Embedded paths in the time of another: their dwells are scaled by a common factor.

use rayon::prelude::*;

use super::expected::{ByTerms, expected};
use crate::calibration::Estimate;
use crate::models::{self, Place, Room};
use crate::study::path::{PathError, PathStudy};
use crate::turntable::{Moves, Path};

/// Shortest dwell, s.
const SHORTEST: f64 = 1.0;

/// An embedded path, stretched or shortened to a time.
#[derive(Debug, Clone)]
pub struct Shipped {
    /// Name of the path.
    pub name: &'static str,
    /// Factor by which its dwells are scaled.
    pub factor: f64,
    /// Expected σ; `None` if the moves alone take too long.
    pub expected: Option<ByTerms<Estimate>>,
}

impl Shipped {
    /// The paths that a machine can follow, scaled to this time in s.
    pub fn all(setting: &PathStudy, time: f64) -> Result<Vec<Self>, PathError> {
        let names: Vec<&str> = models::names(Room::Path).collect();
        let all = names.into_par_iter().filter_map(|name| {
            let (path, _) = models::path(name, &Place::Embedded, &setting.scenario.site).ok()?;
            // A table with axis angles cannot turn about body axes, except for the positions of the paper.
            let is_of_axes = matches!(path.moves, Moves::Axes { .. });
            let is_wanted = is_of_axes != setting.by_hand || name == "six-position";
            let is_possible = is_wanted.then(|| along(setting, path.clone(), name))??;
            Some(stretched(setting, &is_possible, path, name, time))
        });
        all.collect()
    }
}

fn along(setting: &PathStudy, path: Path, name: &str) -> Option<PathStudy> {
    let scenario = setting.scenario.clone().along(path, name).ok()?;
    Some(PathStudy {
        scenario,
        ..setting.clone()
    })
}

fn stretched(
    setting: &PathStudy,
    study: &PathStudy,
    mut path: Path,
    name: &'static str,
    time: f64,
) -> Result<Shipped, PathError> {
    let standing = study.scenario.standing_time()?;
    let moving = study.scenario.duration()? - standing;
    let factor = (time - moving) / standing;
    path.first_dwell *= factor;
    let dwells: Vec<&mut f64> = match &mut path.moves {
        Moves::Axes { steps, .. } => steps.iter_mut().map(|step| &mut step.dwell).collect(),
        Moves::Body { steps, .. } => steps.iter_mut().map(|step| &mut step.dwell).collect(),
    };
    let mut shortest = f64::INFINITY;
    for dwell in dwells {
        *dwell *= factor;
        shortest = shortest.min(*dwell);
    }
    let study = (shortest >= SHORTEST).then(|| along(setting, path, name));
    let expected = study.flatten().map(|study| expected(&study)).transpose()?;
    Ok(Shipped {
        name,
        factor,
        expected,
    })
}
