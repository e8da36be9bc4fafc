//! `davit graph`

use super::exit::Exit;
use super::input::{CommandInput, CoordinatorInput, Parameters, coordinators, is_deployment, which};
use super::inside::{Inside, Region};
use super::plan_groups::{PlacedPlan, PlanGroup, grouped, placed};
use super::remote::{ASK, ask};
use super::{CommandContext, CommandFailure, CommandResult, Run, write_output};
use crate::app::{drive, plan, plan_way, wrong_in_others};
use crate::check::Until;
use crate::diagnostics::Language;
use crate::draw::{self, ComponentsView, DrawnPlan, PlacedCoordinator};
use crate::lang;
use crate::model::codes::{CLI_CONTRADICTS, CLI_FORMAT_OF_COORDINATORS};
use crate::model::finding::count;
use crate::model::program::AuxiliaryFunction;
use crate::model::{Findings, Ident, Step};
use serde_json::json;
use std::path::PathBuf;

/// Draw a deployment: its components as they are when up, its coordinators, or its bring-up plan.
///
/// A subsystem is a box, with what is in it. Between a coordinator and the subsystems of its file arrows show the events that it
/// raises there, and dashed ones those that it listens to.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The deployment file (for a coordinator alone, its own file serves as well).
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// For plans and components: configurations to apply one after the other, instead of bringing up.
    #[arg(value_name = "ID")]
    ids: Vec<String>,
    /// What to draw.
    #[arg(long, value_enum, default_value_t, value_name = "WHAT")]
    what: Drawn,
    /// The format.
    #[arg(long, value_enum, default_value_t, value_name = "FORMAT")]
    format: Format,
    /// Which coordinator, of a deployment with several; without it, all of them in one picture.
    #[arg(long, value_name = "NAME")]
    of: Option<String>,
    #[command(flatten)]
    inside: Inside,
    /// Draw subsystems that are more than N levels deep (0: all of them) as one box each; without it everything is drawn.
    #[arg(long, value_name = "N")]
    depth: Option<usize>,
    /// For coordinators: mark the states that are active in the running deployment.
    #[arg(long)]
    live: bool,
    /// The running deployment's name, if it is not the file's.
    #[arg(long, value_name = "NAME", requires = "live")]
    on: Option<String>,
    /// Write to this file instead of printing.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    parameters: Parameters,
}

/// What is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
enum Drawn {
    /// Components, ports and connections.
    #[default]
    Components,
    /// The statechart.
    Coordinator,
    /// The steps and their order.
    Plan,
}

/// How it is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
enum Format {
    /// A picture for browsers and documents.
    #[default]
    Svg,
    /// Graphviz.
    Dot,
    /// Mermaid, as code hosts draw it.
    Mermaid,
    /// PlantUML (coordinators only).
    Plantuml,
    /// SCXML, for other statechart programs (coordinators only).
    Scxml,
    /// The graph in the form of rFSM's `rfsm2json`, each transition under the state that it leads from (coordinators only).
    Json,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let what = if is_deployment(&self.file) { self.what } else { Drawn::Coordinator };
        if self.live && what != Drawn::Coordinator {
            return Err(CommandFailure::usage(
                CLI_CONTRADICTS,
                "`--live` marks the active states of coordinators, and none are drawn",
                "add `--what coordinator`; `davit status` shows components as they are now",
            ));
        }
        if let (Some(of), false) = (&self.of, what == Drawn::Coordinator) {
            return Err(CommandFailure::usage(
                CLI_CONTRADICTS,
                format!("`--of {of}` is one of the coordinators, and none are drawn"),
                "add `--what coordinator`; `--in NAME` draws what belongs to a subsystem",
            ));
        }
        let picture = if what == Drawn::Coordinator {
            let mut all = coordinators(&self.file, &self.parameters, &self.inside, self.of.as_deref(), &[])?;
            if all.len() > 1 {
                return self.several(context, &all);
            }
            let Some(read) = all.pop() else { return Ok(Exit::Done) };
            let active = if self.live { self.active(&read)? } else { Vec::new() };
            context.out.findings(&read.findings, &read.sources);
            // A picture says so itself of functions in the chart.
            let hidden = asks_beside(&read) || (self.format == Format::Plantuml && !read.chart.is_pure());
            let mark = if hidden { UNVERIFIED } else { "" };
            let title = format!("{}: coordinator{mark}", read.name);
            let text = match self.format {
                Format::Plantuml => draw::coordinator_plantuml(&title, &read.chart, &active),
                Format::Json => draw::coordinator_json(&read.chart, &active) + "\n",
                Format::Scxml => {
                    let broken = super::convert::errors(&read.chart);
                    if !broken.is_empty() {
                        return Err(CommandFailure::found(broken, read.sources));
                    }
                    let left_out = lang::functions_left_out(&read.chart, read.program.as_deref());
                    context.out.findings(&left_out, &read.sources);
                    lang::print::coordinator(&read.chart, Language::Scxml)
                }
                _ => return self.write(context, &draw::coordinator(&title, &read.chart, &active)),
            };
            write_output(context, self.output.as_deref(), &text)?;
            return Ok(Exit::Done);
        } else {
            let read =
                CommandInput { file: self.file.clone(), parameters: self.parameters.clone() }.read_but_for(context)?;
            let refused = |findings| CommandFailure::found(findings, read.sources.clone());
            let subsystems = read.deployment.all_subsystems();
            let region = self.inside.among(subsystems.iter().map(|(path, _)| path.as_str()))?;
            let region = region.as_ref();
            let name = match region {
                Some(region) => format!("{}/{}", read.deployment.name, region.path()),
                None => read.deployment.name.to_string(),
            };
            let full = |id: &String| region.map_or_else(|| id.clone(), |region| region.full(id));
            let ids: Vec<String> = self.ids.iter().map(full).collect();
            // What is wrong with configurations that are not drawn refuses nothing.
            let tell_others = |told: Option<&Findings>| {
                let told = told.map_or(&[][..], Vec::as_slice);
                context.out.findings(&wrong_in_others(&read, told), &read.sources);
            };
            match what {
                Drawn::Plan => {
                    let plans = if self.ids.is_empty() { plan_way(&read, Until::Up) } else { plan(&read, &ids) };
                    tell_others(plans.as_ref().err());
                    let plans = plans.map_err(refused)?;
                    let placed = placed(&read.deployment, &plans, region);
                    let drawn: Vec<DrawnPlan> =
                        grouped(&placed, self.depth).iter().flat_map(|group| drawn(group, region)).collect();
                    let said = |step: &Step| region.map_or(step.to_string(), |region| region.step(&step.to_string()));
                    draw::plan(&format!("{name}: plan"), &drawn, &said)
                }
                _ => {
                    let system = if self.ids.is_empty() {
                        let (drive, arrived) = drive(&read, Until::Up).map_err(refused)?;
                        tell_others(arrived.as_ref().err());
                        if let Err(findings) = arrived {
                            // The picture shows how far it comes, which helps to see why.
                            context.out.findings(&findings, &read.sources);
                        }
                        drive.system
                    } else {
                        let planned = plan(&read, &ids);
                        tell_others(planned.as_ref().err());
                        let planned = planned.map_err(refused)?;
                        planned.into_iter().last().map(|p| p.result).unwrap_or_default()
                    };
                    let title = format!("{name}: components");
                    let is_it = |path: &&Ident| region.is_some_and(|region| region.path() == path.as_str());
                    let inside = subsystems.iter().map(|(path, _)| path).find(is_it).copied();
                    let view = ComponentsView { inside, depth: self.depth };
                    draw::components(&title, &system, &read.catalogue, &read.deployment.monitors, view)
                }
            }
        };
        self.write(context, &picture)
    }
}

/// What stands behind the name of a coordinator whose functions a picture does not show.
const UNVERIFIED: &str = " (functions are not verified)";

/// Whether functions beside a chart without any are asked for something.
fn asks_beside(read: &CoordinatorInput) -> bool {
    let asks = |beside: &AuxiliaryFunction| beside.plugin.as_deref() != Some("checkevents");
    read.chart.is_pure() && read.program.iter().any(|program| program.beside.iter().any(asks))
}

/// What is planned in one file: each plan with who asks for it, or all of them as one box.
fn drawn(group: &PlanGroup<'_, '_>, region: Option<&Region>) -> Vec<DrawnPlan> {
    let steps = |one: &PlacedPlan<'_>| one.plan.steps.len();
    if group.folded {
        let number = [
            count(group.plans.len(), "request"),
            count(group.plans.iter().map(|one| steps(one)).sum::<usize>(), "step"),
        ];
        return vec![DrawnPlan { heading: group.path.to_owned(), lines: number.to_vec(), steps: Vec::new() }];
    }
    let heading = |one: &PlacedPlan<'_>| {
        let of = one.by.as_deref().or(Some(group.path).filter(|path| !path.is_empty()));
        format!("{}{}", of.map_or_else(String::new, |of| format!("{of}: ")), one.asks(region))
    };
    let plan =
        |one: &&PlacedPlan<'_>| DrawnPlan { heading: heading(one), lines: Vec::new(), steps: one.plan.steps.clone() };
    group.plans.iter().map(plan).collect()
}

impl Args {
    /// All coordinators of a deployment in one picture.
    fn several(&self, context: &CommandContext, all: &[CoordinatorInput]) -> CommandResult {
        if matches!(self.format, Format::Plantuml | Format::Json | Format::Scxml) {
            // These languages write one statechart.
            return Err(which(all.iter()));
        }
        if let Some(first) = all.first() {
            context.out.findings(&first.findings, &first.sources);
        }
        let mut names = Vec::with_capacity(all.len());
        for one in all {
            let mark = if asks_beside(one) { UNVERIFIED } else { "" };
            let active = if self.live { self.active(one)? } else { Vec::new() };
            names.push((format!("{}{mark}", one.of.as_deref().unwrap_or_default()), active));
        }
        let placed = all.iter().zip(&names).map(|(one, (name, active))| PlacedCoordinator {
            name,
            path: &one.path,
            chart: &one.in_file,
            active: active.clone(),
        });
        let charts: Vec<_> = placed.collect();
        let name = all.first().map_or("", |one| one.name.as_str());
        self.write(
            context,
            &draw::coordinators(&format!("{name}: coordinators"), &charts, self.depth.unwrap_or(usize::MAX)),
        )
    }

    fn write(&self, context: &CommandContext, picture: &draw::Diagram) -> CommandResult {
        let text = match self.format {
            Format::Svg => picture.svg(),
            Format::Dot => picture.dot(),
            Format::Mermaid => picture.mermaid(),
            Format::Plantuml | Format::Scxml | Format::Json => {
                return Err(CommandFailure::usage(
                    CLI_FORMAT_OF_COORDINATORS,
                    "only a coordinator can be written in this format",
                    "add `--what coordinator`, or ask for `svg`, `dot` or `mermaid`",
                ));
            }
        };
        write_output(context, self.output.as_deref(), &text)?;
        Ok(Exit::Done)
    }

    /// The active states of the coordinator in the running deployment.
    fn active(&self, read: &CoordinatorInput) -> Result<Vec<String>, CommandFailure> {
        let name = self.on.as_deref().or(read.deployment.as_deref());
        let status = ask(name, "status", &json!({}), ASK)?;
        let states = match &read.full {
            Some(of) => &status["coordinators"][of.as_str()],
            None => &status["coordinator"],
        };
        let states = states.as_array().cloned().unwrap_or_default();
        Ok(states.iter().filter_map(|state| state.as_str().map(str::to_owned)).collect())
    }
}
