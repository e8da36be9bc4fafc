//! What a running deployment shows of itself, as it is seen in one of its subsystems.

use super::inside::{Region, is_within};
use super::status::text;
use serde_json::{Map, Value as Json, json};

impl Region {
    /// A status: of the subsystem what belongs to it, and under `held_by` the frames of others that touch it.
    pub fn status(&self, status: &Json) -> Json {
        let mut seen = status.clone();
        let list = |key: &str| status[key].as_array().map(Vec::as_slice).unwrap_or_default();
        let own = list("subsystems").iter().find(|one| text(&one["name"]) == self.path());
        seen["in"] = json!(self.path());
        seen["standing"] = own.map_or(Json::Null, |own| own["standing"].clone());
        let first = own.and_then(|own| own["coordinators"][0].as_str()).unwrap_or_default();
        seen["coordinator"] = status["coordinators"][first].clone();
        for key in ["coordinators", "slow"] {
            seen[key] = self.by_name(&status[key], |value| value.clone());
        }
        let deeper = list("subsystems").iter().filter(|one| one["name"] != self.path() && self.has(text(&one["name"])));
        seen["subsystems"] = deeper.map(|one| self.subsystem(one)).collect();
        if !status["system"].is_null() {
            seen["system"] = self.system(&status["system"]);
        }
        if status["stack"].is_array() {
            let (own, others): (Vec<&Json>, Vec<&Json>) =
                list("stack").iter().partition(|frame| self.has(text(&frame["subsystem"])));
            seen["stack"] = own.into_iter().map(|frame| self.frame(frame)).collect();
            seen["held_by"] =
                others.into_iter().filter(|frame| self.is_touched(frame)).map(|frame| self.frame(frame)).collect();
        }
        if status["residual"].is_array() {
            seen["residual"] = self.differences(list("residual"));
        }
        let faults = list("faults").iter().filter(|fault| self.has(text(&fault["component"])));
        seen["faults"] = faults.map(|fault| self.with_names(fault, &["component"])).collect();
        let waiting = list("outstanding").iter().filter_map(|asked| {
            let (ask, by) = text(asked).rsplit_once(" by ")?;
            (self.has(ask) || self.has(by)).then(|| json!(format!("{} by {}", self.name(ask), self.name(by))))
        });
        seen["outstanding"] = waiting.collect();
        seen
    }

    /// A look, as `davit watch` asks for it.
    pub fn look(&self, look: &Json) -> Json {
        let list = |key: &str| look[key].as_array().into_iter().flatten();
        let status = self.status(&look["status"]);
        let monitors = list("monitors").filter(|monitor| self.has(text(&monitor["component"])));
        // Those of a parent that update something of it, too.
        let used = |name: &str| {
            let components = status["system"]["components"].as_object().into_iter().flatten();
            components.into_iter().any(|(_, component)| component["activity"] == self.name(name))
        };
        let activities = list("activities").filter(|it| self.has(text(&it["name"])) || used(text(&it["name"])));
        json!({
            "monitors": monitors.map(|it| self.with_names(it, &["component"])).collect::<Vec<_>>(),
            "activities": activities.map(|it| self.with_names(it, &["name"])).collect::<Vec<_>>(),
            "status": status,
        })
    }

    /// Differences that are about something of it.
    pub fn differences(&self, all: &[Json]) -> Json {
        let ends = ["target", "from", "to"];
        let own = all.iter().filter(|one| ends.iter().any(|end| self.has(text(&one[*end]))));
        own.map(|one| {
            let mut there = self.with_names(one, &ends);
            let said = text(&one["text"]);
            there["text"] = json!(match (one["do"].is_string(), said.split_once(' ')) {
                (false, Some((name, rest))) => format!("{} {rest}", self.name(name)),
                _ => self.step(said),
            });
            there
        })
        .collect()
    }

    /// A frame.
    pub fn frame(&self, frame: &Json) -> Json {
        let mut there = self.with_names(frame, &["configuration", "by"]);
        let subsystem = there.as_object_mut().and_then(|fields| fields.remove("subsystem"));
        // Of the subsystem itself it is its own.
        if let Some(of) = subsystem.filter(|of| of != self.path()) {
            there["subsystem"] = json!(self.name(text(&of)));
        }
        if let Some(touches) = there.get_mut("touches").and_then(Json::as_array_mut) {
            touches.retain(|of| of != self.path());
            touches.iter_mut().for_each(|of| *of = json!(self.name(text(of))));
        }
        there
    }

    /// A frame of the stack; none: it neither belongs to it nor touches anything of it. What touches it and is not its own *holds* it.
    pub fn in_stack(&self, frame: &Json) -> Option<Json> {
        let own = self.has(text(&frame["subsystem"]));
        let mut there = (own || self.is_touched(frame)).then(|| self.frame(frame))?;
        if !own {
            there["holds"] = json!(true);
        }
        Some(there)
    }

    fn is_touched(&self, frame: &Json) -> bool {
        frame["touches"].as_array().is_some_and(|all| all.iter().any(|of| self.has(text(of))))
    }

    /// An entry of the log; none: it does not belong to it. What is of the whole deployment does.
    pub fn entry(&self, entry: &Json) -> Option<Json> {
        let has = |key: &str| self.has(text(&entry[key]));
        let steps = || entry["steps"].as_array().into_iter().flatten();
        let is_in_steps = || steps().any(|step| self.is_in_step(text(&step["step"])));
        let own = match text(&entry["what"]) {
            "event" | "emitted" | "stale" | "lost" => has("event") || has("from"),
            "state" => self.has(text(&entry["active"][0])),
            "requested" => has("ask") || has("by"),
            "answered" => has("ask") || has("by") || is_in_steps(),
            "recovered" => is_in_steps(),
            "fault" | "injected" | "returned" => has("component"),
            "slow" => has("coordinator"),
            // Nobody knows of which it is.
            "printed" | "said" => false,
            _ => true,
        };
        if !own {
            return None;
        }
        let mut there = self.with_names(entry, &["event", "from", "ask", "by", "answer", "component", "coordinator"]);
        for state in list_mut(&mut there, "active") {
            *state = json!(self.name(text(state)));
        }
        for step in list_mut(&mut there, "steps") {
            step["step"] = json!(self.step(text(&step["step"])));
        }
        Some(there)
    }

    /// A system: its components, the connections that have an end there, and its written ports.
    pub fn system(&self, system: &Json) -> Json {
        let component = |it: &Json| {
            let scoped = it["type"].as_str().is_some_and(|ty| ty.contains('/'));
            self.with_names(it, if scoped { &["activity", "type"] } else { &["activity"] })
        };
        let inside = |end: &Json| self.has(text(end));
        let connections = system["connections"].as_array().into_iter().flatten();
        let connections = connections.filter(|it| inside(&it["from"]) || inside(&it["to"]));
        json!({
            "components": self.by_name(&system["components"], component),
            "connections": connections.map(|it| self.with_names(it, &["from", "to"])).collect::<Vec<_>>(),
            "ports": self.by_name(&system["ports"], Json::clone),
        })
    }

    fn subsystem(&self, one: &Json) -> Json {
        let mut there = self.with_names(one, &["name"]);
        for name in list_mut(&mut there, "coordinators") {
            *name = json!(self.name(text(name)));
        }
        there
    }

    /// What of a table by names belongs to it.
    fn by_name(&self, table: &Json, value: impl Fn(&Json) -> Json) -> Json {
        let own = table.as_object().into_iter().flatten().filter(|(name, _)| self.has(name));
        Json::Object(own.map(|(name, it)| (self.name(name), value(it))).collect::<Map<_, _>>())
    }

    /// The same with names in these fields, as they are called there.
    pub fn with_names(&self, of: &Json, fields: &[&str]) -> Json {
        let mut there = of.clone();
        for field in fields {
            if let Some(name) = of[*field].as_str() {
                there[*field] = json!(self.name(name));
            }
        }
        there
    }
}

/// What stands in a list of an object, to be changed.
pub fn list_mut<'a>(of: &'a mut Json, field: &str) -> impl Iterator<Item = &'a mut Json> {
    of.get_mut(field).and_then(Json::as_array_mut).into_iter().flatten()
}

/// The paths of subsystems that entries of a log name: of one that does not run any more nobody else tells them.
pub fn paths_named(entries: &[Json]) -> Vec<String> {
    let names = |entry: &Json| {
        let fields = ["from", "by", "ask", "component"].map(|key| text(&entry[key]).to_owned());
        let state = text(&entry["active"][0]).split(':').next().unwrap_or_default().to_owned();
        // A coordinator may be called like its subsystem, or be one of several of it: only what is in it says.
        let event = text(&entry["event"]).to_owned();
        fields.into_iter().chain([state, event])
    };
    let mut paths: Vec<String> = Vec::new();
    for name in entries.iter().flat_map(names) {
        let at = name.match_indices('/').map(|(at, _)| name[..at].to_owned());
        paths.extend(at);
    }
    paths.sort();
    paths.dedup();
    paths.retain(|path| crate::model::ComponentName::new(path).is_ok());
    paths
}

/// The innermost of these paths that a name is in; the empty one: none.
pub fn innermost<'a>(paths: impl IntoIterator<Item = &'a str>, name: &str) -> &'a str {
    paths.into_iter().filter(|path| is_within(name, path)).max_by_key(|path| path.len()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::inside::region;

    #[test]
    fn what_is_wrong_in_a_subsystem_is_seen_there_by_its_own_names() {
        let duo = region("duo");
        let status = json!({
            "subsystems": [], "stack": [], "system": null,
            "outstanding": ["duo/kin/go by duo/kin", "undo by duo", "join by cell"],
            "residual": [
                { "do": "connect", "target": "duo/A.u", "from": "Net.y", "to": "duo/A.u", "text": "connect Net.y -> duo/A.u (data)" },
                { "how": "faulted", "target": "duo/A", "text": "duo/A is faulted" },
                { "how": "faulted", "target": "Net", "text": "Net is faulted" },
            ],
            "faults": [{ "component": "duo/A", "reason": "`duo/A` is hot" }, { "component": "Net", "reason": "gone" }],
        });
        let seen = duo.status(&status);
        assert_eq!(seen["outstanding"], json!(["kin/go by kin", "undo by duo"]));
        let said: Vec<&str> = seen["residual"].as_array().unwrap().iter().map(|one| text(&one["text"])).collect();
        assert_eq!(said, ["connect /Net.y -> A.u (data)", "A is faulted"]);
        assert_eq!(seen["residual"][0]["from"], "/Net.y");
        assert_eq!(seen["faults"], json!([{ "component": "A", "reason": "`duo/A` is hot" }]));
        assert_eq!((&seen["system"], &seen["standing"]), (&Json::Null, &Json::Null));
    }

    #[test]
    fn activities_of_a_parent_are_shown_where_they_update_something() {
        let duo = region("duo");
        let component =
            |activity: &str| json!({ "activity": activity, "type": "duo/davit.Monitors", "state": "running" });
        let look = json!({
            "status": { "system": { "components": { "duo/A": component("control"), "duo/B": component("duo/own"), "C": component("net") } } },
            "monitors": [{ "name": "high", "component": "duo/A" }, { "name": "low", "component": "C" }],
            "activities": [{ "name": "control" }, { "name": "duo/own" }, { "name": "net" }],
        });
        let seen = duo.look(&look);
        assert_eq!(seen["activities"], json!([{ "name": "/control" }, { "name": "own" }]));
        assert_eq!(seen["monitors"], json!([{ "name": "high", "component": "A" }]));
        assert_eq!(seen["status"]["system"]["components"]["A"]["type"], "davit.Monitors");
    }
}
