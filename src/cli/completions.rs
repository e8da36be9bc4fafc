//! `davit completions SHELL`

use super::exit::Exit;
use super::{CommandContext, CommandResult, Run};

/// Print a completion script for a shell.
///
/// For bash: `davit completions bash > ~/.local/share/bash-completion/completions/davit`
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The shell.
    #[arg(value_enum)]
    shell: clap_complete::Shell,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut super::command(), "davit", &mut script);
        context.out.text(String::from_utf8_lossy(&script));
        Ok(Exit::Done)
    }
}
