//! Why a script failed.

use super::super::Refused;
use crate::diagnostics::SourceMap;
use crate::model::Finding;
use std::path::PathBuf;

/// Why a script failed.
#[derive(Debug, thiserror::Error)]
pub enum ScriptFailure {
    /// The file cannot be read, is no text, or is too large.
    #[error("{}", .0.message)]
    Unreadable(Box<Finding>),
    /// It uses names that there are not. It was not begun.
    #[error("{}", told(findings))]
    Unknown {
        /// Each with its place.
        findings: Vec<Finding>,
        /// The script.
        sources: Box<SourceMap>,
    },
    /// It does not parse, or it raised an error; the text names file and line.
    #[error("{message}")]
    Lua {
        /// What happened.
        message: String,
        /// Whether it is the text that is wrong.
        syntax: bool,
    },
    /// A parameter was given that neither it nor a deployment of its reads.
    #[error("{message}")]
    Unread {
        /// Which.
        message: String,
    },
    /// It ran to its end, and figures of it are out of their bounds; the text names file and line of each.
    #[error("{message}")]
    Missed {
        /// Which.
        message: String,
    },
    /// A deployment it loads is refused.
    #[error("{path} is refused")]
    Refused {
        /// The deployment.
        path: PathBuf,
        /// With its findings.
        refused: Box<Refused>,
    },
}

/// What `deploy` raises.
#[derive(Debug, thiserror::Error)]
#[error("{0} is refused")]
pub(super) struct IsRefused(pub String);

/// Findings in one line, each with what to do.
fn told(findings: &[Finding]) -> String {
    let one = |finding: &Finding| match &finding.help {
        Some(help) => format!("{}: {help}", finding.message),
        None => finding.message.clone(),
    };
    findings.iter().map(one).collect::<Vec<_>>().join("; ")
}
