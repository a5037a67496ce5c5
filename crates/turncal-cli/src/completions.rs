//! `turncal completions`

use clap_complete::Shell;

use crate::terminal::print;

/// Prints a shell-completion script
///
/// Save the script where your shell looks for completions; the examples show the location for each shell.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal completions bash > \\
      ~/.local/share/bash-completion/completions/turncal
  turncal completions zsh > ~/.zfunc/_turncal
  turncal completions fish > ~/.config/fish/completions/turncal.fish")]
pub struct Completions {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

impl Completions {
    pub fn run(&self, mut command: clap::Command) -> anyhow::Result<()> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut command, "turncal", &mut script);
        print(&script)
    }
}
