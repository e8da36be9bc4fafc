//! What commands read: a deployment with all its files, or a coordinator alone; with the findings that keep a command
//! from its work.

use super::budget::Following;
use super::exit::Exit;
use super::inside::Inside;
use super::signals::NothingBegan;
use super::{CommandContext, CommandFailure};
use crate::app::{self, Checked, Read, Refused};
use crate::diagnostics::SourceMap;
use crate::lang::{self, LoadOptions, Sources};
use crate::model::codes::{CLI_BAD_SET, CLI_WHICH_COORDINATOR};
use crate::model::finding::did_you_mean;
use crate::model::{CoordinatorNaming, Deployment, Findings, Program, Statechart};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The file a command works on, and its parameters.
#[derive(Debug, Clone, clap::Args)]
pub struct CommandInput {
    /// The deployment file.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    #[command(flatten)]
    #[allow(missing_docs)] // a doc comment here would become the help of the whole command
    pub parameters: Parameters,
}

/// Parameters of the files.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct Parameters {
    /// Give a parameter another value than `with:` does.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
}

impl Parameters {
    /// As the loader wants them.
    ///
    /// # Errors
    /// When one is not of the form `NAME=VALUE`.
    pub fn options(&self) -> Result<LoadOptions, CommandFailure> {
        let mut set = Vec::new();
        for text in &self.set {
            let Some((name, value)) = text.split_once('=').filter(|(name, _)| !name.trim().is_empty()) else {
                return Err(CommandFailure::usage(
                    CLI_BAD_SET,
                    format!("`--set {text}` gives no parameter a value"),
                    "write `--set NAME=VALUE`, such as `--set gains.k=2.5`",
                ));
            };
            set.push((name.trim().to_owned(), value.to_owned()));
        }
        Ok(LoadOptions { set, ..LoadOptions::default() })
    }
}

impl CommandInput {
    /// Reads the deployment.
    ///
    /// # Errors
    /// What is wrong with its texts, or a library that this program does not have.
    pub fn read(&self, context: &CommandContext) -> Result<Read, CommandFailure> {
        Ok(app::read(&self.file, &self.parameters.options()?, &context.extensions)?)
    }

    /// Reads the deployment to work with some of its configurations: a mistake in the text of another does not refuse it.
    ///
    /// # Errors
    /// What else is wrong with its texts, or a library that this program does not have.
    pub fn read_but_for(&self, context: &CommandContext) -> Result<Read, CommandFailure> {
        Ok(app::read_but_for(&self.file, &self.parameters.options()?, &context.extensions)?)
    }

    /// Reads the deployment and checks it; a line on a terminal tells how far that is, unless `silent`.
    ///
    /// # Errors
    /// What reading or checking found.
    pub fn check(&self, context: &CommandContext, silent: bool) -> Result<Checked, CommandFailure> {
        let read = self.read(context)?;
        let following = Following::before_acting(silent);
        let _nothing = NothingBegan::watch();
        let goes_on = |far| {
            following.tell(far);
            Ok(())
        };
        app::check_while(read, false, &goes_on).map_err(|refused| {
            let others = Some(self.checked_by());
            CommandFailure { others, ..refused.into() }
        })
    }

    /// The command that shows all that is found in it.
    pub fn checked_by(&self) -> String {
        let set: String = self.parameters.set.iter().map(|set| format!(" --set {set}")).collect();
        format!("`davit check {}{set}`", self.file.display())
    }
}

impl From<Refused> for CommandFailure {
    fn from(refused: Refused) -> Self {
        unread(refused.findings, refused.sources, refused.unreadable)
    }
}

/// A coordinator read from its own file, or from a deployment that names it.
#[derive(Debug)]
pub struct CoordinatorInput {
    /// A name to show: the file's without its ending.
    pub name: String,
    /// The deployment that names it, if it was read from one.
    pub deployment: Option<String>,
    /// Its name in a deployment, or in the subsystem that is looked into.
    pub of: Option<String>,
    /// The same from outside, by which the running deployment knows it.
    pub full: Option<String>,
    /// The path of the subsystem whose it is; empty: it is of the file that is looked into.
    pub path: String,
    /// The coordinator.
    pub chart: Statechart,
    /// The same by the names of its own file.
    pub in_file: Statechart,
    /// Its texts, when it has functions.
    pub program: Option<Arc<Program>>,
    /// Its texts.
    pub sources: SourceMap,
    /// What reading found; no errors among them.
    pub findings: Findings,
}

/// Reads a coordinator, the only one or the one that `of` names. A file given by hand is trusted to have functions (nothing
/// is open to them); in a deployment `trusted:` says so. `host` are files that stand in for its host.
///
/// # Errors
/// What is wrong with the texts; and when there are several and none is named.
pub fn coordinator(
    path: &Path,
    parameters: &Parameters,
    inside: &Inside,
    of: Option<&str>,
    host: &[PathBuf],
) -> Result<CoordinatorInput, CommandFailure> {
    let mut all = coordinators(path, parameters, inside, of, host)?;
    match (all.pop(), all.is_empty()) {
        (Some(only), true) => Ok(only),
        (last, _) => Err(which(all.iter().chain(&last))),
    }
}

/// That it is to be said which of several coordinators is meant.
pub fn which<'a>(all: impl Iterator<Item = &'a CoordinatorInput>) -> CommandFailure {
    let names: Vec<&str> = all.filter_map(|one| one.of.as_deref()).collect();
    CommandFailure::usage(
        CLI_WHICH_COORDINATOR,
        format!("the deployment has {} coordinators", names.len()),
        format!("say which one: `--of NAME`, with one of {}", names.join(", ")),
    )
}

/// The same, but all of them when none is named.
///
/// # Errors
/// What is wrong with the texts; and when there is none of that name.
pub fn coordinators(
    path: &Path,
    parameters: &Parameters,
    inside: &Inside,
    of: Option<&str>,
    host: &[PathBuf],
) -> Result<Vec<CoordinatorInput>, CommandFailure> {
    let options = LoadOptions { trusted: true, host: host.to_vec(), ..parameters.options()? };
    let name = path.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    if is_deployment(path) {
        let loaded = lang::load(path, &options);
        let Some(d) = loaded.deployment else {
            return Err(unread(loaded.findings, loaded.sources, loaded.unreadable));
        };
        let all = d.all_subsystems();
        let region = inside.among(all.iter().map(|(path, _)| path.as_str()))?;
        let inside = all.iter().find(|(path, _)| region.as_ref().is_some_and(|region| region.path() == path.as_str()));
        let file: &Deployment = inside.map_or(&d, |(_, subsystem)| &subsystem.own);
        let named: Vec<CoordinatorInput> = file
            .coordinators
            .iter()
            .map(|own| {
                let alone = own.of.is_none() && own.written == CoordinatorNaming::Alone;
                let (of, full) = match &region {
                    // It is called like its file's deployment there, and like the subsystem outside.
                    Some(region) if alone => (region.last().to_owned(), region.path().to_owned()),
                    Some(region) => (own.name.to_string(), region.full(own.name.as_str())),
                    None => (own.name.to_string(), own.name.to_string()),
                };
                CoordinatorInput {
                    name: region.as_ref().map_or_else(|| name.clone(), |region| format!("{name}/{}", region.path())),
                    deployment: Some(d.name.to_string()),
                    of: Some(of),
                    full: Some(full),
                    path: own.of.map_or_else(String::new, |path| path.to_string()),
                    program: file.programs.get(&own.name).cloned(),
                    in_file: file.in_its_file(own).chart.clone(),
                    chart: own.chart.clone(),
                    sources: loaded.sources.clone(),
                    findings: loaded.findings.clone(),
                }
            })
            .collect();
        let known: Vec<&str> = named.iter().filter_map(|one| one.of.as_deref()).collect();
        if let Some(of) = of.filter(|of| !known.contains(of)) {
            let help = did_you_mean(of, "coordinators", known);
            return Err(CommandFailure::usage(CLI_WHICH_COORDINATOR, format!("there is no coordinator `{of}`"), help));
        }
        return Ok(named.into_iter().filter(|one| of.is_none() || one.of.as_deref() == of).collect());
    }
    // A file of its own is in no subsystem.
    inside.among([])?;
    let loaded = lang::load_coordinator(&Sources::Disk, path, &options);
    match loaded.coordinator {
        Some(chart) => {
            let (program, sources, findings) = (loaded.program, loaded.sources, loaded.findings);
            let of = of.map(str::to_owned);
            let (full, path, in_file) = (of.clone(), String::new(), chart.clone());
            let deployment = None;
            Ok(vec![CoordinatorInput { name, deployment, of, full, path, in_file, chart, program, sources, findings }])
        }
        None => Err(unread(loaded.findings, loaded.sources, loaded.unreadable)),
    }
}

/// What was found instead of what is read: usage where a text could not be read at all.
pub fn unread(findings: Findings, sources: SourceMap, unreadable: bool) -> CommandFailure {
    let exit = if unreadable { Exit::Usage } else { Exit::No };
    CommandFailure { exit, findings, sources, others: None }
}

/// Whether a file is a deployment: YAML with the key `davit` at the beginning of a line.
pub fn is_deployment(path: &Path) -> bool {
    let yaml = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("yaml") || e.eq_ignore_ascii_case("yml"));
    yaml && Sources::Disk
        .read(path)
        .is_ok_and(|text| text.lines().any(|l| l.starts_with("davit:") || l.starts_with("davit :")))
}
