//! `param("K", 150)`: what is given to a script from outside (`--set K=70`), each of the type of its default.

use super::{SharedHost, error};
use crate::model::Ident;
use crate::model::finding::{did_you_mean, nearest};
use mlua::{Lua, Value};

/// What was given to a script, and which of it the script has read.
#[derive(Default)]
pub(super) struct ScriptParameters {
    given: Vec<(String, String)>,
    read: Vec<String>,
    /// Those that the script's text reads somewhere: they are its own, also where it comes to that behind `deploy`.
    own: Vec<String>,
    /// Somebody else may have read the rest: a deployment that was loaded with it.
    handed_on: bool,
}

impl ScriptParameters {
    pub(super) fn new(given: &[(String, String)], text: &str) -> Self {
        Self { given: given.to_vec(), own: own(text), ..Self::default() }
    }

    /// What the script has not read, and a deployment may.
    pub(super) fn for_deployments(&mut self) -> Vec<(String, String)> {
        self.handed_on = true;
        self.given.iter().filter(|(name, _)| !self.read.contains(name) && !self.own.contains(name)).cloned().collect()
    }

    /// What to say of one that nobody reads.
    pub(super) fn unread(&self, name: &str) -> String {
        let read = self.read.iter().filter(|read| !self.own.contains(read));
        let help = did_you_mean(name, "parameters of the script", self.own.iter().chain(read).map(String::as_str));
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
        let ours = self.given.iter().filter(|(name, _)| !self.read.contains(name)).find_map(|(name, _)| {
            let named = format!("`{}`", name.split('.').next().unwrap_or(name));
            let here = |finding: &&crate::model::Finding| {
                finding.code == TEXT_UNKNOWN_PARAMETER && finding.message.contains(&named)
            };
            Some((name, refused.findings.iter().find(here)?))
        });
        let (name, told) = ours.filter(|_| unknown)?;
        // Of the script's and those of the deployment a near one is meant.
        let is_near = |help: &str| help.starts_with("did you mean");
        let theirs =
            told.help.as_deref().is_some_and(is_near) && nearest(name, self.own.iter().map(String::as_str)).is_none();
        Some(if theirs { told.in_a_line() } else { self.unread(name) })
    }
}

/// The names in each `param("NAME"` of a script's text, however that is spelt.
fn own(text: &str) -> Vec<String> {
    let named = text.match_indices("param").filter_map(|(at, word)| {
        let behind = text[at + word.len()..].trim_start();
        let behind = behind.strip_prefix('(').unwrap_or(behind).trim_start();
        let quote = behind.chars().next().filter(|c| ['"', '\''].contains(c))?;
        behind[1..].split_once(quote).map(|(name, _)| name.to_owned())
    });
    let mut names: Vec<String> = named.filter(|name| Ident::new(name).is_ok()).collect();
    names.sort_unstable();
    names.dedup();
    names
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
