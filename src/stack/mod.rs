//! What is in force: frames, and how they are taken back (design §5).
//!
//! Pure: a stack never touches a platform, and it never changes by itself. [`transaction`] decides everything beforehand
//! and gives the steps together with the stack as it will be; [`Stack::commit`] takes that over when the steps are done,
//! and dropping the transaction leaves the stack as it was.

mod net;
mod permanent;
mod prepared;
mod share;
mod squash;
#[cfg(test)]
mod tests;
mod transaction;

pub use net::reduce;
pub use permanent::may_commit;
pub use transaction::{Request, Transaction, transaction};

use crate::model::{ComponentName, ConfigId, Finding, Ident, codes};
use crate::plan::footprint::Footprint;
use crate::plan::prepare::Act;
use crate::plan::undo::Item;
use crate::plan::{PlannedStep, SavedValue};
use crate::time::Time;
use std::collections::BTreeSet;
use std::fmt;
use std::sync::Arc;

/// Who asked for a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Requester {
    /// A coordinator, by the name of its deployment or the path of its subsystem.
    Coordinator(ComponentName),
    /// Somebody at a terminal or behind the control socket.
    Operator,
}

impl fmt::Display for Requester {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Coordinator(name) => write!(f, "{name}"),
            Self::Operator => f.write_str("operator"),
        }
    }
}

impl serde::Serialize for Requester {
    fn serialize<S: serde::Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_str(self)
    }
}

/// The number of a frame; never used again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
pub struct FrameId(pub u64);

/// A configuration that is contained in a squashed or committed frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Part {
    /// The configuration.
    pub configuration: ConfigId,
    /// Who asked for it.
    pub requester: Requester,
    /// The group it belongs to.
    pub group: Option<Ident>,
}

/// How a frame is taken back.
#[derive(Debug, Clone, PartialEq)]
pub enum Inverse {
    /// By undoing its steps, last first.
    Steps(Vec<PlannedStep>),
    /// By this list: several frames squashed into one.
    List(Vec<Item>),
}

/// An applied configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Its number.
    pub id: FrameId,
    /// The configuration; of a squashed frame the newest one in it.
    pub configuration: ConfigId,
    /// The group it belongs to.
    pub group: Option<Ident>,
    /// Who asked.
    pub requester: Requester,
    /// When.
    pub at: Time,
    /// What was done, or, squashed, what takes it back.
    pub inverse: Inverse,
    /// What it wrote, demanded, and what its inverse needs.
    pub footprint: Footprint,
    /// What its absolute writes overwrote.
    pub saved: Vec<SavedValue>,
    /// Why undo does not pass it, if it does not.
    pub floor: Option<String>,
    /// What was squashed into it; empty for a frame of its own.
    pub parts: BTreeSet<Part>,
    /// Of a frame that a prepared switch pushed: the switch's acts.
    pub acts: Vec<Act>,
}

impl Frame {
    /// The steps it was applied with; none for a squashed frame.
    pub fn steps(&self) -> &[PlannedStep] {
        match &self.inverse {
            Inverse::Steps(steps) => steps,
            Inverse::List(_) => &[],
        }
    }

    /// Whether several frames were squashed into it.
    pub fn is_squashed(&self) -> bool {
        !self.parts.is_empty()
    }

    /// Why `by` must leave the frame alone: it was asked for by another coordinator. An operator may undo anybody's, and
    /// anybody an operator's.
    pub fn foreign_to(&self, by: Requester) -> Option<Finding> {
        let foreign = matches!((self.requester, by), (Requester::Coordinator(a), Requester::Coordinator(b)) if a != b);
        foreign.then(|| {
            let message =
                format!("`{}` is a frame of the coordinator `{}`, not of `{by}`", self.configuration, self.requester);
            Finding::error(codes::STACK_FOREIGN, message)
                .help(format!("only `{}` or an operator undoes it: ask it by an event", self.requester))
        })
    }

    fn part(&self) -> Part {
        Part { configuration: self.configuration, requester: self.requester, group: self.group }
    }
}

/// The frames in force, oldest first.
#[derive(Debug, Clone)]
pub struct Stack {
    frames: Vec<Arc<Frame>>,
    /// What was committed: below the first frame.
    committed: BTreeSet<Part>,
    /// Frames of states of the coordinator that are active.
    active: Vec<FrameId>,
    /// Popped frames of prepared switches, to be used again.
    spares: Vec<Arc<Frame>>,
    bound: usize,
    next: u64,
    version: u64,
}

impl Stack {
    /// An empty stack that squashes past `bound` frames (at least 2).
    pub fn new(bound: usize) -> Self {
        Self {
            frames: Vec::with_capacity(bound.clamp(2, 4096) + 1),
            committed: BTreeSet::new(),
            active: Vec::with_capacity(bound.clamp(2, 4096) + 1),
            spares: Vec::with_capacity(prepared::SPARES),
            bound: bound.max(2),
            next: 1,
            version: 0,
        }
    }

    /// The frames, oldest first.
    pub fn frames(&self) -> &[Arc<Frame>] {
        &self.frames
    }

    /// How many frames there are.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// The newest frame.
    pub fn top(&self) -> Option<&Arc<Frame>> {
        self.frames.last()
    }

    /// The frame of that number.
    pub fn frame(&self, id: FrameId) -> Option<&Arc<Frame>> {
        self.frames.iter().find(|f| f.id == id)
    }

    /// The newest frame of a configuration, by this requester or (none) by anyone. Squashed frames are not found.
    pub fn newest_of(&self, configuration: ConfigId, by: Option<Requester>) -> Option<&Arc<Frame>> {
        let fits = |f: &&Arc<Frame>| {
            f.configuration == configuration && !f.is_squashed() && by.is_none_or(|by| f.requester == by)
        };
        self.frames.iter().rev().find(fits)
    }

    /// Whether a configuration is in a squashed frame or was committed: in force, and not to be undone by itself.
    pub fn is_buried(&self, configuration: ConfigId, by: Option<Requester>) -> bool {
        let fits = |p: &Part| p.configuration == configuration && by.is_none_or(|by| p.requester == by);
        self.committed.iter().any(fits) || self.frames.iter().any(|f| f.parts.iter().any(fits))
    }

    /// Marks the frame of a state of the coordinator that is active (never squashed), or no longer is.
    pub fn set_active(&mut self, frame: FrameId, active: bool) {
        self.active.retain(|id| *id != frame);
        if active {
            self.active.push(frame);
        }
    }

    /// Forgets everything: the system is empty, or is no longer what the frames say.
    pub fn discard(&mut self) {
        self.frames.clear();
        self.committed.clear();
        self.active.clear();
        self.version += 1;
    }

    /// Takes over the stack as `transaction` leaves it, after its steps are done. Answers the frames it pushed.
    ///
    /// # Panics
    /// When the stack changed since the transaction was made: there is one configurator for one stack.
    pub fn commit(&mut self, transaction: Transaction) -> Vec<FrameId> {
        assert!(transaction.version == self.version, "a transaction is committed to the stack it was made from");
        self.version += 1;
        self.next = transaction.next;
        self.frames.clear();
        self.frames.extend(transaction.frames);
        self.active.extend(transaction.active);
        self.active.retain(|id| self.frames.iter().any(|f| f.id == *id));
        transaction.pushed
    }
}
