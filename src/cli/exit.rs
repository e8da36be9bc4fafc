//! Exit codes of every command (design §13).

use std::process::ExitCode;

/// How a command ended, for the shell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use]
pub enum Exit {
    /// Done, or the answer is yes.
    Done,
    /// The answer is no: findings, failed and rolled back.
    No,
    /// Usage, or input that cannot be read: a missing file, text that does not parse.
    Usage,
    /// The system is broken: it is neither as before nor as wanted.
    Broken,
}

impl Exit {
    /// [`Exit::Done`]
    pub const DONE: u8 = 0;
    /// [`Exit::No`]
    pub const NO: u8 = 1;
    /// [`Exit::Usage`]
    pub const USAGE: u8 = 2;
    /// [`Exit::Broken`]
    pub const BROKEN: u8 = 3;

    /// The number.
    pub fn code(self) -> u8 {
        match self {
            Self::Done => Self::DONE,
            Self::No => Self::NO,
            Self::Usage => Self::USAGE,
            Self::Broken => Self::BROKEN,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit.code())
    }
}
