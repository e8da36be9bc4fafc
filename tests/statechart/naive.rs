//! A second interpreter, written from the description of rFSM alone and with no thought of speed: full names as strings,
//! lists searched from end to end, the tree of all paths built every time. It shares no code with the engine.

use davit::model::statechart::{Action, Node, Since, State, Statechart, Trigger};
use std::collections::{BTreeMap, BTreeSet};

#[derive(Clone, Debug)]
struct Trans {
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
            actions: Vec::new(),
            transition: false,
        };
        naive.nodes(&model.root, "root");
        naive.transitions(&model.root, "root")?;
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
                Node::State(inner) => self.nodes(inner, &name),
                Node::Connector(_) => {
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

    fn transitions(&mut self, state: &State, fqn: &str) -> Option<()> {
        for transition in &state.transitions {
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
            let trans = Trans { src: src.clone(), tgt, events, effect: effect.collect(), pn: transition.pn };
            self.outgoing.entry(src).or_default().push(trans);
        }
        for child in &state.children {
            if let Node::State(inner) = child {
                self.transitions(inner, &format!("{fqn}.{}", inner.name))?;
            }
        }
        Some(())
    }

    /// Whether connectors lead round in a circle.
    pub fn has_circle(&self) -> bool {
        self.connectors.iter().any(|start| {
            let mut seen = BTreeSet::new();
            let mut todo = vec![start.clone()];
            while let Some(at) = todo.pop() {
                for trans in self.outgoing.get(&at).into_iter().flatten() {
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

    fn paths(&self, node: &str, events: &[String]) -> Tree {
        let mut ways = Vec::new();
        for trans in self.outgoing.get(node).into_iter().flatten() {
            let enabled = trans.events.is_empty() || events.iter().any(|e| trans.events.contains(e));
            if !enabled {
                continue;
            }
            if self.leaves.contains(&trans.tgt) {
                ways.push((trans.clone(), Tree(Vec::new())));
            } else if self.connectors.contains(&trans.tgt) {
                let then = self.paths(&trans.tgt, events);
                if !then.0.is_empty() {
                    ways.push((trans.clone(), then));
                }
            }
        }
        Tree(ways)
    }

    fn take(&mut self, tree: &Tree) {
        let (trans, then) = &tree.0[0];
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
                self.raise(self.exit[&state].clone());
                if self.leaf.as_ref() == Some(&state) {
                    self.leaf = None;
                }
            }
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
            self.take(then);
        }
    }

    fn raise(&mut self, names: Vec<String>) {
        self.actions.extend(names.into_iter().map(|name| format!("raise {name}")));
    }

    fn enter(&mut self, state: &str) {
        self.active.push(state.to_owned());
        self.started.insert(state.to_owned(), (self.now, false));
        self.actions.push(format!("entry {state}"));
        self.raise(self.entry[state].clone());
        if self.leaves.contains(state) {
            self.leaf = Some(state.to_owned());
            self.queue.push(format!("e_done@{state}"));
        }
    }

    /// `step(fsm, n)`; none: more than so many turns.
    pub fn step(&mut self, mut n: u64, events: &[&str], mut turns: u64) -> Option<bool> {
        self.queue.extend(events.iter().map(|e| (*e).to_owned()));
        self.actions.clear();
        self.transition = false;
        loop {
            turns = turns.checked_sub(1)?;
            let events = std::mem::take(&mut self.queue);
            let mut idle = false;
            let mut counts = true;
            if self.active.is_empty() {
                let tree = self.paths("root.initial", &events);
                if tree.0.is_empty() {
                    return Some(false);
                }
                self.enter("root");
                self.take(&tree);
                self.transition = true;
            } else if !events.is_empty() {
                let mut from_outside = self.active.clone();
                from_outside.sort_by_key(|s| s.matches('.').count());
                let found = from_outside.iter().map(|s| self.paths(s, &events)).find(|tree| !tree.0.is_empty());
                match found {
                    Some(tree) => {
                        self.take(&tree);
                        self.transition = true;
                    }
                    None => counts = false,
                }
            } else {
                idle = true;
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

    pub fn queue(&self) -> &[String] {
        &self.queue
    }
}
