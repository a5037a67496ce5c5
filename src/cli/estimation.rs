//! How a run is estimated, alike for one run and for a lot.

use anyhow::Context;
use clap::ValueEnum;
use clap::error::ErrorKind;
use serde_json::{Value, json};
use turncal::calibration::{self, CalibrationError, NoisePolicy, Options, Problem, Together};
use turncal::imu::InstallationForm;
use turncal::run::Run;

use super::error_term::TermArgument;

/// Arguments that say how.
#[derive(Debug, Clone, clap::Args)]
pub struct Estimation {
    /// Estimation method
    #[arg(long, value_enum, default_value_t = Method::Ekf)]
    pub method: Method,
    /// Form of the installation matrix
    #[arg(long, value_enum, default_value_t = Installation::General)]
    pub installation: Installation,
    /// Observations of the filter [default: table if the run has its log, else velocity]
    #[arg(long, value_enum)]
    aiding: Option<Aiding>,
    /// Error terms to estimate, in addition to those that the run switches on [default: those that the data support]
    #[arg(long, value_name = "TERM", value_enum, value_delimiter = ',')]
    with: Vec<TermArgument>,
    /// Noise used by the filter
    #[arg(long, value_enum, default_value_t = Noise::default())]
    noise: Noise,
}

/// Estimation method.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Method {
    /// Extended Kalman filter over the whole run
    Ekf,
    /// Closed form: from the table's positions, else from labelled sections, else from gravity
    SixPosition,
}

/// An installation form.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Installation {
    /// Six direction cosines, rows of unit norm
    General,
    /// Six off-diagonal entries, unit diagonal
    SixAngle,
    /// Identity plus a cross-product matrix
    ThreeAngle,
}

/// Observations of the filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Aiding {
    /// Zero velocity in every dwell, and the attitude of the table
    Table,
    /// Zero velocity alone; the accelerometers define the body axes
    Velocity,
}

/// Noise used by the filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Noise {
    /// Use the noise that run.toml and models state
    Stated,
    /// Use the stated noise; estimate it from the record if the two disagree (p < 0.001)
    #[value(alias = "estimate")]
    Auto,
    /// Estimate the noise from the record, with the stated noise as prior
    Learnt,
}

impl Default for Noise {
    fn default() -> Self {
        match NoisePolicy::default() {
            NoisePolicy::Stated => Self::Stated,
            NoisePolicy::Auto => Self::Auto,
            NoisePolicy::Learnt => Self::Learnt,
        }
    }
}

impl From<Noise> for NoisePolicy {
    fn from(noise: Noise) -> Self {
        match noise {
            Noise::Stated => Self::Stated,
            Noise::Auto => Self::Auto,
            Noise::Learnt => Self::Learnt,
        }
    }
}

impl From<Installation> for InstallationForm {
    fn from(form: Installation) -> Self {
        match form {
            Installation::General => Self::General,
            Installation::SixAngle => Self::SixAngle,
            Installation::ThreeAngle => Self::ThreeAngle,
        }
    }
}

impl From<Aiding> for turncal::run::Aiding {
    fn from(aiding: Aiding) -> Self {
        match aiding {
            Aiding::Table => Self::Table,
            Aiding::Velocity => Self::Velocity,
        }
    }
}

impl From<Method> for calibration::Method {
    fn from(method: Method) -> Self {
        match method {
            Method::Ekf => Self::Ekf,
            Method::SixPosition => Self::SixPosition,
        }
    }
}

impl Estimation {
    /// Ends the program where arguments exclude each other.
    pub fn check(&self) {
        if let (Method::SixPosition, Some(term)) = (self.method, self.with.first()) {
            let message = format!(
                "--with {}: --method six-position estimates scale factors, installation and biases only; \
                 leave --with out, or estimate it by --method ekf\n",
                term.0.name()
            );
            clap::Error::raw(ErrorKind::ArgumentConflict, message).exit();
        }
        for term in &self.with {
            term.needs_table(self.aiding);
        }
    }

    /// The problem that a run poses.
    pub fn problem<'a>(&self, run: &'a Run, path: &std::path::Path) -> anyhow::Result<Problem<'a>> {
        if self.aiding == Some(Aiding::Table) && run.recording.table.is_none() {
            return Err(CalibrationError::NoTable).with_context(|| path.display().to_string());
        }
        let mut problem = Problem::new(run, &self.options());
        for term in &self.with {
            term.switch_on(&mut problem)?;
        }
        Ok(problem)
    }

    /// The problem that recordings of one instrument pose together.
    pub fn together<'a>(
        &self,
        runs: &[&'a Run],
        together: &Together,
    ) -> anyhow::Result<Problem<'a>> {
        if matches!(self.method, Method::SixPosition) {
            anyhow::bail!(
                "--method six-position: the closed form is of one recording at one temperature; leave it out, or \
                 calibrate each run by itself"
            );
        }
        let mut problem = Problem::together(runs, &self.options(), together)?;
        for term in &self.with {
            term.switch_on(&mut problem)?;
        }
        Ok(problem)
    }

    fn options(&self) -> Options {
        let mut options = Options::default()
            .installation(self.installation.into())
            .noise(self.noise.into());
        options.auto_terms = self.with.is_empty();
        options.aiding = self.aiding.map(turncal::run::Aiding::from);
        options
    }

    /// All of it by name, as the command line spells it.
    pub fn in_words(&self) -> Value {
        let terms: Vec<&str> = self.with.iter().map(|term| term.0.name()).collect();
        json!({
            "method": word(&self.method),
            "installation": word(&self.installation),
            "aiding": self.aiding.as_ref().map(word),
            "with": terms,
            "noise": word(&self.noise),
        })
    }
}

/// A value as the command line spells it.
fn word(value: &impl ValueEnum) -> Option<String> {
    Some(value.to_possible_value()?.get_name().to_owned())
}
