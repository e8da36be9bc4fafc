//! Plans: one box a configuration, the stages as lanes in it, each step coloured by how far it can be undone.

use super::diagram::{Diagram, DiagramEdge, DiagramNode, RankDirection, Shape, Subject, Tone};
use super::text::short;
use crate::model::Step;
use crate::plan::PlannedStep;
use crate::system::Reversibility;
use std::collections::BTreeMap;

/// Plans up to this many stand in a row, joined by arrows; more are numbered and stand one below the other, or the
/// diagram would be a ribbon.
const ROW: usize = 3;

/// A plan that is drawn.
#[derive(Debug, Clone)]
pub struct DrawnPlan {
    /// What stands above it.
    pub heading: String,
    /// What is said of it below that.
    pub lines: Vec<String>,
    /// Its steps; none where it is folded.
    pub steps: Vec<PlannedStep>,
}

/// What plans look like that are carried out one after the other. `said` is how a step is spelt.
pub fn plan(title: &str, plans: &[DrawnPlan], said: &dyn Fn(&Step) -> String) -> Diagram {
    let mut diagram = Diagram::new(Subject::Plan, RankDirection::Right, title);
    let mut before: Option<usize> = None;
    let row = plans.len() <= ROW;
    for (i, DrawnPlan { heading, lines, steps }) in plans.iter().enumerate() {
        let heading = if row { heading.clone() } else { format!("{}. {heading}", i + 1) };
        let mut group = DiagramNode::new(format!("plan{}", diagram.nodes.len()), heading);
        group.shape = Shape::Group;
        group.lines.clone_from(lines);
        if steps.is_empty() && lines.is_empty() {
            group.lines.push("nothing to do".to_owned());
        }
        let group = diagram.add(group);
        if let Some(before) = before.filter(|_| row) {
            diagram.edges.push(DiagramEdge::new(before, group));
        }
        before = Some(group);
        lanes(&mut diagram, group, steps, said);
    }
    diagram.legend = vec![
        (Tone::Good, "exact: its inverse restores what was".to_owned()),
        (Tone::Care, "compensated: another call makes good for it, or nothing has to".to_owned()),
        (Tone::Bad, "irreversible".to_owned()),
    ];
    diagram
}

fn lanes(diagram: &mut Diagram, group: usize, steps: &[PlannedStep], said: &dyn Fn(&Step) -> String) {
    let mut lanes: BTreeMap<u32, usize> = BTreeMap::new();
    let mut nodes: BTreeMap<u32, usize> = BTreeMap::new();
    let mut last: Option<usize> = None;
    for step in steps {
        // A lane for each barrier; lanes are named after the stage they belong to.
        let lane = *lanes.entry(step.wave).or_insert_with(|| {
            let mut lane = DiagramNode::new(format!("lane{}", diagram.nodes.len()), step.stage.word());
            lane.shape = Shape::Group;
            lane.parent = Some(group);
            let lane = diagram.add(lane);
            if let Some(last) = last.replace(lane) {
                diagram.edges.push(DiagramEdge::new(last, lane));
            }
            lane
        });
        let title = said(&step.step);
        let mut node = DiagramNode::new(format!("step{}", diagram.nodes.len()), short(&title, 46));
        node.parent = Some(lane);
        node.tone = match step.reversibility {
            Reversibility::Exact => Tone::Good,
            Reversibility::Compensated => Tone::Care,
            Reversibility::Irreversible => Tone::Bad,
        };
        let undo: Vec<String> = step.undo.steps().iter().map(said).collect();
        if step.reversibility == Reversibility::Irreversible {
            node.lines.push("cannot be undone".to_owned());
        } else if !undo.is_empty() {
            let moving = if step.undo_moves { " (moves)" } else { "" };
            let back = format!("undo: {}", undo.join("; "));
            node.lines.push(short(&back, 54 - moving.len()) + moving);
            if !node.lines[0].starts_with(&back) {
                node.whole = vec![title.clone(), back + moving];
            }
        }
        if step.moves {
            node.lines.push("moves hardware".to_owned());
        }
        if node.title != title && node.whole.is_empty() {
            node.whole = vec![title];
        }
        nodes.insert(step.id, diagram.add(node));
        for after in &step.after {
            if let (Some(from), Some(to)) = (nodes.get(after), nodes.get(&step.id)) {
                diagram.edges.push(DiagramEdge::new(*from, *to));
            }
        }
    }
}
