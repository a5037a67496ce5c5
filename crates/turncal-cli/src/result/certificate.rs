//! `turncal certificate`

use std::path::{Path, PathBuf};

use anyhow::Context;

use crate::NotMet;
use crate::arguments::{Overwrite, of_triads};
use crate::terminal::print;
use turncal::models;
use turncal_files::{digest_of_bytes, read_laboratory};
use turncal_input::small_file;
use turncal_report::certificate::{Certificate as Content, Conformity, Decision};

/// Writes a calibration certificate as PDF/A-3 with an embedded Digital Calibration Certificate
///
/// DIR/certificate.pdf contains the fields that ISO/IEC 17025 requires in a certificate, taken from calibration.json
/// and lab.toml. The PDF embeds dcc.xml (PTB DCC 3.3.0, with D-SI units and the covariance matrix) and
/// calibration.json; both are also written to DIR. If required fields are missing, the command lists them. All dates
/// come from lab.toml, so the same input always gives identical files. The certificate claims no accreditation.
///
/// To draft a lab.toml, run turncal certificate --draft
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal certificate --draft > lab.toml
  turncal certificate mine/calibration.json --laboratory lab.toml
  turncal certificate mine/calibration.json --laboratory lab.toml \\
      --specification specification.toml \\
      --as-found last-year/calibration.json -o paper")]
pub struct Certificate {
    /// The calibration
    #[arg(value_name = "CALIBRATION.json", required_unless_present = "draft")]
    calibration: Option<PathBuf>,
    /// Laboratory data
    #[arg(long, value_name = "lab.toml", required_unless_present = "draft")]
    laboratory: Option<PathBuf>,
    /// Limits for the parameters, checked with the decision rule in lab.toml
    #[arg(long, value_name = "specification.toml")]
    specification: Option<PathBuf>,
    /// Earlier calibration that was valid when the item was received
    #[arg(long, value_name = "EARLIER.json")]
    as_found: Option<PathBuf>,
    /// Directory in which to write the output
    #[arg(short, long, value_name = "DIR", default_value = "certificate")]
    output: PathBuf,
    /// Print only a lab.toml for you to complete
    #[arg(long, exclusive = true)]
    draft: bool,
    #[command(flatten)]
    overwrite: Overwrite,
}

impl Certificate {
    pub fn run(&self) -> anyhow::Result<()> {
        let (Some(path), Some(laboratory)) = (&self.calibration, &self.laboratory) else {
            return print(turncal_files::LABORATORY_DRAFT.as_bytes());
        };
        let read = |path: &Path| -> anyhow::Result<Vec<u8>> {
            small_file::read(path).with_context(|| format!("cannot read {}", path.display()))
        };
        let calibration = of_triads(turncal_files::read_calibration(path)?, path)?;
        let bytes = read(path)?;
        let laboratory = read_laboratory(laboratory, |key| calibration.meta.get(key).cloned())?;
        let specification = self.specification.as_deref();
        let specification = specification.map(models::specification).transpose()?;
        let earlier = self.as_found.as_deref();
        let earlier = earlier.map(turncal_files::read_calibration).transpose()?;
        let name = self
            .as_found
            .as_deref()
            .map(|path| -> anyhow::Result<String> {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                Ok(format!("{name}, SHA-256 {}", digest_of_bytes(&read(path)?)))
            });
        let name = name.transpose()?;
        let digest = digest_of_bytes(&bytes);
        let earlier = name.as_deref().zip(earlier.as_ref());
        let content = Content::new(
            calibration,
            digest,
            laboratory,
            specification.as_ref(),
            earlier,
        )
        .with_context(|| path.display().to_string())?;
        let inputs = [
            &self.calibration,
            &self.laboratory,
            &self.specification,
            &self.as_found,
        ];
        let inputs: Vec<&Path> = inputs.into_iter().flatten().map(PathBuf::as_path).collect();
        let whole = self.overwrite.directory(&self.output, &inputs)?;
        for (name, bytes) in turncal_report::certificate::document::files(&content, bytes)? {
            let target = whole.path().join(&name);
            std::fs::write(&target, bytes)
                .with_context(|| format!("cannot write {}", target.display()))?;
        }
        whole.commit()?;
        tell!(
            "certificate: {}",
            self.output.join("certificate.pdf").display()
        );
        let overall = content.conformity.as_ref().and_then(Conformity::overall);
        match overall {
            Some(Decision::Fail | Decision::ConditionalFail) => {
                let limits = "the certificate lists the limits".to_owned();
                Err(NotMet::Specification(limits).into())
            }
            _ => Ok(()),
        }
    }
}
