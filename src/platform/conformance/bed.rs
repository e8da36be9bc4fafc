//! What a platform brings to be tried.

use crate::platform::Platform;
use crate::time::Clock;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// What a component of the test type `Misbehaving` does in one of its hooks, or in its operation `work`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BedTrouble {
    /// The hook or operation answers an error.
    Fail,
    /// The hook panics (on a platform elsewhere: whatever makes its component faulted).
    Panic,
    /// The hook never returns, or so long after it was called.
    Hang(Option<Duration>),
    /// The operation takes [`Times::work`]; given up meanwhile it comes to rest within [`Times::rest`].
    Long,
    /// The operation takes [`Times::work`], and takes no notice of being given up.
    Deaf,
}

/// What a bed can make happen, beside steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ability {
    /// [`BedTrouble::Fail`] in hooks and in `work`.
    Fails,
    /// [`BedTrouble::Panic`] in hooks.
    Panics,
    /// [`BedTrouble::Hang`] in hooks, for ever.
    Hangs,
    /// [`BedTrouble::Hang`] in `create` and `destroy`.
    MakingHangs,
    /// [`BedTrouble::Hang`] with a time after which the call returns.
    HangsReturn,
    /// [`BedTrouble::Long`] in `work`.
    Works,
    /// [`BedTrouble::Deaf`] in `work`.
    Deaf,
    /// The operation `brake` runs beside its component's activity.
    Beside,
    /// A component raises an event.
    Raises,
}

impl fmt::Display for Ability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fails => "a component fails",
            Self::Panics => "a component panics",
            Self::Hangs => "a component hangs in a hook",
            Self::MakingHangs => "a component hangs while it is made, or dropped",
            Self::HangsReturn => "a component that hangs comes back",
            Self::Works => "an operation takes its time",
            Self::Deaf => "an operation does not hear that it is given up",
            Self::Beside => "an operation runs beside its component's activity",
            Self::Raises => "a component raises an event",
        })
    }
}

/// The times that the rules are tried with. On a simulated clock they cost nothing; on the real clock shorter ones are right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Times {
    /// How long a step may take, and how long a rule waits for what happens by itself.
    pub limit: Duration,
    /// How long the operation `work` takes where it is in trouble: several times [`Self::limit`].
    pub work: Duration,
    /// How long a component takes at most to come to rest.
    pub rest: Duration,
    /// How long after its deadline a call may answer.
    pub late: Duration,
}

impl Default for Times {
    fn default() -> Self {
        Self {
            limit: Duration::from_secs(1),
            work: Duration::from_secs(10),
            rest: Duration::from_millis(50),
            late: Duration::from_millis(100),
        }
    }
}

/// Lets the component of that name raise that event.
pub type BedRaise = Box<dyn Fn(&str, &str)>;

/// A platform to be tried.
pub struct UnderTest {
    /// The platform, with nothing on it.
    pub platform: Arc<dyn Platform>,
    /// The clock it runs on.
    pub clock: Clock,
    /// Lets the component of that name raise that event.
    pub raise: BedRaise,
    /// Whatever must live as long, the guard of a simulated clock among it.
    pub keep: Vec<Box<dyn std::any::Any>>,
}

/// How a platform is made to be tried.
pub trait Bed {
    /// A platform with nothing on it, with the types of [`types`](super::types()), on a clock that the calling thread has
    /// entered.
    ///
    /// In every component of type `Misbehaving` these hooks (`configure`, `start`, `stop`, `cleanup`), its making and its end
    /// (`create`, `destroy`: they only hang), or its operation `work` (`Fail`, `Long`, `Deaf`) are in trouble; it is always
    /// called `bad`. Its operation `brake` needs nothing of its activity.
    fn make(&self, trouble: &[(&'static str, BedTrouble)]) -> UnderTest;

    /// What it cannot make happen: rules that need it are skipped.
    fn cannot(&self) -> &[Ability] {
        &[]
    }

    /// The times to try with.
    fn times(&self) -> Times {
        Times::default()
    }
}
