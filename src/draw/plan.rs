//! Plans: one box a configuration, the stages as lanes in it, each step coloured by how far it can be undone.

use super::diagram::{Diagram, DiagramEdge, DiagramNode, RankDirection, Shape, Subject, Tone};
use super::text::short;
use crate::plan::{PlanStage, PlannedStep};
use crate::system::Reversibility;
use std::collections::BTreeMap;

/// Plans up to this many stand in a row, joined by arrows; more are numbered and stand one below the other, or the
/// diagram would be a ribbon.
const ROW: usize = 3;

/// What plans look like that are carried out one after the other, each with a heading.
pub fn plan(title: &str, plans: &[(String, Vec<PlannedStep>)]) -> Diagram {
    let mut diagram = Diagram::new(Subject::Plan, RankDirection::Right, title);
    let mut before: Option<usize> = None;
    let row = plans.len() <= ROW;
    for (i, (heading, steps)) in plans.iter().enumerate() {
        let heading = if row { heading.clone() } else { format!("{}. {heading}", i + 1) };
        let mut group = DiagramNode::new(format!("plan{}", diagram.nodes.len()), heading);
        group.shape = Shape::Group;
        if steps.is_empty() {
            group.lines.push("nothing to do".to_owned());
        }
        let group = diagram.add(group);
        if let Some(before) = before.filter(|_| row) {
            diagram.edges.push(DiagramEdge::new(before, group));
        }
        before = Some(group);
        lanes(&mut diagram, group, steps);
    }
    diagram.legend = vec![
        (Tone::Good, "exact: its inverse restores what was".to_owned()),
        (Tone::Care, "compensated: another call makes good for it".to_owned()),
        (Tone::Bad, "irreversible".to_owned()),
    ];
    diagram
}

fn lanes(diagram: &mut Diagram, group: usize, steps: &[PlannedStep]) {
    let mut lanes: BTreeMap<u32, usize> = BTreeMap::new();
    let mut nodes: BTreeMap<u32, usize> = BTreeMap::new();
    let mut last: Option<usize> = None;
    for step in steps {
        // A lane for each barrier; lanes are named after the stage they belong to.
        let lane = *lanes.entry(step.wave).or_insert_with(|| {
            let mut lane = DiagramNode::new(format!("lane{}", diagram.nodes.len()), stage(step.stage));
            lane.shape = Shape::Group;
            lane.parent = Some(group);
            let lane = diagram.add(lane);
            if let Some(last) = last.replace(lane) {
                diagram.edges.push(DiagramEdge::new(last, lane));
            }
            lane
        });
        let mut node = DiagramNode::new(format!("step{}", diagram.nodes.len()), short(&step.step.to_string(), 46));
        node.parent = Some(lane);
        node.tone = match step.reversibility {
            Reversibility::Exact => Tone::Good,
            Reversibility::Compensated => Tone::Care,
            Reversibility::Irreversible => Tone::Bad,
        };
        let undo: Vec<String> = step.undo.steps().iter().map(ToString::to_string).collect();
        if step.reversibility == Reversibility::Irreversible {
            node.lines.push("cannot be undone".to_owned());
        } else if !undo.is_empty() {
            let moving = if step.undo_moves { " (moves)" } else { "" };
            node.lines.push(short(&format!("undo: {}", undo.join("; ")), 54 - moving.len()) + moving);
        }
        nodes.insert(step.id, diagram.add(node));
        for after in &step.after {
            if let (Some(from), Some(to)) = (nodes.get(after), nodes.get(&step.id)) {
                diagram.edges.push(DiagramEdge::new(*from, *to));
            }
        }
    }
}

fn stage(stage: PlanStage) -> &'static str {
    match stage {
        PlanStage::Pre => "pre",
        PlanStage::Changes => "changes",
        PlanStage::Post => "post",
    }
}
