//! Coordinators with functions in a deployment that is printed: they stay the texts that they are, with the files that they
//! load and those that stand in for their host.

use super::float;
use super::yaml::quoted;
use crate::lang::trusted::mentions;
use crate::model::program::{Openings, Program};
use crate::model::{Deployment, Ident};
use serde_json::Value as Json;
use std::collections::BTreeMap;

/// What is kept, as texts.
#[derive(Debug, Default)]
pub struct KeptFiles {
    /// The file of each coordinator that is kept.
    pub coordinators: BTreeMap<Ident, String>,
    /// All files, by name.
    pub files: Vec<(String, String)>,
    /// `trusted:`, `host:` and `with:` of the deployment.
    pub keys: String,
}

impl KeptFiles {
    /// What is kept of a deployment.
    pub fn of(deployment: &Deployment) -> Self {
        let mut kept = Self::default();
        let Some(first) = deployment.programs.values().next() else { return kept };
        let one = super::alone(deployment);
        for (name, program) in &deployment.programs {
            let file = match (program.files.is_empty(), one) {
                (true, true) => "coordinator.lua".to_owned(),
                (true, false) => format!("{name}.coordinator.lua"),
                (false, _) => kept.with_its_files(name, program),
            };
            kept.files.push((file.clone(), program.text.to_string()));
            kept.coordinators.insert(*name, file);
        }
        let open: Vec<&str> = Openings::NAMES
            .into_iter()
            .zip([first.open.io, first.open.os])
            .filter_map(|(name, open)| open.then_some(name))
            .collect();
        kept.keys = match &open[..] {
            [] => "trusted: true\n".to_owned(),
            open => format!("trusted: {{ open: [{}] }}\n", open.join(", ")),
        };
        let mut host = Vec::new();
        for (shown, text) in &first.host {
            let own = base(shown);
            let taken = |name: &String| host.contains(name);
            let name = (1..).map(|n| if n == 1 { format!("host/{own}") } else { format!("host/{n}_{own}") });
            let name = name.into_iter().find(|name| !taken(name)).unwrap_or_default();
            kept.files.push((name.clone(), text.to_string()));
            host.push(name);
        }
        if !host.is_empty() {
            let host: Vec<String> = host.iter().map(|name| quoted(name)).collect();
            kept.keys += &format!("host: [{}]\n", host.join(", "));
        }
        let texts = || deployment.programs.values().flat_map(|program| texts(program));
        let with: Vec<_> = first.with.iter().filter(|(name, _)| texts().any(|text| mentions(text, name))).collect();
        if !with.is_empty() {
            kept.keys += "with:\n";
        }
        for (name, value) in with {
            kept.keys += &format!("  {}: {}\n", quoted(name), json(value));
        }
        kept
    }

    /// Files that are loaded keep their names and where they lie from the coordinator, so all of them get a folder of their
    /// own, as deep as a name goes up.
    fn with_its_files(&mut self, name: &Ident, program: &Program) -> String {
        let up = program.files.keys().map(|file| rises(file)).max().unwrap_or(0);
        let folder = format!("{name}{}", "/model".repeat(up));
        for (file, (_, text)) in &program.files {
            // One that is named from the root of the disk stays there.
            if !std::path::Path::new(file).is_absolute() {
                let place = normal(&format!("{folder}/{file}"));
                if !self.files.iter().any(|(known, _)| *known == place) {
                    self.files.push((place, text.to_string()));
                }
            }
        }
        let own = format!("{folder}/{}", base(&program.file));
        // A model may load itself.
        self.files.retain(|(known, _)| *known != own);
        own
    }
}

/// All texts of a program.
pub fn texts(program: &Program) -> impl Iterator<Item = &str> {
    let loaded = program.files.values().map(|(_, text)| &**text);
    std::iter::once(&*program.text).chain(program.host.iter().map(|(_, text)| &**text)).chain(loaded)
}

fn base(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// How many folders a path goes above where it begins.
fn rises(path: &str) -> usize {
    let (mut depth, mut most) = (0_i32, 0);
    for piece in path.split('/') {
        match piece {
            ".." => depth -= 1,
            "" | "." => {}
            _ => depth += 1,
        }
        most = most.max(-depth);
    }
    usize::try_from(most).unwrap_or(0)
}

/// A path without `.` and `..`.
fn normal(path: &str) -> String {
    let mut pieces: Vec<&str> = Vec::new();
    for piece in path.split('/') {
        match piece {
            ".." => _ = pieces.pop(),
            "" | "." => {}
            piece => pieces.push(piece),
        }
    }
    pieces.join("/")
}

fn json(value: &Json) -> String {
    match value {
        Json::Null => "null".to_owned(),
        Json::Bool(v) => v.to_string(),
        Json::Number(v) if v.is_f64() => float(v.as_f64().unwrap_or_default()),
        Json::Number(v) => v.to_string(),
        Json::String(text) => quoted(text),
        Json::Array(list) => format!("[{}]", list.iter().map(json).collect::<Vec<_>>().join(", ")),
        Json::Object(fields) => {
            let fields: Vec<String> =
                fields.iter().map(|(name, value)| format!("{}: {}", quoted(name), json(value))).collect();
            format!("{{ {} }}", fields.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_stay_inside() {
        assert_eq!([rises("a.lua"), rises("x/../a.lua"), rises("../a.lua"), rises("x/../../../a.lua")], [0, 0, 1, 2]);
        assert_eq!(normal("c/model/../shared/./a.lua"), "c/shared/a.lua");
    }
}
