//! Exit codes of every command (docs/operating.md).

use crate::session::Ended;
use std::process::ExitCode;

/// How a command ended, for the shell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use]
pub enum Exit {
    /// Done, or the answer is yes.
    Done = 0,
    /// The answer is no: findings, failed and rolled back.
    No = 1,
    /// Usage, or input that cannot be read: a missing file, text that does not parse.
    Usage = 2,
    /// The system is broken: it is neither as before nor as wanted.
    Broken = 3,
    /// It was shut down otherwise than in order: without the coordinator, by force, or incompletely.
    Forced = 4,
}

impl Exit {
    /// How a command ends whose deployment was stopped so, and that would have ended with `well` had that gone in order.
    pub fn of_stop(ended: &Ended, well: Self) -> Self {
        if ended.is_orderly() { well } else { Self::Forced }
    }

    /// Of the ends of several things the one that tells most: broken, died or forced, no, done.
    pub fn worst(all: impl IntoIterator<Item = Self>) -> Self {
        let order = [Self::Done, Self::No, Self::Usage, Self::Forced, Self::Broken];
        let place = |exit: &Self| order.iter().position(|of| of == exit);
        all.into_iter().max_by_key(place).unwrap_or(Self::Done)
    }

    /// The number.
    pub fn code(self) -> u8 {
        self as u8
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit.code())
    }
}
