//! A second interpreter, written from the description of rFSM alone and with no thought of speed: full names as strings,
//! lists searched from end to end, the tree of all paths built every time. It shares no code with the engine. Functions of
//! a model are small programs here, which `rich.rs` writes down in Lua for the engine.

use davit::model::statechart::{Action, ChartNode, Since, State, Statechart, Trigger};
use davit::statechart::Mode;
use std::collections::{BTreeMap, BTreeSet};

#[derive(Clone, Debug)]
struct Trans {
    /// In the order of the text: a state's own, then those of its children.
    number: usize,
    src: String,
    tgt: String,
    events: Vec<String>,
    effect: Vec<String>,
    pn: f64,
}

#[derive(Clone, Debug)]
struct Clocked {
    name: String,
    relative: bool,
    nanos: i128,
}

/// What a call answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    Yes,
    No,
    Nothing,
    Error,
}

/// A function: it notes that it was called, sends events, and answers one after the other.
#[derive(Clone, Debug)]
pub struct Program {
    pub id: usize,
    pub sends: Vec<String>,
    pub answers: Vec<Answer>,
}

/// The functions of a model.
#[derive(Clone, Debug, Default)]
pub struct Rich {
    /// By state; they come before the names it raises.
    pub entry: BTreeMap<String, Program>,
    pub exit: BTreeMap<String, Program>,
    /// By leaf: a part a resumption, whose first answer is what it yields; after the last it is through.
    pub doo: BTreeMap<String, Vec<Program>>,
    /// By the transition's number.
    pub guard: BTreeMap<usize, Program>,
    pub effect: BTreeMap<usize, Program>,
    pub predicates: BTreeMap<usize, Vec<Program>>,
}

/// All complete paths on from a node: a transition and what follows it.
struct Tree(Vec<(Trans, Tree)>);

pub struct Naive {
    states: BTreeSet<String>,
    connectors: BTreeSet<String>,
    leaves: BTreeSet<String>,
    entry: BTreeMap<String, Vec<String>>,
    exit: BTreeMap<String, Vec<String>>,
    outgoing: BTreeMap<String, Vec<Trans>>,
    timers: BTreeMap<String, Clocked>,
    started: BTreeMap<String, (i128, bool)>,
    active: Vec<String>,
    leaf: Option<String>,
    queue: Vec<String>,
    now: i128,
    rich: Rich,
    lost: bool,
    /// Steps in which connectors led round.
    pub rounds: usize,
    calls: BTreeMap<usize, usize>,
    /// How far the activity of the leaf is; none: it is through, or there is none.
    doo: Option<usize>,
    /// What functions said.
    pub said: Vec<String>,
    pub actions: Vec<String>,
    pub transition: bool,
}

fn parent(fqn: &str) -> String {
    fqn.rsplit_once('.').map_or(fqn, |(parent, _)| parent).to_owned()
}

fn is_or_inside(fqn: &str, of: &str) -> bool {
    fqn == of || fqn.strip_prefix(of).is_some_and(|rest| rest.starts_with('.'))
}

/// Lua's sort as the description words it, on the 1-based range `l..=u`.
fn lua_sort(a: &mut [Trans], mut l: usize, mut u: usize) {
    fn lt(a: &[Trans], x: usize, y: usize) -> bool {
        a[x - 1].pn > a[y - 1].pn
    }
    while l < u {
        if lt(a, u, l) {
            a.swap(u - 1, l - 1);
        }
        if u - l == 1 {
            break;
        }
        let middle = (l + u) / 2;
        if lt(a, middle, l) {
            a.swap(middle - 1, l - 1);
        } else if lt(a, u, middle) {
            a.swap(middle - 1, u - 1);
        }
        if u - l == 2 {
            break;
        }
        let pivot = a[middle - 1].pn;
        a.swap(middle - 1, u - 2);
        let (mut i, mut j) = (l, u - 1);
        loop {
            i += 1;
            while a[i - 1].pn > pivot {
                i += 1;
            }
            j -= 1;
            while pivot > a[j - 1].pn {
                j -= 1;
            }
            if j < i {
                break;
            }
            a.swap(i - 1, j - 1);
        }
        a.swap(u - 2, i - 1);
        if i - l < u - i {
            lua_sort(a, l, i - 1);
            l = i + 1;
        } else {
            lua_sort(a, i + 1, u);
            u = i - 1;
        }
    }
}

impl Naive {
    /// None when a reference leads nowhere.
    pub fn new(model: &Statechart) -> Option<Self> {
        Self::with(model, Rich::default())
    }

    /// With functions.
    pub fn with(model: &Statechart, rich: Rich) -> Option<Self> {
        let mut naive = Self {
            states: BTreeSet::new(),
            connectors: BTreeSet::new(),
            leaves: BTreeSet::new(),
            entry: BTreeMap::new(),
            exit: BTreeMap::new(),
            outgoing: BTreeMap::new(),
            timers: BTreeMap::new(),
            started: BTreeMap::new(),
            active: Vec::new(),
            leaf: None,
            queue: vec!["e_init_fsm".to_owned()],
            now: 0,
            rich,
            lost: false,
            rounds: 0,
            calls: BTreeMap::new(),
            doo: None,
            said: Vec::new(),
            actions: Vec::new(),
            transition: false,
        };
        naive.nodes(&model.root, "root");
        naive.transitions(&model.root, "root", &mut 0)?;
        for list in naive.outgoing.values_mut() {
            let length = list.len();
            lua_sort(list, 1, length);
        }
        naive.connectors.contains("root.initial").then_some(naive)
    }

    fn nodes(&mut self, state: &State, fqn: &str) {
        self.states.insert(fqn.to_owned());
        let names = |actions: &[(Action, _)]| -> Vec<String> {
            actions.iter().map(|(a, _)| if let Action::Raise(n) = a { n.to_string() } else { unreachable!() }).collect()
        };
        let mut entry = names(&state.entry);
        entry.extend(state.config.iter().map(|(id, _)| id.to_string()));
        let mut exit: Vec<String> = state.config.iter().rev().map(|(id, _)| format!("{id}.undo")).collect();
        exit.extend(names(&state.exit));
        self.entry.insert(fqn.to_owned(), entry);
        self.exit.insert(fqn.to_owned(), exit);
        if state.children.is_empty() {
            self.leaves.insert(fqn.to_owned());
        } else if state.transitions.iter().any(|t| t.src.as_ref().unwrap().0 == "initial") {
            self.connectors.insert(format!("{fqn}.initial"));
        }
        for child in &state.children {
            let name = format!("{fqn}.{}", child.name());
            match child {
                ChartNode::State(inner) => self.nodes(inner, &name),
                ChartNode::Connector(_) => {
                    self.connectors.insert(name);
                }
            }
        }
    }

    fn exists(&self, fqn: &str) -> bool {
        self.states.contains(fqn) || self.connectors.contains(fqn)
    }

    fn resolve(&self, scope: &str, text: &str) -> Option<String> {
        let fqn = if !text.contains('.') {
            format!("{scope}.{text}")
        } else if let Some(rest) = text.strip_prefix('.') {
            format!("{scope}.{rest}")
        } else if let Some(rest) = text.strip_prefix("root.") {
            format!("root.{rest}")
        } else {
            format!("root.{text}")
        };
        self.exists(&fqn).then_some(fqn)
    }

    fn transitions(&mut self, state: &State, fqn: &str, numbers: &mut usize) -> Option<()> {
        for transition in &state.transitions {
            let number = *numbers;
            *numbers += 1;
            let src = self.resolve(fqn, &transition.src.as_ref()?.0)?;
            let mut tgt = self.resolve(fqn, &transition.tgt.as_ref()?.0)?;
            if self.states.contains(&tgt) && !self.leaves.contains(&tgt) {
                tgt = format!("{tgt}.initial");
                self.connectors.contains(&tgt).then_some(())?;
            }
            let mut events = Vec::new();
            for (trigger, _) in &transition.events {
                match trigger {
                    Trigger::Event(name) if name.as_str() == "e_done" => events.push(format!("e_done@{src}")),
                    Trigger::Event(name) => events.push(name.to_string()),
                    Trigger::Timed(timed) => {
                        let name = timed.event_of(&src);
                        events.push(name.clone());
                        if self.states.contains(&src) {
                            let relative = timed.since == Since::Entry;
                            let nanos = (timed.seconds * 1e9) as i128;
                            self.timers.insert(src.clone(), Clocked { name, relative, nanos });
                        }
                    }
                    Trigger::Predicate(_) => unreachable!("pure"),
                }
            }
            let effect = transition.effect.iter().map(|(a, _)| match a {
                Action::Raise(name) => name.to_string(),
                Action::Function(_) => unreachable!("pure"),
            });
            let trans = Trans { number, src: src.clone(), tgt, events, effect: effect.collect(), pn: transition.pn };
            self.outgoing.entry(src).or_default().push(trans);
        }
        for child in &state.children {
            if let ChartNode::State(inner) = child {
                self.transitions(inner, &format!("{fqn}.{}", inner.name), numbers)?;
            }
        }
        Some(())
    }

    /// Whether connectors lead round in a circle; where `null`, one that needs no event.
    pub fn has_circle(&self, null: bool) -> bool {
        self.connectors.iter().any(|start| {
            let mut seen = BTreeSet::new();
            let mut todo = vec![start.clone()];
            while let Some(at) = todo.pop() {
                let outgoing = self.outgoing.get(&at).into_iter().flatten();
                for trans in outgoing.filter(|trans| !null || trans.events.is_empty()) {
                    if trans.tgt == *start {
                        return true;
                    }
                    if self.connectors.contains(&trans.tgt) && seen.insert(trans.tgt.clone()) {
                        todo.push(trans.tgt.clone());
                    }
                }
            }
            false
        })
    }

    /// Calls a function: what it says, sends and answers.
    fn call(&mut self, program: &Program, detail: &str, tag: &str) -> Answer {
        self.said.push(format!("{} {detail}", program.id));
        self.queue.extend(program.sends.iter().cloned());
        let calls = self.calls.entry(program.id).or_default();
        let answer = program.answers[*calls % program.answers.len()];
        *calls += 1;
        if answer == Answer::Error {
            self.said.push(format!("ERR {tag} no"));
        }
        answer
    }

    /// What entry, exit, effect and doo see of the machine.
    fn sight(&self) -> String {
        let innermost = self.active().last().cloned().unwrap_or_else(|| "nil".to_owned());
        format!("{innermost} {}", self.leaf.as_deref().unwrap_or("false"))
    }

    fn mode(&self, state: &str) -> &'static str {
        match () {
            () if self.connectors.contains(state) => "-",
            () if !self.active.iter().any(|s| s == state) => "inactive",
            () if self.leaf.as_deref() == Some(state) && self.doo.is_none() => "done",
            () => "active",
        }
    }

    /// The guard first, whatever the events; then the events in their order, each with the list and then the predicates.
    fn enabled(&mut self, trans: &Trans, events: &[String]) -> bool {
        if let Some(guard) = self.rich.guard.get(&trans.number).cloned() {
            let detail = format!("{}>{} {} {}", trans.src, trans.tgt, self.mode(&trans.src), events.join(","));
            if matches!(self.call(&guard, &detail, "GUARD"), Answer::No | Answer::Error) {
                return false;
            }
        }
        let predicates = self.rich.predicates.get(&trans.number).cloned().unwrap_or_default();
        if trans.events.is_empty() && predicates.is_empty() {
            return true;
        }
        for event in events {
            if trans.events.contains(event) {
                return true;
            }
            for predicate in &predicates {
                if self.call(predicate, event, "PREDICATE") == Answer::Yes {
                    return true;
                }
            }
        }
        false
    }

    /// All paths from a node; none at all in this step once connectors led round in a circle (`behind` are those on the way).
    fn paths(&mut self, node: &str, behind: &[String], events: &[String]) -> Tree {
        let mut ways: Vec<(Trans, Tree)> = Vec::new();
        self.lost |= behind.iter().any(|before| before == node);
        let mut way = behind.to_vec();
        way.push(node.to_owned());
        for trans in self.outgoing.get(node).cloned().unwrap_or_default() {
            // Of a state only the first way is taken; without guards the others are not looked at.
            let pure = self.rich.guard.is_empty() && self.rich.predicates.is_empty();
            let seen_enough = self.states.contains(node) && pure && !ways.is_empty();
            if self.lost || seen_enough {
                break;
            }
            if !self.enabled(&trans, events) {
                continue;
            }
            if self.leaves.contains(&trans.tgt) {
                ways.push((trans.clone(), Tree(Vec::new())));
            } else if self.connectors.contains(&trans.tgt) {
                let then = self.paths(&trans.tgt, &way, events);
                if !then.0.is_empty() {
                    ways.push((trans.clone(), then));
                }
            }
        }
        Tree(if self.lost { Vec::new() } else { ways })
    }

    fn take(&mut self, tree: &Tree, events: &[String]) {
        let (trans, then) = &tree.0[0];
        if self.connectors.contains(&trans.src) && tree.0.len() > 1 {
            self.said.push(format!("WARN conflicting transitions from src {} to", trans.src));
            self.said.extend(tree.0.iter().map(|(way, _)| format!("WARN \t{}", way.tgt)));
        }
        // The least common ancestor: the first of the target's ancestors that is one of the source's.
        let mut around_source = Vec::new();
        let mut at = trans.src.clone();
        while at != "root" {
            at = parent(&at);
            around_source.push(at.clone());
        }
        let mut lca = parent(&trans.tgt);
        while !around_source.contains(&lca) {
            lca = parent(&lca);
        }
        let mut topmost = trans.src.clone();
        while parent(&topmost) != lca {
            topmost = parent(&topmost);
        }
        if self.states.contains(&topmost) {
            let mut leaving: Vec<String> = self.active.iter().filter(|s| is_or_inside(s, &topmost)).cloned().collect();
            leaving.sort_by_key(|s| std::cmp::Reverse(s.matches('.').count()));
            for state in leaving {
                self.active.retain(|s| *s != state);
                self.actions.push(format!("exit {state}"));
                let (undone, names): (Vec<_>, Vec<_>) =
                    self.exit[&state].iter().cloned().partition(|name| name.ends_with(".undo"));
                self.raise(undone);
                if let Some(exit) = self.rich.exit.get(&state).cloned() {
                    let detail = format!("{state} {}", self.sight());
                    self.call(&exit, &detail, "EXIT");
                }
                self.raise(names);
                if self.leaf.as_ref() == Some(&state) {
                    self.leaf = None;
                }
            }
        }
        if let Some(effect) = self.rich.effect.get(&trans.number).cloned() {
            let detail = format!("{}>{} {} {}", trans.src, trans.tgt, self.sight(), events.join(","));
            self.call(&effect, &detail, "EFFECT");
        }
        self.raise(trans.effect.clone());
        let mut entering = Vec::new();
        let mut at = trans.tgt.clone();
        while at != lca {
            entering.insert(0, at.clone());
            at = parent(&at);
        }
        for state in entering {
            if self.states.contains(&state) {
                self.enter(&state);
            }
        }
        if !self.leaves.contains(&trans.tgt) {
            self.take(then, events);
        }
    }

    fn raise(&mut self, names: Vec<String>) {
        self.actions.extend(names.into_iter().map(|name| format!("raise {name}")));
    }

    fn enter(&mut self, state: &str) {
        self.active.push(state.to_owned());
        self.started.insert(state.to_owned(), (self.now, false));
        self.actions.push(format!("entry {state}"));
        if let Some(entry) = self.rich.entry.get(state).cloned() {
            let detail = format!("{state} {}", self.sight());
            self.call(&entry, &detail, "ENTRY");
        }
        self.raise(self.entry[state].clone());
        if self.leaves.contains(state) {
            self.leaf = Some(state.to_owned());
            self.doo = self.rich.doo.contains_key(state).then_some(0);
            if self.doo.is_none() {
                self.queue.push(format!("e_done@{state}"));
            }
        }
    }

    /// Resumes the leaf's activity; whether there is nothing to do.
    fn resume(&mut self) -> bool {
        let (Some(leaf), Some(at)) = (self.leaf.clone(), self.doo) else { return true };
        let Some(part) = self.rich.doo[&leaf].get(at).cloned() else {
            self.doo = None;
            self.queue.push(format!("e_done@{leaf}"));
            return false;
        };
        let detail = format!("{leaf} {}", self.sight());
        let answer = self.call(&part, &detail, "DOO");
        self.doo = (answer != Answer::Error).then_some(at + 1);
        matches!(answer, Answer::Yes | Answer::Error) && self.queue.is_empty()
    }

    /// `step(fsm, n)`; none: more than so many microsteps.
    pub fn step(&mut self, mut n: u64, events: &[&str], mut turns: u64) -> Option<bool> {
        self.queue.extend(events.iter().map(|e| (*e).to_owned()));
        self.actions.clear();
        self.said.clear();
        self.transition = false;
        loop {
            turns = turns.checked_sub(1)?;
            let events = std::mem::take(&mut self.queue);
            let mut idle = false;
            let mut counts = true;
            if self.active.is_empty() {
                self.lost = false;
                let tree = self.paths("root.initial", &[], &events);
                self.rounds += usize::from(self.lost);
                if tree.0.is_empty() {
                    let text = "failed to enter fsm root root, no valid path from root.initial";
                    self.said.push(format!("ERR ERROR: {text} nil"));
                    return Some(false);
                }
                self.enter("root");
                self.take(&tree, &events);
                self.transition = true;
            } else if !events.is_empty() {
                let mut from_outside = self.active.clone();
                from_outside.sort_by_key(|s| s.matches('.').count());
                self.lost = false;
                let found = from_outside.iter().map(|s| self.paths(s, &[], &events)).find(|tree| !tree.0.is_empty());
                self.rounds += usize::from(self.lost);
                match found {
                    Some(tree) => {
                        self.take(&tree, &events);
                        self.transition = true;
                    }
                    None => counts = false,
                }
            } else {
                idle = self.resume();
            }
            // The plugin's hook: after idle was computed, from the leaf outwards.
            let mut from_inside = self.active.clone();
            from_inside.sort_by_key(|s| std::cmp::Reverse(s.matches('.').count()));
            for state in from_inside {
                let Some(timer) = self.timers.get(&state) else { continue };
                let (started, fired) = self.started.get_mut(&state).unwrap();
                let from = if timer.relative { *started } else { 0 };
                if !*fired && self.now > from + timer.nanos {
                    *fired = true;
                    self.queue.push(timer.name.clone());
                }
            }
            if counts {
                n = n.saturating_sub(1);
            }
            if n < 1 {
                return Some(idle);
            }
            if idle {
                return Some(true);
            }
        }
    }

    pub fn advance(&mut self, nanos: i128) {
        self.now += nanos;
    }

    /// From the root to the leaf.
    pub fn active(&self) -> Vec<String> {
        let mut active = self.active.clone();
        active.sort_by_key(|s| s.matches('.').count());
        active
    }

    /// The mode of the leaf.
    pub fn leaf_mode(&self) -> Option<Mode> {
        self.leaf.as_ref().map(|_| if self.doo.is_some() { Mode::Active } else { Mode::Done })
    }

    pub fn queue(&self) -> &[String] {
        &self.queue
    }
}
