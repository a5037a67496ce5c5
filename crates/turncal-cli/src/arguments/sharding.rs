//! Parts of studies.

use std::ops::ControlFlow;
use std::path::Path;

use serde::Serialize;

use super::{Delivery, shard};
use crate::terminal::Runs;
use turncal::study::{Shard, Study};
use turncal_files::{Job, JobKind, Part, part_is_there, write_part};

/// The part of a study that this process computes.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct Sharding {
    /// Compute part i of M of the runs and write the results to DIR for turncal merge
    #[arg(long, value_name = "i/M", value_parser = shard, requires = "output", conflicts_with = "json", help_heading = "Advanced")]
    shard: Option<Shard>,
}

impl Sharding {
    /// Runs the requested part of a study unless its results already exist; returns false if the whole study was
    /// requested.
    pub fn make<S: Study<Trial: Serialize> + Serialize>(
        self,
        job: JobKind,
        study: &S,
        delivery: &Delivery,
        inputs: &[&Path],
    ) -> anyhow::Result<bool> {
        let Some((shard, target)) = self.shard.zip(delivery.output()) else {
            return Ok(false);
        };
        let runs = study.runs();
        let job = Job::new(job, serde_json::to_value(study)?, runs);
        let part = Part::new(job, Some(shard));
        if !delivery.force() && part_is_there(target, &part) {
            tell!("part {shard} already exists");
            return Ok(true);
        }
        let begun = delivery.begin(inputs)?;
        let held = part.held();
        let progress = Runs::new(held.len() as u64);
        let made = study.trials(&held, &|| {
            progress.one_done();
            ControlFlow::Continue(())
        })?;
        drop(progress);
        let written = begun.fill(|directory| write_part(directory, part.clone(), &made));
        // Another process may have computed the same part in the meantime.
        match written {
            Err(_) if part_is_there(target, &part) => {}
            written => written?,
        }
        tell!(
            "part {shard}: {} of {runs} runs; merge all parts with turncal merge",
            held.len()
        );
        Ok(true)
    }
}
