//! Subsystems: a box each, with what is in it; all coordinators in one picture, and what they tell each other.

use super::coordinator::{UNVERIFIED, draw, fold};
use super::diagram::{Diagram, DiagramEdge, DiagramNode, RankDirection, Shape, Subject};
use crate::model::finding::count;
use crate::model::names::{folded_into, is_within, local_to};
use crate::model::{EventName, Statechart};
use std::collections::{BTreeMap, BTreeSet};

/// The boxes of subsystems, by their paths.
#[derive(Debug, Default)]
pub(super) struct SubsystemBoxes(BTreeMap<String, usize>);

impl SubsystemBoxes {
    /// The box of a subsystem's path, made where it is not there yet; none of the top.
    pub fn of(&mut self, diagram: &mut Diagram, path: &str) -> Option<usize> {
        if path.is_empty() {
            return None;
        }
        if let Some(group) = self.0.get(path) {
            return Some(*group);
        }
        let (outer, own) = path.rsplit_once('/').unwrap_or(("", path));
        let mut node = DiagramNode::new(path, own);
        node.shape = Shape::Group;
        node.parent = self.of(diagram, outer);
        Some(self.add(diagram, path, node))
    }

    /// The box of a subsystem that is folded.
    pub fn folded(&mut self, diagram: &mut Diagram, path: &str) -> usize {
        let (outer, own) = path.rsplit_once('/').unwrap_or(("", path));
        let mut node = DiagramNode::new(path, own);
        node.parent = self.of(diagram, outer);
        self.add(diagram, path, node)
    }

    fn add(&mut self, diagram: &mut Diagram, path: &str, node: DiagramNode) -> usize {
        let group = diagram.add(node);
        self.0.insert(path.to_owned(), group);
        group
    }
}

/// A coordinator among others.
#[derive(Debug)]
pub struct PlacedCoordinator<'a> {
    /// What stands above it.
    pub name: &'a str,
    /// The path of the subsystem whose it is; empty: it is the deployment's own.
    pub path: &'a str,
    /// Its statechart, by the names of its own file.
    pub chart: &'a Statechart,
    /// Its active states.
    pub active: Vec<String>,
}

/// All coordinators of a deployment, each in a box with its name inside the boxes of its subsystem. An arrow leads from a coordinator
/// to each subsystem of its file, with the events that it raises there; a dashed one back, with those of it that it listens to.
/// Subsystems that are more than `depth` levels deep are boxes with nothing in them.
pub fn coordinators(title: &str, all: &[PlacedCoordinator<'_>], depth: usize) -> Diagram {
    let mut diagram = Diagram::new(Subject::Statechart, RankDirection::Down, title);
    let mut boxes = SubsystemBoxes::default();
    let mut own: Vec<(usize, &PlacedCoordinator<'_>)> = Vec::new();
    let mut folded: BTreeSet<&str> = BTreeSet::new();
    for placed in all {
        if let Some(path) = folded_into(placed.path, depth) {
            folded.insert(path);
            continue;
        }
        let parent = boxes.of(&mut diagram, placed.path);
        // The only coordinator of a subsystem without subsystems is what its box shows.
        let alone = all.iter().filter(|other| within(other.path, placed.path)).count() == 1;
        let group = match parent.filter(|_| alone) {
            Some(group) => group,
            None => {
                let name = placed.name.rsplit('/').next().unwrap_or(placed.name);
                let mut group = DiagramNode::new(format!("{}:", placed.name), name);
                group.shape = Shape::Group;
                group.parent = parent;
                diagram.add(group)
            }
        };
        if !placed.chart.is_pure() {
            diagram.nodes[group].lines.push(UNVERIFIED.to_owned());
        }
        draw(&mut diagram, placed.chart, &placed.active, &format!("{}:", placed.name), Some(group));
        own.push((group, placed));
    }
    for path in folded {
        let inside = all.iter().filter(|placed| within(placed.path, path)).count();
        let at = boxes.folded(&mut diagram, path);
        diagram.nodes[at].lines.push(count(inside, "coordinator"));
    }
    for (at, placed) in own {
        for (path, group) in &boxes.0 {
            if let Some(name) = child(path, placed.path) {
                arrows(&mut diagram, at, *group, placed.chart, name);
            }
        }
    }
    diagram
}

/// Whether a path is that of a subsystem, or of one in it. The top is none.
fn within(path: &str, of: &str) -> bool {
    !of.is_empty() && is_within(path, of)
}

/// What the subsystem of a path is called in the file of that other one, if it is named there.
fn child<'p>(path: &'p str, parent: &str) -> Option<&'p str> {
    let name = local_to(path, parent)?;
    (!name.contains('/')).then_some(name)
}

/// What a coordinator and a subsystem of its file tell each other.
fn arrows(diagram: &mut Diagram, from: usize, to: usize, chart: &Statechart, subsystem: &str) {
    let of = |events: Vec<EventName>| {
        let own = |event: &EventName| local_to(event.as_str(), subsystem);
        let names: BTreeSet<&str> = events.iter().filter_map(own).collect();
        fold(&names.into_iter().map(str::to_owned).collect::<Vec<_>>())
    };
    for (from, to, (label, whole), dashed) in
        [(from, to, of(chart.raised()), false), (to, from, of(chart.waited_for()), true)]
    {
        if !label.is_empty() {
            diagram.edges.push(DiagramEdge { label, whole, dashed, ..DiagramEdge::new(from, to) });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::statechart::{Action, ChartNode, ChartTransition, State, Trigger};
    use crate::model::{Ident, Origin};

    fn event(name: &str) -> EventName {
        EventName::new(name).unwrap()
    }

    /// A chart of one state that raises and hears these.
    fn chart(raises: &[&str], hears: &[&str]) -> Statechart {
        let mut on = State::new(Ident::new("on").unwrap());
        on.entry = raises.iter().map(|name| (Action::Raise(event(name)), Origin::default())).collect();
        let mut root = State::new(Ident::new("root").unwrap());
        root.children.push(ChartNode::State(on));
        let hears = hears.iter().map(|name| Trigger::Event(event(name)));
        root.transitions = vec![ChartTransition::new("initial", "on", []), ChartTransition::new("on", "on", hears)];
        Statechart::new(root)
    }

    fn picture(depth: usize) -> Diagram {
        let top = chart(&["cell/e_start", "left"], &["cell/up", "cell/failed", "e_go"]);
        let cell = chart(&["arm/e_start"], &["arm/up", "e_start"]);
        let arm = chart(&["make"], &["e_start"]);
        let one = |name, path, chart| PlacedCoordinator { name, path, chart, active: Vec::new() };
        let all = [one("top", "", &top), one("cell", "cell", &cell), one("cell/arm", "cell/arm", &arm)];
        coordinators("all", &all, depth)
    }

    fn edges(diagram: &Diagram) -> Vec<String> {
        let id = |at: usize| diagram.nodes[at].id.as_str();
        let told = diagram.edges.iter().filter(|edge| !id(edge.from).contains(".") && !id(edge.to).contains("."));
        told.map(|e| {
            format!("{} {} {}: {}", id(e.from), if e.dashed { "-->" } else { "->" }, id(e.to), e.label.join(" "))
        })
        .collect()
    }

    #[test]
    fn parents_and_children_tell_each_other_at_every_level() {
        let diagram = picture(9);
        let told = [
            "top: -> cell: e_start",
            "cell --> top:: failed, up",
            "cell: -> cell/arm: e_start",
            "cell/arm --> cell:: up",
        ];
        assert_eq!(edges(&diagram), told);
        let node = |id: &str| diagram.nodes.iter().position(|node| node.id == id).expect(id);
        assert_eq!(diagram.nodes[node("cell/arm")].parent, Some(node("cell")));
        assert_eq!(diagram.nodes[node("cell:")].parent, Some(node("cell")), "beside the box of what is in it");
        assert_eq!(diagram.nodes[node("cell/arm:root.on")].parent, Some(node("cell/arm")), "alone in its box");
        for text in [diagram.svg(), diagram.dot(), diagram.mermaid()] {
            assert!(text.contains("failed, up"), "{text}");
        }
    }

    #[test]
    fn what_is_folded_is_a_box_with_its_arrows() {
        let diagram = picture(0);
        assert_eq!(edges(&diagram), ["top: -> cell: e_start", "cell --> top:: failed, up"]);
        let cell = diagram.nodes.iter().find(|node| node.id == "cell").unwrap();
        assert_eq!((cell.shape, cell.lines.join(" ").as_str()), (Shape::Box, "2 coordinators"));
        assert!(diagram.nodes.iter().all(|node| !node.id.starts_with("cell/")));
        assert_eq!(picture(1).nodes.iter().filter(|node| node.id.starts_with("cell/")).count(), 1);
    }
}
