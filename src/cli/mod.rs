//! Commands: each parses its arguments, calls the library and says what came of it.

mod allan;
mod apply;
mod calibrate;
mod calibrated;
#[cfg(feature = "certificate")]
mod certificate;
mod check;
mod compare;
mod completions;
mod convert;
mod demo;
mod error_term;
mod estimation;
mod explain;
mod export;
mod init;
mod input;
mod list;
mod lot;
mod man;
mod merge;
mod names;
mod navigate;
mod noise;
mod output;
mod progress;
mod sharding;
mod signals;
mod simulate;
mod source;
mod study;
#[cfg(test)]
mod tests;
mod threads;

pub use lot::NotMet;
pub use signals::leave_nothing_behind;
pub use threads::with_threads;

use clap::{Parser, Subcommand};

/// Calibrates an inertial measurement unit on a turntable, with honest accuracies.
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
  turncal calibrate run.toml"
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
    Compare(compare::Compare),
    Navigate(navigate::Navigate),
    Apply(apply::Apply),
    Export(export::Export),
    #[cfg(feature = "certificate")]
    Certificate(certificate::Certificate),
    Study(study::Study),
    Merge(merge::Merge),
    Init(init::Init),
    Convert(convert::Convert),
    Check(check::Check),
    Explain(explain::Explain),
    Allan(allan::Allan),
    Noise(noise::Noise),
    List(list::List),
    Completions(completions::Completions),
    Man(man::Manual),
}

impl Cli {
    /// Does what the command line asks for.
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
            Command::Explain(explain) => explain.run(),
            Command::Allan(allan) => allan.run(),
            Command::Noise(noise) => noise.run(),
            Command::List(list) => list.run(),
            Command::Completions(completions) => completions.run(),
            Command::Man(manual) => manual.run(),
        }
    }
}
