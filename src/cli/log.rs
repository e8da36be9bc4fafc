//! `davit log`

use super::exit::Exit;
use super::inside::Hierarchy;
use super::kept;
use super::output::{Output, Style};
use super::remote::{ASK, OnlyWhich, connect, failure};
use super::sieve::Sieve;
use super::status::text;
use super::{CommandContext, CommandFailure, CommandResult, Run, output};
use crate::model::codes::{CLI_NO_ANSWER, CLI_NOT_RUNNING};
use crate::model::finding::count;
use crate::session::Stage;
use crate::session::client::{Client, ClientError};
use crate::session::kept::entries;
use crate::session::owner;
use serde_json::{Value as Json, json};

/// Show what happened: requests and their answers, events, states, faults, and how long each step took; of a deployment in the
/// background also what its components printed. Of one that does not run any more what was kept of it.
///
/// With `--in`, what belongs to that subsystem, what others have done to it, and what is of the whole deployment; with `--depth`, of
/// deeper subsystems only what goes wrong and what they and their parents tell each other.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    #[allow(missing_docs)] // a doc comment here would become the help of the whole command
    which: OnlyWhich,
    #[command(flatten)]
    hierarchy: Hierarchy,
    /// Only so many of the newest entries.
    #[arg(long, value_name = "N")]
    last: Option<usize>,
    /// Show the steps of every answer.
    #[arg(long)]
    steps: bool,
    /// Go on with what happens from now on, until the deployment ends.
    #[arg(long, short)]
    follow: bool,
    /// Print JSON; with `--follow` one object a line.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        if self.follow {
            return self.follow(context);
        }
        let asked = Client::connect(self.which.name()).and_then(|mut client| {
            let log = client.call("log", &json!({ "last": self.at_most() }), ASK)?;
            Ok((log.as_array().cloned().unwrap_or_default(), self.status(&mut client)?))
        });
        let entries = match asked {
            Ok((log, status)) => Sieve::new(&self.hierarchy, status.as_ref(), &log)?.newest(&log, self.last),
            Err(error) => self.kept(context, error)?,
        };
        if self.json {
            context.out.json(&entries);
            return Ok(Exit::Done);
        }
        for entry in &entries {
            context.out.text(line(&context.out, entry, self.steps));
        }
        Ok(Exit::Done)
    }
}

impl Args {
    /// How many entries are asked for: all, where only some of them are shown.
    fn at_most(&self) -> Option<usize> {
        self.last.filter(|_| !self.is_sifted())
    }

    fn is_sifted(&self) -> bool {
        self.hierarchy.inside.is_some() || self.hierarchy.depth.is_some()
    }

    /// The status, which is only needed to know the subsystems.
    fn status(&self, client: &mut Client) -> Result<Option<Json>, ClientError> {
        self.is_sifted().then(|| client.call("status", &json!({}), ASK)).transpose()
    }

    /// What was kept of one that could not be asked since it does not run any more.
    fn kept(&self, context: &CommandContext, error: ClientError) -> Result<Vec<Json>, CommandFailure> {
        let life = kept::meant(&error).ok_or_else(|| failure(error))?;
        let entries = entries(&life.name).map_err(|why| {
            CommandFailure::no(
                CLI_NOT_RUNNING,
                format!("`{}` does not run, and its log cannot be read: {why}", life.name),
                "`davit list` shows what runs",
            )
        })?;
        let entries = Sieve::new(&self.hierarchy, None, &entries)?.newest(&entries, self.last);
        context.out.error(match life.is_open() {
            true => format!("note: {}\n", kept::ended(&life)),
            false => format!("note: `{}` does not run any more\n", life.name),
        });
        Ok(entries)
    }

    /// Whether it prints one object a line.
    pub fn streams(&self) -> bool {
        self.follow
    }

    fn print(&self, context: &CommandContext, entry: &Json) {
        match self.json {
            true => context.out.json_line(entry),
            false => context.out.text(line(&context.out, entry, self.steps)),
        }
    }

    fn follow(&self, context: &CommandContext) -> CommandResult {
        let mut client = match Client::connect(self.which.name()) {
            Ok(client) => client,
            Err(error) => {
                let kept = self.kept(context, error)?;
                kept.iter().for_each(|entry| self.print(context, entry));
                return Ok(Exit::Done);
            }
        };
        let name = client.name().to_owned();
        client.subscribe(ASK).map_err(failure)?;
        // Asked for behind the subscription: what happens in between is in both.
        let mut asking = connect(Some(&name))?;
        let log = asking.call("log", &json!({ "last": self.at_most() }), ASK).map_err(failure)?;
        let told = log.as_array().cloned().unwrap_or_default();
        let sieve = Sieve::new(&self.hierarchy, self.status(&mut asking).map_err(failure)?.as_ref(), &told)?;
        drop(asking);
        let print = |entry: &Json| self.print(context, entry);
        sieve.newest(&told, self.last).iter().for_each(print);
        let mut overlap = Overlap(told);
        let mut phases = Phases::default();
        while let Ok(next) = client.next_entry() {
            if let Some(entry) = &next {
                phases.see(entry);
                if overlap.is_news(entry)
                    && let Some(entry) = sieve.pass(entry)
                {
                    print(&entry);
                }
            }
            if output::arrives_nowhere() || output::is_unread() {
                return Ok(Exit::Done);
            }
        }
        if !phases.over && kept::told_died(&context.out, &name, self.json) {
            return Ok(kept::EXIT);
        }
        if !phases.over && owner::is_owned(&name) {
            return Err(CommandFailure::no(
                CLI_NO_ANSWER,
                format!("the deployment `{name}` ended the connection"),
                "more happened than could be printed, or it is going down: `davit log` shows what it remembers",
            ));
        }
        Ok(Exit::Done)
    }
}

/// What was told already of what comes: the end of a log that was asked for while it went on.
struct Overlap(Vec<Json>);

impl Overlap {
    fn is_news(&mut self, entry: &Json) -> bool {
        let known = self.0.iter().position(|old| old == entry);
        match known {
            Some(place) => drop(self.0.drain(..=place)),
            // From the first that is new on all are.
            None => self.0.clear(),
        }
        known.is_none()
    }
}

/// How far a story is.
#[derive(Default)]
struct Phases {
    ending: bool,
    over: bool,
}

impl Phases {
    fn see(&mut self, entry: &Json) {
        if entry["what"] == "phase" {
            self.over = self.ending && entry["phase"] != "shutting_down";
            self.ending |= entry["phase"] == "shutting_down";
        }
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
            let line = format!(
                "answer     {} ({}, {})",
                out.paint(style, text(&entry["answer"])),
                count(entry["steps"].as_array().map_or(0, Vec::len), "step"),
                duration(entry["took_us"].as_f64().unwrap_or_default()),
            );
            line + &reasons(entry) + &if steps { below(out, entry) } else { String::new() }
        }
        "lost" => format!("lost       {}", out.paint(Style::Bad, text(&entry["event"]))) + &reasons(entry),
        "stale" => format!("stale      {}", text(&entry["event"])),
        "fault" => {
            format!("{}      {}: {}", out.paint(Style::Bad, "fault"), text(&entry["component"]), text(&entry["reason"]))
        }
        "injected" => format!("inject     {}: {}", text(&entry["component"]), text(&entry["fault"])),
        "returned" => format!("returned   {}", text(&entry["component"])),
        "missed" => format!(
            "{}     not shown: {}, which {}",
            out.paint(Style::Care, "missed"),
            count(&entry["entries"], "entry"),
            if entry["unreadable"] == true { "cannot be read in the file" } else { "came faster than they were read" }
        ),
        "dropped" => format!(
            "{}    {}: the coordinator does not keep up",
            out.paint(Style::Care, "dropped"),
            count(&entry["events"], "event")
        ),
        "slow" => format!(
            "{}       coordinator `{}` has been in a function for {:.1} s",
            out.paint(Style::Care, "slow"),
            text(&entry["coordinator"]),
            entry["seconds"].as_f64().unwrap_or_default()
        ),
        "printed" => format!("printed    {}", text(&entry["text"])),
        "began" => format!("began      process {}, {}", entry["pid"], text(&entry["when"])),
        "goes_on" => out.paint(Style::Dim, "goes on    what was before is not kept any more"),
        "ended" => {
            let why = entry["why"].as_str().map_or_else(String::new, |why| format!(": {why}"));
            let phase = entry["ended"]["phase"].as_str().unwrap_or_default();
            format!("ended      {}{why}, {}", out.paint(super::status::state_style(phase), phase), text(&entry["when"]))
        }
        "said" => format!("{:<10} {}", text(&entry["by"]), text(&entry["text"])),
        "recovered" => {
            let number = entry["steps"].as_array().map_or(0, Vec::len);
            let line = format!("{}  {}", out.paint(Style::Good, "recovered"), count(number, "step"));
            line + &if steps { below(out, entry) } else { String::new() }
        }
        "stopping" => {
            let stage = serde_json::from_value::<Stage>(entry["stage"].clone()).map_or("", Stage::words);
            let why = entry["why"].as_str().map_or_else(String::new, |why| format!(": {why}"));
            format!("stopping   {stage}{why}")
        }
        "forced" => format!("{}     {}", out.paint(Style::Care, "forced"), text(&entry["note"])),
        "noted" => format!("{}       {}", out.paint(Style::Care, "note"), text(&entry["note"])),
        other => format!("{other} {entry}"),
    };
    format!("{:>12.6}  {what}\n", entry["at"].as_f64().unwrap_or_default())
}

/// The reasons of an entry, one line each.
fn reasons(entry: &Json) -> String {
    let line = |reason: &Json| format!("\n{:>12}           {}", "", text(reason));
    entry["reasons"].as_array().into_iter().flatten().map(line).collect()
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

/// Microseconds as a person reads them.
pub fn duration(us: f64) -> String {
    match us {
        us if us < 1000.0 => format!("{us:.1} µs"),
        us if us < 1e6 => format!("{:.1} ms", us / 1e3),
        us => format!("{:.2} s", us / 1e6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_log_had_already_is_not_told_twice() {
        let entry = |number: u32| json!({ "at": number });
        let mut overlap = Overlap((0..5).map(entry).collect());
        let told: Vec<bool> = [3, 4, 5, 3, 6].map(|number| overlap.is_news(&entry(number))).to_vec();
        assert_eq!(told, [false, false, true, true, true]);
    }
}
