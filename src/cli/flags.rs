//! The flags of the commands, as `davit explain` tells of them: what each means, of which commands, and the keys that are about it.

use super::Cli;
use crate::lang::schema;
use clap::{Arg, Command, CommandFactory};
use serde::Serialize;

/// A flag with one meaning.
#[derive(Debug, Serialize)]
pub struct Flag {
    /// How it is written: `--set <NAME=VALUE>`.
    pub name: String,
    /// What it means.
    pub doc: String,
    /// The commands that have it so.
    pub of: Vec<String>,
    /// Keys of files that tell more, `deployment.with`.
    pub see: Vec<String>,
}

/// The commands with their flags; each also has those that all have.
fn commands() -> impl Iterator<Item = Command> {
    let mut all = Cli::command();
    all.build();
    all.get_subcommands().cloned().collect::<Vec<_>>().into_iter()
}

fn words(arg: &Arg) -> Vec<String> {
    let long = arg.get_long().map(|long| format!("--{long}"));
    long.into_iter().chain(arg.get_short().map(|short| format!("-{short}"))).collect()
}

/// All that are written like this, one for each meaning. `--set=1` is written like `--set`.
pub fn about(what: &str) -> Vec<Flag> {
    let what = what.split(['=', ' ']).next().unwrap_or(what);
    let mut found: Vec<Flag> = Vec::new();
    for command in commands() {
        for arg in command.get_arguments().filter(|arg| words(arg).iter().any(|word| word == what)) {
            let doc = arg.get_long_help().or_else(|| arg.get_help()).map(ToString::to_string).unwrap_or_default();
            let of = command.get_name().to_owned();
            match found.iter_mut().find(|flag| flag.doc == doc) {
                Some(flag) => flag.of.push(of),
                None => found.push(Flag { name: arg.to_string(), doc, of: vec![of], see: keys(what) }),
            }
        }
    }
    found
}

/// Keys whose meaning names the flag.
fn keys(flag: &str) -> Vec<String> {
    let named = |doc: &str| doc.split(|c: char| !c.is_alphanumeric() && c != '-').any(|word| word == flag);
    let all = schema::names().into_iter().flat_map(schema::about).filter(|entry| named(entry.doc));
    all.map(|entry| entry.of.map_or_else(|| entry.name.to_owned(), |of| format!("{of}.{}", entry.name))).collect()
}

/// Every flag that there is, once.
pub fn names() -> Vec<String> {
    let mut all: Vec<String> =
        commands().flat_map(|command| command.get_arguments().flat_map(words).collect::<Vec<_>>()).collect();
    all.sort_unstable();
    all.dedup();
    all
}
