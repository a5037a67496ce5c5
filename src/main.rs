//! The `turncal` command.

fn main() {}
