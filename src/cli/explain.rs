//! `davit explain CODE|KEY`

use super::exit::Exit;
use super::flags::{self, Flag};
use super::output::{Output, Style, Table, text_columns};
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::diagnostics::wrapped;
use crate::lang::schema::{self, ReferenceEntry};
use crate::model::Verdict;
use crate::model::codes::{self, CLI_UNKNOWN_CODE, PAGES, Page};
use crate::model::finding::{and_also, did_you_mean, nearest};
use serde::Serialize;
use serde_json::json;

/// Explain a finding (what happened, why it is refused, what to do), or a key of the files (what it means, its form, its unit, its
/// bounds, what holds without it, how it is written), or an answer to a request (`ID.lost`). Behind `--` also a flag: `davit explain -- --set`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The finding's code, as `conf::unknown_component` or `davit::conf::unknown_component`; a key, as `timeout` or
    /// `configuration.timeout` or `type.ports.unit`; a table, as `configuration`; a word, as `above` or `e_after`; an answer, as `lost` or
    /// `ID.undo.failed`. Without one, all codes are listed.
    #[arg(value_name = "CODE|KEY")]
    what: Option<String>,
    /// List all keys, tables and words instead of the codes.
    #[arg(long, conflicts_with = "what")]
    keys: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct CodeView {
    code: &'static str,
    title: &'static str,
    text: &'static str,
}

impl From<&'static Page> for CodeView {
    fn from(page: &'static Page) -> Self {
        Self { code: page.code.0, title: page.title, text: page.text }
    }
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let out = &context.out;
        match (self.what, self.keys) {
            (Some(what), _) => one(out, &what, self.json)?,
            (None, true) => keys(out, self.json),
            (None, false) => all(out, self.json),
        }
        Ok(Exit::Done)
    }
}

fn all(out: &Output, json: bool) {
    if json {
        return out.json(&PAGES.iter().map(CodeView::from).collect::<Vec<_>>());
    }
    let mut table = Table::new(0);
    for page in PAGES {
        table.row([out.paint(Style::Name, page.code), page.title.to_owned()]);
    }
    out.text(table.to_string());
}

fn keys(out: &Output, json: bool) {
    let entries: Vec<ReferenceEntry> = schema::names().into_iter().flat_map(schema::about).collect();
    if json {
        return out.json(&entries);
    }
    let mut table = Table::new(0);
    for entry in &entries {
        table.row([out.paint(Style::Name, path(entry)), first_sentence(entry.doc).to_owned()]);
    }
    out.text(table.to_string());
}

/// What it is called where its name alone may mean several: `configuration.timeout`.
fn path(entry: &ReferenceEntry) -> String {
    entry.of.map_or_else(|| entry.name.to_owned(), |of| format!("{of}.{}", entry.name))
}

fn first_sentence(text: &str) -> &str {
    text.find(". ").map_or(text, |end| &text[..=end])
}

/// The codes that are called so in their areas.
fn called(name: &str) -> Vec<&'static str> {
    let all = PAGES.iter().map(|page| page.code.0);
    all.filter(|code| code.rsplit_once("::").is_some_and(|(_, own)| own == name)).collect()
}

/// A code, else what can be written under that name.
fn one(out: &Output, what: &str, json: bool) -> Result<(), CommandFailure> {
    if let Some(page) = codes::page(what) {
        if json {
            out.json(&CodeView::from(page));
        } else {
            out.line(format!("{}: {}\n", out.paint(Style::Name, page.code), out.paint(Style::Bold, page.title)));
            out.text(wrapped(page.text, text_columns(), 0));
        }
        return Ok(());
    }
    if what.starts_with('-') {
        return flag(out, what, json);
    }
    let entries = schema::about(what);
    let answer = match Verdict::split(what) {
        // A key may be written like one: `deploy.failed`.
        Some((_, ending)) => Verdict::ended(&ending[1..]).filter(|_| entries.is_empty()),
        None => Verdict::ended(what),
    };
    if let Some(verdict) = answer {
        let alone = entries.is_empty() && called(what).len() != 1;
        match (json, alone) {
            (true, true) => out.json(&json!({ "answer": answer_name(verdict), "text": verdict.meaning() })),
            (true, false) => {}
            (false, true) => out.text(shown_answer(out, verdict)),
            (false, false) => out.line(shown_answer(out, verdict)),
        }
        if alone {
            return Ok(());
        }
    }
    if entries.is_empty() {
        // Of a code only what is behind its area is remembered.
        let called: Vec<&str> = called(what);
        return match called[..] {
            [code] => one(out, code, json),
            _ => Err(unknown(what)),
        };
    }
    if json {
        out.json(&entries);
        return Ok(());
    }
    for (at, entry) in entries.iter().enumerate() {
        if at > 0 {
            out.line("");
        }
        out.text(shown(out, entry));
    }
    Ok(())
}

/// Whose answer it is, as files write it: `ID.undo.failed`.
fn answer_name(verdict: Verdict) -> String {
    format!("ID{}", verdict.ending(false))
}

fn shown_answer(out: &Output, verdict: Verdict) -> String {
    format!(
        "{}: an answer\n{}",
        out.paint(Style::Name, answer_name(verdict)),
        wrapped(verdict.meaning(), text_columns(), 2)
    )
}

/// A flag: which commands have it, and what it means there.
fn flag(out: &Output, what: &str, json: bool) -> Result<(), CommandFailure> {
    let flags = flags::about(what);
    if flags.is_empty() {
        let message = format!("no command has a flag `{what}`");
        let known = flags::names();
        let help = did_you_mean(what, "flags", known.iter().map(String::as_str));
        return Err(CommandFailure::no(CLI_UNKNOWN_CODE, message, help));
    }
    if json {
        out.json(&flags);
        return Ok(());
    }
    for (at, flag) in flags.iter().enumerate() {
        if at > 0 {
            out.line("");
        }
        out.text(shown_flag(out, flag));
    }
    Ok(())
}

fn shown_flag(out: &Output, flag: &Flag) -> String {
    let mut text = format!("{}\n{}", out.paint(Style::Name, &flag.name), wrapped(&flag.doc, text_columns(), 2));
    let of: Vec<String> = flag.of.iter().map(|command| format!("davit {command}")).collect();
    let see: Vec<String> = flag.see.iter().map(|key| format!("davit explain {key}")).collect();
    for (name, list) in [("of", of), ("see", see)] {
        if !list.is_empty() {
            let list = wrapped(&list.join(", "), text_columns(), 12);
            text.push_str(&format!("  {:10}{}\n", format!("{name}:"), list.trim()));
        }
    }
    text
}

fn unknown(what: &str) -> CommandFailure {
    let name = what.strip_prefix("davit::").unwrap_or(what);
    let (message, list) = match what.contains("::") {
        true => (format!("there is no finding with the code `{what}`"), "`davit explain` lists all codes"),
        false => (
            format!("`{what}` is neither a code of a finding nor a key of a file, nor an answer"),
            "`davit explain` lists all codes, `davit explain --keys` all keys",
        ),
    };
    let inside =
        name.rsplit_once('.').and_then(|(of, key)| Some(format!("{of}.{}", nearest(key, schema::keys_of(of))?)));
    let near = called(name)
        .first()
        .map(|code| (*code).to_owned())
        .or(inside)
        .or_else(|| nearest(name, PAGES.iter().map(|page| page.code.0).chain(schema::names())).map(str::to_owned));
    let help = near.map_or_else(|| list.to_owned(), |near| and_also(&format!("did you mean `{near}`?"), list));
    CommandFailure::no(CLI_UNKNOWN_CODE, message, help)
}

/// What a key, a table or a word is, for people.
fn shown(out: &Output, entry: &ReferenceEntry) -> String {
    let mut text = format!("{}{}\n", out.paint(Style::Name, path(entry)), entry.demanded());
    text.push_str(&wrapped(entry.doc, text_columns(), 2));
    let mut line = |name: &str, value: &str| {
        if !value.is_empty() {
            let value = wrapped(value, text_columns(), 12);
            text.push_str(&format!("  {:10}{}\n", format!("{name}:"), value.trim()));
        }
    };
    line("form", &entry.form);
    line("unit", entry.unit);
    line("without", entry.default);
    line("YAML", entry.example.yaml.as_deref().unwrap_or_default());
    line("Lua", entry.example.lua.unwrap_or_default());
    if let Some((refused, code)) = entry.refused {
        line("refused", &format!("{refused}  ({code})"));
    }
    text
}
