//! Whether something safe holds a deployment, or a part of it, where it is: then nothing goes on by itself, whatever its time or its coordinator
//! says of it, before people let go.

use super::halt::StandsStill;
use super::hub::Hub;
use super::{Session, Unanswered};
use crate::configurator::{ConfiguratorHandle, FrameView, Requester};
use crate::limits;
use crate::model::{Ask, ConfigId, Deployment, EventName, FAULTED, Ident};
use crate::time::{Clock, Time, lock};
use rustc_hash::FxHashSet;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

impl Session {
    /// Whether something safe could hold it, and somebody is there to decide how to go on then.
    pub(super) fn may_be_held(&self) -> bool {
        self.attended.load(Ordering::Relaxed) && self.has_safe()
    }

    /// Whether a safe configuration is in force that came since then, or has been asked for, and somebody is there to decide how to go on.
    pub(super) fn waits_for_people(&self, began: Time) -> Result<bool, Unanswered> {
        if !self.may_be_held() {
            return Ok(false);
        }
        let is_safe = |id: ConfigId| self.is_safe(id);
        Ok(self.hub().applies(is_safe) || holds(&self.frames()?, is_safe, None, began))
    }

    /// Whether something safe is in force, or has been asked for; while nobody knows it is as if it were.
    pub fn in_emergency(&self) -> bool {
        self.waits_for_people(Time::default()).unwrap_or(true)
    }

    /// Whether a bring-up that began then, and has failed, waits for people. Where nobody has stopped anything, what a coordinator makes safe that has
    /// failed is its own way to fail; what another one does is not.
    pub(super) fn fails_in_emergency(&self, began: Time) -> Result<bool, Unanswered> {
        if self.junction().alarms.came_since(began) || !self.may_be_held() {
            return self.waits_for_people(began);
        }
        let has_failed: Vec<Requester> = self.has_failed().collect();
        let holds = |id: ConfigId, by: Requester| self.is_safe(id) && !has_failed.contains(&by);
        let asked_for = self.hub().asks_for(|of| matches!(of.ask, Ask::Apply(id) if holds(id, of.by)));
        Ok(asked_for || self.frames()?.iter().any(|frame| frame.at >= began && holds(frame.configuration, frame.by)))
    }

    /// The coordinators that are in a state that says that they failed, those of subsystems among them.
    fn has_failed(&self) -> impl Iterator<Item = Requester> {
        let failed = self.parts().iter().filter(|part| part.failed_state().is_some());
        failed.map(|part| Requester::Coordinator(part.name.into()))
    }

    /// The events from outside that the coordinator hears where it is that has made something safe (nobody's: any coordinator), but for those that
    /// make it safe, and end it.
    fn lets_go(&self, by: Requester) -> Vec<EventName> {
        let ends = self.deployment().shutdown.event;
        let leads_on = |event: &EventName| {
            let is_told = event.as_str().ends_with(FAULTED) || self.junction().alarms.is_one(*event);
            *event != ends && !is_told && self.may_raise(event.as_str()).is_ok()
        };
        // One that is heard and comes back to where it was lets go of nothing.
        let hears = |event: &EventName| {
            let mut may = self.parts().iter().filter(|part| may_let_go(by, part.name));
            may.any(|part| part.takes(*event).any(|edge| !part.chart.leads_back(edge)))
        };
        self.events().into_iter().filter(leads_on).filter(hears).collect()
    }

    /// What keeps it from coming up, of these frames, before people decide.
    pub(super) fn held_coming_up(&self, frames: &[FrameView]) -> Option<StandsStill> {
        let held = self.coming_up_held.load(Ordering::Relaxed);
        let safe = frames.iter().find(|frame| held && self.is_safe(frame.configuration))?;
        let heard = self.lets_go(safe.by);
        let by = match (safe.by, heard.len()) {
            // No coordinator lets go of what somebody else has made safe.
            (Requester::Operator, _) => format!("`davit undo {}`", safe.configuration),
            (_, 0) => "an event that its coordinator hears".to_owned(),
            _ => one_of(&heard),
        };
        let leads_on = match (self.failed_state(), safe.by) {
            (Some(state), _) => {
                format!(
                    "{by} lets go of it, and since the coordinator is in `{state}` it is led down then, as by `davit shutdown`"
                )
            }
            (None, Requester::Operator) => format!("{by} lets go of it, `davit shutdown` leads it down"),
            (None, _) => format!("{by} leads on, `davit shutdown` leads it down"),
        };
        Some(StandsStill { safe: safe.configuration.to_string(), since: safe.at.as_secs_f64(), leads_on })
    }
}

/// Whether a coordinator may let go of what somebody has made safe: of several the one that has it in force lets it go, or none does.
pub(super) fn may_let_go(by: Requester, part: Ident) -> bool {
    match by {
        Requester::Coordinator(name) => name.as_str() == part.as_str(),
        Requester::Operator | Requester::Safety => true,
    }
}

/// The first of several events that may be raised, in words.
fn one_of(events: &[EventName]) -> String {
    let named = events.iter().take(limits::EVENTS_NAMED).map(|event| format!("`davit event {event}`"));
    named.collect::<Vec<_>>().join(" or ")
}

/// Events of safety, those of a deployment and those of its subsystems, and when a coordinator has taken one up last.
#[derive(Debug, Default)]
pub(super) struct Alarms {
    events: FxHashSet<EventName>,
    last: Mutex<Option<Time>>,
}

impl Alarms {
    /// Those of a deployment.
    pub fn of(deployment: &Deployment) -> Self {
        let mut events: FxHashSet<EventName> = deployment.safety.iter().map(|(event, _)| *event).collect();
        for (path, subsystem) in deployment.all_subsystems() {
            events.extend(subsystem.own.safety.iter().map(|(event, _)| event.within(path)));
        }
        Self { events, last: Mutex::default() }
    }

    /// Whether an event is one.
    pub fn is_one(&self, event: EventName) -> bool {
        self.events.contains(&event)
    }

    /// A coordinator takes an event up; it may be one.
    pub fn hear(&self, event: EventName, now: impl FnOnce() -> Time) {
        if self.is_one(event) {
            *lock(&self.last) = Some(now());
        }
    }

    /// Whether one has come since then.
    pub fn came_since(&self, began: Time) -> bool {
        lock(&self.last).is_some_and(|at| at >= began)
    }
}

/// A moment from which something is to be let go unasked, where something safe may hold it: what comes at that very moment is heard first, and done
/// what it leads to.
#[derive(Debug, Clone, Copy)]
pub(super) struct LastMoment(pub Time);

impl LastMoment {
    /// Whether that is over.
    pub fn is_over(self, now: Time, has_reacted: impl FnOnce() -> bool) -> bool {
        now >= self.0 + limits::LAST_LOOK && (has_reacted() || now >= self.0 + limits::VIEW)
    }

    /// When it is looked at next.
    pub fn next_look(self, now: Time) -> Time {
        if now < self.0 { self.0 } else { now + limits::LAST_LOOK }
    }
}

/// How many are being told of something: it is written down already, and not all of those have it in their inboxes whose it is.
#[derive(Debug, Default)]
pub(super) struct OnTheWay(AtomicUsize);

/// One that is, as long as this is there.
pub(super) struct BeingTold<'t>(&'t OnTheWay);

impl OnTheWay {
    /// Somebody is about to write something down, and to tell of it.
    pub fn begin(&self) -> BeingTold<'_> {
        self.0.fetch_add(1, Ordering::SeqCst);
        BeingTold(self)
    }

    /// Whether nothing is.
    pub fn is_none(&self) -> bool {
        self.0.load(Ordering::SeqCst) == 0
    }
}

impl Drop for BeingTold<'_> {
    fn drop(&mut self) {
        self.0.0.fetch_sub(1, Ordering::SeqCst);
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

    /// Whether a moment has come from which something is late that one of them could hold.
    pub fn has_come(&self, moment: Time, now: Time, has_reacted: impl FnOnce() -> bool) -> bool {
        if self.0.is_empty() { now >= moment } else { LastMoment(moment).is_over(now, has_reacted) }
    }

    /// When that is looked at next.
    pub fn next_look(&self, moment: Time, now: Time) -> Time {
        if self.0.is_empty() { moment } else { LastMoment(moment).next_look(now) }
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
