//! What a check comes to.

use crate::model::{Finding, Severity, finding};
use serde::Serialize;

/// What a check comes to: the first that applies of refused, warnings, followed, sound.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CheckVerdict {
    /// Everything was followed, and nothing was found but notes.
    Sound,
    /// Nothing was found but notes, as far as it was followed.
    Followed {
        /// What was left out, one bound each.
        left: Vec<String>,
    },
    /// There are warnings.
    Warnings,
    /// There are errors: it is not started.
    Refused,
}

impl CheckVerdict {
    /// What these findings come to. `whole`: there was something to follow; `left` tells what was left out.
    pub(super) fn of(findings: &[Finding], whole: bool, left: Vec<String>) -> Self {
        if finding::has_errors(findings) || !whole {
            Self::Refused
        } else if findings.iter().any(|finding| finding.severity == Severity::Warning) {
            Self::Warnings
        } else if left.is_empty() {
            Self::Sound
        } else {
            Self::Followed { left }
        }
    }

    /// Its word in JSON.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Sound => "sound",
            Self::Followed { .. } => "followed",
            Self::Warnings => "warnings",
            Self::Refused => "refused",
        }
    }

    /// It in words.
    pub fn text(&self) -> &'static str {
        match self {
            Self::Sound => "sound",
            Self::Followed { .. } => "sound as far as followed",
            Self::Warnings => "has warnings",
            Self::Refused => "refused",
        }
    }

    /// The same with further findings.
    #[must_use]
    pub fn with(self, findings: &[Finding]) -> Self {
        match Self::of(findings, true, Vec::new()) {
            Self::Refused => Self::Refused,
            Self::Warnings if self != Self::Refused => Self::Warnings,
            _ => self,
        }
    }
}
