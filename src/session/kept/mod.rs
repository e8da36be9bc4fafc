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
use crate::time::{Clock, Wall};
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
pub struct Began {
    /// Its number.
    pub pid: u32,
    /// When it began.
    pub began: Wall,
    /// The deployment's file.
    pub file: PathBuf,
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
    /// Its process; none: what it wrote down of itself cannot be read.
    pub process: Option<Began>,
    /// It wrote something after that, which cannot be read.
    pub torn: bool,
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
    /// Whether what it wrote down of itself cannot be read, or not all of it.
    pub fn is_damaged(&self) -> bool {
        self.process.is_none() || self.torn
    }

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
    // That it was there is known also where what it wrote is damaged.
    let process: Option<Began> = lines.next().and_then(|line| serde_json::from_str(line).ok());
    let last = lines.next();
    let end: Option<End> = last.and_then(|line| serde_json::from_str(line).ok());
    let torn = last.is_some() && end.is_none();
    let rebooted = process.as_ref().is_some_and(|began| began.boot.is_some() && began.boot != boot());
    Some(Life { name: name.to_owned(), process, torn, seen, alive, end, rebooted })
}

/// The same of a deployment that has just gone: what its process held is free a moment after it has closed its connections.
pub fn life_after(name: &str) -> Option<Life> {
    let clock = Clock::real();
    loop {
        let life = life(name)?;
        if !life.alive || clock.now().as_secs_f64() >= limits::KEPT_LOCK.as_secs_f64() {
            return Some(life);
        }
        clock.sleep(limits::SOCKET_STEP);
    }
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
