//! `davit recover`

use super::drift::listed;
use super::exit::Exit;
use super::output::Style;
use super::remote::{OnlyWhich, Patience, WITHIN, connect, failure, seconds};
use super::status::text;
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::configurator::WAY_OUT;
use crate::model::codes::{CLI_REFUSED, CLI_WHICH_WAY};
use crate::session::NO_FORWARD;
use serde_json::{Value as Json, json};

/// Lead a broken deployment out: back to the system before what broke it, or by taking what is there as the state.
///
/// The platform is looked at first. `davit undo ID` of the very configuration that broke it goes back as well. What is safe and in force in part stays, and is named:
/// `davit apply ID` applies it anew, `davit undo ID` lets it go. A deployment that is not broken stays as it
/// is. Exit status: 0 recovered; 1 refused, or not over in time; 3 still broken: what remains is named.
#[derive(Debug, clap::Args)]
#[command(override_usage = "davit recover [NAME] --back|--accept [--within SECONDS] [--json]")]
pub struct Args {
    #[command(flatten)]
    #[allow(missing_docs)] // a doc comment here would become the help of the whole command
    which: OnlyWhich,
    /// Undo what remains: to the system before the interrupted application.
    #[arg(long, conflicts_with_all = ["accept", "forward"])]
    back: bool,
    /// Take what is there as the state. The stack is given up: what was applied so far can no longer be undone.
    #[arg(long, conflicts_with = "forward")]
    accept: bool,
    #[arg(long, hide = true)]
    forward: bool,
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds, help = WITHIN)]
    within: f64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        if self.forward {
            return Err(CommandFailure::no(CLI_REFUSED, NO_FORWARD, WAY_OUT));
        }
        if !self.back && !self.accept {
            let message = "it is not said how to recover";
            return Err(CommandFailure::usage(CLI_WHICH_WAY, message, WAY_OUT));
        }
        let out = &context.out;
        let patience = Patience::within(self.within);
        let mut client = connect(self.which.name())?;
        let params = json!({ "direction": if self.back { "back" } else { "accept" }, "within_s": self.within });
        let answer = client.call("recover", &params, patience.left()).map_err(failure)?;
        let whole = answer["recovered"] == true;
        let exit = if whole { Exit::Done } else { Exit::Broken };
        if self.json {
            out.json(&answer);
            return Ok(exit);
        }
        let name = out.paint(Style::Bold, client.name());
        match (whole, answer["was_broken"] == true) {
            (true, true) => {
                out.line(format!("{name}: {}", out.paint(Style::Good, "recovered")));
                for step in answer["steps"].as_array().into_iter().flatten() {
                    out.line(format!("  {} ({})", text(&step["step"]), text(&step["outcome"])));
                }
            }
            (true, false) => out.line(format!("{name}: not broken, nothing to recover")),
            (false, _) => {
                let still = out.paint(Style::Bad, "still broken");
                out.line(format!("{name}: {still}: {}", text(&answer["why"])));
                out.text(listed(answer["residual"].as_array().map_or(&[][..], Vec::<Json>::as_slice)));
            }
        }
        Ok(exit)
    }
}
