//! What a check comes to.

use super::explore::Bound;
use super::state::Failed;
use crate::limits;
use crate::model::{Finding, Severity, finding};
use serde::Serialize;

/// What a check comes to: the first that applies of refused, warnings, followed, sound.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
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

impl Verdict {
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

impl Bound {
    /// What a bound left out; `failed` is what had to fail before, at least, and so many batches of a coordinator waited.
    pub(super) fn told(self, failed: Failed, most_waiting: usize) -> String {
        let what = match self {
            Self::Budget => format!("the budget of {} transitions was used up", limits::CHECK_TRANSITIONS),
            Self::Waiting => {
                format!("more than {most_waiting} batches of one coordinator that wait at once were not followed")
            }
            Self::Lean => {
                return "behind an undo that failed, only one batch of a coordinator at a time was followed".to_owned();
            }
            Self::Piled => format!("more than {} requests that wait were not followed", limits::CHECK_PILED),
            Self::Frames => {
                format!("more than {} frames of one configuration were not followed", limits::CHECK_FRAMES)
            }
            Self::Inbox => format!("more than {} events between coordinators were not followed", limits::CHECK_INBOX),
            Self::Forks => format!(
                "a step that asks for more than {} things, or that may meet what is under way in more than {} ways, was not \
                 followed to its end",
                limits::CHECK_HANDED,
                limits::CHECK_FORKS
            ),
            Self::Entered => "a coordinator could not be entered".to_owned(),
        };
        let behind = match failed {
            Failed::Nothing => "",
            Failed::Apply => ", behind a request that failed",
            Failed::Undo => ", behind an undo that failed",
            Failed::Broken => ", behind something that broke",
        };
        format!("{what}{behind}")
    }
}
