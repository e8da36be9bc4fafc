//! The end of the log's tap that writes to disk, and the process's own words about its life.

use super::reading::{AS_IT_IS, a_file};
use super::rotating::Rotating;
use super::story::Story;
use super::{Began, LifeEnd, boot, file, log_file, prepared};
use crate::limits;
use crate::session::log::LogEntry;
use crate::session::tap::{LogSink, News, Tap};
use crate::session::{Ended, NotUp};
use crate::time::{Clock, Wall, lock};
use serde_json::{Value as Json, json};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, PoisonError};

/// Keeps a deployment's log and its life, as long as it is there.
pub struct Keeper {
    last: Last,
    tap: Tap<KeptState>,
    beat: Arc<KeptBeat>,
}

/// What a life says last: once, whoever says it first.
#[derive(Clone)]
struct Last {
    life: Arc<File>,
    said: Arc<Mutex<bool>>,
}

impl Last {
    fn say(&self, end: &LifeEnd) {
        let mut said = lock(&self.said);
        if !std::mem::replace(&mut said, true) {
            let _ = say(&self.life, &serde_json::to_string(end).expect("plain data"));
        }
    }
}

/// Says, in a process that ends at once, that it does.
pub type Leave = Box<dyn FnOnce() + Send>;

/// What is written.
enum KeptState {
    Entry(Arc<LogEntry>),
    /// A line of the keeper's own.
    Own(Json),
}

impl From<Arc<LogEntry>> for KeptState {
    fn from(entry: Arc<LogEntry>) -> Self {
        Self::Entry(entry)
    }
}

/// What ends the thread that says that the process lives.
#[derive(Default)]
struct KeptBeat {
    over: Mutex<bool>,
    ended: Condvar,
}

impl Keeper {
    /// Begins to keep what happens to the deployment `name`, of that file, on that clock.
    ///
    /// # Errors
    /// When the directory cannot be written, or another process keeps a deployment of that name.
    pub fn open(name: &str, of: &Path, clock: &Clock) -> io::Result<Self> {
        prepared()?;
        let missing = || io::Error::from(io::ErrorKind::NotFound);
        let path = file(name, "life").ok_or_else(missing)?;
        let life = Arc::new(locked(&path)?);
        // What stands there of an earlier life stays until this one is written; then nothing stays of one that is not kept.
        let mut none_before = life.metadata()?.len() == 0;
        Self::keep(name, of, clock, life, &mut none_before).inspect_err(|_| {
            if none_before {
                let _ = std::fs::remove_file(&path);
            }
        })
    }

    /// The same, with the record locked. `gone`: nothing stands in that of a life before.
    fn keep(name: &str, of: &Path, clock: &Clock, life: Arc<File>, gone: &mut bool) -> io::Result<Self> {
        let missing = || io::Error::from(io::ErrorKind::NotFound);
        let of = std::path::absolute(of).unwrap_or_else(|_| of.to_owned());
        let own = Some(name.to_owned());
        let began = Began { name: own, pid: std::process::id(), began: Wall::now(), file: of, boot: boot() };
        let log = Rotating::open(log_file(name).ok_or_else(missing)?, limits::KEPT_BYTES)?;
        *gone = true;
        life.set_len(0)?;
        say(&life, &serde_json::to_string(&began).expect("plain data"))?;
        let begins = json!({ "at": 0.0, "what": "began", "when": began.began.to_string(), "pid": began.pid });
        let mut writer = KeptWriter { log, story: Story::default(), missing: 0, begins: Some(begins) };
        writer.begin();
        let tap = Tap::new("davit-keeps", limits::TAP, clock, move |news| writer.keep(news))?;
        let beat = Arc::new(KeptBeat::default());
        let lives = (life.clone(), beat.clone());
        std::thread::Builder::new().name("davit-lives".to_owned()).spawn(move || live(&lives.0, &lives.1))?;
        Ok(Self { last: Last { life, said: Arc::default() }, tap, beat })
    }

    /// What to give to the session.
    pub fn observer(&self) -> Arc<dyn LogSink> {
        Arc::new(self.tap.clone())
    }

    /// It was stopped, so.
    pub fn ended(&self, ended: &Ended) {
        self.end(&LifeEnd { at: Wall::now(), why: None, ended: Some(ended.clone()) });
    }

    /// It did not come up.
    pub fn not_up(&self, not_up: &NotUp) {
        self.end(&LifeEnd { at: Wall::now(), why: Some(not_up.why.clone()), ended: Some(not_up.ended.clone()) });
    }

    /// It ended before anything was asked for.
    pub fn not_begun(&self, why: &str) {
        self.end(&LifeEnd { at: Wall::now(), why: Some(why.to_owned()), ended: Some(Ended::unbegun()) });
    }

    /// For a process that ends at once.
    pub fn leave(&self) -> Leave {
        let last = self.last.clone();
        Box::new(move || {
            let why = "it was ended at once, by a third signal: the components were asked nothing more".to_owned();
            last.say(&LifeEnd { at: Wall::now(), why: Some(why), ended: None });
        })
    }

    fn end(&self, end: &LifeEnd) {
        let mut own = serde_json::to_value(end).expect("plain data");
        own["what"] = json!("ended");
        own["when"] = json!(end.at.to_string());
        self.tap.put_own(KeptState::Own(own));
        self.tap.finish(limits::TAP_END);
        // Last: what says that it ended has all that happened before it.
        self.last.say(end);
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        self.tap.finish(limits::TAP_END);
        *lock(&self.beat.over) = true;
        self.beat.ended.notify_all();
    }
}

/// Opens and locks the file of a life.
fn locked(path: &Path) -> io::Result<File> {
    let file = OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .mode(0o600)
        .custom_flags(AS_IT_IS)
        .open(path)
        .and_then(a_file)?;
    let clock = Clock::real();
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(file),
            Err(TryLockError::Error(error)) => return Err(error),
            Err(TryLockError::WouldBlock) if clock.now().as_secs_f64() < limits::KEPT_LOCK.as_secs_f64() => {
                clock.sleep(limits::SOCKET_STEP);
            }
            Err(TryLockError::WouldBlock) => {
                return Err(io::Error::other("another process of yours runs a deployment of that name"));
            }
        }
    }
}

fn say(mut life: &File, line: &str) -> io::Result<()> {
    life.write_all(format!("{line}\n").as_bytes())
}

/// Says that the process lives, until it is over.
fn live(life: &File, beat: &KeptBeat) {
    let mut over = lock(&beat.over);
    while !*over {
        let _ = life.set_modified(Wall::now().into());
        over = beat.ended.wait_timeout(over, limits::KEPT_BEAT).unwrap_or_else(PoisonError::into_inner).0;
    }
}

struct KeptWriter {
    log: Rotating,
    story: Story,
    /// Entries that could not be written since the last that could.
    missing: u64,
    /// Where this life begins in the log, until that is written: before anything else.
    begins: Option<Json>,
}

impl KeptWriter {
    fn keep(&mut self, news: News<KeptState>) {
        match news {
            News::Missed(entries) => {
                self.missing += entries;
                self.story.incomplete = true;
            }
            News::One(KeptState::Own(mut own)) => {
                own["at"] = json!(self.story.at);
                self.write(&own);
            }
            News::One(KeptState::Entry(entry)) => {
                self.write(&serde_json::to_value(&*entry).expect("entries are plain data"))
            }
        }
    }

    fn begin(&mut self) {
        if let Some(begins) = self.begins.take()
            && self.put(&begins).is_err()
        {
            self.begins = Some(begins);
        }
    }

    fn write(&mut self, entry: &Json) {
        self.begin();
        if self.begins.is_some() {
            self.missing += 1;
            return self.story.goes_on(entry);
        }
        // A full disk: what could not be written is counted, and told where it goes on once there is room.
        if self.missing > 0 {
            let missed = json!({ "at": self.story.at, "what": "missed", "entries": self.missing });
            // What could not be written is known here all the same.
            if self.put(&missed).is_ok() && self.put(&self.story.head()).is_ok() {
                self.missing = 0;
            }
        }
        if self.missing > 0 || self.put(entry).is_err() {
            self.missing += 1;
        }
        self.story.goes_on(entry);
    }

    fn put(&mut self, line: &Json) -> io::Result<()> {
        self.log.line(&line.to_string(), || self.story.head().to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_behind_the_end_adds_nothing_to_it() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        let last = Last { life: Arc::new(file.reopen().unwrap()), said: Arc::default() };
        let end = |why: &str| LifeEnd { at: Wall::now(), why: Some(why.to_owned()), ended: None };
        last.say(&end("it did not come up"));
        last.clone().say(&end("a third signal"));
        let mut text = String::new();
        io::Read::read_to_string(file.as_file_mut(), &mut text).unwrap();
        assert!(text.lines().count() == 1 && text.contains("come up"), "{text}");
    }
}
