//! What is known of deployments that do not run any more: how they ended, and of those that died how far they were.

use super::exit::Exit;
use super::output::{Output, Style};
use crate::model::finding::count;
use crate::session::client::ClientError;
use crate::session::kept::{self, Began, Life, Story, entries};
use crate::session::{Ended, Stage};
use crate::time::Wall;
use serde_json::{Value as Json, json};

/// What a command answers about a deployment that died, or of which nobody knows how it ended.
#[derive(Debug)]
pub struct Died {
    life: Life,
    story: Story,
    /// The last that it told, a few entries.
    last: Vec<Json>,
}

/// Entries of a dead deployment's log that `davit status` shows.
const LAST: usize = 3;

impl Died {
    /// Of a life that is [open](Life::is_open).
    pub fn of(life: Life) -> Self {
        let entries = entries(&life.name).unwrap_or_default();
        let last = entries[entries.len().saturating_sub(LAST)..].to_vec();
        Self { story: Story::of(&entries), last, life }
    }

    /// For programs: what it was when it died, and when.
    pub fn json(&self) -> Json {
        let Self { life, story, .. } = self;
        json!({
            "name": life.name,
            "phase": self.word(),
            "pid": life.process.as_ref().map(|process| process.pid),
            "file": life.process.as_ref().map(|process| &process.file),
            "began": life.process.as_ref().map(|process| process.began.to_string()),
            "damaged": life.is_damaged(),
            "seen": life.seen.to_string(),
            "why": life.end.as_ref().and_then(|end| end.why.as_ref()),
            "rebooted": life.rebooted,
            "was": {
                "phase": story.phase,
                "coordinator": story.active(),
                "outstanding": story.outstanding.values().collect::<Vec<_>>(),
                "faults": story.faults,
                "incomplete": story.incomplete,
                "at": story.at,
            },
            "log": kept::log_file(&life.name),
        })
    }

    /// For people.
    pub fn print(&self, out: &Output) {
        let Self { life, story, last } = self;
        self.print_short(out);
        if let Some(Began { pid, began, file, .. }) = &life.process {
            out.line(format!("process      {pid}, since {began}: {}", file.display()));
        }
        out.line(format!("it was       {}", story.phase.as_deref().unwrap_or("(not known)")));
        for active in story.states.values() {
            let leaf = active.last().map_or("(inactive)", String::as_str);
            out.line(format!("coordinator  {}", out.paint(Style::Name, leaf)));
        }
        if !story.outstanding.is_empty() {
            let asked: Vec<&str> = story.outstanding.values().map(String::as_str).collect();
            let perhaps = if story.incomplete { " (or answered: part of its log is missing)" } else { "" };
            out.line(format!("waiting for  {}{perhaps}", asked.join(", ")));
        }
        for (component, reason) in &story.faults {
            out.line(format!("{} {component}: {reason}", out.paint(Style::Bad, "fault")));
        }
        if !last.is_empty() {
            out.line(out.paint(Style::Bold, "the last that it told"));
            last.iter().for_each(|entry| out.text(super::log::line(out, entry, false)));
        }
        let anew = life.process.as_ref().map(|it| format!(", `davit deploy {}` begins anew", it.file.display()));
        out.line(out.paint(
            Style::Dim,
            format!(
                "what its components did since is not known: look at the hardware; `davit log {}` shows all that it told{}",
                life.name,
                anew.unwrap_or_default()
            ),
        ));
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.life.name
    }

    /// When it was seen alive last.
    pub fn seen(&self) -> Wall {
        self.life.seen
    }

    /// In one line.
    pub fn print_short(&self, out: &Output) {
        let name = out.paint(Style::Bold, self.name());
        out.line(format!("{name}  {}  {}", out.paint(Style::Bad, self.word()), self.when()));
    }

    /// What it is called instead of a phase.
    fn word(&self) -> &'static str {
        if self.life.is_damaged() { "damaged" } else { "died" }
    }

    /// When, and what is known of why.
    fn when(&self) -> String {
        let Life { name, seen, rebooted, end, .. } = &self.life;
        let at = format!("at {seen} ({})", seen.ago());
        match end.as_ref().and_then(|end| end.why.as_ref()) {
            _ if self.life.is_damaged() => format!(
                "its record cannot be read: it may have died, or have been shut down; written last {at}; `davit list \
                 --forget {name}` throws it away"
            ),
            Some(why) => format!("{why}; {at}"),
            None if *rebooted => format!("the machine went down; seen alive last {at}"),
            None => format!("killed, or crashed; seen alive last {at}"),
        }
    }

    /// For a sentence about another one.
    pub fn sentence(&self) -> String {
        ended(&self.life)
    }
}

/// The life that is meant where no deployment could be asked: that of the name, or the last one that there was. None: nothing
/// is kept, or the reason is another one.
pub fn meant(error: &ClientError) -> Option<Life> {
    let life = match error {
        ClientError::None => kept::lives().into_iter().max_by(|a, b| a.seen.0.total_cmp(&b.seen.0)),
        ClientError::Unknown { name, .. } => kept::life(name),
        _ => None,
    };
    life.filter(|life| !life.alive)
}

/// Tells that a deployment died with which a command went along until now, or that this is not known; false: it ended otherwise.
pub fn told_died(out: &Output, name: &str, json: bool) -> bool {
    let Some(died) = kept::life_after(name).filter(Life::is_open).map(Died::of) else { return false };
    match json {
        true => out.json_line(&died.json()),
        false => died.print_short(out),
    }
    true
}

/// Those that died and were not deployed since, and those of which that is not known.
pub fn died() -> Vec<Died> {
    kept::lives().into_iter().filter(Life::is_open).map(Died::of).collect()
}

/// What is known of how a deployment ended that does not run, for a sentence behind `no deployment is running`.
pub fn ended(life: &Life) -> String {
    let tells = |what: &str| format!("{what}: `davit status {}` tells of it", life.name);
    if life.is_damaged() {
        return tells(&format!("the record of `{}` is damaged", life.name));
    }
    let Some(end) = life.end.as_ref().filter(|_| !life.died()) else { return tells(&format!("`{}` died", life.name)) };
    let how = end.why.clone().or_else(|| end.ended.as_ref().map(how)).unwrap_or_default();
    format!("`{}` ended at {} ({}): {how}; `davit log {0}` shows its log", life.name, end.at, end.at.ago())
}

fn how(ended: &Ended) -> String {
    match ended.stage {
        _ if !ended.is_clean() => format!("{} left", count(ended.left.len(), "thing")),
        Stage::Led => "down".to_owned(),
        stage => format!("down {}", stage.words()),
    }
}

/// How `davit status` ends where a deployment died, or may have: nobody knows that it was shut down.
pub const EXIT: Exit = Exit::Forced;
