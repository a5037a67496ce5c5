//! Estimation options of a run, identical for a single run and a lot.

use super::choice::{AIDINGS, FORMS, METHODS, NOISE, one_of};
use anyhow::Context;
use clap::error::ErrorKind;
use serde::{Serialize, Serializer};

use super::error_term::{error_term, needs_table, supported};
use turncal::calibration::{
    CalibrationError, ErrorTerm, Method, NoisePolicy, Options, Problem, Together,
};
use turncal::imu::InstallationForm;
use turncal::run::{Aiding, Run};

/// Estimation options.
#[derive(Debug, Clone, Serialize, clap::Args)]
pub struct Estimation {
    /// Estimation method
    #[arg(long, value_parser = one_of(&METHODS), default_value = "ekf")]
    pub method: Method,
    /// Form of the installation matrix
    #[arg(long, value_parser = one_of(&FORMS), default_value = "general")]
    installation: InstallationForm,
    /// Observations used by the filter [default: table if the run has a table log, otherwise velocity]
    #[arg(long, value_parser = one_of(&AIDINGS))]
    aiding: Option<Aiding>,
    /// Error terms to estimate, in addition to those switched on in run.toml [default: those supported by the data]
    #[arg(long, value_name = "TERM", value_parser = error_term(), value_delimiter = ',')]
    #[serde(serialize_with = "names")]
    with: Vec<ErrorTerm>,
    /// Noise used by the filter
    #[arg(long, value_parser = one_of(&NOISE), default_value = "auto")]
    noise: NoisePolicy,
}

impl Estimation {
    /// Exits if arguments exclude each other.
    pub fn check(&self) {
        if let (Method::SixPosition, Some(term)) = (self.method, self.with.first()) {
            let message = format!(
                "--with {}: --method six-position estimates only scale factors, misalignments and biases; omit \
                 --with, or use --method ekf\n",
                term.name()
            );
            clap::Error::raw(ErrorKind::ArgumentConflict, message).exit();
        }
        for &term in &self.with {
            needs_table(term, self.aiding);
        }
    }

    /// Calibration problem of a run.
    pub fn problem<'a>(&self, run: &'a Run, path: &std::path::Path) -> anyhow::Result<Problem<'a>> {
        if self.aiding == Some(Aiding::Table) && run.recording.table.is_none() {
            return Err(CalibrationError::NoTable).with_context(|| path.display().to_string());
        }
        let problem = Problem::new(run, &self.options());
        for &term in &self.with {
            supported(term, &problem)?;
        }
        Ok(problem)
    }

    /// Joint calibration problem of several recordings of one instrument.
    pub fn together<'a>(
        &self,
        runs: &[&'a Run],
        together: &Together,
    ) -> anyhow::Result<Problem<'a>> {
        if matches!(self.method, Method::SixPosition) {
            anyhow::bail!(
                "--method six-position handles only one recording at one temperature; omit it, or calibrate each run \
                 separately"
            );
        }
        let problem = Problem::together(runs, &self.options(), together)?;
        for &term in &self.with {
            supported(term, &problem)?;
        }
        Ok(problem)
    }

    /// The options, without checks of a run.
    pub fn options(&self) -> Options {
        Options {
            form: self.installation,
            aiding: self.aiding,
            terms: self.with.clone(),
            auto_terms: self.with.is_empty(),
            noise: self.noise,
            ..Options::default()
        }
    }
}

/// Error terms by their command-line names.
fn names<S: Serializer>(terms: &[ErrorTerm], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(terms.iter().map(|term| term.name()))
}
