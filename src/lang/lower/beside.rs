//! The coordinators of a deployment, and which of their states mean *up*, *failed* and *down*.
//!
//! A state is written `STATE`, or `COORDINATOR:STATE` where there are several coordinators. A state without a coordinator's
//! name is meant of every coordinator that is not named with one of its own.

use super::{names, own_name, text};
use crate::lang::grammar::{DEPLOY, SHUTDOWN};
use crate::lang::tree::{Cx, Fields, Kind, Node};
use crate::model::finding::did_you_mean;
use crate::model::{
    BringUp, ConfigId, Coordinator, CoordinatorNaming, Finding, Ident, OPERATOR, Origin, Statechart, TakeDown, codes,
};

/// A state as a deployment names it.
#[derive(Debug, Clone)]
pub struct Named {
    coordinator: Option<Ident>,
    state: String,
    origin: Origin,
}

/// `deploy`, before it is known which coordinators there are.
pub struct Rise {
    /// What is said of all of them.
    pub deploy: BringUp,
    up: Vec<Named>,
    /// Where `up` is written.
    up_at: Origin,
    failed: Vec<Named>,
}

/// `shutdown`, likewise.
pub struct Fall {
    /// What is said of all of them.
    pub shutdown: TakeDown,
    down: Vec<Named>,
    /// Where `down` is written.
    down_at: Origin,
}

/// `coordinator` and `coordinators`.
pub fn coordinators(cx: &mut Cx, fields: &mut Fields) -> Vec<(Option<Ident>, String, Origin)> {
    let mut out: Vec<(Option<Ident>, String, Origin)> = Vec::new();
    let (one_row, several_row) = (fields.row("coordinator"), fields.row("coordinators"));
    let several = fields.take(cx, "coordinators");
    let one = if several.is_some() {
        fields.take(cx, "coordinator")
    } else {
        fields.needed(cx, "coordinator", |_, _| format!("add `{}`", one_row.example))
    };
    if let Some(node) = one
        && let Some(path) = text(cx, &node, "`coordinator`", one_row.example)
    {
        out.push((None, path, node.origin));
    }
    let Some(several) = several else { return out };
    let Kind::Map(entries) = several.kind else {
        cx.wrong(&several, "`coordinators`", "a table of files by name", several_row.example);
        return out;
    };
    for entry in entries {
        let ident = own_name::<Ident>(cx, &entry, "a coordinator", several_row.example);
        if let (Some(ident), Some(path)) = (ident, text(cx, &entry.value, "a coordinator", several_row.example)) {
            out.push((Some(ident), path, entry.origin));
        }
    }
    if out.is_empty() && !crate::model::finding::has_errors(&cx.findings) {
        let finding = Finding::error(codes::TEXT_BAD_VALUE, "`coordinators` names none").at(several.origin);
        cx.report(finding.help(format!("write at least one: `{}`", several_row.example)));
    }
    out
}

/// The name or path of a coordinator's state, with the coordinator's name before it if there is one.
fn state(cx: &mut Cx, node: &Node, what: &str, example: &str) -> Option<Named> {
    let path = text(cx, node, what, example)?;
    let (coordinator, state) = match path.split_once(':') {
        Some((coordinator, state)) => (Some(coordinator), state),
        None => (None, path.as_str()),
    };
    let bad = coordinator.into_iter().chain(state.split('.')).find_map(|part| Ident::new(part).err());
    if let Some(error) = bad {
        let finding = Finding::error(codes::TEXT_BAD_NAME, format!("`{path}` is not the name of a state"));
        cx.report(finding.at(node.origin).labelled(error.reason).help(format!("write it like `{example}`")));
        return None;
    }
    let coordinator = coordinator.and_then(|name| Ident::new(name).ok());
    Some(Named { coordinator, state: state.to_owned(), origin: node.origin })
}

fn states(cx: &mut Cx, fields: &mut Fields, key: &'static str) -> Vec<Named> {
    let what = format!("`{}.{key}`", fields.object().name);
    let nodes = fields.several(cx, key);
    nodes.iter().filter_map(|node| state(cx, node, &what, fields.row(key).example)).collect()
}

/// `deploy`
pub fn rise(cx: &mut Cx, node: Node) -> Option<Rise> {
    let mut fields = Fields::of(cx, node, &DEPLOY)?;
    let event = fields.name(cx, "event");
    let up_at = fields.place("up").unwrap_or(fields.origin);
    let up = states(cx, &mut fields, "up");
    let failed = states(cx, &mut fields, "failed");
    let within = fields.time(cx, "within_s");
    fields.finish(cx);
    Some(Rise { deploy: BringUp { event: event?, within: within? }, up, up_at, failed })
}

/// `shutdown`
pub fn fall(cx: &mut Cx, node: Node) -> Option<Fall> {
    let mut fields = Fields::of(cx, node, &SHUTDOWN)?;
    let event = fields.name(cx, "event");
    let down_at = fields.place("down").unwrap_or(fields.origin);
    let down = states(cx, &mut fields, "down");
    let within = fields.time(cx, "within_s");
    let rest: Vec<(ConfigId, Origin)> = names(cx, &mut fields, "rest", "`shutdown.rest`");
    fields.finish(cx);
    Some(Fall { shutdown: TakeDown { event: event?, within: within?, rest }, down, down_at })
}

/// Gives each coordinator its states. `own` is the name of the deployment, and of a coordinator without one.
pub fn join(
    cx: &mut Cx,
    own: Ident,
    charts: Vec<(Option<Ident>, Statechart, Origin)>,
    rise: &Rise,
    fall: &Fall,
) -> Vec<Coordinator> {
    let names: Vec<Ident> = charts.iter().map(|(name, ..)| name.unwrap_or(own)).collect();
    if let Some(again) = (1..names.len()).find(|at| names[..*at].contains(&names[*at])) {
        let message = format!("there are two coordinators `{}`", names[again]);
        cx.report(
            Finding::error(codes::TEXT_DUPLICATE_KEY, message)
                .at(charts[again].2)
                .help("the one under `coordinator` is called like the deployment: give the other another name"),
        );
    }
    if let Some(at) = names.iter().position(|name| name.as_str() == OPERATOR) {
        let help = match charts[at].0 {
            Some(_) => "give it another name under `coordinators`",
            None => "it is called like the deployment: give that another `name`",
        };
        cx.report(
            Finding::error(codes::DEPLOY_OPERATOR_NAME, "a coordinator cannot be called `operator`")
                .at(charts[at].2)
                .help(help),
        );
    }
    for named in rise.up.iter().chain(&rise.failed).chain(&fall.down) {
        if let Some(coordinator) = named.coordinator.filter(|name| !names.contains(name)) {
            cx.report(
                Finding::error(codes::DEPLOY_UNKNOWN_STATE, format!("there is no coordinator `{coordinator}`"))
                    .at(named.origin)
                    .help(did_you_mean(coordinator.as_str(), "coordinators", names.iter().map(Ident::as_str))),
            );
        }
    }
    // All of *up* before all of *down*: findings come in the order of the keys.
    let up: Vec<String> = names.iter().map(|name| one(cx, *name, (&rise.up, rise.up_at), "up")).collect();
    let down: Vec<String> = names.iter().map(|name| one(cx, *name, (&fall.down, fall.down_at), "down")).collect();
    let failed = |name: Ident| -> Vec<String> {
        let meant = rise.failed.iter().filter(|f| f.coordinator.is_none_or(|c| c == name));
        meant.map(|f| f.state.clone()).collect()
    };
    let coordinators = charts.into_iter().zip(names).zip(up.into_iter().zip(down));
    let coordinators = coordinators.map(|(((named, chart, origin), name), (up, down))| {
        let written = if named.is_some() { CoordinatorNaming::Named } else { CoordinatorNaming::Alone };
        Coordinator { name, written, chart, up, failed: failed(name), down, of: None, origin }
    });
    coordinators.collect()
}

/// The one state that means `what` of one coordinator.
fn one(cx: &mut Cx, coordinator: Ident, (named, at): (&[Named], Origin), what: &str) -> String {
    let of = |name: Option<Ident>| named.iter().filter(move |n| n.coordinator == name);
    let own: Vec<&Named> = of(Some(coordinator)).collect();
    let meant = if own.is_empty() { of(None).collect() } else { own };
    match meant[..] {
        [one] => one.state.clone(),
        [] => {
            // Where the names themselves are wrong, that is said already.
            if !crate::model::finding::has_errors(&cx.findings) {
                let at = named.first().map_or(at, |n| n.origin);
                let message = format!("no state is named that means {what} of the coordinator `{coordinator}`");
                let help = format!("every coordinator has one: write `{what}: [{coordinator}:STATE, …]`");
                cx.report(Finding::error(codes::DEPLOY_UNKNOWN_STATE, message).at(at).help(help));
            }
            String::new()
        }
        [first, second, ..] => {
            let message = format!("two states mean {what} of the coordinator `{coordinator}`");
            cx.report(
                Finding::error(codes::TEXT_BAD_VALUE, message)
                    .at(second.origin)
                    .also(first.origin, "first here")
                    .help("name one state for each coordinator; a state around both means either"),
            );
            first.state.clone()
        }
    }
}
