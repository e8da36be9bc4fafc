//! `davit convert`

use super::exit::Exit;
use super::input::{Parameters, is_deployment, unread};
use super::{CommandContext, CommandFailure, CommandResult, Run, write_output};
use crate::diagnostics::Language;
use crate::lang::{self, LoadOptions, Sources};
use crate::model::codes::{CLI_OVERWRITES, CLI_UNWRITABLE, CONVERT_FUNCTIONS, CONVERT_SUBSYSTEMS};
use crate::model::{Finding, Findings, Statechart};
use crate::statechart::compile;
use std::path::{Path, PathBuf};

/// Write the same model in another language.
///
/// A file of configurations, of monitors, or a coordinator's file becomes one text. Of a deployment, all files are written: with `-o
/// DIR` into that directory, else one after the other, each below a comment with its name. Comments, loops and parameters
/// of the original are not part of the model.
///
/// A coordinator with functions of Lua cannot be written in another language. Of a deployment it stays the file that it is,
/// with the files that it loads; alone it is written in SCXML only, without its functions and with a warning for each place.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Configurations, monitors, a coordinator, or a deployment.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The language to write.
    #[arg(long, value_enum, value_name = "LANGUAGE")]
    to: To,
    /// Write to this file (of a deployment: into this directory) instead of printing.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Of a deployment: write over files that are there with another text.
    #[arg(long, requires = "output")]
    force: bool,
    /// Stand in for the host of a coordinator with functions: run this Lua file before it. May be given again.
    #[arg(long, value_name = "FILE")]
    host: Vec<PathBuf>,
    #[command(flatten)]
    parameters: Parameters,
}

/// A language to write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum To {
    /// Lua, as in the paper.
    Lua,
    /// YAML.
    Yaml,
    /// SCXML, for coordinators. The outermost state wins here, the innermost there; functions are left out, with warnings.
    Scxml,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let language = match self.to {
            To::Lua => Language::Lua,
            To::Yaml => Language::Yaml,
            To::Scxml => Language::Scxml,
        };
        if is_deployment(&self.file) {
            let loaded = lang::load(&self.file, &self.parameters.options()?);
            let Some(deployment) = loaded.deployment else {
                return Err(unread(loaded.findings, loaded.sources, loaded.unreadable));
            };
            if let Some(subsystem) = deployment.subsystems.first() {
                let message = format!("the deployment has subsystems, as `{}` of `{}`", subsystem.name, subsystem.file);
                let help =
                    "convert their files, and the files of configurations and the coordinator that this one names";
                return Err(CommandFailure::no(CONVERT_SUBSYSTEMS, message, help));
            }
            let broken = deployment.charts().flat_map(errors).collect();
            let broken = one_list(loaded.findings.clone(), broken);
            broken.map_or(Ok(()), |all| Err(CommandFailure::found(all, loaded.sources.clone())))?;
            context.out.findings(&loaded.findings, &loaded.sources);
            for (name, file) in lang::print::kept(&deployment) {
                let message = format!("the coordinator `{name}` has functions: it stays Lua as it is, in `{file}`");
                let help = "a coordinator with functions cannot be written in another language; docs/from-rfsm.md says how to make it pure";
                let finding = Finding::info(CONVERT_FUNCTIONS, message).help(help);
                context.out.findings(&[finding], &loaded.sources);
            }
            let texts = lang::print::deployment(&deployment, language);
            match &self.output {
                Some(directory) => write_all(context, directory, &texts, self.force)?,
                None => {
                    for (name, text) in texts {
                        let comment = if name.ends_with(".lua") { "--" } else { "#" };
                        context.out.text(format!("{comment} {name}\n{text}\n"));
                    }
                }
            }
            return Ok(Exit::Done);
        }
        let options = LoadOptions { trusted: true, host: self.host, ..self.parameters.options()? };
        let converted = lang::convert(&Sources::Disk, &self.file, language, &options);
        let Some(text) = converted.text else {
            return Err(unread(converted.findings, converted.sources, converted.unreadable));
        };
        let broken = converted.coordinator.iter().flat_map(errors).collect();
        if let Some(all) = one_list(converted.findings.clone(), broken) {
            return Err(CommandFailure::found(all, converted.sources));
        }
        context.out.findings(&converted.findings, &converted.sources);
        write_output(context, self.output.as_deref(), &text)?;
        Ok(Exit::Done)
    }
}

/// Writes files of these names into a directory. Nobody has chosen them: unless it is forced, none is written over with another text.
fn write_all(
    context: &CommandContext,
    directory: &Path,
    texts: &[(String, String)],
    force: bool,
) -> Result<(), CommandFailure> {
    let unlike = |(name, text): &&(String, String)| {
        let path = directory.join(name);
        let there = path.metadata().ok().filter(std::fs::Metadata::is_file);
        let same = |there: std::fs::Metadata| {
            there.len() == text.len() as u64 && std::fs::read(&path).is_ok_and(|there| there == text.as_bytes())
        };
        path.symlink_metadata().is_ok() && !there.is_some_and(same)
    };
    let is_no_file = |(name, _): &&(String, String)| {
        let path = directory.join(name);
        path.symlink_metadata().is_ok() && !path.is_file()
    };
    if let Some((name, _)) = texts.iter().find(is_no_file) {
        return Err(CommandFailure::usage(
            CLI_UNWRITABLE,
            format!("{}: it is no file; nothing was written", directory.join(name).display()),
            "name another directory",
        ));
    }
    let others: Vec<String> = texts.iter().filter(unlike).map(|(name, _)| format!("`{name}`")).collect();
    if !force && !others.is_empty() {
        let (is, them) = if others.len() == 1 { ("is", "it") } else { ("are", "them") };
        return Err(CommandFailure::usage(
            CLI_OVERWRITES,
            format!(
                "{}: {} {is} there, with another text; nothing was written",
                directory.display(),
                others.join(", ")
            ),
            format!("name another directory, or write over {them} with `--force`"),
        ));
    }
    // Why it cannot be made is said of the first file that cannot be written.
    _ = std::fs::create_dir_all(directory);
    for (name, text) in texts {
        let path = directory.join(name);
        // Files of a coordinator that is kept lie in folders.
        if let Some(folder) = path.parent().filter(|folder| *folder != directory) {
            _ = std::fs::create_dir_all(folder);
        }
        write_output(context, Some(&path), text)?;
    }
    Ok(())
}

/// What is wrong with a coordinator by itself: a transition that leads nowhere cannot be written in each language.
pub(super) fn errors(chart: &Statechart) -> Findings {
    match compile(chart) {
        (Some(_), _) => Findings::new(),
        (None, found) => found.into_iter().filter(Finding::is_error).collect(),
    }
}

/// Both, where something is wrong.
fn one_list(mut findings: Findings, broken: Findings) -> Option<Findings> {
    (!broken.is_empty()).then(|| {
        findings.extend(broken);
        findings
    })
}
