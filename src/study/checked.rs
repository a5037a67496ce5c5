//! A calibration with its checks, the accuracy predicted for the recording, and the navigation errors that result from
//! the calibration.

use super::navigation::{MethodOutlook, NavigationStudyError, navigate_with_each};
use crate::calibration::{Assessment, Calibration, CalibrationError, Problem, Solution};
use crate::imu::{PerSensor, Triad};
use crate::run::Aiding;
use crate::survey::{Expected, Path};

/// A solution with its checks.
#[derive(Debug, Clone)]
pub struct CheckedCalibration {
    /// The solution.
    pub solution: Solution,
    /// Checks.
    pub assessment: Assessment,
    /// The calibration that is written to a file.
    pub calibration: Calibration,
}

/// Consequences of a calibration.
#[derive(Debug, Clone)]
pub struct Consequences {
    /// Accuracy predicted for the recording; `None` for the closed form and for several recordings.
    pub predicted: Option<Expected>,
    /// Navigation errors at the site of the run, or the reason why there are none.
    pub navigation: Result<Vec<MethodOutlook>, NavigationStudyError>,
}

impl CheckedCalibration {
    /// Checks a solution.
    ///
    /// # Errors
    /// Returns [`CalibrationError`] if the solution belongs to a different problem.
    pub fn new(problem: &Problem, solution: Solution) -> Result<Self, CalibrationError> {
        let assessment = solution.assess(problem)?;
        let calibration = solution.calibration(problem, &assessment);
        Ok(Self {
            solution,
            assessment,
            calibration,
        })
    }

    /// Computes the consequences of the calibration of this problem; the truth may be unknown.
    pub fn consequences(
        &self,
        problem: &Problem,
        truth: Option<&PerSensor<Triad>>,
    ) -> Consequences {
        let method = match self.solution {
            Solution::Filter(_) => "EKF",
            Solution::ClosedForm(_) => "closed form",
        };
        let methods = [(method, self.solution.estimate())];
        Consequences {
            predicted: self.predicted(problem),
            navigation: navigate_with_each(&problem.run().site, &methods, truth),
        }
    }

    fn predicted(&self, problem: &Problem) -> Option<Expected> {
        let outcome = self.solution.outcome()?;
        if outcome.alone.len() > 1 {
            return None;
        }
        let path = match problem.model.aiding {
            Aiding::Table => Path::TableAiding,
            Aiding::Velocity => Path::VelocityAiding,
        };
        Expected::of(problem.run(), path).ok()
    }
}
