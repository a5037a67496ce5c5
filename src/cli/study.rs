//! `turncal study`

mod accuracy;
mod experiment;

use clap::Subcommand;

/// Answers a question with many simulated runs
#[derive(Debug, clap::Args)]
#[command(arg_required_else_help = true)]
pub struct Study {
    #[command(subcommand)]
    question: Question,
}

#[derive(Debug, Subcommand)]
enum Question {
    Accuracy(accuracy::Accuracy),
    Experiment(experiment::Experiment),
}

impl Study {
    pub fn run(&self) -> anyhow::Result<()> {
        match &self.question {
            Question::Accuracy(accuracy) => accuracy.run(),
            Question::Experiment(experiment) => experiment.run(),
        }
    }
}
