//! Small deployments out of a number: the same number gives the same one.
//!
//! They need not be sound. What a coordinator asks for may be refused, fail or be left behind: the oracle is about what
//! happens then, not about whether it should.

use crate::names::{event, ident};
use davit::model::finding::Origin;
use davit::model::statechart::{Action, ChartNode, ChartTransition, State, Statechart, Trigger};
use davit::model::*;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Duration;

/// A generator of chance (splitmix64): the same seed gives the same case on every machine.
pub struct Chance(u64);

impl Chance {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5DEE_CE66_D1CE_CAFE)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// One of `0..n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    /// True in so many of a hundred cases.
    pub fn percent(&mut self, n: usize) -> bool {
        self.below(100) < n
    }

    /// One of some names.
    pub fn pick<'t>(&mut self, list: &[&'t str]) -> &'t str {
        list[self.below(list.len())]
    }

    pub fn of<'t, T>(&mut self, list: &'t [T]) -> &'t T {
        &list[self.below(list.len())]
    }
}

/// What outside events there are beside those that begin and end a life.
pub const EVENTS: [&str; 4] = ["e0", "e1", "e2", "e3"];
/// The event that confirms.
pub const CONFIRMS: &str = "e_conf";
/// What coordinators tell each other.
const TOLD: [&str; 2] = ["x0", "x1"];
const COMPONENTS: [&str; 3] = ["a", "b", "c"];

/// What safe configurations there are.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Safes {
    None,
    /// One, about a component of its own, which is created once, before anything else, and kept.
    Kept,
    /// About components that come and go.
    Loose,
}

/// A deployment and what it is, in words.
pub struct Made {
    pub deployment: Deployment,
    pub catalogue: Catalogue,
    pub text: String,
    /// `c3` creates a component that is kept.
    pub kept: bool,
}

fn raise(text: &str) -> (Action, Origin) {
    (Action::Raise(event(text)), Origin::NONE)
}

/// One type with a bit of everything.
fn catalogue() -> Catalogue {
    let port = |direction| PortType {
        direction,
        ty: ValueType::Float,
        unit: None,
        buffered: false,
        required: false,
        doc: String::new(),
        origin: Origin::NONE,
    };
    let property = |tunable| PropertyType {
        ty: ValueType::Float,
        default: Some(Value::Float(0.0)),
        min: None,
        max: None,
        tunable,
        raises: false,
        unit: None,
        doc: String::new(),
        origin: Origin::NONE,
    };
    let mut node = ComponentType::new("Node", "A component with a bit of everything.");
    node.ports.insert(ident("u"), port(Direction::In));
    node.ports.insert(ident("y"), port(Direction::Out));
    node.properties.insert(ident("k"), property(Tunable::Always));
    node.properties.insert(ident("s"), property(Tunable::Stopped));
    let operations = [("look", Effect::None, false), ("open", Effect::Undo(ident("close")), false)];
    let more = [("close", Effect::Undo(ident("open")), false), ("lift", Effect::Undo(ident("lower")), true)];
    for (name, effect, moves) in operations
        .into_iter()
        .chain(more)
        .chain([("lower", Effect::Undo(ident("lift")), true), ("burn", Effect::Irreversible, false)])
    {
        node.operations.insert(ident(name), OperationType { moves, ..OperationType::new(effect) });
    }
    let mut catalogue = Catalogue::new();
    catalogue.insert(node);
    catalogue
}

fn entry(text: &str) -> StateEntry {
    let (target, state) = text.split_once(':').expect("COMPONENT:STATE");
    let target = match target {
        "_default" => Target::Default,
        name => Target::Component(ComponentName::new(name).expect("a plain name")),
    };
    let state = RunState::from_name(state).and_then(RunState::wanted).expect("a run state");
    StateEntry { target, state, origin: Origin::NONE }
}

fn change(text: &str) -> Change {
    let words: Vec<&str> = text.split_whitespace().collect();
    let component = |at: usize| ComponentName::new(words[at]).expect("a plain name");
    let member = |at: usize| MemberRef::new(words[at]).expect("a member");
    let value = |at: usize| Value::Float(words[at].parse().expect("a number"));
    let kind = match words[0] {
        "create" => ChangeKind::Create {
            component: component(1),
            ty: TypeName::new("Node").expect("a plain name"),
            activity: None,
            properties: BTreeMap::new(),
        },
        "replace" => ChangeKind::Replace {
            component: component(1),
            ty: TypeName::new("Node").expect("a plain name"),
            activity: None,
            properties: BTreeMap::new(),
            map: BTreeMap::new(),
        },
        "destroy" => ChangeKind::Destroy { component: component(1) },
        "connect" => ChangeKind::Connect { from: member(1), to: member(2), policy: Policy::Data },
        "disconnect" => ChangeKind::Disconnect { from: member(1), to: member(2) },
        "set" => ChangeKind::PropertySet { property: member(1), value: value(2) },
        "write" => ChangeKind::PortWrite { port: member(1), value: value(2) },
        "call" => ChangeKind::OperationCall { call: Call { operation: member(1), args: vec![] }, undo: None },
        other => panic!("no change {other}"),
    };
    Change { kind, origin: Origin::NONE }
}

/// What one configuration does to a component: changes and post-states.
fn pieces(chance: &mut Chance, on: &str, kept: bool, changes: &mut Vec<String>, post: &mut Vec<String>) {
    let other = *chance.of(&COMPONENTS);
    let state = *chance.of(&["stopped", "running"]);
    let number = 1 + chance.below(3);
    match chance.below(16) {
        _ if on == "c" && kept && chance.percent(20) => changes.push("set c.k 5".to_owned()),
        0..=4 => changes.push(format!("set {on}.k {number}")),
        5 => changes.push(format!("set {on}.s {number}")),
        6 | 7 => post.push(format!("{on}:{state}")),
        8 | 9 => changes.push(format!("call {on}.open")),
        10 => changes.push(format!("call {on}.lift")),
        11 => changes.push(format!("call {on}.look")),
        12 => changes.push(format!("connect {on}.y {other}.u")),
        13 => changes.push(format!("write {on}.u {number}")),
        14 => post.push(format!("_default:{state}")),
        _ if on == "c" && kept => changes.push("call c.open".to_owned()),
        _ if number == 2 => changes.push(format!("replace {on}")),
        _ => changes.push(format!("destroy {on}")),
    }
}

/// The `at`-th configuration.
fn configuration(chance: &mut Chance, at: usize, safes: Safes, text: &mut String) -> Configuration {
    let kept = safes == Safes::Kept;
    let id = ConfigId::new(&format!("c{at}")).expect("a plain name");
    let (mut changes, mut post): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
    let mut made = Configuration::new(id);
    let on = COMPONENTS[at % 3];
    match at {
        0 | 1 => {
            changes.push(format!("create {on}"));
            if chance.percent(70) {
                post.push(format!("{on}:{}", chance.of(&["stopped", "running"])));
            }
        }
        2 if kept => {
            made.safe = true;
            match chance.below(3) {
                0 => post.push("c:stopped".to_owned()),
                1 => changes.push("set c.k 0".to_owned()),
                _ => {
                    changes.push("set c.k 0".to_owned());
                    post.push("c:stopped".to_owned());
                }
            }
        }
        // About whatever there is, or is not just then; two of them may want the same otherwise.
        2 | 3 if safes == Safes::Loose && (at == 2 || chance.percent(40)) => {
            made.safe = true;
            for on in COMPONENTS {
                match chance.below(8) {
                    0 | 1 => post.push(format!("{on}:stopped")),
                    2 | 3 => changes.push(format!("set {on}.k {}", at - 2)),
                    4 if chance.percent(30) => post.push(format!("{on}:running")),
                    _ => {}
                }
            }
            if changes.is_empty() && post.is_empty() {
                changes.push("set a.k 0".to_owned());
            }
        }
        3 if kept => {
            changes.push("create c".to_owned());
            post.push(format!("c:{}", chance.of(&["stopped", "running"])));
        }
        _ => {
            let count = 1 + chance.below(2);
            for _ in 0..count {
                let on = COMPONENTS[chance.below(5) % 3];
                pieces(chance, on, kept, &mut changes, &mut post);
            }
            if chance.percent(20) {
                made.group = Some(ident("g"));
            }
            made.on_failure = match chance.below(20) {
                0 => OnFailure::Hold,
                1 | 2 => OnFailure::Rollback,
                _ => OnFailure::Unset,
            };
            if made.on_failure != OnFailure::Hold && chance.percent(25) {
                made.confirm = Some(Confirm {
                    event: event({
                        let name: &str = [CONFIRMS, "x0"][usize::from(*chance.of(&[false, true]))];
                        name
                    }),
                    within: Duration::from_millis(1 + chance.below(6) as u64),
                });
            }
        }
    }
    changes.dedup();
    let post: Vec<&str> = post.iter().flat_map(|entries| entries.split(' ')).collect();
    made.post = StateList::of(post.iter().map(|text| entry(text)))
        .unwrap_or_else(|_| StateList::of([entry(post[0])]).expect("one entry"));
    made.changes = changes.iter().map(|text| change(text)).collect();
    let _ = writeln!(
        text,
        "{id}: {changes:?} post {post:?} group {:?} safe {} {:?} confirm {:?}",
        made.group, made.safe, made.on_failure, made.confirm
    );
    made
}

/// A name that a coordinator may raise.
fn raised(chance: &mut Chance, configurations: usize, several: bool, kept: bool) -> String {
    let id = match chance.below(10) {
        0..=2 => chance.below(2),
        3 => 2,
        _ => chance.below(configurations),
    };
    match chance.below(20) {
        _ if kept && id == 3 => "c2".to_owned(),
        17 if kept => "c2.undo".to_owned(),
        0..=11 => format!("c{id}"),
        12..=16 => format!("c{id}.undo"),
        17 => "undo".to_owned(),
        _ if several => chance.pick(&TOLD).to_owned(),
        _ => format!("c{id}"),
    }
}

/// A configuration that a state brings with it.
fn scoped(chance: &mut Chance, configurations: usize, kept: bool) -> String {
    match chance.below(configurations) {
        3 if kept => "c2".to_owned(),
        id => format!("c{id}"),
    }
}

fn answer(chance: &mut Chance, configurations: usize) -> String {
    let id = chance.below(configurations);
    let word =
        chance.of(&["ok", "ok", "ok", "failed", "failed", "undone", "cancelled", "reverted", "undo.failed", "broken"]);
    if chance.percent(10) { (*chance.of(&["undo.done", "undo.failed"])).to_owned() } else { format!("c{id}.{word}") }
}

/// A coordinator. What answers, its own end or the other coordinator lead to stands further on in the list of states: so it
/// comes to rest, however fast the answers come.
fn coordinator(
    chance: &mut Chance,
    name: &str,
    first: usize,
    configurations: usize,
    several: bool,
    kept: bool,
    text: &mut String,
) -> Coordinator {
    let count = 2 + chance.below(4);
    let mut root = State::new(ident("root"));
    let mut names: Vec<String> = vec!["idle".to_owned()];
    names.extend((1..=count).map(|at| format!("s{at}")));
    names.extend((0..chance.below(2)).map(|at| format!("done{at}")));
    let trigger = |text: &str| Trigger::parse(text).expect("an event");
    for (at, own) in names.iter().enumerate() {
        let mut state = State::new(ident(own));
        if at > 0 {
            if at == 1 && chance.percent(85) {
                state.entry.push(raise(&format!("c{first}")));
            }
            for _ in 0..chance.below(3) {
                state.entry.push(raise(&raised(chance, configurations, several, kept)));
            }
            if chance.percent(35) {
                let id = ConfigId::new(&scoped(chance, configurations, kept)).expect("a plain name");
                state.config.push((id, Origin::NONE));
            }
            if chance.percent(15) {
                state.exit.push(raise(&raised(chance, configurations, several, kept)));
            }
            if chance.percent(20) {
                for child in ["in0", "in1"] {
                    let mut inner = State::new(ident(child));
                    if chance.percent(60) {
                        let id = ConfigId::new(&scoped(chance, configurations, kept)).expect("a plain name");
                        inner.config.push((id, Origin::NONE));
                    }
                    if chance.percent(40) {
                        inner.entry.push(raise(&raised(chance, configurations, several, kept)));
                    }
                    state.children.push(ChartNode::State(inner));
                }
                state.transitions.push(ChartTransition::new("initial", "in0", []));
                state.transitions.push(ChartTransition::new("in0", "in1", [trigger(chance.pick(&EVENTS))]));
                state.transitions.push(ChartTransition::new("in1", "in0", [trigger(chance.pick(&EVENTS))]));
            }
        }
        root.children.push(ChartNode::State(state));
    }
    if kept {
        let mut base = State::new(ident("base"));
        base.entry.push(raise("c3"));
        root.children.push(ChartNode::State(base));
    }
    root.transitions.push(ChartTransition::new("initial", "idle", []));
    let mut add = |src: &str, tgt: &str, events: Vec<Trigger>, effect: Vec<String>| {
        let mut transition = ChartTransition::new(src, tgt, events);
        transition.effect.extend(effect.iter().map(|name| raise(name)));
        root.transitions.push(transition);
    };
    let started = format!("s{}", 1 + chance.below(2).min(count - 1));
    match (kept, first) {
        (false, _) => add("idle", &started, vec![trigger("e_start")], vec![]),
        (true, 0) => {
            add("idle", "base", vec![trigger("e_start")], vec![]);
            add("base", &started, vec![trigger("e0")], vec![]);
            add("base", "idle", vec![trigger("e_shutdown")], vec![]);
        }
        (true, _) => add("idle", &started, vec![trigger("e1")], vec![]),
    }
    for (at, own) in names.iter().enumerate() {
        // With a component that is kept, nothing else begins before that is there.
        if kept && at == 0 {
            continue;
        }
        let after = &names[at + 1..];
        if at > 0 {
            let mut effect = Vec::new();
            for _ in 0..chance.below(3) {
                effect.push(raised(chance, configurations, several, kept));
            }
            if chance.percent(70) {
                effect.push(format!("c{first}.undo"));
            }
            add(own, "idle", vec![trigger("e_shutdown")], effect);
        }
        for _ in 0..2 + chance.below(3) {
            let mut effect = Vec::new();
            if chance.percent(35) {
                effect.push(raised(chance, configurations, several, kept));
            }
            let target = names[1 + chance.below(names.len() - 1)].clone();
            let by_itself = !after.is_empty() && !own.starts_with("done");
            match chance.below(10) {
                0..=4 => add(own, &target, vec![trigger(chance.pick(&EVENTS))], effect),
                5..=7 if by_itself => {
                    let further = chance.of(after).clone();
                    let event = answer(chance, configurations);
                    add(own, &further, vec![trigger(&event)], effect);
                }
                8 if by_itself && several => {
                    let further = chance.of(after).clone();
                    add(own, &further, vec![trigger(chance.pick(&TOLD))], effect);
                }
                9 if by_itself
                    && at > 0
                    && after.last().is_some_and(|last| last.starts_with("done"))
                    && chance.percent(50) =>
                {
                    let further = after.last().expect("not empty").clone();
                    add(own, &further, vec![trigger("e_done")], effect);
                }
                _ => {}
            }
        }
    }
    let _ = writeln!(text, "coordinator {name}:");
    told(&root, 1, text);
    Coordinator {
        name: ident(name),
        written: CoordinatorNaming::Named,
        chart: Statechart::new(root),
        up: "s1".to_owned(),
        failed: Vec::new(),
        down: "idle".to_owned(),
        of: None,
        origin: Origin::NONE,
    }
}

/// A state in words.
fn told(state: &State, depth: usize, text: &mut String) {
    let names = |actions: &[(Action, Origin)]| -> Vec<String> {
        let name = |(action, _): &(Action, Origin)| match action {
            Action::Raise(name) => name.to_string(),
            Action::Function(_) => String::new(),
        };
        actions.iter().map(name).collect()
    };
    let config: Vec<String> = state.config.iter().map(|(id, _)| id.to_string()).collect();
    let pad = "  ".repeat(depth);
    let _ = writeln!(
        text,
        "{pad}{} config {config:?} entry {:?} exit {:?}",
        state.name,
        names(&state.entry),
        names(&state.exit)
    );
    for transition in &state.transitions {
        let end = |end: &Option<(String, Origin)>| end.as_ref().map(|(name, _)| name.clone()).unwrap_or_default();
        let events: Vec<String> = transition.events.iter().map(|(trigger, _)| format!("{trigger:?}")).collect();
        let _ = writeln!(
            text,
            "{pad}  {} -> {} on {} effect {:?}",
            end(&transition.src),
            end(&transition.tgt),
            events.join(","),
            names(&transition.effect)
        );
    }
    for child in &state.children {
        if let ChartNode::State(child) = child {
            told(child, depth + 1, text);
        }
    }
}

/// The deployment of that chance.
pub fn make(chance: &mut Chance) -> Made {
    let mut text = String::new();
    let several = chance.percent(50);
    let safes = [Safes::None, Safes::Kept, Safes::Kept, Safes::Loose][chance.below(4)];
    let kept = safes == Safes::Kept;
    let count = if kept { 6 + chance.below(2) } else { 4 + chance.below(3) };
    let stack = if chance.percent(50) { 2 + chance.below(3) } else { 16 };
    let configurations: Vec<Configuration> = (0..count).map(|at| configuration(chance, at, safes, &mut text)).collect();
    let mut coordinators = vec![coordinator(chance, "one", 0, count, several, kept, &mut text)];
    if several {
        coordinators.push(coordinator(chance, "two", 1, count, several, kept, &mut text));
    }
    let _ = writeln!(text, "limits.stack {stack}");
    let deploy = BringUp { event: event("e_start"), within: Duration::from_secs(5) };
    let shutdown = TakeDown { event: event("e_shutdown"), within: Duration::from_secs(5), rest: Vec::new() };
    let deployment = Deployment {
        configurations,
        coordinators,
        emits: TOLD.iter().map(|name| (event(name), Origin::NONE)).collect(),
        limits: DeploymentLimits { stack, step_timeout: Duration::from_millis(20) },
        ..Deployment::new(ident("oracle"), ident("simulated"), deploy, shutdown)
    };
    Made { deployment, catalogue: catalogue(), text, kept }
}
