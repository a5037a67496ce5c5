//! `turncal path design`

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, bail};

use super::setting::{Setting, undecided};
use crate::arguments::{With, keep, seconds};
use crate::terminal::{Activity, show};
use turncal::study::design::{DesignStudy, SHORTEST};
use turncal::study::path::PathStudy;
use turncal_files::write_whole;
use turncal_report::path::{Report, in_words, moves_in_words};

/// Designs a path for a table or for a sensor turned by hand
///
/// Searches for the best sequence of turns and dwells: turns between the faces, edges and corners of a cube, and full
/// turns at several rates, within the limits of the table axes or by hand about body axes. With a specification, the
/// path is the shortest one found that decides every limit. Without a specification, the path takes all of the
/// available time and determines every group of parameters as well as possible, with and without the error terms that
/// may be absent. The terms given with --with are estimated too. The exit status is 3 if the σ are too large to decide a limit.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal path design --time 524 -o mine.toml
  turncal path design --table two-axis --imu tactical-fog
  turncal path design --with gyro-nonlinearity,accel-second-order
  turncal path design --hand --imu bmi088 \\
      --specification mems-by-hand -o by-hand.toml
  turncal path evaluate by-hand.toml --hand --imu bmi088")]
pub struct Design {
    #[command(flatten)]
    setting: Setting,
    /// Maximum duration of the path in s, at least 60 [default: 600; with a specification: 3600]
    #[arg(long, value_name = "S", value_parser = seconds)]
    time: Option<Duration>,
    /// Path file to write
    #[arg(short, long, value_name = "PATH.toml")]
    output: Option<PathBuf>,
    /// Replace the path file if it exists
    #[arg(long)]
    force: bool,
    /// Print the results as a single JSON document, without any other output
    #[arg(long)]
    json: bool,
}

impl Design {
    pub fn run(&self) -> anyhow::Result<()> {
        With::check(&self.setting.with);
        let time = self.time.map(|time| time.as_secs_f64());
        if let Some(short) = time.filter(|time| *time < SHORTEST) {
            bail!(
                "--time: found {short} s, expected {SHORTEST} s or more. A path needs several turns and dwells."
            );
        }
        if let Some(output) = &self.output {
            keep(output, self.setting.files())?;
        }
        let mut setting = PathStudy::setting(&self.setting.named(""))?;
        setting.options.auto_terms = With::is_auto(&self.setting.with);
        self.setting.check_terms(setting.options.aiding);
        let specification = self.setting.limits()?;
        let study = DesignStudy {
            setting,
            specification,
            time,
        };
        let activity = Activity::new("designing the path");
        let design = study.design().context("no path can be designed")?;
        drop(activity);
        let limits = study.specification.as_ref();
        let checks = limits.map(|limits| design.evaluation.decided(limits));
        let name = self.output.as_deref().and_then(|output| output.file_stem());
        let name = name.map_or("designed".into(), |name| name.to_string_lossy());
        let document = Report {
            name: &name,
            with: &in_words(&design.study),
            moves: &moves_in_words(&design.study.scenario),
            evaluation: &design.evaluation,
            checks: checks.as_deref(),
            design: Some(&design),
        }
        .document();
        if let Some(output) = &self.output {
            write_whole(output, design.text.as_bytes(), self.force)?;
        }
        show(&document, self.json)?;
        if let Some(output) = self.output.as_ref().filter(|_| !self.json) {
            tell!("\npath: {}", output.display());
        }
        undecided(&name, &document)
    }
}
