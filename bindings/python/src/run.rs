//! Runs: recordings with what is known of instrument and site.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use turncal::calibration::{
    CalibrationError, ErrorTerm, Method, NoisePolicy, Options, Problem, Together,
};
use turncal::imu::PerSensor;
use turncal::lot::Specification;
use turncal::models::specification;
use turncal::noise::{NoiseAnalysis, Stretch};
use turncal::run::Run as Recording;
use turncal::survey::Survey;
use turncal_files::draft::{Draft, Found, StatedColumns};
use turncal_files::{Campaign, Opened};
use turncal_input::FileError;
use turncal_logs::Table;
use turncal_report::{Document, Facts, allan as of_noise, check};

use crate::calibration::{Calibration, calibrated};
use crate::errors::{Given, in_python, named, names, raise, raised};
use crate::known::Known;
use crate::report::{Report, framed};
use crate::wait::{Progress, Watch, finish, wait};

/// Recordings of one instrument with what is known of it.
pub struct Recorded {
    pub name: String,
    /// Several in a campaign.
    pub runs: Vec<Recording>,
    together: Option<Together>,
    /// The file that it was read from.
    pub path: Option<PathBuf>,
    /// What was found in a log or a table.
    found: Vec<Found>,
}

impl Recorded {
    pub fn of_run(run: Recording, path: Option<PathBuf>) -> Self {
        Self {
            name: run.recording.name.clone(),
            runs: vec![run],
            together: None,
            path,
            found: Vec::new(),
        }
    }

    pub fn of_campaign(name: String, runs: Vec<Recording>, together: Together) -> Self {
        Self {
            name,
            runs,
            together: Some(together),
            path: None,
            found: Vec::new(),
        }
    }

    /// The recording in files or a table, by a function that opens it and shows the draft.
    fn opened(
        path: Option<PathBuf>,
        open: impl FnOnce(&mut dyn FnMut(&Draft)) -> Result<Opened, FileError>,
    ) -> Result<Self, FileError> {
        let mut found = Vec::new();
        let run = open(&mut |draft| found = draft.found())?.run;
        Ok(Self {
            found,
            ..Self::of_run(run, path)
        })
    }

    fn seconds(&self) -> f64 {
        let seconds = self.runs.iter().map(|run| run.recording.imu.duration());
        seconds.sum()
    }

    /// The problem of a request.
    pub fn problem(&self, request: &Request) -> Result<Problem<'_>, Refusal> {
        let runs: Vec<&Recording> = self.runs.iter().collect();
        let usual = request.temperature.then(Together::default);
        let mut problem = match self.together.or(usual) {
            Some(together) => Problem::together(&runs, &request.options, &together)?,
            None => Problem::new(runs[0], &request.options),
        };
        for &term in &request.terms {
            if !problem.model.can_have(term) {
                return Err(Refusal::Term(term));
            }
            problem.model.switch_on(term);
        }
        Ok(problem)
    }
}

/// Why a run cannot be calibrated as requested.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// The data do not suffice.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// An error term that the run cannot have.
    #[error(
        "with_: {} needs a table log, and the axis errors of a table its angles. Omit it, or add them to the run",
        .0.name()
    )]
    Term(ErrorTerm),
}

/// A request for a calibration.
pub struct Request {
    pub method: Method,
    pub temperature: bool,
    terms: Vec<ErrorTerm>,
    options: Options,
    pub specification: Option<Specification>,
}

/// A recording with the knowledge about instrument and site, from :func:`read`, :func:`run` or :func:`simulate`.
///
/// Attributes
/// ----------
/// truth : Calibration or None
///     True parameters of a simulated run.
#[pyclass(frozen, module = "turncal")]
pub struct Run {
    pub of: Arc<Recorded>,
    #[pyo3(get)]
    truth: Option<Py<Calibration>>,
}

impl Run {
    pub fn new(of: Recorded, truth: Option<Py<Calibration>>) -> Self {
        Self {
            of: Arc::new(of),
            truth,
        }
    }

    /// The run, if it is not a campaign.
    pub fn one(&self) -> PyResult<&Recording> {
        match &self.of.runs[..] {
            [run] => Ok(run),
            runs => Err(raised(format_args!(
                "{}: found a campaign of {} recordings, expected one recording. Read its run.toml.",
                self.of.name,
                runs.len()
            ))),
        }
    }

    /// Recordings, and what was found in a log or a table.
    fn page(&self) -> Document {
        let mut document = Document::new(self.of.name.clone());
        let recording = |run: &Recording| {
            let (name, imu) = (&run.recording.name, &run.recording.imu);
            let rate = imu.period.recip();
            (
                name.clone(),
                format!("{:.1} s at {rate:.1} Hz", imu.duration()),
            )
        };
        document.both(Facts::new("Recordings", self.of.runs.iter().map(recording)));
        let found = |of: &Found| {
            let (value, certainty, why) = (&of.value, of.certainty.word(), &of.why);
            (of.what, format!("{value} – {certainty}: {why}"))
        };
        document.both(Facts::new("Found", self.of.found.iter().map(found)));
        document
    }

    /// Makes a report of the run.
    fn report<E: std::error::Error + Send + 'static>(
        &self,
        py: Python,
        make: impl FnOnce(&Recording) -> Result<Report, E> + Send + 'static,
    ) -> PyResult<Report> {
        self.one()?;
        let of = self.of.clone();
        finish(py, move || make(&of.runs[0]))?.map_err(raise)
    }
}

#[pymethods]
impl Run {
    /// What was found in a log or a table: columns, units, time, axes, place; empty for a run.toml.
    ///
    /// Returns
    /// -------
    /// pandas.DataFrame, or structured array without pandas
    ///     Columns ``value``, ``certainty`` ("certain", "guess" or "unknown") and ``why``, a row for each ``what``.
    #[getter]
    fn found<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let row = |of: &Found| {
            let texts = [&of.value, of.certainty.word(), &of.why];
            let [value, certainty, why] = texts.map(in_python);
            (of.what, value, certainty, why)
        };
        let rows: Vec<_> = self.of.found.iter().map(row).collect();
        let frames = py.import("turncal._frames")?;
        frames.call_method1("table", (("what", "value", "certainty", "why"), rows))
    }

    /// The recordings of a campaign, each as a run.
    #[getter]
    fn recordings(&self) -> Vec<Self> {
        let of_run = |run: &Recording| Self::new(Recorded::of_run(run.clone(), None), None);
        self.of.runs.iter().map(of_run).collect()
    }

    /// Dwells, turns, faults of the log, and the accuracy to expect, without a calibration.
    ///
    /// Returns
    /// -------
    /// Report
    fn check(&self, py: Python) -> PyResult<Report> {
        self.report(py, |run| {
            let survey = Survey::of(run);
            Ok::<_, CalibrationError>(Report(check::document(run, &survey)))
        })
    }

    /// Estimates scale factors, misalignments and biases.
    ///
    /// Parameters
    /// ----------
    /// method : {"ekf", "six-position"}
    ///     The filter over the whole run, or the closed form from dwells.
    /// with_ : str or sequence of str, optional
    ///     "auto" (default): average over the absence and the usual sizes of every error term; "none": only K, E and D;
    ///     or terms to estimate in any case, such as "accel-second-order".
    /// noise : {"auto", "stated", "learnt"}
    ///     Stated noise unless the data contradict it, stated noise, or noise estimated from the run.
    /// temperature : bool
    ///     Parameters follow the temperature of the run.
    /// progress : callable or bool, optional
    ///     Called as ``progress(iterations, None)`` after each iteration; True shows a bar if tqdm is installed. An
    ///     exception in it ends the calibration.
    /// specification : path-like, optional
    ///     Limits, by name or as a TOML file, for :attr:`Calibration.conformity`.
    ///
    /// Returns
    /// -------
    /// Calibration
    ///
    /// Raises
    /// ------
    /// Error
    ///     If the run cannot be calibrated. Otherwise, read `verdict` before using the values.
    #[pyo3(signature = (
        method="ekf", with_=None, noise="auto", temperature=false, progress=None, specification=None,
    ))]
    #[expect(clippy::too_many_arguments, reason = "each is a keyword")]
    fn calibrate(
        &self,
        py: Python,
        method: &str,
        with_: Given,
        noise: &str,
        temperature: bool,
        progress: Option<Py<PyAny>>,
        specification: Option<PathBuf>,
    ) -> PyResult<Calibration> {
        let methods = [("ekf", Method::Ekf), ("six-position", Method::SixPosition)];
        let mut options = Options::default().noise(named(
            "noise",
            noise,
            &NoisePolicy::ALL.map(|policy| (policy.name(), policy)),
        )?);
        let (auto_terms, terms) = asked_terms(with_)?;
        options.auto_terms = auto_terms;
        let request = Request {
            method: named("method", method, &methods)?,
            temperature,
            terms,
            options,
            specification: specification.as_deref().map(limits).transpose()?,
        };
        self.refuse(&request)?;
        let progress = Progress::new(py, progress, None)?;
        let of = self.of.clone();
        let work = move |watch: &Watch| calibrated(of, request, &|_| watch.step());
        wait(py, &progress, work)?.map_err(raise)
    }

    fn __repr__(&self) -> String {
        format!(
            "<turncal.Run: {}, {:.1} s>",
            self.of.name,
            self.of.seconds()
        )
    }

    fn _repr_html_(&self) -> String {
        framed(&self.page())
    }
}

impl Run {
    /// Refuses requests that no data can meet.
    fn refuse(&self, request: &Request) -> PyResult<()> {
        let is_joint = request.temperature || self.of.together.is_some();
        match (request.method, request.terms.first()) {
            (Method::SixPosition, Some(term)) => Err(raised(format_args!(
                "with_: found {}, which method \"six-position\" cannot estimate. Omit it, or use method \"ekf\".",
                term.name()
            ))),
            (Method::SixPosition, None) if is_joint => Err(raised(
                "method \"six-position\" handles one recording at one temperature. Use method \"ekf\".",
            )),
            _ => Ok(()),
        }
    }
}

/// Error terms by name.
pub fn error_terms(argument: &str, of: Given) -> PyResult<Vec<ErrorTerm>> {
    let all = ErrorTerm::ALL.map(|term| (term.name(), term));
    let of = names(argument, of)?;
    of.iter().map(|name| named(argument, name, &all)).collect()
}

/// Whether every error term is averaged over, and the terms that `with_` names. An empty sequence is none.
pub fn asked_terms(with_: Given) -> PyResult<(bool, Vec<ErrorTerm>)> {
    let asked = names("with_", with_)?;
    let is_word = |name: &&String| ["auto", "none"].contains(&name.as_str());
    let Some(alone) = asked.iter().find(is_word) else {
        return Ok((with_.is_none(), error_terms("with_", with_)?));
    };
    if let Some(other) = asked.iter().find(|name| *name != alone) {
        return Err(raised(format_args!(
            "with_: found {alone:?} beside {other:?}, expected {alone:?} alone. Use with_={alone:?}, or omit {alone:?}."
        )));
    }
    Ok((alone == "auto", Vec::new()))
}

/// A specification by name or path.
pub fn limits(path: &Path) -> PyResult<Specification> {
    specification(path).map_err(raise)
}

#[pyfunction]
pub fn read(py: Python, path: PathBuf, known: &Known) -> PyResult<Run> {
    let (stated, stream) = (known.stated.clone(), known.stream.clone());
    let recorded = finish(py, move || {
        if Campaign::is_at(&path) {
            Campaign::read(&path).map(|of| Recorded {
                path: Some(path),
                ..Recorded::of_campaign(of.name, of.runs, of.together)
            })
        } else {
            Recorded::opened(Some(path.clone()), |show| {
                Opened::new(&path, stream.as_deref(), &stated, show)
            })
        }
    });
    Ok(Run::new(recorded?.map_err(raise)?, None))
}

/// Columns of a triad along right, front and up.
type Triad = Option<[String; 3]>;

#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "called from one place, by keyword"
)]
pub fn run(
    py: Python,
    name: &str,
    columns: Vec<(String, PyReadonlyArray1<f64>)>,
    gyro: Triad,
    accel: Triad,
    time: Option<String>,
    temperature: Option<String>,
    known: &Known,
) -> PyResult<Run> {
    let mut stated = known.stated.clone();
    stated.columns = StatedColumns {
        triads: PerSensor { gyro, accel },
        time,
        temperature,
    };
    let columns = columns
        .into_iter()
        .map(|(name, of)| (name, of.as_array().to_vec()));
    let table = Table::new(name, columns.collect()).map_err(raise)?;
    let recorded = finish(py, move || {
        Recorded::opened(None, |show| {
            Opened::in_memory(&[table.into()], None, &stated, show)
        })
    });
    Ok(Run::new(recorded?.map_err(raise)?, None))
}

#[pyfunction]
pub fn init(py: Python, path: PathBuf, known: &Known) -> PyResult<String> {
    let (stated, stream) = (known.stated.clone(), known.stream.clone());
    let draft = finish(py, move || {
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        Draft::of_stream(&path.into(), stream.as_deref(), &stated).map(|draft| draft.to_toml(&name))
    });
    draft?.map_err(raise)
}

#[pyfunction]
pub fn allan(py: Python, run: &Run) -> PyResult<Report> {
    run.report(py, |run| {
        let stretch = Stretch::find(run, None)?;
        let analysis = NoiseAnalysis::new(run, stretch);
        Ok::<_, turncal::noise::StretchError>(Report(of_noise::document(
            &run.recording.name,
            &analysis,
        )))
    })
}
