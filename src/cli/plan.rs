//! `davit plan`

use super::exit::Exit;
use super::input::CommandInput;
use super::output::{Output, Style, Table};
use super::plan_view::{PlanView, SystemSteps};
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::app::{Application, plan, plan_way, wrong_in_others};
use crate::check::Until;
use crate::model::finding::count;
use crate::system::Reversibility;

/// Show what configurations mean: their steps, in which order, what runs in parallel, what can be undone and how.
///
/// Without names, the bring-up: the coordinators are driven from nothing to up, with every request answered `ok`. With
/// names, these configurations one after the other, beginning with nothing deployed. A mistake in a configuration that is
/// not asked for is told and refuses nothing. Of several coordinators each is driven in turn, and its name is shown.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    input: CommandInput,
    /// Configurations, in the order to be applied.
    #[arg(value_name = "ID")]
    ids: Vec<String>,
    /// Drive the coordinators from nothing to up (what is shown without names).
    #[arg(long, conflicts_with_all = ["ids", "shutdown"])]
    bringup: bool,
    /// Drive the coordinators from up to down.
    #[arg(long, conflicts_with = "ids")]
    shutdown: bool,
    /// Print JSON: one object for each configuration.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let json = self.json;
        self.show(context).map_err(|failure| failure.in_json(json))
    }
}

impl Args {
    fn show(self, context: &CommandContext) -> CommandResult {
        let read = self.input.read_but_for(context)?;
        let planned = if self.ids.is_empty() {
            plan_way(&read, if self.shutdown { Until::Down } else { Until::Up })
        } else {
            plan(&read, &self.ids)
        };
        let told = planned.as_ref().err().map_or(&[][..], Vec::as_slice);
        context.out.findings(&wrong_in_others(&read, told), &read.sources);
        let planned = planned.map_err(|findings| CommandFailure {
            findings,
            sources: read.sources.clone(),
            ..CommandFailure::default()
        })?;
        if self.json {
            context.out.json(&planned.iter().map(PlanView::new).collect::<Vec<_>>());
        } else {
            for one in &planned {
                show(&context.out, one);
            }
            if let Some(last) = planned.last() {
                summary(&context.out, last);
            }
        }
        Ok(Exit::Done)
    }
}

fn show(out: &Output, planned: &Application) {
    let names: Vec<String> = planned.asks.iter().map(ToString::to_string).collect();
    let of = planned.coordinator.as_ref().map_or_else(String::new, |name| format!("{name}: "));
    for event in &planned.events {
        out.line(out.paint(Style::Dim, format!("-- {of}{event}")));
    }
    let state = planned.state.as_ref().map_or_else(String::new, |s| out.paint(Style::Dim, format!("  → {s}")));
    out.line(format!("{of}{}{state}", out.paint(Style::Bold, names.join(", "))));
    if planned.steps.is_empty() {
        out.line("  nothing to do");
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
        let undo: Vec<String> = step.undo.steps().iter().map(ToString::to_string).collect();
        let moving = if step.undo_moves { " (moves)" } else { "" };
        table.row([
            format!("{:>3}", step.id),
            out.paint(Style::Dim, shown.stage),
            step.step.to_string(),
            out.paint(
                style,
                format!("{:?}", step.reversibility).to_lowercase() + if step.moves { ", moves" } else { "" },
            ),
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
    out.text(table.to_string());
}

fn summary(out: &Output, last: &Application) {
    let running = last.result.components.values().filter(|c| c.state == crate::model::RunState::Running).count();
    out.line(format!(
        "then: {}, {running} of them running, {}, {}",
        count(last.result.components.len(), "component"),
        count(last.result.connections.len(), "connection"),
        count(last.result.ports.len(), "written port")
    ));
}
