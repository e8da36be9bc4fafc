//! Configurations: what both spellings mean.

use super::{by_name, entries, name, own_name, value};
use crate::lang::bound;
use crate::lang::concern;
use crate::lang::grammar::{BUFFER, CHANGES, CONFIGURATION, UNDO, primitive as primitive_of};
use crate::lang::tree::{Cx, Entry, Fields, Kind, Node};
use crate::model::finding::did_you_mean;
use crate::model::{
    Call, Change, ChangeKind, ComponentName, ConfigId, Configuration, Finding, Ident, MemberRef, OnFailure, Origin,
    Policy, TypeName, Value, codes,
};
use std::collections::BTreeMap;

/// The words of the primitives.
fn verbs() -> impl Iterator<Item = &'static str> {
    CHANGES.iter().map(|change| change.object.name)
}

/// What a change needs; in Lua that has no name, so that the whole call is shown.
fn required(cx: &mut Cx, fields: &mut Fields, key: &'static str) -> Option<Node> {
    let (call, line) = (fields.object().example, fields.row(key).example);
    let help = |cx: &Cx, origin| cx.either(origin, &format!("write it like `{call}`"), &format!("add `{line}`"));
    fields.needed(cx, key, help)
}

/// Names that mean something else where a coordinator asks for a configuration, with what.
const RESERVED: [(&str, &str); 2] =
    [("undo", "it asks for undoing what was applied last"), ("e_done", "it is raised when a state's activity is over")];

/// A map of named configurations, in the order given.
pub fn configurations(cx: &mut Cx, node: Node) -> Vec<Configuration> {
    let example =
        cx.either(node.origin, "ConfiguratorConf { engage = Configuration { … } }", "engage: { changes: [ … ] }");
    let entries = entries(cx, node, "the list of configurations", &example);
    let mut all = Vec::with_capacity(entries.len());
    let mut entries = entries.into_iter().peekable();
    while let Some(entry) = entries.next() {
        // `gentle:` and `changes:` below each other: the key is meant to stand in it.
        let is_key = |next: &Entry| CONFIGURATION.key(&next.key).is_some() && !matches!(next.value.kind, Kind::Map(_));
        if matches!(entry.value.kind, Kind::Null) && entries.peek().is_some_and(is_key) {
            while let Some(key) = entries.next_if(is_key) {
                let message = format!("`{}` stands beside `{}`, and is a key of it", key.key, entry.key);
                let finding = Finding::error(codes::TEXT_WRONG_TYPE, message).at(key.origin);
                cx.report(
                    finding.also(entry.origin, "with nothing in it").help("indent it more than the name above it"),
                );
            }
            continue;
        }
        let origin = if matches!(entry.value.kind, Kind::Made(..)) { entry.value.origin } else { entry.origin };
        let before = cx.findings.len();
        let id = own_name::<ConfigId>(cx, &entry, "a configuration's name", "enable_copying");
        let reserved = RESERVED.iter().find(|(name, _)| *name == &*entry.key);
        if let Some((name, means)) = reserved {
            let finding = Finding::error(codes::CONF_RESERVED, format!("a configuration cannot be called `{name}`"));
            cx.report(
                finding
                    .at(entry.origin)
                    .labelled(format!("where a coordinator names it, {means}"))
                    .help("take another name"),
            );
        }
        // Without a name its inside is still looked at, so that all findings come at once.
        let inside = configuration(cx, id.unwrap_or_else(unnamed), entry.value, origin);
        if let (Some(_), Some(configuration), None) = (id, inside, reserved) {
            all.push(configuration);
        }
        concern::all(cx, before, &entry.key);
    }
    all
}

fn unnamed() -> ConfigId {
    ConfigId::new("unnamed").expect("a name")
}

/// One configuration.
pub fn configuration(cx: &mut Cx, id: ConfigId, node: Node, origin: Origin) -> Option<Configuration> {
    let (named, listed) = match node.kind {
        Kind::Made("Configuration", named, listed) => (named, listed),
        Kind::Map(named) => (named, Vec::new()),
        Kind::List(list) if list.is_empty() && cx.is_lua(origin) => (Vec::new(), list),
        _ => {
            let example = cx.either(origin, CONFIGURATION.example, &CONFIGURATION.yaml());
            cx.wrong(&node, "a configuration", "a table", &example);
            return None;
        }
    };
    let mut fields = Fields::new(&CONFIGURATION, origin, named);
    let mut c = Configuration::new(id);
    c.origin = origin;
    let [on_failure, confirms] =
        ["on_failure", "confirm"].map(|key| fields.place(key).map(|origin| cx.part(origin, key)));
    bound::CONFIGURATION.read(&mut c, &mut fields, cx);
    let mut changes = listed;
    let key = fields.place("changes").map(|origin| cx.part(origin, "changes"));
    if let Some(node) = fields.take(cx, "changes") {
        match node.kind {
            _ if cx.is_lua(origin) => cx.report(
                Finding::error(codes::TEXT_UNKNOWN_KEY, "a configuration has no `changes` in Lua")
                    .at(key.unwrap_or(origin))
                    .labelled("unknown key")
                    .help("its changes stand in it as they are: `Configuration { destroy(\"Dynamics\"), … }`"),
            ),
            Kind::List(list) => changes.extend(list),
            _ => cx.wrong(&node, "`changes`", "a list", "changes: [{ destroy: { component: Dynamics } }]"),
        }
    }
    c.changes = Vec::with_capacity(changes.len());
    c.changes.extend(changes.into_iter().filter_map(|node| change(cx, node)));
    exclusive(cx, &c, on_failure, confirms);
    fields.finish(cx);
    Some(c)
}

/// What contradicts itself: each of these words says what happens when something goes wrong. With where `on_failure` and
/// `confirm` stand.
fn exclusive(cx: &mut Cx, c: &Configuration, on_failure: Option<Origin>, confirms: Option<Origin>) {
    if let (Some(confirms), true) = (confirms, c.safe || c.on_failure == OnFailure::Hold) {
        let (beside, why) = match c.safe {
            true => ("`safe = true`", "what is safe stays until it is undone by somebody"),
            false => ("`on_failure = \"hold\"`", "it says that nothing is undone unasked"),
        };
        let message = format!("`confirm` stands beside {beside}: {why}");
        cx.report(
            Finding::error(codes::CONF_CONFIRM_CONTRADICTED, message)
                .at(confirms)
                .help("keep one of the two; a coordinator can wait for the event and undo the configuration itself"),
        );
    }
    if let (Some(on_failure), true) = (on_failure, c.safe) {
        let message =
            "`on_failure` stands beside `safe = true`: of a safe configuration every step is tried, none is undone";
        cx.report(
            Finding::error(codes::CONF_ON_FAILURE_SAFE, message)
                .at(on_failure)
                .help("leave `on_failure` out, or `safe`"),
        );
    }
}

/// One change.
fn change(cx: &mut Cx, node: Node) -> Option<Change> {
    const EXAMPLE: &str = "- property_set: { property: Dynamics.force_gain, value: [0.1, 0.1, 0.1] }";
    let origin = node.origin;
    let (verb, fields) = match node.kind {
        Kind::Made(verb, entries, _) if primitive_of(verb).is_some() => {
            (verb, Fields::new(primitive_of(verb)?.object, origin, entries))
        }
        Kind::Map(mut entries) if entries.len() == 1 => {
            let Entry { key, origin: key_origin, value } = entries.pop()?;
            let Some(primitive) = primitive_of(&key) else {
                cx.report(
                    Finding::error(codes::CONF_UNKNOWN_CHANGE, format!("there is no change `{key}`"))
                        .at(key_origin)
                        .help(did_you_mean(&key, "changes", verbs())),
                );
                return None;
            };
            (primitive.object.name, Fields::of(cx, value, primitive.object)?)
        }
        Kind::Map(entries) if entries.len() > 1 => {
            let (first, second) = (&entries[0], &entries[1]);
            // A field of the first that is not indented any further.
            let field = primitive_of(&first.key).filter(|first| first.object.key(&second.key).is_some());
            let help = match field.filter(|_| primitive_of(&second.key).is_none()) {
                Some(_) => format!(
                    "`{}` belongs to `{}`: write it further in than that, or in braces behind it: `- {}: {{ {}: … }}`",
                    second.key, first.key, first.key, second.key
                ),
                None => format!("begin each change with its own `-`: `{EXAMPLE}`"),
            };
            cx.report(
                Finding::error(
                    codes::CONF_UNKNOWN_CHANGE,
                    "an entry of `changes` is one change, this has several keys",
                )
                .at(second.origin)
                .labelled("a second one")
                .help(help),
            );
            return None;
        }
        _ => {
            let example = cx.either(origin, "property_set(\"Dynamics.force_gain\", { 0.1, 0.1, 0.1 })", EXAMPLE);
            cx.wrong(&node, "an element of a configuration", "a change", &example);
            return None;
        }
    };
    Some(Change { kind: kind(cx, verb, fields)?, origin })
}

fn kind(cx: &mut Cx, verb: &'static str, mut fields: Fields) -> Option<ChangeKind> {
    let kind = match verb {
        "create" | "replace" => {
            let component = component(cx, &mut fields);
            let ty = required(cx, &mut fields, "type");
            let ty = ty.and_then(|node| name::<TypeName>(cx, &node, "a component type", "youbot.Dynamics"));
            let activity = fields.name(cx, "activity");
            let properties = fields.take(cx, "properties");
            let properties = properties.map(|node| properties_of(cx, node, component)).unwrap_or_default();
            let map =
                (verb == "replace").then(|| fields.take(cx, "map").map(|node| ports(cx, node)).unwrap_or_default());
            component.zip(ty).map(|(component, ty)| match map {
                None => ChangeKind::Create { component, ty, activity, properties },
                Some(map) => ChangeKind::Replace { component, ty, activity, properties, map },
            })
        }
        "destroy" => component(cx, &mut fields).map(|component| ChangeKind::Destroy { component }),
        "connect" | "disconnect" => {
            let from = member(cx, &mut fields, "from");
            let to = member(cx, &mut fields, "to");
            if verb == "disconnect" {
                from.zip(to).map(|(from, to)| ChangeKind::Disconnect { from, to })
            } else {
                let policy = fields.take(cx, "policy").map_or(Some(Policy::Data), |node| policy(cx, node));
                from.zip(to).zip(policy).map(|((from, to), policy)| ChangeKind::Connect { from, to, policy })
            }
        }
        "property_set" => {
            let property = member(cx, &mut fields, "property");
            let value = required_value(cx, &mut fields, property, "a property's value");
            property.zip(value).map(|(property, value)| ChangeKind::PropertySet { property, value })
        }
        "port_write" => {
            let port = member(cx, &mut fields, "port");
            let value = required_value(cx, &mut fields, port, "a port's value");
            port.zip(value).map(|(port, value)| ChangeKind::PortWrite { port, value })
        }
        "operation_call" => {
            let undo = fields.take(cx, "undo");
            let call = call(cx, &mut fields);
            let undo = match undo {
                None => Some(None),
                Some(node) => Fields::of(cx, node, &UNDO).and_then(|mut fields| {
                    let undo = self::call(cx, &mut fields);
                    fields.finish(cx);
                    undo.map(Some)
                }),
            };
            call.zip(undo).map(|(call, undo)| ChangeKind::OperationCall { call, undo })
        }
        verb => unreachable!("`{verb}` has a row among the changes, and is read here"),
    };
    fields.finish(cx);
    kind
}

fn component(cx: &mut Cx, fields: &mut Fields) -> Option<ComponentName> {
    let node = required(cx, fields, "component")?;
    name(cx, &node, "a component", "Dynamics")
}

fn member(cx: &mut Cx, fields: &mut Fields, key: &'static str) -> Option<MemberRef> {
    let node = required(cx, fields, key)?;
    let line = fields.row(key).example;
    name(cx, &node, key, line.split_once(": ").map_or(line, |(_, example)| example))
}

/// The value of `slot`, which is called `what` where its name could not be read.
fn required_value(cx: &mut Cx, fields: &mut Fields, slot: Option<MemberRef>, what: &str) -> Option<Value> {
    let node = required(cx, fields, "value")?;
    match slot {
        Some(slot) => value(cx, node, &format!("`{slot}`")),
        None => value(cx, node, what),
    }
}

fn call(cx: &mut Cx, fields: &mut Fields) -> Option<Call> {
    let operation = member(cx, fields, "operation");
    let args = match fields.take(cx, "args") {
        None => Some(Vec::new()),
        Some(Node { kind: Kind::List(list), .. }) => {
            let length = list.len();
            let what = operation.map_or_else(|| "an argument".to_owned(), |o| format!("an argument of `{o}`"));
            let args: Vec<Value> = list.into_iter().filter_map(|node| value(cx, node, &what)).collect();
            (args.len() == length).then_some(args)
        }
        Some(node) => {
            cx.wrong(&node, "`args`", "a list", fields.row("args").example);
            None
        }
    };
    Some(Call { operation: operation?, args: args? })
}

fn policy(cx: &mut Cx, node: Node) -> Option<Policy> {
    if let Kind::Str(text) = &node.kind {
        if &**text == "data" {
            return Some(Policy::Data);
        }
        let queue = cx.either(node.origin, "{ buffer = 8 }", "{ buffer: 8 }");
        let message = format!("the policy of a connection cannot be `{text}`");
        let help = format!(
            "write `{queue}` for a queue of so many values; `data`, the newest value, is what it is without a word"
        );
        let place = cx.place(&node);
        cx.report(Finding::error(codes::TEXT_BAD_VALUE, message).at(place).help(help));
        return None;
    }
    let mut fields = Fields::of(cx, node, &BUFFER)?;
    let length = fields.whole(cx, "buffer");
    fields.finish(cx);
    u32::try_from(length?).ok().map(Policy::Buffer)
}

/// What ports are called on the component that replaces theirs.
fn ports(cx: &mut Cx, node: Node) -> BTreeMap<Ident, Ident> {
    const EXAMPLE: &str = "map = { force = \"wrench\" }";
    let entries = entries(cx, node, "`map`", EXAMPLE);
    let to = |cx: &mut Cx, _, entry: Entry| name::<Ident>(cx, &entry.value, "a port", EXAMPLE);
    by_name(cx, entries, "a port", EXAMPLE, to).into_iter().collect()
}

fn properties_of(cx: &mut Cx, node: Node, component: Option<ComponentName>) -> BTreeMap<Ident, Value> {
    let entries = entries(cx, node, "`properties`", "properties = { friction_comp = 0.9 }");
    let one = |cx: &mut Cx, field: Option<Ident>, entry: Entry| {
        let what = match (component, field) {
            (Some(component), Some(field)) => format!("`{component}.{field}`"),
            _ => "a property's value".to_owned(),
        };
        value(cx, entry.value, &what)
    };
    by_name(cx, entries, "a property", "friction_comp = 0.9", one).into_iter().collect()
}
