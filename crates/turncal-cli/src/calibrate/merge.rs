//! `turncal merge`: merges the parts of a job.

use std::path::{Path, PathBuf};

use anyhow::Context;
use serde::de::DeserializeOwned;

use super::lot;
use crate::arguments::Delivery;
use turncal::lot::{Lot, Unit};
use turncal::study::{AccuracyStudy, ExperimentStudy, Study};
use turncal_files::{JobKind, Part, Parts, read_part_unit};
use turncal_report as report;
use turncal_report::Document;

/// Merges the parts of a sharded job; the result is identical to that of a single run
///
/// A part is a directory of a lot or a study that was written with --shard. The number of parts, their order and the
/// machines that computed them do not affect the result. The command refuses missing or duplicate runs, and parts of a
/// different job.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  turncal study accuracy --runs 500 --shard 1/2 -o part-1
  turncal study accuracy --runs 500 --shard 2/2 -o part-2
  turncal merge part-1 part-2 -o accuracy")]
pub struct Merge {
    /// Directories of all parts
    #[arg(required = true, value_name = "PART")]
    parts: Vec<PathBuf>,
    #[command(flatten)]
    delivery: Delivery,
}

impl Merge {
    pub fn run(&self) -> anyhow::Result<()> {
        let parts = Parts::read(&self.parts)?;
        let inputs: Vec<&Path> = self.parts.iter().map(PathBuf::as_path).collect();
        match parts.job.job {
            JobKind::Lot => self.lot(&parts, &inputs),
            JobKind::StudyAccuracy => {
                self.study::<AccuracyStudy>(&parts, &inputs, report::accuracy::document)
            }
            JobKind::StudyExperiment => {
                self.study::<ExperimentStudy>(&parts, &inputs, report::experiment::document)
            }
        }
    }

    fn study<S: Study<Trial: DeserializeOwned> + DeserializeOwned>(
        &self,
        parts: &Parts,
        inputs: &[&Path],
        document: fn(&S::Outcome) -> Document,
    ) -> anyhow::Result<()> {
        let study: S = serde_json::from_value(parts.job.options.clone()).with_context(|| {
            let first = self.parts.first().map_or(Path::new(""), PathBuf::as_path);
            format!(
                "{}: job.json does not describe a study. Make the parts again",
                first.display()
            )
        })?;
        let begun = self.delivery.begin(inputs)?;
        begun.deliver(&document(&study.outcome(parts.results()?)?))
    }

    fn lot(&self, parts: &Parts, inputs: &[&Path]) -> anyhow::Result<()> {
        let target = self.delivery.output();
        let part = Part::new(parts.job.clone(), None);
        let open = |target| lot::open_directory(target, &part, self.delivery.force(), inputs);
        let directory = target.map(open).transpose()?;
        let units = parts
            .units()
            .into_iter()
            .map(|(name, part)| match &directory {
                Some(directory) => directory.copy(part, name),
                None => read_part_unit(part, name),
            });
        let units = units.collect::<Result<Vec<Unit>, _>>()?;
        let lot = Lot::new(units, None, parts.job.specification.clone());
        lot::deliver(&lot, directory.as_ref().zip(target), self.delivery.json())
    }
}
