//! Bringing a deployment up (semantics: *Stopping*), and what keeps one that fails, or is late, from being stopped: something safe, which people
//! alone let go.

use super::held::LastMoment;
use super::life::NotUp;
use super::log::{Happening, Phase};
use super::{Command, Session, Unanswered};
use crate::limits;
use crate::model::Ident;
use crate::time::Time;
use std::sync::atomic::Ordering;

/// One that is on its way.
struct ComingUp<'s> {
    session: &'s Session,
    start: Time,
    deadline: Time,
    /// Since when a coordinator is in a state that says so, and whether something safe was seen to hold it there.
    failed: Option<Time>,
    failed_held: bool,
    /// Something safe has held it when its time was over.
    held: bool,
    /// The configurator has not answered whether something safe holds it, once.
    unanswered: bool,
    /// What has been told.
    told_failed: bool,
    told_late: bool,
}

/// What becomes of it.
enum Outlook {
    /// It goes on.
    Open,
    /// It is stopped, for that reason, since that moment has come; what was written down up to that count has been heard.
    Stopped { why: String, moment: Time, seen: u64 },
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
        let event = self.deployment().deploy.event;
        let mut coming = ComingUp::new(self);
        let began = hub.heard();
        hub.set_phase(Phase::Deploying);
        // Who does not hear it yet, while what was asked for at the beginning is not answered, is told once more then.
        let mut ticket = match self.offer_watched(event, "deployment") {
            Ok(offered) => Some(offered.ticket),
            Err(refused) => {
                hub.note(Happening::Noted { note: format!("`{event}` was not delivered: {refused}") });
                None
            }
        };
        let mut force = false;
        let why = loop {
            if let Some(Command::Shutdown { force: by_force }) = self.pending_command() {
                force = by_force;
                break (format!("interrupted while deploying `{}`", self.deployment().name), true);
            }
            if !self.leads() {
                break ("a coordinator has ended".to_owned(), false);
            }
            if let Some(why) = coming.failed().begins(self) {
                break (why, false);
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
                let unheard: Vec<Ident> = self.who_hears(event, &heard).collect();
                if !unheard.is_empty() && self.offer_to(event, &unheard, "deployment").is_ok() {
                    continue;
                }
            }
            if let Some(why) = coming.late().begins(self) {
                break (why, false);
            }
            self.tell_slow();
            hub.changed.wait(self.next_look(coming.next_look()));
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
}

impl Outlook {
    /// Why it is stopped from now on, if it is: what is told meanwhile was before that, and is heard first.
    fn begins(self, session: &Session) -> Option<String> {
        let Self::Stopped { why, moment, seen } = self else { return None };
        let has_begun = !session.may_be_held()
            || session.hub().begin_phase(Phase::ShuttingDown, seen)
            || session.clock().now() >= moment + limits::VIEW;
        has_begun.then_some(why)
    }
}

impl<'s> ComingUp<'s> {
    fn new(session: &'s Session) -> Self {
        let start = session.clock().now();
        let deadline = start + session.deployment().deploy.within;
        let (failed, failed_held, held, unanswered) = (None, false, false, false);
        let (told_failed, told_late) = (false, false);
        Self { session, start, deadline, failed, failed_held, held, unanswered, told_failed, told_late }
    }

    /// Whether it is to be stopped since that moment has come: who may be held then is asked about that first.
    fn has_come(&self, moment: Time) -> bool {
        let (session, now) = (self.session, self.session.clock().now());
        if !session.may_be_held() {
            return now >= moment;
        }
        LastMoment(moment).is_over(now, || session.junction().has_reacted(session.hub()))
    }

    /// A coordinator is in a state that says that it failed: it is stopped, but in an emergency. What stopping it would move then, nobody has
    /// asked for.
    fn failed(&mut self) -> Outlook {
        let session = self.session;
        let Some(state) = session.failed_state() else {
            (self.failed, self.failed_held) = (None, false);
            return Outlook::Open;
        };
        let since = *self.failed.get_or_insert_with(|| session.clock().now());
        let seen = session.hub().epoch();
        if !self.has_come(since) {
            return Outlook::Open;
        }
        match session.fails_in_emergency(self.start) {
            Ok(true) => {
                (self.unanswered, self.failed_held) = (false, true);
                if !std::mem::replace(&mut self.told_failed, true) {
                    let why = format!("it does not come up, since the coordinator is in `{state}`");
                    session.tell_held(&why, "when that is let go it is led down");
                }
                Outlook::Open
            }
            // Let go of just now: what comes at that moment is heard first as well.
            Ok(false) if std::mem::take(&mut self.failed_held) => {
                self.failed = Some(session.clock().now());
                Outlook::Open
            }
            // What came while that was asked is heard first.
            Ok(false) if !self.has_come(since) => Outlook::Open,
            // It may be one: asked once more, before anything moves.
            Err(Unanswered) if !std::mem::replace(&mut self.unanswered, true) => self.failed(),
            _ => Outlook::Stopped { why: format!("the coordinator is in `{state}`"), moment: since, seen },
        }
    }

    /// Its time is over: it is stopped, but while something safe holds it. Let go of, it has its time anew.
    fn late(&mut self) -> Outlook {
        let (moment, seen) = (self.deadline, self.session.hub().epoch());
        if !self.has_come(moment) {
            return Outlook::Open;
        }
        let (session, now) = (self.session, self.session.clock().now());
        let within = session.deployment().deploy.within;
        match session.waits_for_people(self.start) {
            Ok(true) => {
                (self.held, self.deadline) = (true, now + within.min(limits::HELD_LOOK));
                if !std::mem::replace(&mut self.told_late, true) {
                    let why = format!("not up after {} s", now.since(self.start).as_secs_f64().round());
                    session.tell_held(&why, "an event that its coordinator hears leads on");
                }
            }
            Ok(false) if std::mem::take(&mut self.held) => self.deadline = now + within,
            Ok(false) if !self.has_come(self.deadline) => {}
            Err(Unanswered) if !std::mem::replace(&mut self.unanswered, true) => self.deadline = now + within,
            _ => return Outlook::Stopped { why: self.not_up(), moment, seen },
        }
        Outlook::Open
    }

    /// What it has come to in its time.
    fn not_up(&self) -> String {
        let (session, waiting) = (self.session, self.session.hub().outstanding());
        let waiting = if waiting.is_empty() { String::new() } else { format!(", waiting for {}", waiting.join(", ")) };
        let within = session.deployment().deploy.within.as_secs_f64();
        format!("not up after {within} s: {}{waiting}", session.hub().whereabouts())
    }

    /// When one of these may have come.
    fn next_look(&self) -> Time {
        let now = self.session.clock().now();
        // While something safe holds one that failed, whoever lets go of it changes something.
        let failed = self.failed.filter(|_| !self.failed_held);
        failed.into_iter().chain([self.deadline]).map(|of| LastMoment(of).next_look(now)).min().unwrap_or(self.deadline)
    }
}
