//! `davit convert`

use super::exit::Exit;
use super::input::{Parameters, is_deployment};
use super::{Answer, Context, Failure, Run, write_output};
use crate::diagnostics::Language;
use crate::lang::{self, Sources};
use std::path::PathBuf;

/// Write the same model in the other language.
///
/// A file of configurations, of monitors, or a coordinator's file becomes one text. Of a deployment, all files are written: with `-o
/// DIR` into that directory, else one after the other, each below a comment with its name. Comments, loops and parameters
/// of the original are not part of the model.
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
    /// SCXML, for coordinators. The outermost state wins here, the innermost there; functions are left out.
    Scxml,
}

impl Run for Args {
    fn run(self, context: &Context) -> Answer {
        let language = match self.to {
            To::Lua => Language::Lua,
            To::Yaml => Language::Yaml,
            To::Scxml => Language::Scxml,
        };
        if is_deployment(&self.file) {
            let loaded = lang::load(&self.file, &self.parameters.options()?);
            let Some(deployment) = loaded.deployment else {
                let exit = if loaded.unreadable { Exit::Usage } else { Exit::No };
                return Err(Failure { exit, findings: loaded.findings, sources: loaded.sources, ..Failure::default() });
            };
            context.out.findings(&loaded.findings, &loaded.sources);
            for (name, text) in lang::print::deployment(&deployment, language) {
                match &self.output {
                    Some(directory) => write_output(context, Some(&directory.join(&name)), &text)?,
                    None => {
                        let comment = if name.ends_with(".lua") { "--" } else { "#" };
                        context.out.text(format!("{comment} {name}\n{text}\n"));
                    }
                }
            }
            return Ok(Exit::Done);
        }
        let converted = lang::convert(&Sources::Disk, &self.file, language, &self.parameters.options()?);
        let Some(text) = converted.text else {
            let exit = if converted.unreadable { Exit::Usage } else { Exit::No };
            return Err(Failure {
                exit,
                findings: converted.findings,
                sources: converted.sources,
                ..Failure::default()
            });
        };
        context.out.findings(&converted.findings, &converted.sources);
        write_output(context, self.output.as_deref(), &text)?;
        Ok(Exit::Done)
    }
}
