//! `davit log`

use super::exit::Exit;
use super::output::{Output, Style};
use super::remote::{ASK, ask};
use super::status::text;
use super::{Answer, Context, Run};
use serde_json::{Value as Json, json};

/// Show what happened: requests and their answers, events, states, faults, and how long each step took.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The running deployment's name; not needed while only one runs.
    name: Option<String>,
    /// Only so many of the newest entries.
    #[arg(long, value_name = "N")]
    last: Option<usize>,
    /// Show the steps of every answer.
    #[arg(long)]
    steps: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &Context) -> Answer {
        let log = ask(self.name.as_deref(), "log", &json!({ "last": self.last }), ASK)?;
        if self.json {
            context.out.json(&log);
            return Ok(Exit::Done);
        }
        for entry in log.as_array().into_iter().flatten() {
            context.out.text(line(&context.out, entry, self.steps));
        }
        Ok(Exit::Done)
    }
}

/// An entry of the log as one line, and its steps below it if wanted.
pub fn line(out: &Output, entry: &Json, steps: bool) -> String {
    let what = match text(&entry["what"]) {
        "phase" => format!("phase      {}", out.paint(Style::Bold, text(&entry["phase"]))),
        "event" => format!("event      {} from {}", text(&entry["event"]), text(&entry["from"])),
        "emitted" => format!("emitted    {}", text(&entry["event"])),
        "state" => {
            let leaf = entry["active"].as_array().and_then(|a| a.last()).map_or("(inactive)", |s| text(s));
            format!("state      {}", out.paint(Style::Name, leaf))
        }
        "requested" => format!("request    {} by {}", text(&entry["ask"]), text(&entry["by"])),
        "answered" => {
            let style = if entry["ok"] == true { Style::Good } else { Style::Bad };
            let mut line = format!(
                "answer     {} ({}, {})",
                out.paint(style, text(&entry["answer"])),
                count(entry["steps"].as_array().map_or(0, Vec::len), "step"),
                duration(entry["took_us"].as_f64().unwrap_or_default()),
            );
            for reason in entry["reasons"].as_array().into_iter().flatten() {
                line.push_str(&format!("\n{:>12}           {}", "", text(reason)));
            }
            line + &if steps { below(out, entry) } else { String::new() }
        }
        "lost" => {
            let mut line = format!("lost       {}", out.paint(Style::Bad, text(&entry["event"])));
            for reason in entry["reasons"].as_array().into_iter().flatten() {
                line.push_str(&format!("\n{:>12}           {}", "", text(reason)));
            }
            line
        }
        "stale" => format!("stale      {}", text(&entry["event"])),
        "fault" => {
            format!("{}      {}: {}", out.paint(Style::Bad, "fault"), text(&entry["component"]), text(&entry["reason"]))
        }
        "returned" => format!("returned   {}", text(&entry["component"])),
        "dropped" => format!(
            "{}    {} events: the coordinator does not keep up",
            out.paint(Style::Care, "dropped"),
            entry["events"]
        ),
        "slow" => format!(
            "{}       coordinator `{}` has been in a function for {:.1} s",
            out.paint(Style::Care, "slow"),
            text(&entry["coordinator"]),
            entry["seconds"].as_f64().unwrap_or_default()
        ),
        "said" => format!("{:<10} {}", text(&entry["by"]), text(&entry["text"])),
        "recovered" => {
            let number = entry["steps"].as_array().map_or(0, Vec::len);
            let line = format!("{}  {}", out.paint(Style::Good, "recovered"), count(number, "step"));
            line + &if steps { below(out, entry) } else { String::new() }
        }
        "forced" => format!("{}     {}", out.paint(Style::Care, "forced"), text(&entry["note"])),
        other => format!("{other} {entry}"),
    };
    format!("{:>12.6}  {what}\n", entry["at"].as_f64().unwrap_or_default())
}

/// The steps of an entry, one line each.
fn below(out: &Output, entry: &Json) -> String {
    let line = |step: &Json| {
        let took = step["took_us"].as_f64().map_or_else(String::new, duration);
        let outcome = match text(&step["outcome"]) {
            "done" => String::new(),
            other => format!("  {}", out.paint(Style::Bad, other)),
        };
        format!("\n{:>12}           {took:>10}  {}{outcome}", "", text(&step["step"]))
    };
    entry["steps"].as_array().into_iter().flatten().map(line).collect()
}

/// `3 steps`, `1 step`.
pub fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// Microseconds as a person reads them.
pub fn duration(us: f64) -> String {
    match us {
        us if us < 1000.0 => format!("{us:.1} µs"),
        us if us < 1e6 => format!("{:.1} ms", us / 1e3),
        us => format!("{:.2} s", us / 1e6),
    }
}
