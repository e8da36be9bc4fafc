//! Stopping, stage by stage (semantics: *Stopping*): what [`stages`](super::stages) decides is carried out.

use super::halt::StandsStill;
use super::held::may_let_go;
use super::life::{Ended, UNSEEN, survived};
use super::log::{Happening, Phase};
use super::raising::make_safe;
use super::stages::{Came, NextStage, Stage, first, next};
use super::{Command, Session, Unanswered};
use crate::configurator::{FrameView, TakenDown};
use crate::coordinator::Class;
use crate::limits;
use crate::model::{ConfigId, EventName, Ident, RequestId, Step};
use crate::stack::Requester;
use crate::time::{Receiver, Time};
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Whether what is left is held by a safe configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum HeldUp {
    No,
    Yes,
    /// The configurator has not answered: people decide, as if it were.
    NotKnown,
}

impl HeldUp {
    fn of(held: bool) -> Self {
        if held { Self::Yes } else { Self::No }
    }
}

/// What stopping has come to so far.
struct Announced {
    /// The last stage that had something to do.
    stage: Stage,
    /// What went otherwise than in order, one line each.
    notes: Vec<String>,
    /// It is one that did not come up.
    coming_up: bool,
}

impl Session {
    /// Takes the deployment down in its stages: the coordinator leads down; what is in force is taken back; force.
    /// With `force` the last of them at once. Where a safe configuration holds what is left, it waits for somebody to ask for
    /// force; where the session is [unattended](Self::unattended), that is its end, and what is left stays.
    pub fn take_down(&self, force: bool) -> Ended {
        self.stop(force, false)
    }

    /// Nobody is there who could ask for force, and nothing waits for that: what a safe configuration holds stays as it is.
    pub fn unattended(&self) {
        self.attended.store(false, Ordering::Relaxed);
    }

    /// Whoever drives it plays its parent, too, until it is stopped: with `leaving` it waits for the event under `until`, as a subsystem
    /// does, instead of being let go at once.
    pub fn played_by_parent(&self) {
        self.junction().has_parent.store(true, Ordering::Release);
    }

    /// The same also of a deployment that is being brought up: an event that nobody hears there leads nowhere.
    pub(super) fn stop(&self, force: bool, coming_up: bool) -> Ended {
        let hub = self.hub();
        hub.halt().begin();
        self.junction().has_parent.store(false, Ordering::Release);
        self.configurator().stopping();
        let _ = survived(|| hub.set_phase(Phase::ShuttingDown));
        let mut told = Announced { stage: Stage::Led, notes: Vec::new(), coming_up };
        let mut stage = first(force, self.leads());
        let mut why = match stage {
            Stage::Led => None,
            Stage::TakenBack => Some("there is no coordinator that leads down".to_owned()),
            Stage::Forced => Some("as asked for".to_owned()),
        };
        loop {
            // What panics in one of them is a defect of ours, and leaves it to the next.
            let began = survived(|| self.begin_stage(stage, why.take(), &mut told));
            let (came, held) =
                began.and_then(|acted| survived(|| self.carry_out(stage, &acted, &mut told))).unwrap_or_else(|panic| {
                    let why = format!("davit itself has panicked: {panic}");
                    told.notes.push(why.clone());
                    (Came::Left(why), HeldUp::No)
                });
            let came_to = next(stage, &came, held != HeldUp::No);
            why = match came {
                Came::Left(why) => Some(why),
                Came::Hurried => Some("as asked for".to_owned()),
                Came::Empty => None,
            };
            match came_to {
                NextStage::Over => break,
                NextStage::Stage(next) => stage = next,
                NextStage::Held if !self.attended.load(Ordering::Relaxed) => {
                    let what = self.what_holds(held);
                    let note = format!("{what}, and nobody is there to ask for force: what is left stays as it is");
                    self.note_all(vec![note], &mut told);
                    break;
                }
                NextStage::Held => {
                    let what = self.what_holds(held);
                    let note = format!(
                        "{what}: what is left stays as it is until a signal (Ctrl-C) or `davit shutdown --force` asks for force anew"
                    );
                    hub.note(Happening::Noted { note });
                    hub.halt().hold(Some(what));
                    self.wait_for_force();
                    hub.halt().hold(None);
                    stage = Stage::Forced;
                    why = Some("as asked for".to_owned());
                }
            }
        }
        let ended = self.finish(told.stage, told.notes);
        self.set_ended(&ended);
        ended
    }

    /// `acted`: what was asked for since a safety event came before to which no coordinator had reacted.
    fn carry_out(&self, stage: Stage, acted: &[RequestId], told: &mut Announced) -> (Came, HeldUp) {
        match stage {
            Stage::Led => (self.lead_down(told), HeldUp::No),
            Stage::TakenBack => self.take_all_back(told),
            // It came before force did: what it has made safe is let go by people alone.
            Stage::Forced => match self.is_made_safe(acted) {
                HeldUp::No => self.force_all(told),
                held => (Came::Left("a safety event came before".to_owned()), held),
            },
        }
    }

    /// Whether what these requests have made safe holds anything, once they are answered.
    fn is_made_safe(&self, acted: &[RequestId]) -> HeldUp {
        if acted.is_empty() {
            return HeldUp::No;
        }
        let hub = self.hub();
        let deadline = self.clock().now() + self.safe_takes() + limits::VIEW;
        let answered = || acted.iter().all(|id| hub.answer(*id).is_some());
        while !answered() && self.clock().now() < deadline {
            hub.changed.wait(self.next_look(deadline));
        }
        if self.left_over().is_empty() { HeldUp::No } else { self.is_held() }
    }

    /// As long as what is safe may take.
    fn safe_takes(&self) -> Duration {
        let step = self.deployment().limits.step_timeout;
        let safe = self.deployment().configurations.iter().filter(|c| c.safe);
        safe.map(|c| c.timeout.unwrap_or(step).max(step)).sum()
    }

    /// A stage begins. A safety event that came before, to which no coordinator has reacted, acts by itself; what is asked for then is
    /// answered.
    fn begin_stage(&self, stage: Stage, why: Option<String>, told: &mut Announced) -> Vec<RequestId> {
        let hub = self.hub();
        if let Some(why) = &why {
            told.notes.push(format!("stopped {}: {why}", stage.words()));
        }
        told.stage = stage;
        hub.halt().stage(stage);
        // Never two commanders.
        let unheard = if stage == Stage::Led { Vec::new() } else { self.detach_coordinators() };
        // Who only hears of it must not keep it from being done.
        if let Err(panic) = survived(|| hub.note(Happening::Stopping { stage, why })) {
            told.notes.push(format!("who hears of it has panicked: {panic}"));
        }
        let mut asked: Vec<RequestId> = Vec::new();
        for event in unheard {
            let acted = make_safe(hub, self.configurator(), event, Class::Report);
            let Some(acted) = acted.filter(|acted| !acted.requests.is_empty()) else { continue };
            let note = format!("`{event}` came before, and no coordinator had reacted to it: it acts by itself");
            self.note_all(vec![note], told);
            asked.extend(acted.requests);
        }
        asked
    }

    /// Whether every coordinator is there.
    pub(super) fn leads(&self) -> bool {
        self.parts().iter().all(|part| !part.coordinator.is_detached())
    }

    /// Force is asked for, now or before.
    fn is_hurried(&self) -> bool {
        std::iter::from_fn(|| self.pending_command()).any(|Command::Shutdown { force }| force)
    }

    /// Which safe configuration is in force, in words.
    fn what_holds(&self, held: HeldUp) -> String {
        let frames = self.frames().unwrap_or_default();
        let safe = frames.into_iter().map(|frame| frame.configuration).find(|id| self.is_safe(*id));
        match (held, safe) {
            (_, Some(id)) => format!("`{id}` is in force"),
            (HeldUp::NotKnown, None) => "whether a safe configuration is in force is not known".to_owned(),
            (_, None) => "a safe configuration is in force".to_owned(),
        }
    }

    fn wait_for_force(&self) {
        while !self.is_hurried() {
            self.hub().changed.wait(self.next_look(Time::NEVER));
        }
    }

    /// The first stage.
    fn lead_down(&self, told: &Announced) -> Came {
        let hub = self.hub();
        let take_down = &self.deployment().shutdown;
        let goal = self.deployment().down_states();
        let (mut deadline, mut said) = (self.clock().now() + take_down.within, false);
        // Since when it stands still.
        let mut stood: Option<Time> = None;
        let ticket = self.offer_watched(take_down.event, "deployment");
        if let Err(refused) = &ticket {
            hub.note(Happening::Noted { note: format!("`{}` was not delivered: {refused}", take_down.event) });
        }
        let ticket = ticket.map(|offered| offered.ticket).ok();
        let unheard = || ticket.is_some_and(|ticket| hub.was_heard(ticket) == Some(false));
        let came = loop {
            if self.is_down() {
                // As the platform shows it: it may have said that something is gone.
                break match &self.left_over()[..] {
                    [] => Came::Empty,
                    [only] if only == UNSEEN => Came::Left(format!("`{goal}` was reached, and {UNSEEN}")),
                    _ => Came::Left(format!("`{goal}` was reached with components left")),
                };
            }
            if self.is_hurried() {
                break Came::Hurried;
            }
            if !self.leads() {
                break Came::Left("a coordinator has ended".to_owned());
            }
            if told.coming_up && unheard() && self.is_still() {
                break Came::Left(format!("{}, which does not hear `{}`", hub.whereabouts(), take_down.event));
            }
            // Stopped in an emergency since: only its coordinator knows the way from there, and somebody decides when. Then its
            // time begins anew.
            let (now, still) = (self.clock().now(), self.stands_still());
            // While nobody knows it is as it was.
            let stands = still.as_ref().map_or(stood.is_some(), Option::is_some);
            if stands {
                stood.get_or_insert(now);
            } else if stood.take().is_some() {
                (deadline, said) = (now + take_down.within, false);
            }
            // Who asked for it is told what leads on, once the coordinator has had its time to go on by itself.
            let tells = stood.map(|since| since + limits::STANDS_TOLD).filter(|_| !said);
            if now >= deadline || tells.is_some_and(|tells| now >= tells && self.is_still()) {
                let late = || format!("not `{goal}` after {} s", take_down.within.as_secs_f64());
                let note = match still {
                    Ok(Some(still)) => still.to_string(),
                    Ok(None) => break Came::Left(late()),
                    Err(unanswered) if !stands => break Came::Left(format!("{}: {unanswered}", late())),
                    Err(unanswered) => unanswered.to_string(),
                };
                if !std::mem::replace(&mut said, true) {
                    hub.note(Happening::Noted { note });
                }
                deadline = now + take_down.within;
            }
            self.tell_slow();
            // What is not still then is looked at when it changes.
            let tells = tells.filter(|tells| *tells > now).unwrap_or(deadline);
            hub.changed.wait(self.next_look(deadline.min(tells)));
        };
        ticket.into_iter().for_each(|ticket| hub.forget(ticket));
        came
    }

    /// The second stage, and whether what is left is held by a safe configuration.
    fn take_all_back(&self, told: &mut Announced) -> (Came, HeldUp) {
        let deadline = self.clock().now() + self.deployment().shutdown.within;
        let Some(down) = self.stage_of(self.configurator().take_back(deadline), deadline) else {
            self.note_all(vec![Unanswered.to_string()], told);
            return (Came::Left(Unanswered.to_string()), self.is_held());
        };
        let popped = down.popped.iter().map(|id| format!("`{id}` undone"));
        let mut notes: Vec<String> = popped.collect();
        notes.extend(down.put_to_rest.iter().map(|id| {
            format!("nothing is undone: `{id}` has moved something since stopping began, which stays where it is")
        }));
        notes.extend(down.kept.iter().map(|id| format!("`{id}` not undone")));
        notes.extend(down.troubles.iter().map(ToString::to_string));
        self.note_all(notes, told);
        let held = HeldUp::of(down.still);
        if self.is_hurried() {
            return (Came::Hurried, held);
        }
        if down.is_clean() {
            // Of a bring-up that had not begun, or has taken everything back itself, nothing was taken back here.
            if told.coming_up && down.is_idle() {
                told.stage = Stage::Led;
                told.notes.clear();
            }
            return (Came::Empty, held);
        }
        let left = super::life::leftovers(&down.left, &[]);
        let what = match left.len() {
            0 if down.quarantined.is_empty() => UNSEEN.to_owned(),
            0 => "a call has not returned".to_owned(),
            1 => format!("{} is left", left[0]),
            more => format!("{more} things are left"),
        };
        (Came::Left(what), held)
    }

    /// The third stage.
    fn force_all(&self, told: &mut Announced) -> (Came, HeldUp) {
        // What brings it to rest takes nothing of the time in which everything is removed.
        let step = self.deployment().limits.step_timeout;
        let takes = |of: Option<Duration>| of.unwrap_or(step).max(step);
        let rest = self.deployment().all_rest().into_iter();
        let rest = rest.map(|id| takes(self.deployment().configuration(id).and_then(|c| c.timeout)));
        let within = self.deployment().shutdown.within + self.safe_takes() + rest.sum::<Duration>();
        let deadline = self.clock().now() + within;
        let Some(down) = self.stage_of(self.configurator().force_down(deadline), deadline) else {
            self.note_all(vec![Unanswered.to_string()], told);
            return (Came::Left(Unanswered.to_string()), HeldUp::No);
        };
        let applied = down.safe.iter().map(|id| (format!("safe configuration `{id}`"), id));
        let applied = applied.chain(down.rest.iter().map(|id| (format!("`{id}`, to come to rest,"), id)));
        let done = |id: &ConfigId| if down.partly.contains(id) { "applied as far as it went" } else { "applied" };
        let mut notes: Vec<String> = applied.map(|(what, id)| format!("{what} {}", done(id))).collect();
        notes.extend(forced(&down.forced));
        notes.extend(down.troubles.iter().map(ToString::to_string));
        self.note_all(notes, told);
        match down.is_clean() {
            true => (Came::Empty, HeldUp::No),
            false => (Came::Left("something is left".to_owned()), HeldUp::of(down.still)),
        }
    }

    /// What the configurator answers. What does not keep its time is broken off.
    fn stage_of(&self, answer: Receiver<TakenDown>, deadline: Time) -> Option<TakenDown> {
        let grace = self.deployment().limits.step_timeout + limits::VIEW;
        answer.recv_deadline(deadline).ok().or_else(|| {
            self.configurator().hurry();
            answer.recv_deadline(deadline + grace).ok()
        })
    }

    fn note_all(&self, notes: Vec<String>, told: &mut Announced) {
        for note in &notes {
            self.hub().note(Happening::Forced { note: note.clone() });
        }
        told.notes.extend(notes);
    }

    /// Whether something safe could be in force at all.
    pub(super) fn has_safe(&self) -> bool {
        self.deployment().configurations.iter().any(|c| c.safe)
    }

    /// Whether what is left is held by a safe configuration, where the configurator has not said so.
    fn is_held(&self) -> HeldUp {
        match self.frames() {
            _ if !self.has_safe() => HeldUp::No,
            Ok(frames) => HeldUp::of(frames.iter().any(|frame| self.is_safe(frame.configuration))),
            Err(Unanswered) => HeldUp::NotKnown,
        }
    }

    /// The first stage stands still where a safe configuration is in force that was asked for since stopping began, and somebody
    /// is there to decide how to go on.
    fn stands_still(&self) -> Result<Option<StandsStill>, Unanswered> {
        if !self.has_safe() {
            return Ok(None);
        }
        Ok(self.held_by(&self.frames()?))
    }

    /// The same with these frames in force.
    pub(super) fn held_by(&self, frames: &[FrameView]) -> Option<StandsStill> {
        let people = self.attended.load(Ordering::Relaxed) && self.hub().halt().is_led();
        let holds = |frame: &&FrameView| frame.since_stopping && self.is_safe(frame.configuration);
        let frame = frames.iter().find(holds).filter(|_| people)?;
        let force = "`davit shutdown --force` takes everything away by force";
        let shutdown = self.deployment().shutdown.event;
        let hears = |event: EventName| self.who_hears(event, &[]).any(|part| may_let_go(frame.by, part));
        let safety = self.deployment().safety.iter().map(|(event, _)| *event).find(|event| hears(*event));
        // What ends a subsystem comes from those around it.
        let of = |name: Ident| self.parts().iter().find(|part| part.name == name).and_then(|part| part.of);
        let inside = match frame.by {
            // By the text: the name of one that is deeper is no single name.
            Requester::Coordinator(name) => self.parts().iter().find(|part| part.name.as_str() == name.as_str()),
            Requester::Operator | Requester::Safety => None,
        };
        let inside = inside.and_then(|part| part.of);
        let around =
            |outer: &Ident| inside.is_some_and(|inside| of(*outer).is_none_or(|of| inside.local(of).is_some()));
        let outer = self.who_hears(shutdown, &[]).find(around);
        let leads_on = match (hears(shutdown), safety) {
            (true, _) => {
                format!("`davit shutdown` raises `{shutdown}` once more, which its coordinator hears there; {force}")
            }
            (false, _) if let Some(outer) = outer => {
                format!("`davit shutdown` raises `{shutdown}` once more, which `{outer}` hears there; {force}")
            }
            (false, Some(event)) => format!("its coordinator hears `davit event {event}` there; {force}"),
            (false, None) => format!("its coordinator hears nothing there that is open now; {force}"),
        };
        Some(StandsStill { safe: frame.configuration.to_string(), since: frame.at.as_secs_f64(), leads_on })
    }

    pub(super) fn is_safe(&self, id: ConfigId) -> bool {
        self.deployment().configurations.iter().any(|c| c.id == id && c.safe)
    }

    /// The coordinators that hear an event where they are, but for these.
    pub(super) fn who_hears(&self, event: EventName, but: &[Requester]) -> impl Iterator<Item = Ident> {
        let others = self.parts().iter().filter(|part| !but.contains(&Requester::Coordinator(part.name.into())));
        others.filter(move |part| part.takes(event).next().is_some()).map(|part| part.name)
    }
}

/// Steps that had to be forced: each, or how many of each kind where there are too many to read.
fn forced(steps: &[Step]) -> Vec<String> {
    if steps.len() <= limits::FORCED_SHOWN {
        return steps.iter().map(ToString::to_string).collect();
    }
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for step in steps {
        match counts.iter_mut().find(|(verb, _)| *verb == step.verb()) {
            Some((_, count)) => *count += 1,
            None => counts.push((step.verb(), 1)),
        }
    }
    counts.into_iter().map(|(verb, count)| format!("{count} × {verb}")).collect()
}
