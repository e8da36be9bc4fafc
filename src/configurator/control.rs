//! What the session asks of the configurator beside requests: how things stand, and to take everything down.

use super::request::{Reason, Request, Residual};
use crate::model::words::words;
use crate::model::{ComponentName, ConfigId, Configuration, RequestId, Snapshot, Step};
use crate::stack::{Frame, FrameId, Requester};
use crate::time::{Sender, Time};
use serde::Serialize;
use std::sync::Arc;

/// A frame as it is shown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameView {
    /// The configuration.
    pub configuration: ConfigId,
    /// Who asked.
    pub by: Requester,
    /// When it was applied.
    pub at: Time,
    /// Undo does not pass it.
    pub floor: bool,
    /// How many frames were squashed into it; 1 for a plain frame.
    pub parts: usize,
    /// It is what was done and not taken back of something that ended *broken*.
    pub partial: bool,
    /// What its configuration stands for is no longer so, since it was applied last.
    pub lost: bool,
    /// The platform does not show what its configuration stands for.
    pub unseen: bool,
    /// It is of what was asked for since stopping began.
    pub since_stopping: bool,
}

/// How things stand, at one moment.
#[derive(Debug, Clone)]
pub struct ConfiguratorView {
    /// The system as the configurator knows it, if it was asked for.
    pub system: Option<Arc<Snapshot>>,
    /// Frames in force, newest last.
    pub stack: Vec<FrameView>,
    /// What is broken longest, if anything is.
    pub broken: Option<Arc<Residual>>,
    /// All that is broken.
    pub residuals: Vec<Arc<Residual>>,
    /// What the partial frames hold beside that.
    pub partial: Vec<Residual>,
    /// Components whose call has not returned.
    pub quarantined: Vec<ComponentName>,
}

/// A moment, and what of the stack is from before it.
#[derive(Debug, Clone)]
pub(super) struct Moment {
    /// The number that the next frame got.
    pub next: FrameId,
    /// When.
    pub at: Time,
    /// What was asked for and not answered then: it counts as before, also where it begins at the same instant.
    pub asked: Vec<RequestId>,
    /// The frames of those that were answered since.
    pub before: Vec<FrameId>,
}

impl Moment {
    /// Whether a frame is of what was asked for since. What is not answered yet has none that counts.
    pub fn has_come(&self, frame: &Frame) -> bool {
        frame.id >= self.next && frame.at >= self.at && !self.before.contains(&frame.id)
    }

    /// A request is answered, and has left this frame on the stack, if it has left one.
    pub fn answered(&mut self, request: &Request, frame: Option<FrameId>) {
        if let Some(at) = self.asked.iter().position(|asked| *asked == request.id) {
            self.asked.swap_remove(at);
            self.before.extend(frame);
        }
    }
}

/// What was in force when stopping began.
#[derive(Debug, Clone)]
pub(super) struct StoppingBegan {
    /// When that was.
    pub since: Moment,
    /// The number of the next frame when its coordinators were left out.
    pub led: Option<FrameId>,
}

/// What a stage of stopping came to.
#[derive(Debug, Clone, Default)]
#[allow(clippy::struct_excessive_bools)]
pub struct TakenDown {
    /// Configurations whose frames were popped, in that order.
    pub popped: Vec<ConfigId>,
    /// Those whose frames were to be popped and stay.
    pub kept: Vec<ConfigId>,
    /// No frame was popped, since this one has moved hardware since stopping began.
    pub put_to_rest: Option<ConfigId>,
    /// Safe configurations that were applied first, in that order.
    pub safe: Vec<ConfigId>,
    /// Configurations that were applied then, for the system to come to rest.
    pub rest: Vec<ConfigId>,
    /// Those of both of which something failed.
    pub partly: Vec<ConfigId>,
    /// What had to be forced: steps that belong to no frame's undo, done.
    pub forced: Vec<Step>,
    /// What went wrong on the way.
    pub troubles: Vec<Reason>,
    /// What is still there.
    pub left: Snapshot,
    /// Components whose call has not returned.
    pub quarantined: Vec<ComponentName>,
    /// Whether `left` was read from the platform (else the platform did not answer).
    pub observed: bool,
    /// Whether it was done before its deadline.
    pub in_time: bool,
    /// A safe configuration is in force that was before stopping began.
    pub held: bool,
    /// A safe configuration is in force.
    pub still: bool,
}

impl TakenDown {
    /// Whether nothing had to be done.
    pub fn is_idle(&self) -> bool {
        self.popped.is_empty() && self.kept.is_empty() && self.forced.is_empty() && self.troubles.is_empty()
    }

    /// Whether nothing is left, as the platform shows it: where it does not answer, that is not known.
    pub fn is_clean(&self) -> bool {
        self.observed && self.left.is_empty() && self.quarantined.is_empty()
    }
}

/// The difference between the picture and the platform.
#[derive(Debug, Clone, Default)]
pub struct Drift {
    /// Steps from the system as it should be to the system as it is.
    pub steps: Vec<Step>,
    /// Components that are faulted and should not be.
    pub faulted: Vec<ComponentName>,
    /// Steps of which nobody knows whether they happened: looking does not tell.
    pub unsettled: Vec<Step>,
    /// Components whose call has not returned.
    pub quarantined: Vec<ComponentName>,
    /// Whether the platform answered.
    pub observed: bool,
}

words! {
    /// How a broken system is recovered.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Recovery by word {
        /// To the system before the interrupted application.
        Back = "back",
        /// The system as it is becomes the one that should be; the stack is discarded. For when a person has decided that
        /// what is there is right.
        Accept = "accept",
    }
}

/// What somebody tells it, with where its answer goes.
pub(super) enum ControlCommand {
    AtOnce(UrgentCommand),
    Queued(QueuedCommand),
}

/// Done where it is taken in.
pub(super) enum UrgentCommand {
    View {
        system: bool,
        reply: Sender<Arc<ConfiguratorView>>,
    },
    /// A configuration that an operator makes up, in the place of the one of that name; `listed`: it may be applied without force.
    Define {
        configuration: Box<Configuration>,
        listed: bool,
        reply: Sender<()>,
    },
    /// Stopping begins: operators' requests are refused from now on.
    Stopping,
    /// Somebody wants force: looked for by what takes its time.
    Hurry,
    /// A coordinator has come to its *down* state.
    Down(Requester),
    /// The configurator's thread is to panic: a script tries that.
    Panic,
}

/// Waits until what is being done has an end, or gives way.
#[derive(Clone)]
pub(super) enum QueuedCommand {
    Drift { reply: Sender<Drift> },
    Recover { direction: Recovery, reply: Sender<Result<bool, Arc<Residual>>> },
    TakeBack { deadline: Time, reply: Sender<TakenDown> },
    Force { deadline: Time, reply: Sender<TakenDown> },
    DiscardStack,
    Stop,
}

impl From<UrgentCommand> for ControlCommand {
    fn from(command: UrgentCommand) -> Self {
        Self::AtOnce(command)
    }
}

impl From<QueuedCommand> for ControlCommand {
    fn from(command: QueuedCommand) -> Self {
        Self::Queued(command)
    }
}

impl UrgentCommand {
    /// Whether somebody only wants to know something, or to change what can be asked for again: there may be many of these.
    pub fn only_asks(&self) -> bool {
        matches!(self, Self::View { .. } | Self::Define { .. })
    }
}

impl QueuedCommand {
    /// As [`UrgentCommand::only_asks`].
    pub fn only_asks(&self) -> bool {
        matches!(self, Self::Drift { .. } | Self::Recover { .. })
    }

    /// Whether what is under way gives way to it.
    pub fn is_urgent(&self) -> bool {
        matches!(self, Self::TakeBack { .. } | Self::Force { .. } | Self::Stop)
    }
}
