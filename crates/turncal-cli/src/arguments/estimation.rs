//! Options that control how a run is estimated, which are the same for a single run and a lot.

use super::choice::{AIDINGS, FORMS, METHODS, NOISE, one_of};
use anyhow::Context;
use clap::error::ErrorKind;
use serde::Serialize;

use super::error_term::{needs_table, supported};
use super::with::{With, with_value};
use turncal::calibration::{CalibrationError, Method, NoisePolicy, Options, Problem, Together};
use turncal::imu::InstallationForm;
use turncal::run::{Aiding, Run};

/// Estimation options.
#[derive(Debug, Clone, Serialize, clap::Args)]
pub struct Estimation {
    /// Estimation method
    #[arg(long, value_parser = one_of(&METHODS), default_value = "ekf")]
    pub method: Method,
    /// Form of the misalignment matrix
    #[arg(long, value_parser = one_of(&FORMS), default_value = "general")]
    installation: InstallationForm,
    /// Observations used by the filter [default: table if the run has a table log, otherwise velocity]
    #[arg(long, value_parser = one_of(&AIDINGS))]
    aiding: Option<Aiding>,
    /// Error terms to estimate in addition to those switched on in run.toml. auto: average over each term being absent
    /// or having one of its usual sizes; none: only K, E and D; or names of terms that are always estimated [default:
    /// auto]
    #[arg(long, value_name = "TERM", value_parser = with_value(), value_delimiter = ',')]
    #[serde(serialize_with = "With::names")]
    with: Vec<With>,
    /// Noise used by the filter
    #[arg(long, value_parser = one_of(&NOISE), default_value = "auto")]
    noise: NoisePolicy,
}

impl Estimation {
    /// Exits if two arguments exclude each other.
    pub fn check(&self) {
        With::check(&self.with);
        let first = With::terms(&self.with).next();
        if let (Method::SixPosition, Some(term)) = (self.method, first) {
            let message = format!(
                "--with {}: --method six-position estimates only scale factors, misalignments and biases; omit \
                 --with, or use --method ekf\n",
                term.name()
            );
            clap::Error::raw(ErrorKind::ArgumentConflict, message).exit();
        }
        for term in With::terms(&self.with) {
            needs_table(term, self.aiding);
        }
    }

    /// Calibration problem for one run.
    pub fn problem<'a>(&self, run: &'a Run, path: &std::path::Path) -> anyhow::Result<Problem<'a>> {
        if self.aiding == Some(Aiding::Table) && run.recording.table.is_none() {
            return Err(CalibrationError::NoTable).with_context(|| path.display().to_string());
        }
        let problem = Problem::new(run, &self.options());
        for term in With::terms(&self.with) {
            supported(term, &problem)?;
        }
        Ok(problem)
    }

    /// Joint calibration problem for several recordings of one instrument.
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
        for term in With::terms(&self.with) {
            supported(term, &problem)?;
        }
        Ok(problem)
    }

    /// The options, before the checks that need a run.
    pub fn options(&self) -> Options {
        Options {
            form: self.installation,
            aiding: self.aiding,
            terms: With::terms(&self.with).collect(),
            auto_terms: With::is_auto(&self.with),
            noise: self.noise,
            ..Options::default()
        }
    }
}
