//! A calibration in progress.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::Vector3;
use numpy::PyReadonlyArray2;
use numpy::ndarray::ArrayView1;
use pyo3::prelude::*;
use turncal::recording::SampleError;
use turncal::survey;
use turncal::survey::Status;
use turncal_report::session::data;

use crate::errors::{Given, positive, raise, raised};
use crate::known::Known;
use crate::run::{Recorded, Run, limits};
use crate::wait::finish;

/// A calibration in progress: rows are pushed as they arrive, and the next move is recommended.
///
/// Parameters
/// ----------
/// rate : float
///     Samples per second.
/// sensor : str
///     Sensor whose data sheet gives noise and tolerances, such as "bmi088", or a TOML file.
/// latitude, height : float, optional
///     Latitude of the site in degrees (north positive), and height in m above the ellipsoid.
/// gravity : float, optional
///     Gravity at the site, m/s².
/// specification : path-like, optional
///     Specification with the limits that the calibration must decide, by name or as a TOML file.
#[pyclass(frozen, module = "turncal")]
pub struct Session(Arc<Mutex<survey::Session>>);

#[pymethods]
impl Session {
    #[new]
    #[pyo3(signature = (rate, sensor, *, latitude=None, height=None, gravity=None, specification=None))]
    fn new(
        rate: &Bound<PyAny>,
        sensor: &str,
        latitude: Given,
        height: Given,
        gravity: Given,
        specification: Option<PathBuf>,
    ) -> PyResult<Self> {
        let known = Known::of_sensor(sensor, latitude, height, gravity)?.stated;
        let Some(instrument) = known.instrument() else {
            return Err(raised(format_args!(
                "sensor: {sensor} states no noise. Name another."
            )));
        };
        let rate = positive("rate", Some(rate))?.unwrap_or(1.0);
        let session = survey::Session::new(instrument, known.site(), rate.recip());
        let session = match specification.as_deref().map(limits).transpose()? {
            Some(limits) => session.to_decide(limits),
            None => session,
        };
        Ok(Self(Arc::new(Mutex::new(session))))
    }

    /// Adds samples.
    ///
    /// Parameters
    /// ----------
    /// gyro, accel : array of shape (n, 3) or (3,)
    ///     Angular rates in rad/s and specific forces in m/s² along right, front and up.
    ///
    /// Returns
    /// -------
    /// dict or None
    ///     The status, if a second of samples has arrived since the last status.
    fn push<'py>(
        &self,
        py: Python<'py>,
        gyro: &Bound<PyAny>,
        accel: &Bound<PyAny>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let (gyro, accel) = (samples("gyro", gyro)?, samples("accel", accel)?);
        let status = self.ask(py, move |session| session.push(&gyro, &accel))?;
        status.map(|status| as_dict(py, &status)).transpose()
    }

    /// The status with all samples so far.
    ///
    /// Returns
    /// -------
    /// dict
    ///     Duration in s, dwells, expected 1σ of each group of parameters, those not observed, and the next move in words;
    ///     it is None if every limit of the specification can be decided.
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let status = self.ask(py, survey::Session::status)?;
        as_dict(py, &status)
    }

    /// The run of all samples so far, ready for calibration.
    fn run(&self, py: Python) -> PyResult<Run> {
        let run = self.ask(py, |session| session.run())?;
        Ok(Run::new(Recorded::of_run(run, None), None))
    }
}

impl Session {
    fn ask<T: Send + 'static>(
        &self,
        py: Python,
        question: impl FnOnce(&mut survey::Session) -> Result<T, SampleError> + Send + 'static,
    ) -> PyResult<T> {
        let session = self.0.clone();
        let answer = finish(py, move || {
            let mut session: MutexGuard<_> = session.lock().unwrap_or_else(PoisonError::into_inner);
            question(&mut session)
        });
        answer?.map_err(raise)
    }
}

fn as_dict<'py>(py: Python<'py>, status: &Status) -> PyResult<Bound<'py, PyAny>> {
    let json = data(status).to_string();
    py.import("json")?.call_method1("loads", (json,))
}

/// Rows of three numbers.
fn samples(name: &str, of: &Bound<PyAny>) -> PyResult<Vec<Vector3<f64>>> {
    let columns = of.py().import("turncal._columns")?;
    let of: PyReadonlyArray2<f64> = columns.call_method1("samples", (name, of))?.extract()?;
    let rows = of.as_array();
    let vector = |row: ArrayView1<f64>| Vector3::new(row[0], row[1], row[2]);
    Ok(rows.rows().into_iter().map(vector).collect())
}
