//! Whether findings speak the language of the file that they are about.

use serde_json::Value;

/// What is made in Lua, and nowhere else.
const MADE: &[&str] = &[
    "create",
    "destroy",
    "connect",
    "disconnect",
    "property_set",
    "port_write",
    "operation_call",
    "replace",
    "state",
    "trans",
    "transition",
    "conn",
    "Configuration",
    "ConfiguratorConf",
    "monitor",
    "Monitors",
    "above",
    "below",
    "in_state",
    "once",
    "age",
];

/// A construct of Lua in a text about a file of YAML.
fn lua_in(text: &str) -> Option<String> {
    for word in MADE {
        for (at, _) in text.match_indices(word) {
            let (before, behind) = (&text[..at], &text[at + word.len()..]);
            let whole = !before.ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '.');
            if whole && (behind.starts_with(['(', '{']) || behind.starts_with(" {")) {
                return Some(format!("{word}{}", behind.chars().take(12).collect::<String>()));
            }
        }
    }
    let quoted = text.split('`').skip(1).step_by(2);
    // A step as plans print it has one, too.
    let step = |part: &&str| part.split_once(' ').is_some_and(|(word, _)| MADE.contains(&word));
    quoted.filter(|part| part.contains(" = ") && !step(part)).map(str::to_owned).next()
}

/// A construct of YAML in a text about a file of Lua, unless it is about the deployment, which is YAML.
fn yaml_in(text: &str) -> Option<String> {
    let quoted = text.split('`').skip(1).step_by(2).filter(|_| !text.contains("deployment"));
    let key = |part: &&str| {
        let (word, behind) = part.trim_start_matches(['-', '{', ' ']).split_once(':').unwrap_or(("", ""));
        let name = !word.is_empty() && word.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        name && behind.starts_with(' ')
    };
    quoted.filter(key).map(str::to_owned).next()
}

/// What findings (as JSON) say in the other language.
pub fn strange(findings: &Value) -> Vec<String> {
    let mut strange = Vec::new();
    for finding in findings.as_array().into_iter().flatten() {
        let file = finding["file"].as_str().unwrap_or_default();
        let labels = finding["labels"].as_array().into_iter().flatten();
        let own = [&finding["message"], &finding["help"]].map(|text| (file, text));
        let texts =
            own.into_iter().chain(labels.map(|label| (label["file"].as_str().unwrap_or_default(), &label["text"])));
        for (file, text) in texts {
            let text = text.as_str().unwrap_or_default();
            let found = match file.rsplit_once('.') {
                Some((_, "yaml")) => lua_in(text),
                Some((_, "lua")) => yaml_in(text),
                _ => None,
            };
            strange.extend(found.map(|found| format!("{} at {file}: {found}: {text}", finding["code"])));
        }
    }
    strange
}
