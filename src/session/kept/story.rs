//! Reading what was kept of what happened.

use super::log_file;
use super::reading::{end_of, opened};
use super::rotating::older;
use crate::limits;
use serde_json::{Value as Json, json};
use std::collections::BTreeMap;
use std::io;
use std::path::Path;

/// The entries of the last life of that name, oldest first, as far as they are kept. Where lines cannot be read (the last one of
/// who was killed, what a disk has lost) stands how many.
///
/// # Errors
/// When the log cannot be read at all.
pub fn entries(name: &str) -> io::Result<Vec<Json>> {
    let path = log_file(name).ok_or(io::ErrorKind::NotFound)?;
    let read = |path: &Path| end_of(&opened(path)?, limits::KEPT_BYTES);
    let mut text = read(&older(&path)).unwrap_or_default();
    text.push(b'\n');
    text.extend(read(&path)?);
    let text = String::from_utf8_lossy(&text);
    // From the last beginning on: what is before belongs to another life.
    let lines: Vec<&str> = text.lines().collect();
    let begins = lines.iter().rposition(|line| line.contains(r#""what":"began""#)).unwrap_or_default();
    Ok(read_lines(&lines[begins..]))
}

fn read_lines(lines: &[&str]) -> Vec<Json> {
    let mut entries: Vec<Json> = Vec::new();
    let mut unreadable = 0;
    for line in lines.iter().filter(|line| !line.is_empty()) {
        let entry = serde_json::from_str(line).ok().filter(|entry: &Json| entry["what"].is_string());
        match entry {
            Some(entry) => {
                entries.extend(missing(&entries, std::mem::take(&mut unreadable)));
                entries.push(entry);
            }
            // What is read from its end on may begin in the middle of a line.
            None if entries.is_empty() => {}
            None => unreadable += 1,
        }
    }
    entries.extend(missing(&entries, unreadable));
    entries
}

/// That lines could not be read, behind these.
fn missing(before: &[Json], lines: usize) -> Option<Json> {
    let at = before.last().and_then(|entry| entry["at"].as_f64()).unwrap_or_default();
    (lines > 0).then(|| json!({ "at": at, "what": "missed", "entries": lines, "unreadable": true }))
}

/// How far it was, as told by its entries.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Story {
    /// When the last of them was, in seconds of the deployment's clock.
    pub at: f64,
    /// Its phase.
    pub phase: Option<String>,
    /// The active states of its coordinators, by name.
    pub states: BTreeMap<String, Vec<String>>,
    /// Requests that were not answered.
    pub outstanding: BTreeMap<u64, String>,
    /// Components that failed and of which nothing better was heard.
    pub faults: BTreeMap<String, String>,
    /// Part of what happened is missing: what is still not answered, or failed, need not be so.
    pub incomplete: bool,
}

impl Story {
    /// Of entries, oldest first.
    pub fn of(entries: &[Json]) -> Self {
        let mut story = Self::default();
        entries.iter().for_each(|entry| story.goes_on(entry));
        story
    }

    /// One more entry.
    pub fn goes_on(&mut self, entry: &Json) {
        let text = |key: &str| entry[key].as_str().unwrap_or_default().to_owned();
        self.at = entry["at"].as_f64().unwrap_or(self.at);
        match entry["what"].as_str().unwrap_or_default() {
            "began" => *self = Self::default(),
            "phase" => self.phase = Some(text("phase")),
            "state" => {
                let active: Vec<String> = serde_json::from_value(entry["active"].clone()).unwrap_or_default();
                let of = active.first().and_then(|root| root.split_once(':')).map_or("", |(name, _)| name);
                self.states.insert(of.to_owned(), active);
            }
            "goes_on" => {
                self.phase = entry["phase"].as_str().map(str::to_owned);
                self.states = serde_json::from_value(entry["states"].clone()).unwrap_or_default();
                self.outstanding = serde_json::from_value(entry["outstanding"].clone()).unwrap_or_default();
                self.faults = serde_json::from_value(entry["faults"].clone()).unwrap_or_default();
                self.incomplete = entry["incomplete"] == true;
            }
            "missed" => self.incomplete = true,
            "requested" => {
                if let Some(number) = entry["request"].as_u64() {
                    self.outstanding.insert(number, format!("{} by {}", text("ask"), text("by")));
                }
            }
            "answered" => {
                self.outstanding.remove(&entry["request"].as_u64().unwrap_or_default());
            }
            "fault" => {
                self.faults.insert(text("component"), text("reason"));
            }
            "returned" => {
                self.faults.remove(&text("component"));
            }
            _ => {}
        }
    }

    /// What stands at the beginning of a new file, so that the older one is not needed to know this.
    pub fn head(&self) -> Json {
        json!({
            "at": self.at, "what": "goes_on", "phase": self.phase, "states": self.states, "outstanding": self.outstanding,
            "faults": self.faults, "incomplete": self.incomplete
        })
    }

    /// All active states, root to leaf.
    pub fn active(&self) -> Vec<String> {
        self.states.values().flatten().cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_file_knows_what_the_older_one_did() {
        let entries = [
            json!({"at": 0.0, "what": "began"}),
            json!({"at": 0.1, "what": "phase", "phase": "up"}),
            json!({"at": 0.2, "what": "state", "active": ["arm:root", "arm:root.on"]}),
            json!({"at": 0.3, "what": "requested", "request": 7, "ask": "fast", "by": "operator"}),
            json!({"at": 0.3, "what": "requested", "request": 8, "ask": "slow", "by": "operator"}),
            json!({"at": 0.4, "what": "fault", "component": "a", "reason": "torn"}),
            json!({"at": 0.5, "what": "answered", "request": 7, "answer": "fast.ok"}),
        ];
        let story = Story::of(&entries);
        assert_eq!((story.at, story.phase.as_deref()), (0.5, Some("up")));
        assert_eq!(story.active(), ["arm:root", "arm:root.on"]);
        assert_eq!(story.outstanding, BTreeMap::from([(8, "slow by operator".to_owned())]));
        assert_eq!(story.faults, BTreeMap::from([("a".to_owned(), "torn".to_owned())]));
        assert_eq!(Story::of(&[story.head()]), story);
        assert_eq!(Story::of(&[story.head(), entries[0].clone()]), Story::default(), "another life");
        let lines = [
            r#"alf a line"#,
            r#"{"at":1.0,"what":"began"}"#,
            "",
            "\0\0\0",
            r#"{"at":2.0,"what":"pha"#,
            r#"{"at":3.0,"what":"phase"}"#,
            r#"{"at":4"#,
        ];
        let read = read_lines(&lines);
        let told: Vec<_> =
            read.iter().map(|entry| (entry["at"].as_f64().unwrap(), entry["entries"].as_u64())).collect();
        assert_eq!(told, [(1.0, None), (1.0, Some(2)), (3.0, None), (3.0, Some(1))]);
        let missed = json!({"at": 0.6, "what": "missed", "entries": 3});
        let with_hole = Story::of(&[&entries[..], std::slice::from_ref(&missed)].concat());
        assert!(with_hole.incomplete && Story::of(&[with_hole.head()]).incomplete);
        assert!(!Story::of(&[missed, story.head()]).incomplete, "what was missed is known from there on");
    }
}
