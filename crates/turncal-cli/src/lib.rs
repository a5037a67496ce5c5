//! The commands. Each command parses its arguments, calls the library and reports the result.

/// Prints a line on standard error. A closed pipe, as with `head`, is not an error.
macro_rules! tell {
    ($($words:tt)*) => {
        let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("{}\n", format_args!($($words)*)));
    };
}

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

use std::ffi::OsString;

use clap::{CommandFactory, Parser, Subcommand};

use turncal_report::terminal::printable;

use calibrate::NotMet;
use terminal::{leave_nothing_behind, with_threads};

/// Calibrates an inertial measurement unit on a turntable or by hand, with realistic uncertainties.
#[derive(Debug, Parser)]
#[command(
    name = "turncal",
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
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::Demo),
    Simulate(simulate::Simulate),
    Calibrate(calibrate::Calibrate),
    Show(result::show::Show),
    Compare(result::compare::Compare),
    Navigate(result::navigate::Navigate),
    Apply(result::apply::Apply),
    Export(result::export::Export),
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

/// Runs a command line and returns its exit status. The first argument is the name of the command. Wrong usage ends the
/// process at once.
pub fn command(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let cli = Cli::parse_from(arguments);
    leave_nothing_behind();
    let done = with_threads(|| cli.run()).unwrap_or_else(|error| Err(error.into()));
    let Err(error) = done else {
        return 0;
    };
    tell!("turncal: {}", printable(&format!("{error:#}")));
    if error.is::<NotMet>() { 3 } else { 1 }
}

impl Cli {
    fn run(&self) -> anyhow::Result<()> {
        match &self.command {
            Command::Demo(demo) => demo.run(),
            Command::Simulate(simulate) => simulate.run(),
            Command::Calibrate(calibrate) => calibrate.run(),
            Command::Show(show) => show.run(),
            Command::Compare(compare) => compare.run(),
            Command::Navigate(navigate) => navigate.run(),
            Command::Apply(apply) => apply.run(),
            Command::Export(export) => export.run(),
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
            Command::Completions(completions) => completions.run(Self::command()),
            Command::Man(manual) => manual.run(Self::command()),
        }
    }
}
