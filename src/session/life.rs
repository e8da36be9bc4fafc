//! The life of a deployment: brought up ([`bring_up`](super::bring_up)), served, down (semantics: *Stopping*). How it is stopped:
//! [`stopping`](super::stopping).

use super::log::{Happening, Phase};
use super::stages::Stage;
use super::{Command, Session};
use crate::model::Snapshot;
use crate::time::Time;
use crate::time::clock::panic_text;
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// How a deployment ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ended {
    /// `down`, or `broken` when something is left.
    pub phase: Phase,
    /// The last stage that it took.
    pub stage: Stage,
    /// What went otherwise than in order: taken back without the coordinator, forced, one line each.
    pub forced: Vec<String>,
    /// What is left, one line each.
    pub left: Vec<String>,
    /// Events that components raised while it was being stopped, each once.
    pub reported: Vec<String>,
}

impl Ended {
    /// Of one that never began.
    pub(super) fn unbegun() -> Self {
        Self { phase: Phase::Down, stage: Stage::Led, forced: Vec::new(), left: Vec::new(), reported: Vec::new() }
    }

    /// Whether nothing is left.
    pub fn is_clean(&self) -> bool {
        self.left.is_empty()
    }

    /// Whether the coordinator has led down, and nothing is left.
    pub fn is_orderly(&self) -> bool {
        self.is_clean() && self.stage == Stage::Led
    }
}

/// Why a deployment did not come up; it was stopped, as `ended` says.
#[derive(Debug, Clone, PartialEq, Serialize, thiserror::Error)]
#[error("{why}")]
pub struct NotUp {
    /// One sentence.
    pub why: String,
    /// What led to it, one line each.
    pub reasons: Vec<String>,
    /// Whether somebody asked for the end.
    pub interrupted: bool,
    /// How the deployment ended.
    pub ended: Ended,
}

impl Session {
    /// Waits until somebody commands the end. A deployment that breaks meanwhile stays: its coordinator decides. One whose
    /// coordinator has ended is led by nobody: that is the end too.
    pub fn serve(&self) -> Command {
        loop {
            if let Some(command) = self.pending_command() {
                return command;
            }
            if !self.leads() {
                return Command::Shutdown { force: false };
            }
            self.tell_slow();
            self.hub().changed.wait(self.next_look(Time::NEVER));
        }
    }

    /// Drives it by `drive`. Where that panics it is stopped in its stages first, as far as that goes: a defect of whoever drives
    /// it must not leave a robot up.
    ///
    /// # Errors
    /// What `drive` panicked with, and how it ended; none: also stopping it has panicked.
    pub fn guarded<T>(&self, drive: impl FnOnce() -> T) -> Result<T, (Box<dyn Any + Send>, Option<Ended>)> {
        let panic = match catch_unwind(AssertUnwindSafe(drive)) {
            Ok(driven) => return Ok(driven),
            Err(panic) => panic,
        };
        let note = format!("what drives `{}` has panicked: {}", self.deployment().name, panic_text(&*panic));
        let ended = survived(|| {
            let _ = survived(|| self.hub().note(Happening::Noted { note }));
            // Nothing is there any more that could be stopped.
            self.ended().unwrap_or_else(|| self.stop(false, self.hub().phase() == Phase::Deploying))
        });
        Err((panic, ended.ok()))
    }

    /// Where it is in its life, as people are shown it, and what is left where its coordinators are down and something is there all the
    /// same (what was found was accepted as it is): that is not *down*.
    pub(super) fn phase_of(&self, broken: bool, system: Option<&Snapshot>) -> (Phase, Vec<String>) {
        // What was broken may be right again, and that not told yet.
        let told = match self.hub().phase() {
            Phase::Broken if !broken && self.ended().is_none() => Phase::Up,
            told => told,
        };
        let phase = match told {
            Phase::Up | Phase::Deploying if broken => Phase::Broken,
            // Its coordinator leads down, whoever raised the event: nobody stops it for that.
            Phase::Up if self.configurator().is_leaving() => Phase::ShuttingDown,
            Phase::Up if self.is_down() => match system.map_or_else(Vec::new, |system| leftovers(system, &[])) {
                left if left.is_empty() => Phase::Down,
                left => return (Phase::Broken, left),
            },
            phase => phase,
        };
        (phase, Vec::new())
    }

    pub(super) fn finish(&self, stage: Stage, forced: Vec<String>) -> Ended {
        self.detach_coordinators();
        let left = self.left_over();
        // With something left the configurator stays, as long as the session: when a call returns late, it cleans up.
        if left.is_empty() {
            self.stop_threads();
        }
        let phase = if left.is_empty() { Phase::Down } else { Phase::Broken };
        let _ = survived(|| self.hub().set_phase(phase));
        Ended { phase, stage, forced, left, reported: self.hub().halt().reported() }
    }
}

/// What is done, or what it panicked with.
pub(super) fn survived<T>(what: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(what)).map_err(|panic| panic_text(&*panic))
}

/// What is left where the platform does not answer.
pub(super) const UNSEEN: &str = "what is there is not known: the platform has not answered";

/// What is left of a system, one line each.
pub(super) fn leftovers(system: &Snapshot, quarantined: &[String]) -> Vec<String> {
    let mut left: Vec<String> = system
        .components
        .iter()
        .map(|(name, component)| {
            let hung = quarantined.iter().any(|q| q == name.as_str());
            format!("{name} ({}){}", component.state, if hung { ": quarantined, a call has not returned" } else { "" })
        })
        .collect();
    left.extend(
        quarantined
            .iter()
            .filter(|q| system.components.keys().all(|name| name.as_str() != q.as_str()))
            .map(|q| format!("{q}: quarantined, a call has not returned")),
    );
    left.extend(system.connections.keys().map(|(from, to)| format!("connection {from} -> {to}")));
    left
}
