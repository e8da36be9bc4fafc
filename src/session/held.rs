//! Whether something safe holds a deployment, or a part of it, where it is: then nothing goes on by itself, whatever its time or its coordinator
//! says of it, before people let go.

use super::halt::StandsStill;
use super::hub::Hub;
use super::{Session, Unanswered};
use crate::configurator::{ConfiguratorHandle, FrameView, Requester};
use crate::limits;
use crate::model::{ConfigId, Ident};
use crate::time::{Clock, Time};
use rustc_hash::FxHashSet;
use std::sync::atomic::Ordering;

impl Session {
    /// Whether a safe configuration is in force that came since then, or has been asked for, and somebody is there to decide how to go on.
    pub(super) fn waits_for_people(&self, began: Time) -> Result<bool, Unanswered> {
        if !self.attended.load(Ordering::Relaxed) || !self.has_safe() {
            return Ok(false);
        }
        let is_safe = |id: ConfigId| self.is_safe(id);
        Ok(self.hub().applies(is_safe) || holds(&self.frames()?, is_safe, None, began))
    }

    /// The same of a bring-up that has failed: what a coordinator makes safe since that failed, and nobody has stopped anything, is its own way to
    /// fail.
    pub(super) fn fails_in_emergency(&self, began: Time) -> Result<bool, Unanswered> {
        if self.is_alarmed(began) || !self.attended.load(Ordering::Relaxed) || !self.has_safe() {
            return self.waits_for_people(began);
        }
        let by_people = |frame: &FrameView| !matches!(frame.by, Requester::Coordinator(_));
        let safe = |frame: &FrameView| frame.at >= began && self.is_safe(frame.configuration);
        Ok(self.frames()?.iter().any(|frame| safe(frame) && by_people(frame)))
    }

    /// Whether an event of safety has come since then.
    pub(super) fn is_alarmed(&self, began: Time) -> bool {
        self.junction().alarmed_since(began)
    }

    /// What keeps it from coming up, of these frames, before people decide.
    pub(super) fn held_coming_up(&self, frames: &[FrameView]) -> Option<StandsStill> {
        let held = self.coming_up_held.load(Ordering::Relaxed);
        let safe = frames.iter().find(|frame| held && self.is_safe(frame.configuration))?;
        let leads_on = "an event that its coordinator hears leads on, `davit shutdown` leads it down".to_owned();
        Some(StandsStill { safe: safe.configuration.to_string(), since: safe.at.as_secs_f64(), leads_on })
    }

    /// Whether every coordinator has done what it was to do by what came: what it asks for then has been asked for.
    pub(super) fn has_reacted(&self) -> bool {
        self.parts().iter().all(|part| part.coordinator.is_settled())
    }
}

/// The safe configurations of a deployment with subsystems.
#[derive(Debug)]
pub(super) struct SafeOnes(FxHashSet<ConfigId>);

impl SafeOnes {
    /// Those.
    pub fn new(ids: impl IntoIterator<Item = ConfigId>) -> Self {
        Self(ids.into_iter().collect())
    }

    /// The frames in force, to be asked about several subsystems; none: nobody answers.
    pub fn frames(&self, clock: &Clock, configurator: Option<&ConfiguratorHandle>) -> Option<Vec<FrameView>> {
        if self.0.is_empty() {
            return Some(Vec::new());
        }
        Some(configurator?.view(false, clock.now() + limits::VIEW)?.stack.clone())
    }

    /// Whether one that came since then holds a subsystem. While nobody knows it is as it was: one that may be held is not late.
    pub fn hold(&self, hub: &Hub, frames: Option<&[FrameView]>, path: Ident, since: Time) -> bool {
        let is_safe = |id: ConfigId| self.0.contains(&id);
        hub.applies(|id| is_safe(id) && concerns(id, path))
            || frames.is_none_or(|frames| holds(frames, is_safe, Some(path), since))
    }
}

/// Whether one of these frames is safe, came since then, and holds what has that path (none: all of it).
fn holds(frames: &[FrameView], is_safe: impl Fn(ConfigId) -> bool, path: Option<Ident>, since: Time) -> bool {
    let concerns = |id: ConfigId| path.is_none_or(|path| concerns(id, path));
    frames.iter().any(|frame| frame.at >= since && is_safe(frame.configuration) && concerns(frame.configuration))
}

/// Whether a configuration is one of that subsystem, of something around it, or of something in it.
fn concerns(id: ConfigId, path: Ident) -> bool {
    let within = |inner: &str, outer: &str| {
        outer.is_empty() || inner.strip_prefix(outer).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    };
    within(path.as_str(), id.prefix()) || within(id.prefix(), path.as_str())
}
