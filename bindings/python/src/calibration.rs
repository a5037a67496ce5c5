//! Calibrations.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use turncal::calibration::{self, AtRest, Progress as Passes, Solution, Verdict};
use turncal::recording::LogFacts;
use turncal::report::calibration::Calibrated;
use turncal::report::{Document, at_rest, terminal, write};

use crate::errors::{raise, raised};
use crate::report::{brief, framed};
use crate::run::{Recorded, Refusal, Request};
use crate::wait::finish;

/// What a report needs beside the calibration.
struct Solved {
    of: Arc<Recorded>,
    request: Request,
    solution: Solution,
    calibrated: Calibrated,
}

impl Solved {
    fn document(&self) -> Result<Document, Refusal> {
        let problem = self.of.problem(&self.request)?;
        let (name, method) = (&*self.of.name, self.request.method);
        Ok(self
            .calibrated
            .document((&problem, name), &self.solution, method, None))
    }
}

/// Scale factors, misalignments and biases of gyros and accelerometers, with their covariance.
///
/// ``calibration["gyro.bias.x"]`` is a parameter: ``gyro.scale.x``, ``gyro.installation.xy``, ``gyro.bias.x``, the same
/// for ``accel``, then error terms. Scale factors are the output for 1 rad/s or 1 m/s², biases are in the unit of the
/// output (rates as logged; pulses and increments per second), misalignments are pure numbers, and error terms are in
/// SI. The calibrated value is ``u = correction · (N − bias)`` in rad/s and m/s².
#[pyclass(frozen, module = "turncal")]
pub struct Calibration {
    pub record: calibration::Calibration,
    solved: Option<Arc<Solved>>,
    document: OnceLock<Document>,
}

/// Calibrates a run as requested; the progress may stop it.
pub fn calibrated(
    of: Arc<Recorded>,
    request: Request,
    progress: Passes,
) -> Result<Calibration, Refusal> {
    let problem = of.problem(&request)?;
    // Without a turn, only the output at rest against temperature can be determined.
    if request.temperature
        && problem.dwells().nth(1).is_none()
        && let Some(found) = AtRest::new(&of.runs[0], AtRest::HIGHEST_ORDER)
    {
        let run = &of.runs[0];
        let record = found.record(run);
        let document = at_rest::document(&found, run, &record);
        return Ok(Calibration {
            record,
            solved: None,
            document: OnceLock::from(document),
        });
    }
    let mut solution = problem.solve(request.method, progress)?;
    let mut calibrated = Calibrated::new(&problem, &mut solution)?;
    if let Some(path) = &of.path {
        calibrated = calibrated.of_files(path, problem.run());
    }
    drop(problem);
    let record = calibrated.calibration.clone();
    let solved = Arc::new(Solved {
        of,
        request,
        solution,
        calibrated,
    });
    Ok(Calibration {
        solved: Some(solved),
        ..Calibration::of_record(record)
    })
}

impl Calibration {
    /// Values without the run that they were estimated from.
    pub fn of_record(record: calibration::Calibration) -> Self {
        Self {
            record,
            solved: None,
            document: OnceLock::new(),
        }
    }

    /// The log of the run that it was estimated from.
    pub fn log(&self) -> Option<&LogFacts> {
        self.solved.as_ref()?.of.runs[0].recording.imu.log.as_ref()
    }

    /// The complete report, made at its first use.
    fn document(&self, py: Python) -> PyResult<&Document> {
        if let Some(document) = self.document.get() {
            return Ok(document);
        }
        let Some(solved) = self.solved.clone() else {
            return Err(raised(
                "found a calibration that was read from a file, expected one from Run.calibrate, because a report shows \
                 its run. Calibrate the run again.",
            ));
        };
        let document = finish(py, move || solved.document())?.map_err(raise)?;
        Ok(self.document.get_or_init(|| document))
    }

    /// The value of a parameter.
    fn value<'a>(&self, name: &str, value: Option<&'a f64>) -> PyResult<&'a f64> {
        value.ok_or_else(|| {
            PyKeyError::new_err(format!(
                "found {name:?}, expected a parameter of this calibration. `calibration.parameters` lists them."
            ))
        })
    }
}

#[pymethods]
impl Calibration {
    /// Reads a calibration.json or truth.json.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///
    /// Returns
    /// -------
    /// Calibration
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        calibration::Calibration::read(&path)
            .map(Self::of_record)
            .map_err(raise)
    }

    fn __getitem__(&self, name: &str) -> PyResult<f64> {
        self.value(name, self.record.get(name)).copied()
    }

    /// 1σ of a parameter in its own unit, zero if it was not estimated.
    fn sigma(&self, name: &str) -> PyResult<f64> {
        self.__getitem__(name)?;
        self.value(name, self.record.sigma_of(name)).copied()
    }

    /// Value and 1σ of every parameter.
    ///
    /// Returns
    /// -------
    /// pandas.DataFrame
    ///     Columns ``value`` and ``sigma``, a row for each parameter by name.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let names = self.record.names();
        let value = |name: &String| self.record.get(name).copied();
        let sigma = |name: &String| self.record.sigma_of(name).copied();
        let values: Vec<Option<f64>> = names.iter().map(value).collect();
        let sigmas: Vec<Option<f64>> = names.iter().map(sigma).collect();
        let frames = py.import("turncal._frames")?;
        frames.call_method1("parameters", (names, values, sigmas))
    }

    /// Covariance of the estimated parameters, in their units.
    ///
    /// Returns
    /// -------
    /// pandas.DataFrame
    ///     Shape (n, n), rows and columns by name.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (names, rows) = (
            self.record.parameters.clone(),
            self.record.covariance.clone(),
        );
        py.import("turncal._frames")?
            .call_method1("covariance", (names, rows))
    }

    /// "good", "use with care" or "failed"; None for values that were not estimated.
    #[getter]
    fn verdict(&self) -> Option<String> {
        let word = |verdict: &Verdict| verdict.word.to_string().to_lowercase();
        self.record.verdict.as_ref().map(word)
    }

    /// What to know before using the values: problem, meaning and remedy, the most severe first.
    #[getter]
    fn findings(&self) -> Vec<String> {
        let text = |finding: &calibration::Finding| format!("{} {}", finding.code, finding.text);
        self.record.findings.iter().map(text).collect()
    }

    /// Calibrated rates and specific forces.
    ///
    /// Parameters
    /// ----------
    /// data : DataFrame, array of shape (n, 6), mapping of arrays, or Run
    ///     Samples as logged: gyros, then accelerometers.
    /// gyro, accel : (x, y, z) or (x, y, z, unit), optional
    ///     Columns along right, front and up. Default: those of the run that was calibrated.
    /// rate : float, optional
    ///     Rows per second, for increments and pulses. Default: that of the run that was calibrated.
    ///
    /// Returns
    /// -------
    /// DataFrame or array of shape (n, 6)
    ///     Angular rate in rad/s and specific force in m/s² along right, front and up, of the kind of `data`; for a Run
    ///     also start and end of each sample in s.
    #[pyo3(signature = (data, gyro=None, accel=None, rate=None))]
    fn apply<'py>(
        slf: Bound<'py, Self>,
        data: Bound<'py, PyAny>,
        gyro: Option<Bound<'py, PyAny>>,
        accel: Option<Bound<'py, PyAny>>,
        rate: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let frames = slf.py().import("turncal._frames")?;
        frames.call_method1("applied", (slf, data, gyro, accel, rate))
    }

    /// Writes a report with figures and ``calibration.json`` into a directory, which is created if needed.
    ///
    /// Parameters
    /// ----------
    /// directory : path-like
    fn report(&self, py: Python, directory: PathBuf) -> PyResult<()> {
        let document = self.document(py)?;
        std::fs::create_dir_all(&directory)?;
        self.record
            .write(&directory.join("calibration.json"), true)
            .map_err(raise)?;
        write(document, &directory).map_err(raise)
    }

    /// The calibration as text, byte for byte the calibration.json of the command.
    fn to_json(&self) -> PyResult<String> {
        let bytes = self.record.to_json(Path::new("to_json")).map_err(raise)?;
        String::from_utf8(bytes).map_err(raise)
    }

    fn __str__(&self, py: Python) -> PyResult<String> {
        match self.solved.is_some() || self.document.get().is_some() {
            true => Ok(terminal::brief(self.document(py)?, Some(100))),
            false => self.to_json(),
        }
    }

    fn __repr__(&self) -> String {
        let verdict = self.verdict();
        format!(
            "<turncal.Calibration: {}>",
            verdict.as_deref().unwrap_or("not estimated")
        )
    }

    fn _repr_html_(&self, py: Python) -> PyResult<String> {
        match self.solved.is_some() || self.document.get().is_some() {
            true => Ok(framed(&brief(self.document(py)?))),
            false => self.parameters(py)?.call_method0("to_html")?.extract(),
        }
    }
}
