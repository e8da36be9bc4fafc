//! `davit plan`

use super::exit::Exit;
use super::input::CommandInput;
use super::inside::{Hierarchy, Region};
use super::output::{Output, Style, Table};
use super::plan_groups::{PlacedPlan, PlanGroup, event_in, grouped, placed};
use super::plan_view::SystemSteps;
use super::status_view::indented;
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::app::{Application, plan, plan_way, wrong_in_others};
use crate::check::Until;
use crate::model::codes::UNKNOWN_COMPONENT;
use crate::model::finding::count;
use crate::model::{MemberRef, RunState, Step};
use crate::system::Reversibility;

/// Show what configurations mean: their steps, in which order, what runs in parallel, what can be undone and how.
///
/// Without names, the bring-up: the coordinators are driven from nothing to up, with every request answered `ok`. With
/// names, these configurations one after the other, beginning with nothing deployed. A mistake in a configuration that is
/// not asked for is told and refuses nothing. Of several coordinators each is driven in turn, and its name is shown. What a
/// subsystem's coordinators ask for stands below its path.
///
/// With `--in`, configurations are named as in the file of that subsystem, and of others' requests those are shown that touch
/// something of it. With `--depth`, what a deeper subsystem asks for is one line.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    input: CommandInput,
    /// Configurations, in the order to be applied.
    #[arg(value_name = "ID")]
    ids: Vec<String>,
    #[command(flatten)]
    hierarchy: Hierarchy,
    /// Drive the coordinators from nothing to up (what is shown without names).
    #[arg(long, conflicts_with_all = ["ids", "shutdown"])]
    bringup: bool,
    /// Drive the coordinators from up to down.
    #[arg(long, conflicts_with = "ids")]
    shutdown: bool,
    /// Print JSON: one object for each configuration, with its `subsystem` where it is of one.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let read = self.input.read_but_for(context)?;
        let all = read.deployment.all_subsystems();
        let region = self.hierarchy.inside.among(all.iter().map(|(path, _)| path.as_str()))?;
        let region = region.as_ref();
        let planned = if self.ids.is_empty() {
            plan_way(&read, if self.shutdown { Until::Down } else { Until::Up })
        } else {
            let full = |id: &String| region.map_or_else(|| id.clone(), |region| region.full(id));
            plan(&read, &self.ids.iter().map(full).collect::<Vec<_>>())
        };
        let told = planned.as_ref().err().map_or(&[][..], Vec::as_slice);
        context.out.findings(&wrong_in_others(&read, told), &read.sources);
        let planned = planned.map_err(|mut findings| {
            // Names are typed as in that file.
            if let Some(region) = region {
                let before = format!("{}/", region.path());
                let helps = findings.iter_mut().filter(|finding| finding.code == UNKNOWN_COMPONENT);
                helps.filter_map(|finding| finding.help.as_mut()).for_each(|help| *help = help.replace(&before, ""));
            }
            CommandFailure::found(findings, read.sources.clone())
        })?;
        let placed = placed(&read.deployment, &planned, region);
        if self.json {
            context.out.json(&placed.iter().map(|one| one.json(region)).collect::<Vec<_>>());
            return Ok(Exit::Done);
        }
        let top = region.map_or(read.deployment.name.as_str(), Region::path);
        for group in grouped(&placed, self.hierarchy.depth) {
            self.show_group(&context.out, &group, region, top, !all.is_empty());
        }
        if let Some(last) = planned.last() {
            summary(&context.out, last, region);
        }
        Ok(Exit::Done)
    }
}

impl Args {
    /// What one file asks for, below its path where there are several.
    fn show_group(&self, out: &Output, group: &PlanGroup<'_, '_>, region: Option<&Region>, top: &str, several: bool) {
        let path = if group.path.is_empty() { top } else { group.path };
        if group.folded {
            out.line(folded(out, path, group));
            return;
        }
        if several {
            out.line(out.paint(Style::Bold, path));
        }
        let indent = if several { 2 } else { 0 };
        for one in &group.plans {
            let shown = show(out, one, region);
            out.text(if indent > 0 { indented(&shown) } else { shown });
        }
    }
}

/// What is folded, in a line.
fn folded(out: &Output, path: &str, group: &PlanGroup<'_, '_>) -> String {
    let steps = || group.plans.iter().flat_map(|one| &one.plan.steps);
    let some = |number: usize, style, word: &str| match number {
        0 => String::new(),
        _ => format!(", {}", out.paint(style, format!("{number} {word}"))),
    };
    let worst = steps().filter(|step| step.reversibility == Reversibility::Irreversible).count();
    let state = group.plans.last().and_then(|one| one.plan.state.as_deref());
    format!(
        "{}  {}, {}{}{}{}",
        out.paint(Style::Bold, path),
        count(group.plans.len(), "request"),
        count(steps().count(), "step"),
        some(worst, Style::Bad, "irreversible"),
        some(steps().filter(|step| step.moves).count(), Style::Care, "of them move"),
        state.map_or_else(String::new, |state| out.paint(Style::Dim, format!("  → {state}"))),
    )
}

fn show(out: &Output, one: &PlacedPlan<'_>, region: Option<&Region>) -> String {
    let planned = one.plan;
    let said = |step: &Step| region.map_or(step.to_string(), |region| region.step(&step.to_string()));
    let of = one.by.as_ref().map_or_else(String::new, |name| format!("{name}: "));
    let mut shown = String::new();
    for event in planned.events.iter().filter(|_| !one.outside) {
        shown += &format!("{}\n", out.paint(Style::Dim, format!("-- {of}{}", event_in(region, event))));
    }
    let state = planned.state.as_ref().map_or_else(String::new, |s| out.paint(Style::Dim, format!("  → {s}")));
    shown += &format!("{of}{}{state}\n", out.paint(Style::Bold, one.asks(region)));
    if planned.steps.is_empty() {
        shown += "  nothing to do\n";
    }
    let mut table = Table::new(2);
    for shown in SystemSteps::new(&planned.steps) {
        let step = &planned.steps[shown.index];
        let after = shown.after.iter().map(ToString::to_string).collect::<Vec<_>>();
        let style = match step.reversibility {
            Reversibility::Exact => Style::Good,
            Reversibility::Compensated => Style::Care,
            Reversibility::Irreversible => Style::Bad,
        };
        let undo: Vec<String> = step.undo.steps().iter().map(said).collect();
        let moving = if step.undo_moves { " (moves)" } else { "" };
        table.row([
            format!("{:>3}", step.id),
            out.paint(Style::Dim, shown.stage),
            said(&step.step),
            out.paint(style, step.reversibility.word().to_owned() + if step.moves { ", moves" } else { "" }),
            if undo.is_empty() {
                String::new()
            } else {
                out.paint(Style::Dim, format!("undo: {}{moving}", undo.join("; ")))
            },
            match after.len() {
                0 => String::new(),
                n if n > 6 => out.paint(Style::Dim, format!("after {} … ({n})", after[..4].join(" "))),
                _ => out.paint(Style::Dim, format!("after {}", after.join(" "))),
            },
        ]);
    }
    shown + &table.to_string()
}

fn summary(out: &Output, last: &Application, region: Option<&Region>) {
    let has = |name: &str| region.is_none_or(|region| region.has(name));
    let components: Vec<_> = last.result.components.iter().filter(|(name, _)| has(name.as_str())).collect();
    let running = components.iter().filter(|(_, it)| it.state == RunState::Running).count();
    let connected = |(from, to): &(MemberRef, MemberRef)| has(from.component.as_str()) || has(to.component.as_str());
    let connections = last.result.connections.keys().filter(|ends| connected(ends)).count();
    let ports = last.result.ports.keys().filter(|port| has(port.component.as_str())).count();
    out.line(format!(
        "then: {}, {running} of them running, {}, {}",
        count(components.len(), "component"),
        count(connections, "connection"),
        count(ports, "written port")
    ));
}
