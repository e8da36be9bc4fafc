//! The life of a deployment: brought up, served, down (semantics: *Stopping*). How it is stopped: [`stopping`](super::stopping).

use super::log::{Happening, Phase};
use super::stages::Stage;
use super::{Command, Session, Unanswered};
use crate::limits;
use crate::model::{Ident, Snapshot};
use crate::time::Time;
use crate::time::clock::panic_text;
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering;
use std::time::Duration;

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
    /// Raises the deployment's event and waits until it is *up*: the named state is active and every request raised so
    /// far has been answered.
    ///
    /// # Errors
    /// [`NotUp`] when a state listed under `deploy.failed` became active, when it took too long, or when a command to
    /// shut down came; then it has been stopped.
    pub fn bring_up(&self) -> Result<(), NotUp> {
        let hub = self.hub();
        let bring_up = &self.deployment().deploy;
        let start = self.clock().now();
        let mut deadline = start + bring_up.within;
        let began = hub.heard();
        hub.set_phase(Phase::Deploying);
        // Who does not hear it yet, while what was asked for at the beginning is not answered, is told once more then.
        let mut ticket = match self.offer_watched(bring_up.event, "deployment") {
            Ok(offered) => Some(offered.ticket),
            Err(refused) => {
                hub.note(Happening::Noted { note: format!("`{}` was not delivered: {refused}", bring_up.event) });
                None
            }
        };
        let (mut force, mut unanswered, mut told, mut failed_told, mut held) = (false, false, false, false, false);
        let why = loop {
            if let Some(Command::Shutdown { force: by_force }) = self.pending_command() {
                force = by_force;
                break (format!("interrupted while deploying `{}`", self.deployment().name), true);
            }
            if !self.leads() {
                break ("a coordinator has ended".to_owned(), false);
            }
            // Stopped in an emergency: what stopping it would move, nobody has asked for.
            if let Some(state) = self.failed_state().filter(|_| !self.is_alarmed(start) || self.has_reacted()) {
                match self.fails_in_emergency(start) {
                    Ok(true) => {
                        unanswered = false;
                        if !std::mem::replace(&mut failed_told, true) {
                            let why = format!("it does not come up, since the coordinator is in `{state}`");
                            self.tell_held(&why, "when that is let go it is led down");
                        }
                    }
                    // It may be one: asked once more, before anything moves.
                    Err(Unanswered) if !std::mem::replace(&mut unanswered, true) => continue,
                    _ => break (format!("the coordinator is in `{state}`"), false),
                }
            }
            if self.is_up() {
                self.coming_up_held.store(false, Ordering::Relaxed);
                ticket.into_iter().for_each(|ticket| hub.forget(ticket));
                hub.set_phase(Phase::Up);
                return Ok(());
            }
            if let Some((heard, of)) = ticket.and_then(|of| Some((hub.who_heard(of)?, of))).filter(|_| self.is_still())
            {
                hub.forget(of);
                ticket = None;
                let unheard: Vec<Ident> = self.who_hears(bring_up.event, &heard).collect();
                if !unheard.is_empty() && self.offer_to(bring_up.event, &unheard, "deployment").is_ok() {
                    continue;
                }
            }
            let now = self.clock().now();
            // What came at the very end of its time is to be heard: it may be an emergency.
            let heard = !self.has_safe()
                || now >= deadline + limits::LAST_LOOK && (self.has_reacted() || now >= deadline + limits::VIEW);
            if now >= deadline && heard {
                match self.waits_for_people(start) {
                    Ok(true) => {
                        (held, deadline) = (true, now + bring_up.within.min(limits::HELD_LOOK));
                        if !std::mem::replace(&mut told, true) {
                            let why = format!("not up after {} s", now.since(start).as_secs_f64().round());
                            self.tell_held(&why, "an event that its coordinator hears leads on");
                        }
                    }
                    // Let go of, it has its time anew.
                    Ok(false) if std::mem::take(&mut held) => deadline = now + bring_up.within,
                    Err(Unanswered) if !std::mem::replace(&mut unanswered, true) => deadline = now + bring_up.within,
                    _ => {}
                }
            }
            if now >= deadline && heard {
                let waiting = hub.outstanding();
                break (
                    format!(
                        "not up after {} s: {}{}",
                        bring_up.within.as_secs_f64(),
                        hub.whereabouts(),
                        if waiting.is_empty() {
                            String::new()
                        } else {
                            format!(", waiting for {}", waiting.join(", "))
                        }
                    ),
                    false,
                );
            }
            self.tell_slow();
            let looks = [Duration::ZERO, limits::LAST_LOOK, limits::VIEW].map(|behind| deadline + behind);
            let looks = looks.into_iter().find(|look| *look > now).unwrap_or(deadline);
            hub.changed.wait(self.next_look(looks));
        };
        self.coming_up_held.store(false, Ordering::Relaxed);
        ticket.into_iter().for_each(|ticket| hub.forget(ticket));
        let reasons = self.failures_since(began);
        let ended = self.stop(force, true);
        Err(NotUp { why: why.0, reasons, interrupted: why.1, ended })
    }

    /// It does not come up since something safe came, and nothing is stopped before people ask for it.
    fn tell_held(&self, why: &str, leads_on: &str) {
        self.coming_up_held.store(true, Ordering::Relaxed);
        let note = format!(
            "{why}, and something safe holds it: {leads_on} (`davit status` says where it is), `davit shutdown` leads it down"
        );
        self.hub().note(Happening::Noted { note });
    }

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
