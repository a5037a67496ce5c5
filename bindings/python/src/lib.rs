//! The library for Python: conversions of arguments, results and errors. The package's Python files hold the public
//! functions.

// The macros of PyO3 expand to unsafe code; there is none in these files.

mod apply;
mod calibration;
mod errors;
mod known;
mod report;
mod results;
mod run;
mod session;
mod study;
mod values;
mod wait;

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the command `turncal` with these arguments, the first of which is its name, and returns its exit status.
#[pyfunction]
fn command(py: Python, arguments: Vec<OsString>) -> u8 {
    py.detach(|| turncal_cli::command(arguments))
}

#[pymodule]
mod _turncal {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::apply::{correct, inputs, samples};
    #[pymodule_export]
    use super::calibration::Calibration;
    #[pymodule_export]
    use super::command;
    #[pymodule_export]
    use super::errors::Error;
    #[pymodule_export]
    use super::known::Known;
    #[pymodule_export]
    use super::report::Report;
    #[pymodule_export]
    use super::results::{certificate, compare, export, navigate};
    #[pymodule_export]
    use super::run::{Run, allan, init, read, run};
    #[pymodule_export]
    use super::session::Session;
    #[pymodule_export]
    use super::study::{evaluate, simulate, study, study_merged, study_options, study_part};

    #[pymodule_init]
    fn declare_attributes(module: &Bound<PyModule>) -> PyResult<()> {
        module.setattr("__version__", env!("CARGO_PKG_VERSION"))?;
        let error = module.py().get_type::<Error>();
        let mut names = super::errors::ATTRIBUTES.into_iter();
        names.try_for_each(|name| error.setattr(name, module.py().None()))
    }
}
