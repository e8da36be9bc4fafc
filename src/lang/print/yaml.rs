//! Printing in YAML.

use super::monitor::CommonConditions;
use super::wrap::wrap;
use super::{change, fields, float, seconds};
use crate::diagnostics::Language;
use crate::lang::bound::{self, BoundTable, Pen, WrittenKey};
use crate::model::monitor::Condition;
use crate::model::statechart::{ChartNode, State};
use crate::model::{
    ComponentType, Configuration, Coordinator, CoordinatorNaming, Deployment, Ident, Interface, MemberClass,
    Statechart, Value,
};
use std::collections::BTreeMap;
use std::fmt::{Display, Write as _};

/// A text: plain where every reader takes it for a text, else in quotes.
pub fn text(t: &str) -> String {
    let mut bytes = t.bytes();
    let plain = bytes.next().is_some_and(|b| b.is_ascii_alphabetic() || b == b'_')
        && bytes.all(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'.' | b'/'));
    // Words that YAML 1.2, or other readers, take for something else.
    const WORDS: &[&str] = &["true", "false", "null", "yes", "no", "on", "off", "y", "n", "nan", "inf"];
    if plain && !WORDS.contains(&t.to_ascii_lowercase().as_str()) { t.to_owned() } else { quoted(t) }
}

pub fn quoted(t: &str) -> String {
    let mut out = String::with_capacity(t.len() + 2);
    out.push('"');
    for c in t.chars() {
        let code = c as u32;
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            '\r' => out.push_str("\\r"),
            c if c.is_control() => _ = write!(out, "\\x{code:02x}"),
            // Line separators, directions, and what YAML does not let stand as it is.
            '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}' | '\u{fffe}' | '\u{ffff}' => {
                _ = write!(out, "\\u{code:04x}");
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// What has a name, as a text.
pub fn t(name: &dyn Display) -> String {
    text(&name.to_string())
}

/// A value.
pub fn value(v: &Value) -> String {
    match v {
        Value::Bool(v) => v.to_string(),
        Value::Int(v) => v.to_string(),
        Value::Float(v) => float(*v),
        Value::Str(v) => text(v),
        Value::Array(list) => format!("[{}]", list.iter().map(value).collect::<Vec<_>>().join(", ")),
        Value::Record(fields) => value_map(fields.iter().map(|(name, v)| (name, value(v)))),
    }
}

/// Named things that are printed already.
pub fn value_map<'n>(fields: impl Iterator<Item = (&'n Ident, String)>) -> String {
    let fields: Vec<_> = fields.map(|(name, value)| format!("{}: {value}", t(name))).collect();
    format!("{{ {} }}", fields.join(", "))
}

/// A list of what is printed already.
pub fn list(texts: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", texts.into_iter().collect::<Vec<_>>().join(", "))
}

/// `configurations: …`
pub fn configurations_yaml(configurations: &[Configuration]) -> String {
    if configurations.is_empty() {
        return "configurations: {}\n".to_owned();
    }
    let mut out = String::from("configurations:\n");
    let mut shared = CommonConditions::of(configurations.iter().filter_map(|c| c.holds.as_ref()), Language::Yaml);
    for c in configurations {
        let mut body = String::new();
        let mut holds = |of: &Condition| wrap(&shared.print(of, Language::Yaml), 11, 6);
        let keys = bound::CONFIGURATION.written(c, &mut Pen { language: Language::Yaml, condition: &mut holds });
        let (before, behind) = fields::around(&keys, "post_conf_state");
        fields::lines(&mut body, "    ", before, Language::Yaml);
        if !c.changes.is_empty() {
            body.push_str("    changes:\n");
            for c in &c.changes {
                _ = writeln!(body, "      - {}", change::in_yaml(&c.kind));
            }
        }
        fields::lines(&mut body, "    ", behind, Language::Yaml);
        let id = t(&c.id);
        if body.is_empty() {
            _ = writeln!(out, "  {id}: {{}}");
        } else {
            _ = write!(out, "  {id}:\n{body}");
        }
    }
    out
}

fn state(out: &mut String, s: &State, indent: usize) {
    let pad = "  ".repeat(indent);
    let mut body = String::new();
    fields::lines(&mut body, &pad, &bound::STATE.plain(s, Language::Yaml), Language::Yaml);
    if !s.children.is_empty() {
        _ = writeln!(body, "{pad}states:");
        for child in &s.children {
            _ = write!(body, "{pad}  {}:", t(&child.name()));
            match child {
                ChartNode::State(child) => state(&mut body, child, indent + 2),
                ChartNode::Connector(c) => {
                    let mut keys = vec![("connector", "true".to_owned())];
                    keys.extend(bound::CONNECTOR.plain(c, Language::Yaml));
                    _ = writeln!(body, " {}", fields::table(keys, Language::Yaml));
                }
            }
        }
    }
    if !s.transitions.is_empty() {
        _ = writeln!(body, "{pad}transitions:");
        for t in &s.transitions {
            let keys = fields::table(bound::TRANSITION.plain(t, Language::Yaml), Language::Yaml);
            _ = writeln!(body, "{pad}  - {keys}");
        }
    }
    if body.is_empty() {
        out.push_str(" {}\n");
    } else {
        _ = write!(out, "\n{body}");
    }
}

/// What a deployment shows to one that it is a subsystem of. Its parameters have their values wherever they are used.
fn interface(out: &mut String, of: &Interface) {
    if !of.accepts.is_empty() {
        _ = writeln!(out, "accepts: {}", list(of.accepts.iter().map(|(event, _)| t(event))));
    }
    if !of.exports.is_empty() || of.from.is_some() {
        out.push_str("exports:\n");
        for (_, kind) in MemberClass::WORDS {
            let own: Vec<String> = of
                .exports
                .iter()
                .filter(|(_, export)| export.kind == *kind)
                .map(|(name, export)| format!("{}: {}", t(name), t(&export.of)))
                .collect();
            if !own.is_empty() {
                _ = writeln!(out, "  {}: {{ {} }}", kind.several(), own.join(", "));
            }
        }
        if let Some((event, _)) = of.from {
            _ = writeln!(out, "  from: {}", t(&event));
        }
    }
    if let Some(leaving) = of.leaving {
        _ = writeln!(out, "leaving: {{ says: {}, until: {} }}", t(&leaving.says), t(&leaving.until));
    }
}

/// `coordinator: …`
pub fn coordinator_yaml(chart: &Statechart) -> String {
    let mut out = String::from("coordinator:");
    state(&mut out, &chart.root, 1);
    out
}

/// Named things of one kind, each in a line.
fn members<T>(out: &mut String, key: &str, of: &BTreeMap<Ident, T>, table: &BoundTable<T>) {
    if !of.is_empty() {
        _ = writeln!(out, "    {key}:");
    }
    for (name, member) in of {
        _ = writeln!(out, "      {}: {}", t(name), flow(table, member));
    }
}

/// The keys of a table, in one line.
fn flow<T>(table: &BoundTable<T>, of: &T) -> String {
    fields::table(table.plain(of, Language::Yaml), Language::Yaml)
}

fn component_type(out: &mut String, ty: &ComponentType) {
    _ = writeln!(out, "  {}:", t(&ty.name));
    let mut body = String::new();
    let keys = bound::TYPE.plain(ty, Language::Yaml);
    let doc = usize::from(keys.first().is_some_and(|(key, _)| *key == "doc"));
    fields::lines(&mut body, "    ", &keys[..doc], Language::Yaml);
    members(&mut body, "ports", &ty.ports, &bound::PORT);
    members(&mut body, "properties", &ty.properties, &bound::PROPERTY);
    members(&mut body, "operations", &ty.operations, &bound::OPERATION);
    fields::lines(&mut body, "    ", &keys[doc..], Language::Yaml);
    if body.is_empty() {
        out.truncate(out.trim_end().len());
        out.push_str(" {}\n");
    }
    out.push_str(&body);
}

/// The deployment file, with the names of the files of its configurations, its coordinators and its monitors.
pub fn deployment_yaml(
    d: &Deployment,
    configurations: &[&str],
    coordinators: &[String],
    monitors: Option<&str>,
    trusted: &str,
) -> String {
    let options: Vec<String> =
        d.platform_options.iter().map(|(name, v)| format!("{}: {}", t(name), value(v))).collect();
    let platform = match options.is_empty() {
        true => t(&d.platform),
        false => format!("{{ {}: {{ {} }} }}", t(&d.platform), options.join(", ")),
    };
    let mut out = format!("davit: 1\nname: {}\nplatform: {platform}\n", t(&d.name));
    let keys = bound::DEPLOYMENT.plain(d, Language::Yaml);
    let (libraries, others) = keys.split_at(usize::from(!d.libraries.is_empty()));
    fields::lines(&mut out, "", libraries, Language::Yaml);
    if d.libraries.is_empty() && d.types.is_empty() {
        out.push_str("libraries: []\n");
    }
    if !d.types.is_empty() {
        out.push_str("types:\n");
        d.types.iter().for_each(|ty| component_type(&mut out, ty));
    }
    if !d.activities.is_empty() {
        out.push_str("activities:\n");
    }
    for (name, activity) in &d.activities {
        _ = writeln!(out, "  {}: {}", t(name), flow(&bound::ACTIVITY, activity));
    }
    _ = writeln!(out, "configurations: {}", list(configurations.iter().map(|file| text(file))));
    let files = || d.coordinators.iter().zip(coordinators);
    for (_, file) in files().filter(|(c, _)| c.written == CoordinatorNaming::Alone) {
        _ = writeln!(out, "coordinator: {}", text(file));
    }
    let named: Vec<String> = files()
        .filter(|(c, _)| c.written == CoordinatorNaming::Named)
        .map(|(c, file)| format!("{}: {}", t(&c.name), text(file)))
        .collect();
    if !named.is_empty() {
        _ = writeln!(out, "coordinators: {{ {} }}", named.join(", "));
    }
    out.push_str(trusted);
    if let Some(monitors) = monitors {
        _ = writeln!(out, "monitors: {}", list([text(monitors)]));
    }
    interface(&mut out, &d.interface);
    fields::lines(&mut out, "", others, Language::Yaml);
    // With one coordinator its states need no name before them; with several each has its own.
    let one = d.coordinators.len() == 1;
    let own = |c: &Coordinator, state: &str| text(&if one { state.to_owned() } else { format!("{}:{state}", c.name) });
    let each = |states: Vec<String>| if one { states.concat() } else { list(states) };
    let up = each(d.coordinators.iter().map(|c| own(c, &c.up)).collect());
    let down = each(d.coordinators.iter().map(|c| own(c, &c.down)).collect());
    let failed: Vec<String> =
        d.coordinators.iter().flat_map(|c| c.failed.iter().map(move |state| own(c, state))).collect();
    let (event, within) = (t(&d.deploy.event), seconds(d.deploy.within));
    let failed = if failed.is_empty() { String::new() } else { format!(", failed: {}", list(failed)) };
    _ = writeln!(out, "deploy: {{ event: {event}, up: {up}{failed}, within_s: {within} }}");
    let (event, within) = (t(&d.shutdown.event), seconds(d.shutdown.within));
    let rest = list(d.shutdown.rest.iter().map(|(id, _)| t(id)));
    let rest = if d.shutdown.rest.is_empty() { String::new() } else { format!(", rest: {rest}") };
    _ = writeln!(out, "shutdown: {{ event: {event}, down: {down}, within_s: {within}{rest} }}");
    if !d.reactions.is_empty() {
        out.push_str("simulated:\n  reactions:\n");
    }
    let one = |step: (&'static str, &str), keys: Vec<WrittenKey>| {
        fields::table([(step.0, text(step.1))].into_iter().chain(keys), Language::Yaml)
    };
    for reaction in &d.reactions {
        let keys = bound::REACTION.plain(reaction, Language::Yaml);
        _ = writeln!(out, "    - {}", one(("after", &reaction.after), keys));
    }
    if !d.faults.is_empty() {
        out.push_str("faults:\n");
    }
    for fault in &d.faults {
        _ = writeln!(out, "  - {}", one(("step", &fault.step), bound::FAULT.plain(fault, Language::Yaml)));
    }
    out
}
