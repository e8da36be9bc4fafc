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
    #[error("{}", findings.iter().map(Finding::in_a_line).collect::<Vec<_>>().join("; "))]
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

/// How many reasons are told to a script that catches a refusal.
const REASONS: usize = 8;

/// What `deploy` raises: who catches it is told why.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct IsRefused(String);

impl IsRefused {
    /// That a deployment is, and why: a line for each error, with its place.
    pub fn of(file: &str, refused: &Refused) -> Self {
        let errors = || refused.findings.iter().filter(|finding| finding.is_error());
        let placed = |finding: &Finding| {
            let place = refused.sources.locate(finding.origin);
            let place = place.map(|at| format!("{}:{}: ", refused.sources.file(at.file).name, at.line));
            format!("\n  {}{}", place.unwrap_or_default(), finding.in_a_line())
        };
        let told: String = errors().take(REASONS).map(placed).collect();
        let more = errors().count().saturating_sub(REASONS);
        let more = if more > 0 { format!("\n  and {more} more") } else { String::new() };
        Self(format!("{file} is refused{told}{more}"))
    }
}
