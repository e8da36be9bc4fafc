//! From files to a checked deployment.

use super::platforms::{Extensions, PlatformMaker};
use crate::check::{self, Effort, Far, Halt, Report};
use crate::diagnostics::SourceMap;
use crate::lang::{self, LoadOptions, Loaded};
use crate::libraries::monitors;
use crate::model::codes::DEPLOY_UNKNOWN_LIBRARY;
use crate::model::finding::{and_also, did_you_mean};
use crate::model::{Catalogue, Deployment, Finding, Findings, Ident};
use crate::runtime::Libraries;
use std::collections::BTreeMap;
use std::path::Path;

/// A deployment that was read, with all that it may use. Nothing is checked yet.
#[derive(Debug, Clone)]
pub struct Read<D = Deployment> {
    /// The deployment.
    pub deployment: D,
    /// The component types of its libraries, and those it declares beside them.
    pub catalogue: Catalogue,
    /// The libraries it names.
    pub libraries: Libraries,
    /// The platform it names.
    pub platform: PlatformMaker,
    /// Its texts.
    pub sources: SourceMap,
    /// What reading found; no errors among them, or (of `read_but_for`) only such as are about single configurations. Of one that
    /// was checked also what that found.
    pub findings: Findings,
}

/// A deployment in which nothing was found that refuses it.
pub type Checked = Read<check::Accepted<Deployment>>;

/// Why a deployment is refused.
#[derive(Debug)]
pub struct Refused {
    /// What was found.
    pub findings: Findings,
    /// The texts it is about.
    pub sources: SourceMap,
    /// Whether a text could not be read or parsed at all, rather than being judged.
    pub unreadable: bool,
}

/// Reads a deployment with all the files it names.
///
/// # Errors
/// [`Refused`] with what is wrong in its texts, or a library or platform that this program does not have.
pub fn read(path: &Path, options: &LoadOptions, extensions: impl Into<Extensions>) -> Result<Read, Refused> {
    read_for(path, options, extensions, None)
}

/// The same on another platform of the program than the one that the deployment names.
///
/// # Errors
/// As [`read`].
pub fn read_for(
    path: &Path,
    options: &LoadOptions,
    extensions: impl Into<Extensions>,
    platform: Option<Ident>,
) -> Result<Read, Refused> {
    read_loaded(lang::load(path, options), &extensions.into(), platform)
}

/// Reads a deployment for those who work with some of its configurations: what is wrong in the texts of single ones does
/// not refuse it. The errors among [`Read::findings`] say which these are ([`crate::model::finding::configuration`]); what
/// could not be read of them is missing in the deployment.
///
/// # Errors
/// [`Refused`] with what else is wrong in its texts, or a library or platform that this program does not have.
pub fn read_but_for(path: &Path, options: &LoadOptions, extensions: impl Into<Extensions>) -> Result<Read, Refused> {
    let mut loaded = lang::load(path, options);
    loaded.deployment = loaded.deployment.or(loaded.but_for.take());
    read_loaded(loaded, &extensions.into(), None)
}

fn read_loaded(loaded: Loaded, extensions: &Extensions, other: Option<Ident>) -> Result<Read, Refused> {
    let mut findings = loaded.findings;
    let Some(mut deployment) = loaded.deployment else {
        return Err(Refused { findings, sources: loaded.sources, unreadable: loaded.unreadable });
    };
    let libraries = match extensions.libraries.select(&deployment.libraries) {
        Ok(libraries) => libraries,
        Err(name) => {
            let known: Vec<&str> = extensions.libraries.iter().map(|l| l.name().as_str()).collect();
            findings.push(
                Finding::error(DEPLOY_UNKNOWN_LIBRARY, format!("this program has no component library `{name}`"))
                    .at(deployment.key_origin("libraries"))
                    .path("libraries")
                    .help(and_also(
                        &did_you_mean(name.as_str(), "libraries", known),
                        "others are brought by a program of one's own, as `examples/scara` is one (`docs/scara.md`)",
                    )),
            );
            return Err(Refused { findings, sources: loaded.sources, unreadable: false });
        }
    };
    // The monitors are a component type of this deployment.
    let libraries = monitors::added_to(libraries, &deployment.monitors);
    if let Some(other) = other.filter(|other| *other != deployment.platform) {
        // Its options are those of the platform that it names.
        (deployment.platform, deployment.platform_options) = (other, BTreeMap::new());
    }
    let platform = match extensions.platform_of(&mut deployment) {
        Ok(platform) => platform,
        Err(wrong) => {
            findings.extend(wrong);
            return Err(Refused { findings, sources: loaded.sources, unreadable: false });
        }
    };
    let mut catalogue = libraries.catalogue();
    // What a library has is what runs: a declaration of it is held against that (`check`).
    for ty in &deployment.types {
        if catalogue.get(ty.name).is_none() {
            catalogue.insert(ty.clone());
        }
    }
    Ok(Read { deployment, catalogue, libraries, platform, sources: loaded.sources, findings })
}

/// Checks a deployment that was read.
///
/// # Errors
/// [`Refused`] with everything that reading and checking found.
pub fn check(read: Read) -> Result<Checked, Refused> {
    checked(read, &|_| Ok(()), |report| report.checked.take())
}

/// The same as long as it `goes_on`: told every few milliseconds how far it is. Where it does not it ends, and says nothing of the deployment.
/// One `to_replay` is to go a way that `davit check` found, on the simulated platform: what was found by following its coordinators does not
/// refuse it.
///
/// # Errors
/// [`Refused`] with all findings.
pub fn check_while(
    read: Read,
    to_replay: bool,
    goes_on: &(dyn Fn(Far) -> Result<(), Halt> + Sync),
) -> Result<Checked, Refused> {
    checked(read, goes_on, |report| if to_replay { report.replayed.take() } else { report.checked.take() })
}

fn checked(
    read: Read,
    goes_on: &(dyn Fn(Far) -> Result<(), Halt> + Sync),
    take: impl FnOnce(&mut Report) -> Option<check::Accepted<Deployment>>,
) -> Result<Checked, Refused> {
    let Read { deployment, catalogue, libraries, platform, sources, findings: before } = read;
    let mut report = check::run_with(deployment, &catalogue, Effort { goes_on, ..Effort::default() });
    let taken = take(&mut report);
    let mut findings = report.findings;
    findings.extend(before);
    match taken {
        Some(deployment) => Ok(Read { deployment, catalogue, libraries, platform, sources, findings }),
        None => Err(Refused { findings, sources, unreadable: false }),
    }
}
