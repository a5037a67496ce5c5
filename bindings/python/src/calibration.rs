//! Calibrations.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use numpy::PyArray1;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyIterator};
use turncal::calibration;
use turncal::calibration::{Correction, Finding, Progress as Passes};
use turncal::imu::{Output, Sensor, Term};
use turncal::lot::{Lot, Specification, Unit};
use turncal::study::CheckedCalibration;
use turncal_files::{calibration_json, read_calibration, record_inputs, write_calibration};
use turncal_report::calibration as of_calibration;
use turncal_report::document::Table;
use turncal_report::values::verdict;
use turncal_report::{Document, at_rest, lot as of_lot, write};

use crate::errors::{in_python, raise, raised};
use crate::report::{Report, brief, framed};
use crate::run::{Recorded, Refusal, Request};
use crate::values;
use crate::wait::finish;

/// What a report needs beside the calibration.
struct Solved {
    of: Arc<Recorded>,
    request: Request,
    checked: CheckedCalibration,
}

impl Solved {
    fn document(&self) -> Result<Document, Refusal> {
        let problem = self.of.problem(&self.request)?;
        let of = (&self.checked, &self.checked.consequences(&problem, None));
        Ok(of_calibration::document(
            (&problem, &self.of.name),
            of,
            None,
        ))
    }
}

/// Scale factors, misalignments and biases of gyros and accelerometers, with their covariance.
///
/// ``calibration["gyro.bias.x"]`` is a parameter: ``gyro.scale.x``, ``gyro.installation.xy``, ``gyro.bias.x``, the same
/// for ``accel``, then error terms. Scale factors are the output for 1 rad/s or 1 m/s², biases are in the unit of the
/// output (rates as logged; pulses and increments per second), misalignments are pure numbers, and error terms are in
/// SI; ``calibration.parameters`` has the units. The calibrated value is ``u = correction · (N − bias)`` in rad/s and
/// m/s².
#[pyclass(frozen, module = "turncal")]
pub struct Calibration {
    pub record: calibration::Calibration,
    solved: Option<Arc<Solved>>,
    document: OnceLock<Document>,
    specification: Option<Specification>,
}

/// Units of gyros whose rows are sums over their samples.
const INCREMENTS: [&str; 3] = ["rad", "deg", "arcsec"];
const EQUATION: &str = "u = correction · (N − bias): N is the output, with correction the inverse of scale · \
                        installation, and u in rad/s and m/s².";

/// Calibrates a run as requested; the progress may stop it.
pub fn calibrated(
    of: Arc<Recorded>,
    request: Request,
    progress: Passes,
) -> Result<Calibration, Refusal> {
    let problem = of.problem(&request)?;
    // Without a turn, only the biases against temperature can be determined.
    if request.temperature
        && let Some(found) = problem.at_rest()
    {
        let record = found.record(&problem);
        let document = at_rest::document(&found, problem.run(), &record);
        return Ok(Calibration {
            document: OnceLock::from(document),
            specification: request.specification,
            ..Calibration::of_record(record)
        });
    }
    let solution = problem.solve(request.method, progress)?;
    let mut checked = CheckedCalibration::new(&problem, solution)?;
    if let Some(path) = &of.path {
        record_inputs(&mut checked.calibration, [path.as_path()], problem.run());
    }
    drop(problem);
    let record = checked.calibration.clone();
    let specification = request.specification.clone();
    let solved = Arc::new(Solved {
        of,
        request,
        checked,
    });
    Ok(Calibration {
        solved: Some(solved),
        specification,
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
            specification: None,
        }
    }

    /// Whether the run is from a table in memory.
    pub fn is_of_table(&self) -> bool {
        self.solved
            .as_ref()
            .is_some_and(|solved| solved.of.path.is_none())
    }

    /// Whether a row is a sum over its sample; None for counts that a file does not explain.
    pub fn is_of_sums(&self) -> Option<bool> {
        let stated = self.record.output.map(|output| output != Output::Rate);
        let of_unit = || match &*self.record.unit.as_ref()?.gyro {
            "count" => None,
            unit => Some(INCREMENTS.contains(&unit)),
        };
        stated.or_else(of_unit)
    }

    /// The unit of a parameter and its σ.
    pub fn unit(&self, name: &str) -> String {
        let has = |term: &Term| {
            let mut names = term.parameters().filter_map(Term::parameter_name);
            names.any(|of| of == name)
        };
        let term = Term::ALL.into_iter().find(has);
        let (sensor, input) = if name.starts_with(Sensor::Gyro.name()) {
            (Sensor::Gyro, "rad/s")
        } else {
            (Sensor::Accel, "m/s²")
        };
        let unit = self.record.unit.as_ref().map(|unit| unit.get(sensor));
        let unit = unit.map_or("output", String::as_str);
        let per_second = match self.is_of_sums() {
            Some(true) => "/s",
            _ => "",
        };
        match (term, name.split('.').nth(1)) {
            (Some(term), _) => term.entry().si_unit.to_owned(),
            (_, Some("scale")) => format!("{unit}{per_second} per {input}"),
            (_, Some("bias")) => format!("{unit}{per_second}"),
            (_, Some("installation")) => "1".to_owned(),
            // Errors of the table are angles.
            _ => "rad".to_owned(),
        }
    }

    /// Every parameter with value, σ and unit.
    fn values(&self) -> Vec<(String, f64, f64, String)> {
        let row = |name: String| {
            let [value, sigma] = [self.record.get(&name), self.record.sigma_of(&name)];
            let (value, sigma) = (value.copied(), sigma.copied().unwrap_or_default());
            Some((name.clone(), value?, sigma, self.unit(&name)))
        };
        self.record.names().into_iter().filter_map(row).collect()
    }

    /// How many parameters were determined, and how many findings there are.
    fn summary(&self) -> String {
        verdict(&self.record).map_or_else(
            || format!("{} values, not estimated", self.record.names().len()),
            |(_, words)| words,
        )
    }

    /// Verdict, findings and, if the run is known, accuracy; then all values.
    fn page(&self, py: Python) -> PyResult<Document> {
        let verdict = self.record.verdict.as_ref();
        let mut document = if self.solved.is_some() || self.document.get().is_some() {
            brief(self.document(py)?)
        } else {
            Document {
                verdict: verdict.map(|of| (of.word, self.summary())),
                findings: self.record.findings.clone(),
                ..Document::new("Calibration")
            }
        };
        let values = self.values().into_iter();
        let row = |(name, value, sigma, unit): (_, _, _, String)| {
            let unit = unit.replace(' ', "\u{a0}");
            vec![name, digits(value, 7), digits(sigma, 3), unit]
        };
        let table = Table::new("Values", ["", "value", "1σ", "unit"]).section(values.map(row));
        document.page(table.note(EQUATION));
        Ok(document)
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

    fn verdict_word(&self) -> Option<String> {
        let verdict = self.record.verdict.as_ref();
        verdict.map(|verdict| verdict.word.to_string().to_lowercase())
    }
}

/// A number of so many significant digits.
pub fn digits(value: f64, digits: usize) -> String {
    let rounded = format!("{value:.*e}", digits - 1).parse();
    rounded.unwrap_or(value).to_string()
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
        read_calibration(&path).map(Self::of_record).map_err(raise)
    }

    /// The calibration in the text of ``to_json``, for pickle.
    #[staticmethod]
    fn _of_json(text: &str) -> PyResult<Self> {
        serde_json::from_str(text)
            .map(Self::of_record)
            .map_err(raise)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((slf.get_type().getattr("_of_json")?, (slf.get().to_json()?,)))
    }

    fn __getitem__(&self, name: &str) -> PyResult<f64> {
        self.record.get(name).copied().ok_or_else(|| {
            PyKeyError::new_err(format!(
                "found {name:?}, expected a parameter of this calibration. `calibration.parameters` lists them."
            ))
        })
    }

    fn __contains__(&self, name: &str) -> bool {
        self.record.get(name).is_some()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyIterator>> {
        self.record.names().into_pyobject(py)?.try_iter()
    }

    fn __len__(&self) -> usize {
        self.record.names().len()
    }

    /// 1σ of a parameter in its own unit, zero if it was not estimated.
    fn sigma(&self, name: &str) -> PyResult<f64> {
        self.__getitem__(name)?;
        Ok(self.record.sigma_of(name).copied().unwrap_or_default())
    }

    /// Value, 1σ and their unit of every parameter.
    ///
    /// Returns
    /// -------
    /// pandas.DataFrame, or structured array without pandas
    ///     Columns ``value``, ``sigma`` (zero if not estimated) and ``unit``, a row for each ``parameter``.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let columns = ("parameter", "value", "sigma", "unit");
        let frames = py.import("turncal._frames")?;
        frames.call_method1("table", (columns, self.values()))
    }

    /// Covariance of the estimated parameters, in their units.
    ///
    /// Returns
    /// -------
    /// pandas.DataFrame, or array without pandas
    ///     Shape (n, n), rows and columns by name, in the order of the parameters whose σ is not zero.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (names, rows) = (
            self.record.parameters.clone(),
            self.record.covariance.clone(),
        );
        py.import("turncal._frames")?
            .call_method1("covariance", (names, rows))
    }

    /// Scale factors K: ``scale.gyro`` and ``scale.accel`` are arrays of shape (3,).
    #[getter]
    fn scale<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        values::vectors(py, |sensor| self.record.triad(sensor).scale)
    }

    /// Biases D: ``bias.gyro`` and ``bias.accel`` are arrays of shape (3,).
    #[getter]
    fn bias<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        values::vectors(py, |sensor| self.record.triad(sensor).bias)
    }

    /// Matrices of ``u = correction · (N − bias)``: ``correction.gyro`` and ``correction.accel``, of shape (3, 3).
    ///
    /// The matrices are for the reference temperature and do not contain error terms; :meth:`apply` includes both.
    #[getter]
    fn correction<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let by = Correction::of_record(&self.record).map_err(raise)?;
        values::matrices(py, &by.matrix)
    }

    /// The magnetometer: ``matrix``, ``bias`` and ``correction`` of ``N = matrix · field + bias`` and
    /// ``field = correction · (N − bias)``, with the units of N and field; None if it was not calibrated.
    #[getter]
    fn magnetometer<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(mag) = &self.record.mag else {
            return Ok(None);
        };
        let all = PyDict::new(py);
        all.set_item("matrix", values::matrix(py, &mag.matrix))?;
        all.set_item("bias", PyArray1::from_slice(py, &mag.bias))?;
        all.set_item("correction", values::matrix(py, &mag.correction))?;
        all.set_item("unit", &mag.unit)?;
        all.set_item("field_unit", &mag.field.unit)?;
        Ok(Some(all))
    }

    /// "good", "use with care", "partial" (some of K, E and D were not determined) or "failed"; None for values that were not estimated.
    #[getter]
    fn verdict(&self) -> Option<String> {
        self.verdict_word()
    }

    /// Whether the values are within the limits of the specification given to :meth:`Run.calibrate`; otherwise None.
    ///
    /// Returns
    /// -------
    /// Report or None
    #[getter]
    fn conformity(&self) -> Option<Report> {
        let unit = Unit::of_record("calibration", self.record.clone(), None);
        let specification = self.specification.clone()?;
        let lot = Lot::new(vec![unit], None, Some(specification));
        Some(Report(of_lot::document(&lot)))
    }

    /// Findings to read before using the values: problem, meaning and remedy, the most severe first.
    #[getter]
    fn findings(&self) -> Vec<String> {
        let text = |finding: &Finding| in_python(&format!("{} {}", finding.code, finding.text));
        self.record.findings.iter().map(text).collect()
    }

    /// Calibrated rates and specific forces.
    ///
    /// Parameters
    /// ----------
    /// data : DataFrame, Dataset of xarray, array of shape (rows, columns), mapping of arrays, or Run, optional
    ///     Samples as logged.
    /// gyro, accel : (x, y, z), (x, y, z, unit) or array of shape (n, 3), optional
    ///     Columns along right, front and up; a minus sign before a name reverses a column. Default: the
    ///     columns of the calibrated run, by name.
    /// rate : float, optional
    ///     Rows per second, for increments and pulses. Default: the rate of the calibrated run.
    ///
    /// Returns
    /// -------
    /// DataFrame or array of shape (n, 6)
    ///     Angular rate in rad/s and specific force in m/s² along right, front and up, of the kind of `data`; for a Run
    ///     also start and end of each sample in s.
    #[pyo3(signature = (data=None, gyro=None, accel=None, rate=None))]
    fn apply<'py>(
        slf: Bound<'py, Self>,
        data: Option<Bound<'py, PyAny>>,
        gyro: Option<Bound<'py, PyAny>>,
        accel: Option<Bound<'py, PyAny>>,
        rate: Option<Bound<'py, PyAny>>,
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
        let file = directory.join("calibration.json");
        write_calibration(&self.record, &file, true).map_err(raise)?;
        write(document, &directory).map_err(raise)
    }

    /// The calibration as text, byte for byte the calibration.json of the command.
    fn to_json(&self) -> PyResult<String> {
        let bytes = calibration_json(&self.record, Path::new("to_json")).map_err(raise)?;
        String::from_utf8(bytes).map_err(raise)
    }

    fn __repr__(&self) -> String {
        let verdict = self
            .verdict_word()
            .map_or(String::new(), |word| word + ", ");
        format!("<turncal.Calibration: {verdict}{}>", self.summary())
    }

    fn _repr_html_(&self, py: Python) -> PyResult<String> {
        let mut page = self.page(py)?;
        let verdict = page.verdict.take();
        let verdict = verdict.map_or_else(String::new, |(word, summary)| {
            format!("<p><strong>{word}</strong> {}</p>", in_python(&summary))
        });
        Ok(verdict + &values::html(self) + &framed(&page))
    }
}
