//! `davit graph`

use super::exit::Exit;
use super::input::{CommandInput, CoordinatorInput, Parameters, coordinators, is_deployment, which};
use super::remote::{ASK, ask};
use super::{CommandContext, CommandFailure, CommandResult, Run, write_output};
use crate::app::{drive, plan, plan_way, wrong_in_others};
use crate::check::Until;
use crate::diagnostics::Language;
use crate::draw;
use crate::lang;
use crate::model::Findings;
use crate::model::codes::CLI_FORMAT_OF_COORDINATORS;
use crate::model::program::AuxiliaryFunction;
use serde_json::json;
use std::path::PathBuf;

/// Draw a deployment: its components as they are when up, its coordinators, or its bring-up plan.
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
    /// Mark the states that are active in the running deployment.
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
    /// The graph as rFSM's `rfsm2json` writes it (coordinators only).
    Json,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let what = if is_deployment(&self.file) { self.what } else { Drawn::Coordinator };
        let picture = if what == Drawn::Coordinator {
            let mut all = coordinators(&self.file, &self.parameters, self.of.as_deref(), &[])?;
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
            let refused =
                |findings| CommandFailure { findings, sources: read.sources.clone(), ..CommandFailure::default() };
            let name = read.deployment.name;
            // What is wrong with configurations that are not drawn refuses nothing.
            let tell_others = |told: Option<&Findings>| {
                let told = told.map_or(&[][..], Vec::as_slice);
                context.out.findings(&wrong_in_others(&read, told), &read.sources);
            };
            match what {
                Drawn::Plan => {
                    let plans = if self.ids.is_empty() { plan_way(&read, Until::Up) } else { plan(&read, &self.ids) };
                    tell_others(plans.as_ref().err());
                    let plans: Vec<_> = plans
                        .map_err(refused)?
                        .into_iter()
                        .map(|p| {
                            let asks: Vec<String> = p.asks.iter().map(ToString::to_string).collect();
                            let of = p.coordinator.map_or_else(String::new, |name| format!("{name}: "));
                            (format!("{of}{}", asks.join(", ")), p.steps)
                        })
                        .collect();
                    draw::plan(&format!("{name}: plan"), &plans)
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
                        let planned = plan(&read, &self.ids);
                        tell_others(planned.as_ref().err());
                        let planned = planned.map_err(refused)?;
                        planned.into_iter().last().map(|p| p.result).unwrap_or_default()
                    };
                    let title = format!("{name}: components");
                    draw::components(&title, &system, &read.catalogue, &read.deployment.monitors)
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
        let (mut names, mut charts) = (Vec::with_capacity(all.len()), Vec::with_capacity(all.len()));
        for one in all {
            let active = if self.live { self.active(one)? } else { Vec::new() };
            let mark = if asks_beside(one) { UNVERIFIED } else { "" };
            names.push(format!("{}{mark}", one.of.as_deref().unwrap_or_default()));
            charts.push((&one.chart, active));
        }
        let charts: Vec<_> =
            names.iter().zip(charts).map(|(name, (chart, active))| (name.as_str(), chart, active)).collect();
        let name = all.first().map_or("", |one| one.name.as_str());
        self.write(context, &draw::coordinators(&format!("{name}: coordinators"), &charts))
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
        let states = match &read.of {
            Some(of) => &status["coordinators"][of.as_str()],
            None => &status["coordinator"],
        };
        let states = states.as_array().cloned().unwrap_or_default();
        Ok(states.iter().filter_map(|state| state.as_str().map(str::to_owned)).collect())
    }
}
