//! `davit get`, `davit set`: one property or port of a running deployment.

use super::exit::Exit;
use super::output::Style;
use super::remote::{Patience, WITHIN, Which, ask, seconds};
use super::request::Asking;
use super::status::text;
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::model::codes::TEXT_NOT_FINITE;
use serde_json::{Value as Json, json};

/// Show what a property or a port of a running deployment is worth: value, unit, and when that was.
///
/// A property and a written in-port are read from the platform; of an out-port, and of an in-port that is connected, the next
/// sample is shown; a number that is not finite is a text in JSON: `"inf"`, `"-inf"`, `"nan"`. Exit status: 0 there is a value;
/// 1 there is none.
#[derive(Debug, clap::Args)]
pub struct GetArgs {
    /// The property or port: `Component.member`.
    #[arg(value_name = "PORT|PROPERTY")]
    member: String,
    #[command(flatten)]
    which: Which,
    #[arg(long, value_name = "SECONDS", default_value_t = 2.0, value_parser = seconds, help = WITHIN)]
    within: f64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Run for GetArgs {
    fn run(self, context: &CommandContext) -> CommandResult {
        let out = &context.out;
        let params = json!({ "name": self.member, "within_s": self.within });
        let patience = Patience::within(self.within);
        let seen = ask(self.which.name.as_deref(), "get", &params, patience.left())?;
        let there = !seen["value"].is_null();
        if self.json {
            out.json(&seen);
        } else if there {
            let unit = seen["unit"].as_str().map_or_else(String::new, |unit| format!(" {unit}"));
            let at = seen["at"].as_f64().unwrap_or_default();
            let driven = match seen["driven_by"].as_array() {
                Some(by) => format!(", from {}", by.iter().map(text).collect::<Vec<_>>().join(", ")),
                None => String::new(),
            };
            let about = format!("({}, at {at:.3} s{driven})", text(&seen["type"]));
            out.line(format!(
                "{} = {}{unit}  {}",
                out.paint(Style::Name, text(&seen["name"])),
                seen["value"],
                out.paint(Style::Dim, about)
            ));
        } else {
            out.line(format!("{}: {}", out.paint(Style::Name, text(&seen["name"])), text(&seen["why"])));
        }
        Ok(if there { Exit::Done } else { Exit::No })
    }
}

/// Set a property of a running deployment, or write an in-port that nothing drives, and wait for the answer.
///
/// It is applied like a configuration of this one change: checked against type, limits and run state, kept on the stack as a frame
/// of the operator, and taken back by `davit undo`. Exit status: 0 set; 1 refused, failed and taken back, or not answered
/// in time; 3 broken.
#[derive(Debug, clap::Args)]
pub struct SetArgs {
    /// The property or in-port: `Component.member`.
    #[arg(value_name = "PROPERTY|PORT")]
    member: String,
    /// Its new value, as JSON has it: `2.5`, `true`, `[0.1, 0.2]`, `{"x": 1}`; a text needs no quotes.
    #[arg(allow_negative_numbers = true)]
    value: String,
    /// Also when the deployment's `operator:` does not list it.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    asking: Asking,
}

impl Run for SetArgs {
    fn run(self, context: &CommandContext) -> CommandResult {
        let patience = self.asking.patience();
        let params = json!({ "name": self.member, "within_s": 0 });
        let seen = ask(self.asking.which.name.as_deref(), "get", &params, patience.left())?;
        let ty = text(&seen["type"]);
        let number = self.value.parse::<f64>().ok().filter(|_| matches!(ty, "float" | "int"));
        if number.is_some_and(|number| !number.is_finite()) {
            let message = format!("`{}` is no finite number", self.value);
            return Err(CommandFailure::usage(TEXT_NOT_FINITE, message, "numbers go up to about 1.8e308"));
        }
        let value = meant(&self.value, ty);
        let params = json!({ "name": self.member, "value": value, "force": self.force });
        self.asking.request(context, "set", params, &patience)
    }
}

/// A value as it was typed. A text is one as it stands, unless it is quoted.
fn meant(typed: &str, ty: &str) -> Json {
    match serde_json::from_str(typed) {
        Ok(value @ Json::String(_)) => value,
        Ok(value) if ty != "string" => value,
        _ => Json::String(typed.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_needs_no_quotes_and_a_number_may_be_one() {
        assert_eq!(meant("2.5", "float"), json!(2.5));
        assert_eq!(meant("[1, 2]", "float[2]"), json!([1, 2]));
        assert_eq!(meant("5", "string"), json!("5"));
        assert_eq!(meant("two words", "string"), json!("two words"));
        assert_eq!(meant("\"5\"", "string"), json!("5"));
        assert_eq!(meant("fast", "float"), json!("fast"), "the deployment says what is wrong with it");
    }
}
