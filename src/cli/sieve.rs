//! What of a log is shown where a command looks into a subsystem, or folds them.

use super::CommandFailure;
use super::inside::{Hierarchy, Region};
use super::inside_view::{innermost, paths_named};
use super::status::text;
use crate::model::names::level;
use serde_json::Value as Json;

/// Lets entries of a log through.
#[derive(Debug, Default)]
pub struct Sieve {
    region: Option<Region>,
    depth: Option<usize>,
    /// The paths of subsystems, as they are called in the region.
    paths: Vec<String>,
}

impl Sieve {
    /// For a log of a deployment of that status; of one that does not run its entries say which subsystems there are.
    ///
    /// # Errors
    /// It has no subsystem of the path that is asked for.
    pub fn new(hierarchy: &Hierarchy, status: Option<&Json>, entries: &[Json]) -> Result<Self, CommandFailure> {
        let paths: Vec<String> = match status {
            Some(status) => {
                let all = status["subsystems"].as_array().into_iter().flatten();
                all.map(|one| text(&one["name"]).to_owned()).collect()
            }
            None => paths_named(entries),
        };
        let region = hierarchy.inside.among(paths.iter().map(String::as_str))?;
        let paths = match &region {
            Some(region) => {
                let deeper = paths.iter().filter(|path| region.path() != *path && region.has(path));
                deeper.map(|path| region.name(path)).collect()
            }
            None => paths,
        };
        Ok(Self { region, depth: hierarchy.depth, paths })
    }

    /// An entry as it is shown; none: it is not.
    pub fn pass(&self, entry: &Json) -> Option<Json> {
        let entry = match &self.region {
            Some(region) => region.entry(entry)?,
            None => entry.clone(),
        };
        let folded = self.depth.is_some_and(|depth| self.is_folded(&entry, depth));
        (!folded).then_some(entry)
    }

    /// The newest `last` of those that pass.
    pub fn newest(&self, entries: &[Json], last: Option<usize>) -> Vec<Json> {
        let mut passed: Vec<Json> = entries.iter().filter_map(|entry| self.pass(entry)).collect();
        passed.drain(..passed.len().saturating_sub(last.unwrap_or(usize::MAX)));
        passed
    }

    /// Whether it is something that only the inside of a subsystem has to do with which is deeper than that. What goes wrong is never
    /// folded, nor what a subsystem and its parent tell each other where the parent is unfolded.
    fn is_folded(&self, entry: &Json, depth: usize) -> bool {
        let of = |name: &str| innermost(self.paths.iter().map(String::as_str), name);
        let path = match text(&entry["what"]) {
            "event" | "emitted" | "stale" => {
                let path = of(text(&entry["event"]));
                let told = entry["what"] == "emitted" || entry["from"] == path;
                if told && level(path) == depth + 1 {
                    return false;
                }
                path
            }
            "state" => of(text(&entry["active"][0])),
            "requested" | "answered" => {
                let ask = of(text(&entry["ask"]));
                if ask.is_empty() && text(&entry["ask"]).starts_with("undo") { of(text(&entry["by"])) } else { ask }
            }
            _ => "",
        };
        // What failed is as much the parent's business.
        level(path) > depth && !(entry["what"] == "answered" && entry["ok"] == false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_goes_wrong_inside_is_told_folded_and_what_is_only_done_there_is_not() {
        let sieve = Sieve { region: None, depth: Some(0), paths: ["duo", "duo/kin"].map(str::to_owned).to_vec() };
        let told = |entry: Json| sieve.pass(&entry).is_some();
        let asked = |what: &str, ask: &str, ok: bool| json!({ "what": what, "ask": ask, "by": "duo/kin", "ok": ok });
        for kept in [
            json!({ "what": "fault", "component": "duo/kin/Drive" }),
            json!({ "what": "lost", "event": "duo/kin/hold.lost" }),
            asked("answered", "duo/kin/make", false),
            asked("answered", "undo", false),
            asked("answered", "own", true),
            json!({ "what": "event", "event": "duo/up", "from": "duo" }),
            json!({ "what": "emitted", "event": "duo/e_start" }),
            json!({ "what": "state", "active": ["cell:root"] }),
            json!({ "what": "phase", "phase": "up" }),
        ] {
            assert!(told(kept.clone()), "{kept}");
        }
        for folded in [
            asked("requested", "duo/make", true),
            asked("answered", "duo/kin/make", true),
            asked("requested", "undo", true),
            json!({ "what": "event", "event": "duo/kin/up", "from": "duo/kin" }),
            json!({ "what": "event", "event": "duo/e_hot", "from": "duo/Drive" }),
            json!({ "what": "emitted", "event": "duo/kin/e_start" }),
            json!({ "what": "state", "active": ["duo/kin:root"] }),
        ] {
            assert!(!told(folded.clone()), "{folded}");
        }
    }
}
