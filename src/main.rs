//! The `turncal` command.

/// Prints a line on standard error. A closed pipe, as with `head`, is not a failure.
macro_rules! tell {
    ($($words:tt)*) => {
        let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("{}\n", format_args!($($words)*)));
    };
}

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
            tell!("turncal: {}", printable(&format!("{error:#}")));
            match error.is::<cli::NotMet>() {
                true => ExitCode::from(3),
                false => ExitCode::FAILURE,
            }
        }
    }
}
