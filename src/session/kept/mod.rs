//! What is kept of a deployment on disk, and outlives its process: who it was, that it lived, how it ended, and what
//! happened.
//!
//! In a directory of the user's own, two things a name. `NAME.life`: a line with the process and when it began, a second
//! one with how it ended; the process holds a lock on it as long as it lives, and its time of modification says when it lived
//! last. A life that nobody holds and that has no second line ended without a word. `NAME.log`, and `NAME.log.1` before it: the
//! entries of the log, one JSON object a line.

mod keeper;
mod reading;
mod rotating;
mod story;

pub use keeper::{Keeper, Leave};
pub use story::{Story, entries};

use super::Ended;
use super::place;
use crate::limits;
use crate::time::Wall;
use serde::{Deserialize, Serialize};
use std::fs::{self, TryLockError};
use std::path::{Path, PathBuf};

/// The directory: `$XDG_STATE_HOME/davit`, else `.local/state/davit` in the user's home; none where there is no home.
pub fn directory() -> Option<PathBuf> {
    let state = std::env::var_os("XDG_STATE_HOME").filter(|dir| Path::new(dir).is_absolute());
    let state = match state {
        Some(state) => PathBuf::from(state),
        None => std::env::home_dir().filter(|home| home.is_absolute())?.join(".local/state"),
    };
    Some(state.join("davit"))
}

fn file(name: &str, ending: &str) -> Option<PathBuf> {
    Some(directory()?.join(format!("{name}.{ending}")))
}

/// Where the log of a deployment is kept.
pub fn log_file(name: &str) -> Option<PathBuf> {
    file(name, "log")
}

/// A deployment's process, as it wrote itself down.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Began {
    pid: u32,
    began: Wall,
    /// The deployment's file.
    file: PathBuf,
    /// Which start of the machine it was.
    boot: Option<String>,
}

/// How it ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct End {
    /// When.
    pub at: Wall,
    /// Why it did not come up, or ended at once.
    pub why: Option<String>,
    /// How far stopping went, where it was stopped.
    pub ended: Option<Ended>,
}

/// One life of a deployment: the last of its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Life {
    /// The deployment's name.
    pub name: String,
    /// Its process.
    pub pid: u32,
    /// When it began.
    pub began: Wall,
    /// The deployment's file.
    pub file: PathBuf,
    /// When it was seen alive last.
    pub seen: Wall,
    /// Whether it lives.
    pub alive: bool,
    /// How it ended, if it said so.
    pub end: Option<End>,
    /// Whether the machine was started anew since.
    pub rebooted: bool,
}

impl Life {
    /// Whether it ended without a word: killed, crashed, or the machine went down under it.
    pub fn died(&self) -> bool {
        !self.alive && self.end.is_none()
    }
}

/// What is known of the last life of that name; none: nothing is kept.
pub fn life(name: &str) -> Option<Life> {
    let file = reading::opened(&file(name, "life")?).ok()?;
    let alive = matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
    let text = reading::end_of(&file, limits::LIFE_BYTES).ok()?;
    let text = String::from_utf8_lossy(&text);
    let seen = file.metadata().ok()?.modified().ok()?.into();
    let mut lines = text.lines();
    let began: Began = serde_json::from_str(lines.next()?).ok()?;
    let end = lines.next().and_then(|line| serde_json::from_str(line).ok());
    let rebooted = began.boot.is_some() && began.boot != boot();
    let Began { pid, began, file, .. } = began;
    Some(Life { name: name.to_owned(), pid, began, file, seen, alive, end, rebooted })
}

/// The last life of every name, in the order of their names.
pub fn lives() -> Vec<Life> {
    let Some(entries) = directory().and_then(|directory| fs::read_dir(directory).ok()) else { return Vec::new() };
    let mut names: Vec<String> = entries
        .filter_map(Result::ok)
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "life"))
        .filter_map(|path| path.file_stem().map(|name| name.to_string_lossy().into_owned()))
        .collect();
    names.sort();
    names.iter().filter_map(|name| life(name)).collect()
}

/// Removes what is kept of a deployment that does not run; answers whether there was something.
pub fn forget(name: &str) -> bool {
    if life(name).is_none_or(|life| life.alive) {
        return false;
    }
    for ending in ["log", "log.1", "life"] {
        let _ = file(name, ending).map(fs::remove_file);
    }
    true
}

/// Which start of the machine this is.
fn boot() -> Option<String> {
    fs::read_to_string("/proc/sys/kernel/random/boot_id").ok().map(|id| id.trim().to_owned())
}

/// The directory, made for its owner alone.
fn prepared() -> std::io::Result<PathBuf> {
    let missing = || std::io::Error::other("there is no home directory, and XDG_STATE_HOME is not set");
    let directory = directory().ok_or_else(missing)?;
    place::prepare(&directory)?;
    Ok(directory)
}
