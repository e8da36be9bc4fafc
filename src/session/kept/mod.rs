//! What is kept of a deployment on disk, and outlives its process: who it was, that it lived, how it ended, and what
//! happened.
//!
//! In a directory of the user's own, two things a name. `NAME.life`: a line with the process and when it began, a second
//! one with how it ended; the process holds a lock on it as long as it lives, and its time of modification says when it lived
//! last. A life that nobody holds and that has no second line ended without a word; of one in which anything else stands
//! nothing is known. `NAME.log`, and `NAME.log.1` before it: the
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
use std::io;
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

/// None: there is no directory, or that is no name but leads elsewhere.
fn file(name: &str, ending: &str) -> Option<PathBuf> {
    crate::model::Ident::new(name).ok()?;
    Some(directory()?.join(format!("{name}.{ending}")))
}

/// Where the log of a deployment is kept.
pub fn log_file(name: &str) -> Option<PathBuf> {
    file(name, "log")
}

/// A deployment's process, as it wrote itself down.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Began {
    /// The deployment's name, which a copy of another one's file gives away.
    #[serde(default)]
    name: Option<String>,
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
#[serde(deny_unknown_fields)]
pub struct LifeEnd {
    /// When.
    pub at: Wall,
    /// Why it did not come up, or ended at once.
    pub why: Option<String>,
    /// How far stopping went; none: the process ended at once, and nobody knows what is up still.
    pub ended: Option<Ended>,
}

/// One life of a deployment: the last of its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Life {
    /// The deployment's name.
    pub name: String,
    /// Its process; none: what it wrote down of itself cannot be read.
    pub process: Option<Began>,
    /// What stands in its record is not that, or not that alone.
    damaged: bool,
    /// When it was seen alive last.
    pub seen: Wall,
    /// Whether it lives.
    pub alive: bool,
    /// How it ended, if it said so.
    pub end: Option<LifeEnd>,
    /// Whether the machine was started anew since.
    pub rebooted: bool,
}

impl Life {
    /// Whether it does not live, and what it wrote down of itself cannot be read, or not all of it: how it ended is not known.
    pub fn is_damaged(&self) -> bool {
        !self.alive && self.damaged
    }

    /// Whether it was not shut down: killed, crashed, ended at once by signals, or the machine went down under it.
    pub fn died(&self) -> bool {
        !self.alive && !self.damaged && self.end.as_ref().is_none_or(|end| end.ended.is_none())
    }

    /// Whether nobody knows what is up still of it: it died, or it is not known how it ended.
    pub fn is_open(&self) -> bool {
        self.died() || self.is_damaged()
    }
}

/// What is known of the last life of that name; none: nothing is kept.
pub fn life(name: &str) -> Option<Life> {
    let path = file(name, "life")?;
    // That there was something is known also where what stands there is damaged, or no file at all.
    let seen = fs::symlink_metadata(&path).ok()?.modified().ok()?.into();
    let opened = reading::opened(&path);
    let alive = opened.as_ref().is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)));
    let text = opened.and_then(|file| reading::end_of(&file, limits::LIFE_BYTES)).unwrap_or_default();
    let (process, end) = record(name, &text).unzip();
    let damaged = process.is_none();
    let rebooted = process.as_ref().is_some_and(|began| began.boot.is_some() && began.boot != boot());
    Some(Life { name: name.to_owned(), process, damaged, seen, alive, end: end.flatten(), rebooted })
}

/// What a record of that name says; none: not only that of such a process stands there.
fn record(name: &str, text: &[u8]) -> Option<(Began, Option<LifeEnd>)> {
    let text = std::str::from_utf8(text).ok()?.strip_suffix('\n')?;
    let mut lines = text.split('\n');
    let began: Began = serde_json::from_str(lines.next()?).ok()?;
    let end = lines.next().map(serde_json::from_str).transpose().ok()?;
    let own = began.name.as_deref().is_none_or(|own| own == name);
    (own && lines.next().is_none()).then_some((began, end))
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

/// Removes what is kept of a deployment that does not run, and what is in the place of it; answers whether there was something.
///
/// # Errors
/// Where something stays: what it is, and why.
pub fn forget(name: &str) -> Result<bool, (PathBuf, io::Error)> {
    if life(name).is_none_or(|life| life.alive) {
        return Ok(false);
    }
    for path in ["log", "log.1", "life"].into_iter().filter_map(|ending| file(name, ending)) {
        let is_folder = fs::symlink_metadata(&path).is_ok_and(|it| it.is_dir());
        // Nothing that somebody has put into it is removed.
        let removed = if is_folder { fs::remove_dir(&path) } else { fs::remove_file(&path) };
        if let Err(why) = removed.or_else(|why| if why.kind() == io::ErrorKind::NotFound { Ok(()) } else { Err(why) }) {
            return Err((path, why));
        }
    }
    Ok(true)
}

/// Which start of the machine this is.
fn boot() -> Option<String> {
    fs::read_to_string("/proc/sys/kernel/random/boot_id").ok().map(|id| id.trim().to_owned())
}

/// The directory, made for its owner alone.
fn prepared() -> io::Result<PathBuf> {
    let missing = || io::Error::other("there is no home directory, and XDG_STATE_HOME is not set");
    let directory = directory().ok_or_else(missing)?;
    place::prepare(&directory)?;
    Ok(directory)
}
