//! Expected σ of a path in a setting.

use crate::calibration::{
    CalibrationError, Estimate, Journey, Leg, ParameterVector, Problem, Terms, coarse_start,
};
use crate::imu::{PerSensor, Triad};
use crate::study::path::{PathError, PathStudy};
use crate::turntable::Path;

/// A result for an instrument with no error term that may be absent, and for an instrument with all of these terms.
#[derive(Debug, Clone)]
pub struct ByTerms<T> {
    /// Without the terms.
    pub none: T,
    /// With every term in its typical magnitude; `None` if no term may be absent.
    pub all: Option<T>,
}

/// σ of the parameters of both triads.
pub type Sigma = ByTerms<ParameterVector>;

impl<T> ByTerms<T> {
    /// The result with these terms.
    pub fn of(&self, terms: Terms) -> Option<&T> {
        match terms {
            Terms::None => Some(&self.none),
            Terms::All => self.all.as_ref(),
        }
    }

    /// A function of both results.
    pub fn map<U>(&self, of: impl Fn(&T) -> U) -> ByTerms<U> {
        ByTerms {
            none: of(&self.none),
            all: self.all.as_ref().map(of),
        }
    }
}

impl ByTerms<Estimate> {
    /// σ of the estimates.
    pub fn sigma(&self) -> Sigma {
        self.map(Estimate::sigma)
    }
}

impl Sigma {
    /// σ after a journey; `None` if a constant is undetermined.
    pub fn after(journey: &Journey) -> Option<Self> {
        by_terms(journey, |terms| journey.sigma(terms))
    }
}

/// The setting along a path.
pub fn along(setting: &PathStudy, path: Path) -> Result<PathStudy, PathError> {
    let scenario = setting.scenario.clone().along(path, "designed");
    Ok(PathStudy {
        scenario: scenario.map_err(PathError::Words)?,
        ..setting.clone()
    })
}

/// Expected σ of a path.
pub fn expected(study: &PathStudy) -> Result<ByTerms<Estimate>, PathError> {
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
    Ok(estimates(&journey, &truth).ok_or(undetermined)?)
}

fn estimates(journey: &Journey, truth: &PerSensor<Triad>) -> Option<ByTerms<Estimate>> {
    by_terms(journey, |terms| journey.estimate(truth, terms))
}

/// A result without the terms that may be absent and, if there are such terms, with all of them.
fn by_terms<T>(journey: &Journey, of: impl Fn(Terms) -> Option<T>) -> Option<ByTerms<T>> {
    let none = of(Terms::None)?;
    let all = if journey.may_have_terms() {
        Some(of(Terms::All)?)
    } else {
        None
    };
    Some(ByTerms { none, all })
}
