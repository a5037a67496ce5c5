//! The `turncal` command.

mod cli;

use clap::Parser;

/// Calibrates an inertial measurement unit on a turntable, with honest accuracies.
#[derive(Debug, Parser)]
#[command(version)]
enum Command {
    Compare(cli::compare::CompareArgs),
}

fn main() -> anyhow::Result<()> {
    match Command::parse() {
        Command::Compare(args) => cli::compare::run(&args),
    }
}
