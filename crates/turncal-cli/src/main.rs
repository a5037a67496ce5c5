//! The `turncal` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    turncal_cli::command(std::env::args_os()).into()
}
