//! A coordinator: states inside states, with what they ask for; transitions with what triggers them.

use super::diagram::{Diagram, DiagramEdge, DiagramNode, RankDirection, Shape, Subject, Tone};
use super::text::{raised, short};
use crate::model::Statechart;
use crate::model::statechart::{Action, ChartNode as Child, ChartTransition, INITIAL, ROOT, State, Trigger};
use std::collections::BTreeMap;

/// Lines of a transition's label before the rest is only counted.
const LABEL_LINES: usize = 5;
/// Characters of a line of a label.
const LABEL_COLUMNS: usize = 34;
/// What stands for the events of a transition that needs none in particular.
const ANY: &str = "any event";

/// What a coordinator looks like. `active` are the active states (`root.sync.copying`), which are marked.
///
/// References are followed as far as they lead to something; a transition that leads nowhere is not drawn (`check` says
/// so). Transitions with the same ends are one edge with the events of all; one without events says *any event*, but for the
/// only way between a connector and a node. A priority number other than 0 stands in parentheses.
pub fn coordinator(title: &str, chart: &Statechart, active: &[String]) -> Diagram {
    let title = if chart.is_pure() { title.to_owned() } else { format!("{title} ({UNVERIFIED})") };
    let mut diagram = Diagram::new(Subject::Statechart, RankDirection::Down, &title);
    draw(&mut diagram, chart, active, "", None);
    diagram
}

/// What stands beside the name of a coordinator with functions.
pub(super) const UNVERIFIED: &str = "functions are not verified";

/// One coordinator inside `parent`; the names of its nodes begin with `prefix`.
pub(super) fn draw(diagram: &mut Diagram, chart: &Statechart, active: &[String], prefix: &str, parent: Option<usize>) {
    let first = diagram.edges.len();
    let mut drawing = Drawing { diagram, index: BTreeMap::new(), active, prefix };
    drawing.state_content(&chart.root, ROOT, parent);
    drawing.transitions(&chart.root, ROOT);
    for edge in &mut diagram.edges[first..] {
        (edge.label, edge.whole) = fold(&edge.label);
    }
}

struct Drawing<'a> {
    diagram: &'a mut Diagram,
    /// Nodes by their full name; the root has none.
    index: BTreeMap<String, usize>,
    active: &'a [String],
    prefix: &'a str,
}

impl Drawing<'_> {
    fn state_content(&mut self, state: &State, fqn: &str, parent: Option<usize>) {
        let implied = state.transitions.iter().any(|t| t.src.as_ref().is_some_and(|(s, _)| s == INITIAL));
        let written = state.children.iter().any(|c| c.name().as_str() == INITIAL);
        if implied && !written {
            self.dot(&format!("{fqn}.{INITIAL}"), parent);
        }
        for child in &state.children {
            let name = format!("{fqn}.{}", child.name());
            match child {
                Child::Connector(c) if c.name.as_str() == INITIAL => self.dot(&name, parent),
                Child::Connector(c) => {
                    let mut node = DiagramNode::new(self.id(&name), c.name.as_str());
                    node.shape = Shape::Connector;
                    node.parent = parent;
                    let at = self.diagram.add(node);
                    self.index.insert(name, at);
                }
                Child::State(inner) => {
                    let mut node = DiagramNode::new(self.id(&name), inner.name.as_str());
                    node.parent = parent;
                    node.shape = if inner.children.is_empty() && inner.transitions.is_empty() {
                        Shape::Box
                    } else {
                        Shape::Group
                    };
                    (node.lines, node.whole) = state_lines(inner);
                    if self.active.contains(&name) {
                        node.tone = Tone::Active;
                    }
                    let at = self.diagram.add(node);
                    self.index.insert(name.clone(), at);
                    self.state_content(inner, &name, Some(at));
                }
            }
        }
    }

    /// The name of a node among those of all coordinators.
    fn id(&self, fqn: &str) -> String {
        format!("{}{fqn}", self.prefix)
    }

    fn dot(&mut self, name: &str, parent: Option<usize>) {
        let mut node = DiagramNode::new(self.id(name), INITIAL);
        node.shape = Shape::Dot;
        node.parent = parent;
        let at = self.diagram.add(node);
        self.index.insert(name.to_owned(), at);
    }

    fn transitions(&mut self, state: &State, fqn: &str) {
        for transition in &state.transitions {
            let ends = (transition.src.as_ref(), transition.tgt.as_ref());
            let (Some((src, _)), Some((tgt, _))) = ends else { continue };
            let (Some(from), Some(to)) = (self.find(fqn, src), self.find(fqn, tgt)) else { continue };
            let connector = matches!(self.diagram.nodes[from].shape, Shape::Dot | Shape::Connector);
            let mut label = transition_lines(transition, connector);
            if let Some(edge) = self.diagram.edges.iter_mut().find(|e| e.from == from && e.to == to) {
                // Beside another one, what needs no event must not vanish.
                if edge.label.is_empty() != label.is_empty() {
                    let empty = if label.is_empty() { &mut label } else { &mut edge.label };
                    empty.push(ANY.to_owned());
                }
                edge.label.extend(label);
            } else {
                let mut edge = DiagramEdge::new(from, to);
                edge.label = label;
                self.diagram.edges.push(edge);
            }
        }
        for child in &state.children {
            if let Child::State(inner) = child {
                self.transitions(inner, &format!("{fqn}.{}", inner.name));
            }
        }
    }

    /// The node that `text` names in the scope `fqn`: a name of the scope, a path from it (with a leading dot), or a
    /// path from the root.
    fn find(&self, fqn: &str, text: &str) -> Option<usize> {
        if let Some(rest) = text.strip_prefix('.') {
            return self.index.get(&format!("{fqn}.{rest}")).copied();
        }
        if !text.contains('.') {
            return self.index.get(&format!("{fqn}.{text}")).copied();
        }
        let mut path = text.strip_prefix("root.").unwrap_or(text);
        // A state inside may be called like the outermost one.
        while let Some(rest) = path.strip_prefix("root.").filter(|_| !self.index.contains_key("root.root")) {
            path = rest;
        }
        self.index.get(&format!("{ROOT}.{path}")).copied()
    }
}

fn actions(what: &str, actions: &[(Action, crate::model::Origin)]) -> Option<String> {
    (!actions.is_empty()).then(|| format!("{what} / {}", raised(actions).join(", ")))
}

/// What a state does, and the same whole where it is cut.
fn state_lines(state: &State) -> (Vec<String>, Vec<String>) {
    let mut lines: Vec<String> = Vec::new();
    lines.extend(actions("entry", &state.entry));
    if !state.config.is_empty() {
        let names: Vec<&str> = state.config.iter().map(|(id, _)| id.as_str()).collect();
        lines.push(format!("config {}", names.join(", ")));
    }
    if state.doo.is_some() {
        lines.push("doo / function".to_owned());
    }
    lines.extend(actions("exit", &state.exit));
    let shown: Vec<String> = lines.iter().map(|l| short(l, 48)).collect();
    let whole = if shown == lines { Vec::new() } else { lines };
    (shown, whole)
}

/// Each event of a transition, the last with its priority and what the transition raises. Of one out of a connector nothing is
/// said where it needs no event.
fn transition_lines(transition: &ChartTransition, connector: bool) -> Vec<String> {
    let mut lines: Vec<String> = transition
        .events
        .iter()
        .map(|(trigger, _)| match trigger {
            Trigger::Predicate(_) => "[predicate]".to_owned(),
            other => other.to_string(),
        })
        .collect();
    if lines.is_empty() && !connector {
        lines.push(ANY.to_owned());
    }
    let mut tail = String::new();
    if transition.guard.is_some() {
        tail.push_str(" [guard]");
    }
    if transition.pn != 0.0 {
        tail.push_str(&format!(" ({})", transition.pn));
    }
    if let Some(effect) = actions("", &transition.effect) {
        tail.push_str(&effect);
    }
    if !tail.is_empty() {
        match lines.last_mut() {
            Some(last) => last.push_str(&tail),
            None => lines.push(tail.trim().to_owned()),
        }
    }
    lines
}

/// Events as few lines, and how many more there are; and all of them whole, where something of them is not there.
pub(super) fn fold(events: &[String]) -> (Vec<String>, Vec<String>) {
    let mut lines: Vec<String> = Vec::new();
    let mut cut = events.iter().any(|event| short(event, LABEL_COLUMNS) != *event);
    for (i, event) in events.iter().enumerate() {
        let last = i + 1 == events.len();
        let text = format!("{}{}", short(event, LABEL_COLUMNS), if last { "" } else { "," });
        let full = lines.len() == LABEL_LINES;
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + text.chars().count() <= LABEL_COLUMNS => {
                line.push(' ');
                line.push_str(&text);
            }
            _ if full => {
                lines.push(format!("… {} more", events.len() - i));
                cut = true;
                break;
            }
            _ => lines.push(text),
        }
    }
    (lines, if cut { events.to_vec() } else { Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{EventName, Ident};

    fn state(name: &str, children: Vec<State>, transitions: &[(&str, &str, &[&str])]) -> State {
        let mut state = State::new(Ident::new(name).unwrap());
        state.children = children.into_iter().map(Child::State).collect();
        state.transitions = transitions
            .iter()
            .map(|(src, tgt, events)| {
                ChartTransition::new(src, tgt, events.iter().map(|e| Trigger::Event(EventName::new(e).unwrap())))
            })
            .collect();
        state
    }

    fn leaf(name: &str) -> State {
        state(name, vec![], &[])
    }

    #[test]
    fn nested_states_transitions_and_what_is_active() {
        let five = state(
            "five_DOF_mode",
            vec![leaf("free"), leaf("degraded")],
            &[
                ("initial", "free", &[]),
                ("free", "degraded", &["e_qos_degraded"]),
                ("degraded", "free", &["e_qos_restored"]),
            ],
        );
        let mut copying = state(
            "copying",
            vec![leaf("eight_DOF_mode"), five],
            &[
                ("initial", "eight_DOF_mode", &[]),
                ("eight_DOF_mode", "five_DOF_mode", &["e_5dof", "eight_DOF.failed"]),
                ("eight_DOF_mode", ".five_DOF_mode.degraded", &["e_qos_degraded"]),
                (".five_DOF_mode.free", "eight_DOF_mode", &["e_8dof"]),
                ("eight_DOF_mode", "eight_DOF_mode", &["e_again"]),
            ],
        );
        copying.entry.push((Action::Raise(EventName::new("enable_copying").unwrap()), Default::default()));
        let sync = state(
            "sync",
            vec![leaf("harmonizing"), copying],
            &[
                ("initial", "harmonizing", &[]),
                ("harmonizing", "copying", &["e_aligned"]),
                (
                    "copying",
                    "harmonizing",
                    &["enable_copying.failed", "e_misaligned", "e_peer_left", "e_torque_sat", "e_x"],
                ),
            ],
        );
        let root = state(
            "root",
            vec![leaf("unsync"), sync, leaf("fault")],
            &[
                ("initial", "unsync", &[]),
                ("unsync", "sync", &["e_qos_ok"]),
                ("sync", "unsync", &["e_link_lost"]),
                ("sync.copying.five_DOF_mode", "unsync", &["e_out"]),
                ("nowhere", "unsync", &["e"]),
            ],
        );
        let chart = Statechart::new(root);
        let diagram = coordinator("demo", &chart, &["root.sync".to_owned(), "root.sync.copying".to_owned()]);
        assert_eq!(diagram.edges.len(), 15);
        let svg = diagram.svg();
        if let Ok(path) = std::env::var("DRAW_COORDINATOR") {
            std::fs::write(path, &svg).unwrap();
        }
        assert!(svg.contains("entry / enable_copying"));
        assert_eq!(diagram.nodes.iter().filter(|n| n.tone == Tone::Active).count(), 2);
        assert!(diagram.mermaid().contains("[*] -->"));
        assert!(diagram.dot().contains("cluster_"));
    }

    #[test]
    fn what_needs_no_event_is_seen_and_so_is_its_priority() {
        let mut root = state(
            "root",
            vec![leaf("idle"), leaf("on")],
            &[
                ("initial", "idle", &[]),
                ("idle", "on", &["e_go"]),
                ("on", "idle", &[]),
                ("on", "idle", &["e_stop"]),
                ("fork", "on", &[]),
                ("fork", "on", &["e_more"]),
                ("fork", "idle", &[]),
            ],
        );
        root.children.push(Child::Connector(crate::model::statechart::Connector::new(Ident::new("fork").unwrap())));
        root.transitions[3].pn = 2.0;
        let diagram = coordinator("k", &Statechart::new(root), &[]);
        let label = |from: &str, to: &str| {
            let named = |at: usize| diagram.nodes[at].title.as_str();
            let edge = diagram.edges.iter().find(|e| (named(e.from), named(e.to)) == (from, to)).expect("drawn");
            edge.label.join("|")
        };
        assert_eq!(label("on", "idle"), "any event, e_stop (2)");
        assert_eq!(label("fork", "on"), "any event, e_more");
        assert_eq!([label("initial", "idle"), label("fork", "idle")], ["", ""]);
        for text in [diagram.svg(), diagram.dot(), diagram.mermaid()] {
            assert!(text.contains("any event, e_stop (2)"), "{text}");
        }
    }

    #[test]
    fn mermaid_has_a_title_as_it_is_and_lines_in_labels() {
        let long = ["e_one_of_them_with_a_name", "e_another_with_a_long_name"];
        let chart = Statechart::new(state("root", vec![leaf("a")], &[("initial", "a", &[]), ("a", "a", &long)]));
        let text = coordinator("lab: \"x\" #1; \\", &chart, &[]).mermaid();
        assert!(text.starts_with("---\ntitle: \"lab: \\\"x\\\" #1; \\\\\"\n---\n"), "{text}");
        assert!(text.contains("e_one_of_them_with_a_name,<br/>e_another_with_a_long_name"), "{text}");
    }
}
