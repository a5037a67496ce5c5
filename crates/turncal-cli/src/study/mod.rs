//! `turncal study`

mod accuracy;
mod experiment;
mod table1;

use std::ops::ControlFlow;
use std::path::Path;

use clap::Subcommand;

use crate::arguments::Delivery;
use crate::terminal::Runs;
use turncal::study;
use turncal_report::Document;

/// Runs a Monte Carlo study
#[derive(Debug, clap::Args)]
#[command(arg_required_else_help = true)]
#[command(after_help = "Example:  turncal study accuracy --runs 500 -o accuracy")]
pub struct Study {
    #[command(subcommand)]
    question: Question,
}

#[derive(Debug, Subcommand)]
enum Question {
    Accuracy(accuracy::Accuracy),
    Experiment(experiment::Experiment),
    Table1(table1::Table1),
}

impl Study {
    pub fn run(&self) -> anyhow::Result<()> {
        match &self.question {
            Question::Accuracy(accuracy) => accuracy.run(),
            Question::Experiment(experiment) => experiment.run(),
            Question::Table1(table1) => table1.run(),
        }
    }
}

/// Makes a whole study and delivers the document of its outcome.
fn carry_out<S: study::Study>(
    study: &S,
    delivery: &Delivery,
    inputs: &[&Path],
    document: fn(&S::Outcome) -> Document,
) -> anyhow::Result<()> {
    let begun = delivery.begin(inputs)?;
    let runs = Runs::new(study.runs());
    let outcome = study.run(&|| {
        runs.one_done();
        ControlFlow::Continue(())
    })?;
    drop(runs);
    begun.deliver(&document(&outcome))
}
