//! A parent that has ended a subsystem where nobody has begun it, and waits to hear that it is down: that ignores the event, and tells nothing.

use super::children::{Child, begun};
use super::explore::Graph;
use super::judge::Traced;
use super::product::Product;
use super::reactions::triggers;
use super::state::{Failed, ProductState};
use crate::model::codes::COORD_STUCK;
use crate::model::subsystem::IGNORED;
use crate::model::{EventName, Finding, Severity};
use crate::statechart::{Chart, NodeId, RaiseMoment};
use std::collections::BTreeMap;

/// Whether a coordinator raises an event when it comes to a leaf.
fn raises_there(chart: &Chart, leaf: NodeId, event: EventName) -> bool {
    let there = |when: RaiseMoment| match when {
        RaiseMoment::Entry(node) => chart.is_inside(leaf, node),
        RaiseMoment::Effect(edge) => chart.is_inside(leaf, chart.ends(edge).1),
        RaiseMoment::Exit(_) => false,
    };
    chart.raises().iter().any(|site| site.name == event && there(site.when))
}

fn help(child: &Child) -> String {
    let hear = format!("hear `{}{IGNORED}` there as well: that is told then", child.ends);
    match (&child.deaf, &child.beliefs) {
        // Else it is known what it tells, and when.
        (Some(deaf), None) => format!(
            "{hear}; and let `{}` hear `{}` in `{deaf}` too, so that this says that it is down",
            child.path,
            child.ends.local(child.path).unwrap_or_default()
        ),
        _ => hear,
    }
}

impl Product<'_> {
    /// The subsystem, by its place, that a coordinator waits for there and that tells nothing more, since it was not begun.
    pub(super) fn waits_for_unbegun(&self, state: &ProductState, number: usize) -> Option<usize> {
        let tells_nothing =
            |at: usize, child: &Child| state.children & begun(at) == 0 && !child.ends_unbegun && !child.unbidden;
        // Of most states it is known at once.
        if !self.children.iter().enumerate().any(|(at, child)| tells_nothing(at, child)) || !state.is_at_rest() {
            return None;
        }
        let (member, leaf) = (&self.members[number], state.leaves[number]);
        let (waits, any) = triggers(member.chart, leaf);
        let names: Vec<EventName> = waits.iter().filter_map(|event| member.name_of(*event)).collect();
        // A time leads on, or may.
        if any || names.len() < waits.len() {
            return None;
        }
        // So does what components, monitors and other coordinators raise.
        let told = |name: &EventName| {
            self.is_told_by_child(*name) && !self.is_silent(state, *name)
                || self.is_raised_inside(state, *name)
                || self.members.iter().any(|other| other.chart.raises().iter().any(|site| site.name == *name))
        };
        let silent = |(at, child): &(usize, &Child)| {
            let ignored = |name: &EventName| name.as_str().strip_suffix(IGNORED) == Some(child.ends.as_str());
            tells_nothing(*at, child)
                && names.contains(&child.down)
                && names.iter().all(|name| !ignored(name) && !told(name))
                && raises_there(member.chart, leaf, child.ends)
        };
        self.children.iter().enumerate().find(silent).map(|(at, _)| at)
    }
}

impl Graph<'_, '_> {
    /// Where a parent waits for what a subsystem that was not begun never tells.
    pub(super) fn unbegun(&mut self, found: &mut Traced) {
        if self.product.children.is_empty() {
            return;
        }
        let mut some: BTreeMap<(usize, NodeId, usize), Vec<u32>> = BTreeMap::new();
        for (at, state) in (0u32..).zip(&self.reached.states) {
            for number in 0..state.leaves.len() {
                if let Some(child) = self.product.waits_for_unbegun(state, number) {
                    some.entry((number, state.leaves[number], child)).or_default().push(at);
                }
            }
        }
        for ((number, leaf, child), states) in some {
            let Some(at) = self.best_first(states).first().copied() else { continue };
            let (member, child) = (&self.product.members[number], &self.product.children[child]);
            let fqn = member.chart.fqn(leaf).to_string();
            let message = format!(
                "what `{fqn}` waits for never comes: `{}`, for on this way `{}` was not begun, or is down again, and ignores `{}`",
                child.down, child.path, child.ends
            );
            // Where an undo has failed not every coordinator can go on.
            let severity = if self.failed[at as usize] >= Failed::Undo { Severity::Info } else { Severity::Warning };
            let finding = Finding::new(severity, COORD_STUCK, message)
                .at(member.chart.origin(leaf))
                .path(format!("coordinator.{fqn}"))
                .help(help(child));
            let trace = self.trace(at);
            found.push((finding, trace));
        }
    }
}
