//! The `turncal` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    turncal::command(std::env::args_os()).into()
}
