//! Commands: each parses its arguments, calls the library and reports the result.

mod arguments;
mod calibrate;
mod completions;
mod demo;
mod list;
mod log;
mod man;
mod path;
mod result;
mod schema;
mod simulate;
mod study;
mod terminal;
#[cfg(test)]
mod tests;

pub use calibrate::NotMet;
pub use terminal::{leave_nothing_behind, with_threads};

use clap::{Parser, Subcommand};

/// Calibrates an inertial measurement unit on a turntable or by hand, with realistic uncertainties.
#[derive(Debug, Parser)]
#[command(
    version,
    arg_required_else_help = true,
    after_help = "\
Begin with:
  turncal demo

With a log of your own:
  turncal calibrate imu.csv

With a turntable:
  turncal init imu.csv -o run.toml
  turncal check run.toml
  turncal calibrate run.toml

Advanced (each with --help):
  merge        merge the parts of a job split with --shard
  study        run Monte Carlo studies: accuracy, table1, experiment
  schema       print the JSON schema of run.toml
  completions  print a shell-completion script
  man          write the manual pages"
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::Demo),
    Simulate(simulate::Simulate),
    Calibrate(calibrate::Calibrate),
    Compare(result::compare::Compare),
    Navigate(result::navigate::Navigate),
    Apply(result::apply::Apply),
    Export(result::export::Export),
    #[cfg(feature = "certificate")]
    Certificate(result::certificate::Certificate),
    #[command(hide = true)]
    Study(study::Study),
    #[command(hide = true)]
    Merge(calibrate::Merge),
    Init(log::init::Init),
    Convert(log::convert::Convert),
    Check(log::check::Check),
    Path(path::PathCommand),
    Explain(result::explain::Explain),
    Allan(log::allan::Allan),
    Noise(log::noise::Noise),
    List(list::List),
    #[command(hide = true)]
    Schema(schema::Schema),
    #[command(hide = true)]
    Completions(completions::Completions),
    #[command(hide = true)]
    Man(man::Manual),
}

impl Cli {
    /// Runs the command line.
    pub fn run(&self) -> anyhow::Result<()> {
        match &self.command {
            Command::Demo(demo) => demo.run(),
            Command::Simulate(simulate) => simulate.run(),
            Command::Calibrate(calibrate) => calibrate.run(),
            Command::Compare(compare) => compare.run(),
            Command::Navigate(navigate) => navigate.run(),
            Command::Apply(apply) => apply.run(),
            Command::Export(export) => export.run(),
            #[cfg(feature = "certificate")]
            Command::Certificate(certificate) => certificate.run(),
            Command::Study(study) => study.run(),
            Command::Merge(merge) => merge.run(),
            Command::Init(init) => init.run(),
            Command::Convert(convert) => convert.run(),
            Command::Check(check) => check.run(),
            Command::Path(path) => path.run(),
            Command::Explain(explain) => explain.run(),
            Command::Allan(allan) => allan.run(),
            Command::Noise(noise) => noise.run(),
            Command::List(list) => list.run(),
            Command::Schema(schema) => schema.run(),
            Command::Completions(completions) => completions.run(),
            Command::Man(manual) => manual.run(),
        }
    }
}
