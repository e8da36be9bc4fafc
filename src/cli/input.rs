//! What commands read: a deployment with all its files, or a coordinator alone; with the findings that keep a command
//! from its work.

use super::exit::Exit;
use super::{Context, Failure};
use crate::check::{self, Report};
use crate::diagnostics::SourceMap;
use crate::lang::{self, LoadOptions, Sources};
use crate::model::codes::{CLI_BAD_SET, DEPLOY_UNKNOWN_LIBRARY};
use crate::model::finding::did_you_mean;
use crate::model::{Catalogue, Deployment, Finding, Findings, Statechart};
use crate::runtime::Libraries;
use std::path::{Path, PathBuf};

/// The file a command works on, and its parameters.
#[derive(Debug, Clone, clap::Args)]
pub struct Input {
    /// The deployment file.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    #[command(flatten)]
    pub parameters: Parameters,
}

/// Parameters of the files.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct Parameters {
    /// Give a parameter another value than `with:` does.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
}

/// A deployment that was read, with all that it may use. Nothing is checked yet.
#[derive(Debug)]
pub struct Read {
    /// The deployment.
    pub deployment: Deployment,
    /// The component types of its libraries and those it declares.
    pub catalogue: Catalogue,
    /// The libraries it names.
    pub libraries: Libraries,
    /// Its texts.
    pub sources: SourceMap,
    /// What reading found; no errors among them.
    pub findings: Findings,
}

/// A deployment in which nothing was found that refuses it.
#[derive(Debug)]
pub struct Checked {
    /// The deployment.
    pub deployment: check::Checked<Deployment>,
    /// The component types it may use.
    pub catalogue: Catalogue,
    /// The libraries it names.
    pub libraries: Libraries,
    /// Its texts.
    pub sources: SourceMap,
}

impl Checked {
    /// The deployment.
    pub fn deployment(&self) -> &Deployment {
        &self.deployment
    }
}

impl Parameters {
    /// As the loader wants them.
    ///
    /// # Errors
    /// When one is not of the form `NAME=VALUE`.
    pub fn options(&self) -> Result<LoadOptions, Failure> {
        let mut set = Vec::new();
        for text in &self.set {
            let Some((name, value)) = text.split_once('=').filter(|(name, _)| !name.trim().is_empty()) else {
                return Err(Failure::usage(
                    CLI_BAD_SET,
                    format!("`--set {text}` gives no parameter a value"),
                    "write `--set NAME=VALUE`, such as `--set gains.k=2.5`",
                ));
            };
            set.push((name.trim().to_owned(), value.to_owned()));
        }
        Ok(LoadOptions { set })
    }
}

impl Input {
    /// Reads the deployment.
    ///
    /// # Errors
    /// What is wrong with its texts, or a library that this program does not have.
    pub fn read(&self, context: &Context) -> Result<Read, Failure> {
        let loaded = lang::load(&self.file, &self.parameters.options()?);
        let mut findings = loaded.findings;
        let Some(deployment) = loaded.deployment else {
            let exit = if loaded.unreadable { Exit::Usage } else { Exit::No };
            return Err(Failure { exit, findings, sources: loaded.sources, ..Failure::default() });
        };
        let libraries = match context.libraries.select(&deployment.libraries) {
            Ok(libraries) => libraries,
            Err(name) => {
                let known: Vec<String> = context.libraries.iter().map(|l| l.name().to_string()).collect();
                findings.push(
                    Finding::error(DEPLOY_UNKNOWN_LIBRARY, format!("this program has no component library `{name}`"))
                        .at(deployment.key_origin("libraries"))
                        .path("libraries")
                        .help(did_you_mean(name.as_str(), "libraries", known.iter().map(String::as_str))),
                );
                return Err(Failure { exit: Exit::No, findings, sources: loaded.sources, ..Failure::default() });
            }
        };
        let mut catalogue = libraries.catalogue();
        for ty in &deployment.types {
            catalogue.insert(ty.clone());
        }
        Ok(Read { deployment, catalogue, libraries, sources: loaded.sources, findings })
    }

    /// Reads the deployment and checks it.
    ///
    /// # Errors
    /// What reading or checking found.
    pub fn check(&self, context: &Context) -> Result<Checked, Failure> {
        let read = self.read(context)?;
        let Report { checked, mut findings, .. } = check::run(&read.deployment, &read.catalogue);
        let Some(deployment) = checked else {
            findings.extend(read.findings);
            return Err(Failure { exit: Exit::No, findings, sources: read.sources, ..Failure::default() });
        };
        Ok(Checked { deployment, catalogue: read.catalogue, libraries: read.libraries, sources: read.sources })
    }
}

/// A coordinator read from its own file, or from a deployment that names it.
#[derive(Debug)]
pub struct Coordinator {
    /// A name to show: the file's without its ending.
    pub name: String,
    /// The coordinator.
    pub chart: Statechart,
    /// Its texts.
    pub sources: SourceMap,
    /// What reading found; no errors among them.
    pub findings: Findings,
}

/// Reads a coordinator.
///
/// # Errors
/// What is wrong with the texts.
pub fn coordinator(path: &Path, parameters: &Parameters) -> Result<Coordinator, Failure> {
    let options = parameters.options()?;
    let name = path.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    if is_deployment(path) {
        let loaded = lang::load(path, &options);
        return match loaded.deployment {
            Some(d) => {
                Ok(Coordinator { name, chart: d.coordinator, sources: loaded.sources, findings: loaded.findings })
            }
            None => Err(unread(loaded.findings, loaded.sources, loaded.unreadable)),
        };
    }
    let loaded = lang::load_coordinator(&Sources::Disk, path, &options);
    match loaded.coordinator {
        Some(chart) => Ok(Coordinator { name, chart, sources: loaded.sources, findings: loaded.findings }),
        None => Err(unread(loaded.findings, loaded.sources, loaded.unreadable)),
    }
}

fn unread(findings: Findings, sources: SourceMap, unreadable: bool) -> Failure {
    let exit = if unreadable { Exit::Usage } else { Exit::No };
    Failure { exit, findings, sources, ..Failure::default() }
}

/// Whether a file is a deployment: YAML with the key `davit` at the beginning of a line.
pub fn is_deployment(path: &Path) -> bool {
    let yaml = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("yaml") || e.eq_ignore_ascii_case("yml"));
    yaml && Sources::Disk
        .read(path)
        .is_ok_and(|text| text.lines().any(|l| l.starts_with("davit:") || l.starts_with("davit :")))
}
