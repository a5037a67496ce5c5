//! The `turncal` command.

mod cli;

use std::process::ExitCode;

use clap::Parser;
use turncal::report::terminal::printable;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    cli::leave_nothing_behind();
    let done = cli::with_threads(|| cli.run()).unwrap_or_else(|error| Err(error.into()));
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("turncal: {}", printable(&format!("{error:#}")));
            ExitCode::FAILURE
        }
    }
}
