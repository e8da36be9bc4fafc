//! `param("K", 150)`: what is given to a script from outside (`--set K=70`), each of the type of its default.

use super::{SharedHost, error};
use crate::model::Ident;
use crate::model::finding::did_you_mean;
use mlua::{Lua, Value};

/// What was given to a script, and which of it the script has read.
#[derive(Default)]
pub(super) struct ScriptParameters {
    given: Vec<(String, String)>,
    read: Vec<String>,
    /// Those of them that the script's text reads somewhere: they are its own, also where it comes to that behind `deploy`.
    own: Vec<String>,
    /// Somebody else may have read the rest: a deployment that was loaded with it.
    handed_on: bool,
}

impl ScriptParameters {
    pub(super) fn new(given: &[(String, String)], text: &str) -> Self {
        let own = given.iter().map(|(name, _)| name).filter(|name| reads(text, name)).cloned().collect();
        Self { given: given.to_vec(), own, ..Self::default() }
    }

    /// What the script has not read, and a deployment may.
    pub(super) fn for_deployments(&mut self) -> Vec<(String, String)> {
        self.handed_on = true;
        self.given.iter().filter(|(name, _)| !self.read.contains(name) && !self.own.contains(name)).cloned().collect()
    }

    /// What to say of one that nobody reads.
    pub(super) fn unread(&self, name: &str) -> String {
        let help = did_you_mean(name, "parameters of the script", self.read.iter().map(String::as_str));
        format!("nothing reads the parameter `{name}`: {help}")
    }

    /// One that neither the script nor a deployment has read.
    pub(super) fn first_unread(&self) -> Option<String> {
        let may_be = |name: &String| self.handed_on && !self.own.contains(name);
        let unread = self.given.iter().find(|(name, _)| !self.read.contains(name) && !may_be(name));
        unread.map(|(name, _)| self.unread(name))
    }

    /// Of a refused deployment: one of ours that it does not read, and that the script may have been meant by.
    pub(super) fn refused(&self, refused: &crate::app::Refused) -> Option<String> {
        use crate::model::codes::TEXT_UNKNOWN_PARAMETER;
        let unknown = refused
            .findings
            .iter()
            .any(|finding| finding.code == TEXT_UNKNOWN_PARAMETER && finding.severity == crate::model::Severity::Error);
        let ours = self.given.iter().find(|(name, _)| {
            let named = format!("`{}`", name.split('.').next().unwrap_or(name));
            let here = |finding: &crate::model::Finding| {
                finding.code == TEXT_UNKNOWN_PARAMETER && finding.message.contains(&named)
            };
            !self.read.contains(name) && refused.findings.iter().any(here)
        });
        ours.filter(|_| unknown).map(|(name, _)| self.unread(name))
    }
}

/// Whether a script's text has `param("NAME"` in it, however it is spelt.
fn reads(text: &str, name: &str) -> bool {
    text.match_indices("param").any(|(at, word)| {
        let behind = text[at + word.len()..].trim_start();
        let behind = behind.strip_prefix('(').unwrap_or(behind).trim_start();
        let quoted = |quote: char| behind.strip_prefix(quote).and_then(|behind| behind.strip_prefix(name));
        ['"', '\''].into_iter().any(|quote| quoted(quote).is_some_and(|behind| behind.starts_with(quote)))
    })
}

pub(super) fn param(host: &SharedHost, lua: &Lua, name: &str, default: Value) -> mlua::Result<Value> {
    if Ident::new(name).is_err() {
        return Err(error(format!("`param`: `{name}` is no name: it is made of letters, digits and `_`")));
    }
    let given = {
        let parameters = &mut host.borrow_mut().parameters;
        if !parameters.read.iter().any(|read| read == name) {
            parameters.read.push(name.to_owned());
        }
        // The last one counts, as it does for a deployment.
        parameters.given.iter().rev().find(|(given, _)| given == name).map(|(_, text)| text.trim().to_owned())
    };
    let kind = match default {
        Value::Boolean(_) => "true or false",
        Value::Integer(_) | Value::Number(_) => "a number",
        Value::String(_) => "a text",
        _ => return Err(error(format!("`param(\"{name}\", …)` needs a default, which says of which type it is"))),
    };
    let Some(text) = given else { return Ok(default) };
    let value = match default {
        Value::Boolean(_) => text.parse().ok().map(Value::Boolean),
        Value::Integer(_) | Value::Number(_) => {
            let number = text.parse().ok().filter(|number: &f64| number.is_finite());
            text.parse().ok().map(Value::Integer).or(number.map(Value::Number))
        }
        _ => Some(Value::String(lua.create_string(&text)?)),
    };
    let range = if text.contains(':') { "; a range for `davit sweep` has a step: FROM:TO:STEP" } else { "" };
    value.ok_or_else(|| error(format!("`--set {name}={text}`: `{name}` is {kind}, as its default is{range}")))
}
