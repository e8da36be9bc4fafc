//! Where in the hierarchy of a composed deployment a command looks: what `--in` and `--depth` mean, for all of them.
//!
//! To a subsystem belongs what stands in its file and in those of its subsystems: everything whose name begins with its path, and its
//! coordinators. Inside it is called as in that file; what is outside has a `/` before its path from the deployment that runs, as in
//! other hierarchies of names. What only people read (reasons, notes) stays as it was said.

use super::CommandFailure;
use crate::model::codes::CLI_UNKNOWN_SUBSYSTEM;
use crate::model::finding::did_you_mean;
use crate::model::names;
use crate::model::{Ask, ComponentName, OPERATOR};
use serde_json::Value as Json;

/// Which subsystem.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct Inside {
    /// Only what belongs to the subsystem of this path, by the names of its own file; what is outside has a `/` before its path.
    #[arg(long = "in", value_name = "PATH", value_parser = path)]
    path: Option<String>,
}

/// Which subsystem, and how far what is in it is unfolded.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct Hierarchy {
    #[command(flatten)]
    #[allow(missing_docs)] // a doc comment here would become the help of the whole command
    pub inside: Inside,
    /// Fold subsystems that are more than N levels deep (0: all of them); without it everything is unfolded.
    #[arg(long, value_name = "N", conflicts_with = "json")]
    pub depth: Option<usize>,
}

/// The path of a subsystem as it is typed: a `/` at either end is no mistake.
///
/// # Errors
/// It is none.
fn path(text: &str) -> Result<String, String> {
    let path = text.trim_matches('/');
    match ComponentName::new(path) {
        Ok(_) => Ok(path.to_owned()),
        Err(_) => Err("a path is names of subsystems separated by `/`, such as `left` or `cell/left`".to_owned()),
    }
}

impl Inside {
    /// The subsystem that is meant, if one is; `known` are the paths of all.
    ///
    /// # Errors
    /// There is none of that path.
    pub fn among<'a>(&self, known: impl IntoIterator<Item = &'a str>) -> Result<Option<Region>, CommandFailure> {
        let Some(path) = self.path.as_deref() else { return Ok(None) };
        let known: Vec<&str> = known.into_iter().collect();
        if known.contains(&path) {
            return Ok(Some(Region { path: path.to_owned() }));
        }
        let help = did_you_mean(path, "subsystems", known);
        Err(CommandFailure::usage(CLI_UNKNOWN_SUBSYSTEM, format!("there is no subsystem `{path}`"), help))
    }

    /// The same of a running deployment, by its status.
    ///
    /// # Errors
    /// There is none of that path.
    pub fn in_status(&self, status: &Json) -> Result<Option<Region>, CommandFailure> {
        self.among(status["subsystems"].as_array().into_iter().flatten().filter_map(|one| one["name"].as_str()))
    }

    /// Whether a subsystem is meant.
    pub fn is_some(&self) -> bool {
        self.path.is_some()
    }
}

/// A subsystem that is looked into.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Region {
    path: String,
}

/// Who is in no file.
const NOBODYS: [&str; 4] = [OPERATOR, "configurator", "deployment", "script"];

impl Region {
    /// Its path.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// What it is called in the file of its parent.
    pub fn last(&self) -> &str {
        self.path.rsplit('/').next().unwrap_or(&self.path)
    }

    /// Whether what is called so belongs to it. A coordinator may be called like the subsystem.
    pub fn has(&self, name: &str) -> bool {
        is_within(name, &self.path)
    }

    /// How that is called there.
    pub fn name(&self, name: &str) -> String {
        if let Some((coordinator, state)) = name.split_once(':') {
            return format!("{}:{state}", self.name(coordinator));
        }
        match names::local_to(name, &self.path) {
            _ if name == self.path => self.last().to_owned(),
            Some(own) => own.to_owned(),
            _ if is_nobodys(name) => name.to_owned(),
            _ => format!("/{name}"),
        }
    }

    /// A step as its text has it: behind the verb, and behind an arrow, stands a name.
    pub fn step(&self, text: &str) -> String {
        let named = names_of(text);
        let mut before = "";
        let mut words = Vec::new();
        for (at, word) in text.split(' ').enumerate() {
            words.push(match named.contains(&at) {
                true => self.name(word),
                // A type that the file's own monitors are of; others have no path.
                false if before == ":" && at == named[0] + 2 => {
                    names::local_to(word, &self.path).unwrap_or(word).to_owned()
                }
                false => word.to_owned(),
            });
            before = word;
        }
        words.join(" ")
    }

    /// Whether a step is about something of it.
    pub fn is_in_step(&self, text: &str) -> bool {
        let named = names_of(text);
        text.split(' ').enumerate().any(|(at, word)| named.contains(&at) && self.has(word))
    }

    /// A full name, of one that was typed as it is called there.
    pub fn full(&self, name: &str) -> String {
        name.strip_prefix('/').map_or_else(|| format!("{}/{name}", self.path), str::to_owned)
    }
}

/// Whether a name, or a path, is that of a subsystem or in it.
pub fn is_within(name: &str, path: &str) -> bool {
    // Of a state the coordinator's name.
    names::is_within(name.split(':').next().unwrap_or(name), path)
}

/// What has no place in any file: who asks from outside, and a request that names nothing.
fn is_nobodys(name: &str) -> bool {
    let bare = Ask::Undo.subject();
    let about_undo = name == bare || name.strip_prefix(bare).is_some_and(|rest| rest.starts_with('.'));
    about_undo || name == "commit" || name.starts_with("commit.") || name.contains(' ') || NOBODYS.contains(&name)
}

/// Which words of a step's text are names.
fn names_of(text: &str) -> Vec<usize> {
    let first = if text.starts_with("undo: ") { 2 } else { 1 };
    let arrows = text.split(' ').enumerate().filter(|(_, word)| *word == "->").map(|(at, _)| at + 1);
    std::iter::once(first).chain(arrows).collect()
}

/// One of that path, for tests.
#[cfg(test)]
pub fn region(path: &str) -> Region {
    Region { path: path.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_inside_are_those_of_the_file_and_outside_those_from_the_root() {
        let left = region("cell/left");
        for (name, there) in [
            ("cell/left/Drive.gain", "Drive.gain"),
            ("cell/left/arm/Drive", "arm/Drive"),
            ("cell/left", "left"),
            ("cell/left:root.on", "left:root.on"),
            ("cell/left/hand:root", "hand:root"),
            ("cell/leftover/Drive", "/cell/leftover/Drive"),
            ("join", "/join"),
            ("operator", "operator"),
            ("a safety event", "a safety event"),
            ("undo.done", "undo.done"),
            ("undoing", "/undoing"),
        ] {
            assert_eq!(left.name(name), there, "{name}");
        }
        assert!(left.has("cell/left") && left.has("cell/left/x.ok") && !left.has("cell/leftover") && !left.has("cell"));
        assert_eq!((left.full("make"), left.full("/join")), ("cell/left/make".to_owned(), "join".to_owned()));
    }

    #[test]
    fn steps_are_about_what_stands_behind_the_verb_and_the_arrow() {
        let left = region("left");
        let step = "connect left/Drive.pose -> right/Drive.ref (data)";
        assert_eq!(left.step(step), "connect Drive.pose -> /right/Drive.ref (data)");
        assert_eq!(left.step("undo: stop left/Drive"), "undo: stop Drive");
        assert_eq!(left.step("property_set left/Drive.name = \"left/x\""), "property_set Drive.name = \"left/x\"");
        assert_eq!(left.step("create left/Seen : left/davit.Monitors"), "create Seen : davit.Monitors");
        assert_eq!(left.step("create left/Drive : my.Drive"), "create Drive : my.Drive");
        assert!(left.is_in_step(step) && region("right").is_in_step(step) && !left.is_in_step("start right/Drive"));
    }

    #[test]
    fn a_path_is_taken_as_it_is_typed() {
        assert_eq!(path("/cell/left/").as_deref(), Ok("cell/left"));
        assert!(path("/").is_err() && path("left right").is_err() && path("a//b").is_err());
    }
}
