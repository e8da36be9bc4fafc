//! `davit drift`

use super::exit::Exit;
use super::inside::Inside;
use super::output::Style;
use super::remote::{OnlyWhich, Patience, WITHIN, connect, failure, seconds};
use super::status::text;
use super::{CommandContext, CommandResult, Run};
use crate::configurator::WAY_OUT;
use serde_json::{Value as Json, json};

/// Show how a running deployment differs from what it should be: the platform is read and compared.
///
/// Each line is what leads from the system as it should be to the system as it is. Exit status: 0 no difference; 1 a
/// difference, or the platform cannot be read.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    #[allow(missing_docs)] // a doc comment here would become the help of the whole command
    which: OnlyWhich,
    #[command(flatten)]
    inside: Inside,
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds, help = WITHIN)]
    within: f64,
    /// Print JSON: an array with one object a difference.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let out = &context.out;
        let patience = Patience::within(self.within);
        let mut client = connect(self.which.name())?;
        let drift = client.call("drift", &json!({ "within_s": self.within }), patience.left()).map_err(failure)?;
        let drift = match (self.inside.is_some(), drift.as_array()) {
            (true, Some(all)) => {
                let status = client.call("status", &json!({}), patience.left()).map_err(failure)?;
                self.inside.in_status(&status)?.map_or(Json::Null, |region| region.differences(all))
            }
            _ => drift,
        };
        let differences = drift.as_array().map_or(&[][..], Vec::as_slice);
        let exit = if differences.is_empty() { Exit::Done } else { Exit::No };
        if self.json {
            out.json(&drift);
            return Ok(exit);
        }
        let name = out.paint(Style::Bold, client.name());
        let broken = client.call("status", &json!({}), patience.left()).is_ok_and(|status| status["phase"] == "broken");
        match (differences.is_empty(), broken) {
            (true, false) => out.line(format!("{name}: as it should be")),
            (true, true) => out.line(format!("{name}: nothing differs from what is known of it")),
            (false, _) => {
                out.line(format!("{name}: what leads from the system as it should be to the system as it is"));
                context.out.text(listed(differences));
            }
        }
        if broken {
            out.error(format!("note: it is broken; {WAY_OUT}\n"));
        }
        Ok(exit)
    }
}

/// Differences as they are shown, one a line.
pub fn listed(differences: &[Json]) -> String {
    differences.iter().map(|difference| format!("  {}\n", text(&difference["text"]))).collect()
}
