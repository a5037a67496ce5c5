//! `turncal study`

mod accuracy;
mod carry_out;
mod experiment;
mod table1;

use clap::Subcommand;

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
