//! Printing in YAML.

use super::monitor::{self, CommonConditions};
use super::wrap::wrap;
use super::{change, fields, float, milliseconds, seconds};
use crate::diagnostics::Language;
use crate::model::monitor::Condition;
use crate::model::statechart::{ChartNode, State};
use crate::model::{
    ComponentType, Configuration, Coordinator, CoordinatorNaming, Deployment, Effect, Ident, Interface, MemberClass,
    Statechart, Tunable, Value,
};
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
        let holds = |of: &Condition| wrap(&shared.print(of, Language::Yaml), 11, 6);
        let [before, behind] = fields::of_configuration(c, Language::Yaml, holds);
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
    fields::lines(&mut body, &pad, fields::of_state(s, Language::Yaml), Language::Yaml);
    if !s.children.is_empty() {
        _ = writeln!(body, "{pad}states:");
        for child in &s.children {
            _ = write!(body, "{pad}  {}:", t(&child.name()));
            match child {
                ChartNode::State(child) => state(&mut body, child, indent + 2),
                ChartNode::Connector(c) => {
                    let doc = c.doc.as_ref().map_or(String::new(), |doc| format!(", doc: {}", quoted(doc)));
                    _ = writeln!(body, " {{ connector: true{doc} }}");
                }
            }
        }
    }
    if !s.transitions.is_empty() {
        _ = writeln!(body, "{pad}transitions:");
        for t in &s.transitions {
            let keys = fields::table(fields::of_transition(t, Language::Yaml), Language::Yaml);
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
    if !of.exports.is_empty() {
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

fn component_type(out: &mut String, ty: &ComponentType) {
    _ = writeln!(out, "  {}:", t(&ty.name));
    let mut body = String::new();
    if !ty.doc.is_empty() {
        _ = writeln!(body, "    doc: {}", quoted(&ty.doc));
    }
    let doc = |doc: &str| if doc.is_empty() { String::new() } else { format!(", doc: {}", quoted(doc)) };
    let unit =
        |unit: &Option<std::sync::Arc<str>>| unit.as_ref().map_or(String::new(), |u| format!(", unit: {}", text(u)));
    if !ty.ports.is_empty() {
        body.push_str("    ports:\n");
    }
    for (name, port) in &ty.ports {
        let direction = port.direction.word();
        let buffered = if port.buffered { ", buffered: true" } else { "" };
        let required = if port.required { ", required: true" } else { "" };
        let (ty, unit, doc) = (text(&port.ty.to_string()), unit(&port.unit), doc(&port.doc));
        _ = writeln!(
            body,
            "      {}: {{ direction: {direction}, type: {ty}{unit}{buffered}{required}{doc} }}",
            t(name)
        );
    }
    if !ty.properties.is_empty() {
        body.push_str("    properties:\n");
    }
    for (name, property) in &ty.properties {
        let mut parts = format!("type: {}", text(&property.ty.to_string()));
        if let Some(default) = &property.default {
            _ = write!(parts, ", default: {}", value(default));
        }
        for (name, limit) in [("min", property.min), ("max", property.max)] {
            if let Some(limit) = limit {
                _ = write!(parts, ", {name}: {}", float(limit));
            }
        }
        if property.tunable != Tunable::Always {
            _ = write!(parts, ", tunable: {}", property.tunable);
        }
        _ = writeln!(body, "      {}: {{ {parts}{}{} }}", t(name), unit(&property.unit), doc(&property.doc));
    }
    if !ty.operations.is_empty() {
        body.push_str("    operations:\n");
    }
    for (name, operation) in &ty.operations {
        let args = list(operation.args.iter().map(|ty| text(&ty.to_string())));
        let returns =
            operation.returns.as_ref().map_or(String::new(), |ty| format!(", returns: {}", text(&ty.to_string())));
        let effect = match &operation.effect {
            Effect::None => "none".to_owned(),
            Effect::Irreversible => "irreversible".to_owned(),
            Effect::Undo(operation) => format!("{{ undo: {} }}", t(operation)),
        };
        let moves = if operation.moves { ", moves: true" } else { "" };
        let settled = operation.settled_by.as_ref();
        let settled = settled.map(|c| format!(", settled_by: {}", monitor::condition(c, Language::Yaml)));
        let (settled, doc) = (settled.unwrap_or_default(), doc(&operation.doc));
        _ = writeln!(body, "      {}: {{ args: {args}{returns}, effect: {effect}{moves}{settled}{doc} }}", t(name));
    }
    if !ty.raises.is_empty() {
        _ = writeln!(body, "    raises: {}", list(ty.raises.keys().map(|event| t(event))));
    }
    for (name, types) in [("start_after", &ty.start_after), ("stop_before", &ty.stop_before)] {
        if !types.is_empty() {
            _ = writeln!(body, "    {name}: {}", list(types.iter().map(|ty| t(ty))));
        }
    }
    if ty.actuator {
        body.push_str("    actuator: true\n");
    }
    let lost = ty.irreversible;
    let irreversible = [(lost.configure, "configure"), (lost.stop, "stop"), (lost.destroy, "destroy")];
    let moves = [(ty.moves.start, "start"), (ty.moves.stop, "stop")];
    for (key, marks) in [("moves", &moves[..]), ("irreversible", &irreversible)] {
        let marks: Vec<String> = marks.iter().filter(|(is, _)| *is).map(|(_, name)| (*name).to_owned()).collect();
        if !marks.is_empty() {
            _ = writeln!(body, "    {key}: {}", list(marks));
        }
    }
    if !ty.exclusive.is_empty() {
        _ = writeln!(body, "    exclusive: {}", list(ty.exclusive.iter().map(|name| text(&name.to_string()))));
    }
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
    _ = writeln!(out, "libraries: {}", list(d.libraries.iter().map(|l| t(l))));
    if !d.types.is_empty() {
        out.push_str("types:\n");
        d.types.iter().for_each(|ty| component_type(&mut out, ty));
    }
    if !d.activities.is_empty() {
        out.push_str("activities:\n");
    }
    for (name, activity) in &d.activities {
        let mut parts = Vec::new();
        if let Some(period) = activity.period {
            parts.push(format!("period_ms: {}", milliseconds(period)));
        }
        if activity.priority > 0 {
            parts.push(format!("priority: {}", activity.priority));
        }
        if let Some(cpu) = activity.cpu {
            parts.push(format!("cpu: {cpu}"));
        }
        let parts = if parts.is_empty() { "{}".to_owned() } else { format!("{{ {} }}", parts.join(", ")) };
        _ = writeln!(out, "  {}: {parts}", t(name));
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
    if !d.emits.is_empty() {
        _ = writeln!(out, "emits: {}", list(d.emits.iter().map(|(event, _)| t(event))));
    }
    interface(&mut out, &d.interface);
    if !d.safety.is_empty() {
        _ = writeln!(out, "safety: {}", list(d.safety.iter().map(|(event, _)| t(event))));
    }
    if !d.operator.is_empty() {
        _ = writeln!(out, "operator: {}", list(d.operator.iter().map(|(may, _)| t(may))));
    }
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
    let (stack, timeout) = (d.limits.stack, seconds(d.limits.step_timeout));
    _ = writeln!(out, "limits: {{ stack: {stack}, step_timeout_s: {timeout} }}");
    if !d.reactions.is_empty() {
        out.push_str("simulated:\n  reactions:\n");
    }
    for reaction in &d.reactions {
        let delay =
            if reaction.delay.is_zero() { String::new() } else { format!("delay_s: {}, ", seconds(reaction.delay)) };
        _ = writeln!(
            out,
            "    - {{ after: {}, {delay}raise: {}, component: {} }}",
            text(&reaction.after),
            t(&reaction.raise),
            t(&reaction.component)
        );
    }
    if !d.faults.is_empty() {
        out.push_str("faults:\n");
    }
    for fault in &d.faults {
        let times = if fault.times == 1 { String::new() } else { format!(", times: {}", fault.times) };
        let takes = if fault.takes.is_zero() { String::new() } else { format!(", takes_s: {}", seconds(fault.takes)) };
        _ = writeln!(out, "  - {{ step: {}, how: {}{takes}{times} }}", text(&fault.step), fault.how.word());
    }
    out
}
