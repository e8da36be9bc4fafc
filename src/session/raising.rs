//! Events from outside: to all coordinators or to none.

use super::Session;
use super::halt::Heeded;
use super::hub::Hub;
use super::log::Happening;
use super::names::NotFromOutside;
use super::parts::CoordinatorPart;
use super::routes::{Handles, NO_MORE};
use crate::configurator::{Batch, ConfiguratorHandle, Request, Requester};
use crate::coordinator::{Class, NotAccepted};
use crate::model::{Ask, EventName, Ident, RequestId};

/// An event that was given to all coordinators.
#[derive(Debug)]
pub struct Offered {
    /// To be asked with what became of it.
    pub ticket: u64,
    /// It is one of safety that acted by itself, since no coordinator leads any more.
    pub acted: Option<Acted>,
}

/// Why an event from outside was not raised. Nobody was told of it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotRaised {
    /// Nobody outside may raise it.
    #[error(transparent)]
    NotFromOutside(#[from] NotFromOutside),
    /// It begins the deployment, which is being stopped.
    #[error("{NO_MORE}")]
    Stopping,
    /// A coordinator that may hear it does not keep up.
    #[error(transparent)]
    Refused(#[from] NotAccepted),
}

impl Session {
    /// Gives an event to all coordinators, in the name of `from`; where that is refused it is written down.
    pub fn raise(&self, event: EventName, from: &str) {
        if let Err(refused) = self.offer(event, from) {
            self.hub().note(Happening::Noted { note: format!("`{event}` was not delivered: {refused}") });
        }
    }

    /// The same, for those who can be told that it is refused.
    ///
    /// # Errors
    /// [`NotRaised`].
    pub fn offer(&self, event: EventName, from: &str) -> Result<(), NotRaised> {
        self.deliver(event, from, 0, |_| true).map(drop)
    }

    /// The same to these coordinators alone, those of subsystems among them, also where it is given on to these: each hears of one event
    /// in its own time, and this is how that is tried.
    ///
    /// # Errors
    /// As [`Session::offer`].
    pub fn offer_to(&self, event: EventName, to: &[Ident], from: &str) -> Result<(), NotRaised> {
        self.deliver(event, from, 0, |name| to.contains(&name)).map(drop)
    }

    /// The coordinators to which an event from outside is given: those of the file whose event it is, and of one of safety those of the
    /// subsystems that it is given on to.
    pub fn given_to(&self, event: EventName) -> Vec<Ident> {
        let files: Vec<Option<Ident>> = self.junction().reaches(event).map(|(_, file)| file).collect();
        self.parts().iter().filter(|part| files.contains(&part.of)).map(|part| part.name).collect()
    }

    /// The same as [`raise`](Self::raise); the hub (`was_heard`) says with the number that this answers what became of it, until it is
    /// forgotten.
    ///
    /// # Errors
    /// As [`Session::offer`].
    pub fn offer_watched(&self, event: EventName, from: &str) -> Result<Offered, NotRaised> {
        let ticket = self.hub().ticket(self.parts().len());
        let acted = self.deliver(event, from, ticket, |_| true).inspect_err(|_| self.hub().forget(ticket))?;
        Ok(Offered { ticket, acted })
    }

    /// What to know where no coordinator heard an event of safety since something safe is in force: that something else was
    /// applied over that. It is the coordinators that lead, so the event does nothing there.
    pub(super) fn applied_over_safe(&self, event: EventName) -> Option<String> {
        if !self.deployment().safety.iter().any(|(own, _)| *own == event) {
            return None;
        }
        let frames = match self.frames() {
            Ok(frames) => frames,
            Err(unanswered) => {
                return Some(format!(
                    "{unanswered}: whether something safe is in force, and what was applied over it, is not known"
                ));
            }
        };
        let safe = frames.iter().rposition(|frame| self.is_safe(frame.configuration))?;
        let over = &frames[safe + 1..];
        let names: Vec<String> = over.iter().map(|it| format!("`{}` by {}", it.configuration, it.by)).collect();
        let safe = frames[safe].configuration;
        (!over.is_empty()).then(|| {
            format!(
                "`{safe}` is in force, and was not applied again: since then came {}; `davit apply {safe}` applies it again",
                names.join(", ")
            )
        })
    }

    fn deliver(
        &self,
        event: EventName,
        from: &str,
        ticket: u64,
        to: impl Fn(Ident) -> bool,
    ) -> Result<Option<Acted>, NotRaised> {
        self.may_raise(event.as_str())?;
        if self.hub().is_stopping() && self.junction().begins(event) {
            return Err(NotRaised::Stopping);
        }
        let given =
            |file: Option<Ident>| self.parts().iter().filter(move |part| part.of == file).filter(|part| to(part.name));
        let mut reached = self.junction().reaches(event);
        let own = reached.by_ref().take(1).flat_map(|(_, file)| given(file));
        let incoming = self.junction().incoming(Class::Outside, event).watched(ticket);
        // All of them have room, or none hears of it.
        let (mut held, mut gone): (Vec<&CoordinatorPart>, bool) = (Vec::with_capacity(self.parts().len()), false);
        for part in own {
            match part.coordinator.hold(incoming.class) {
                Ok(()) => held.push(part),
                Err(NotAccepted::Full) if part.may_hear(event) => {
                    held.iter().for_each(|part| part.coordinator.release(incoming.class));
                    return Err(NotAccepted::Full.into());
                }
                Err(NotAccepted::Full) => {}
                Err(NotAccepted::Detached) => gone = true,
            }
        }
        let _on_the_way = self.junction().on_the_way.begin();
        self.hub().note(Happening::Event { event: event.to_string(), from: from.to_owned(), safety: false });
        self.configurator().event(event);
        self.junction().tell_leaving(self.configurator(), event);
        let acted = make_safe(self.hub(), self.configurator(), event, Class::Outside);
        // One of safety is given on to every subsystem that has it: whether it was heard is said there as well.
        let coordinators = |file| given(file).map(|part| part.coordinator.clone()).collect();
        let inside: Vec<(EventName, Handles)> = reached.map(|(event, file)| (event, coordinators(file))).collect();
        let given_on: usize = inside.iter().map(|(_, coordinators)| coordinators.len()).sum();
        (held.len() + given_on..self.parts().len()).for_each(|_| self.hub().taken_up(ticket, None));
        let (mut unwatched, mut missed) = (false, 0);
        {
            let _giving = self.junction().giving();
            for part in held {
                match part.coordinator.deliver(incoming) {
                    Ok(_) => continue,
                    // It waits already, and too many want to know what becomes of it.
                    Err(NotAccepted::Full) => unwatched = true,
                    Err(NotAccepted::Detached) => gone = true,
                }
                missed += 1;
            }
        }
        (0..missed).for_each(|_| self.hub().taken_up(ticket, None));
        // Stopped meanwhile: then it acts by itself.
        let again = || make_safe(self.hub(), self.configurator(), event, Class::Outside);
        let acted = acted.or_else(|| gone.then(again).flatten());
        if gone && acted.is_none() {
            self.hub().note(Happening::Noted { note: format!("`{event}` was not delivered: the coordinator is gone") });
        }
        // One that has acted by itself is heard by nobody: what they kept of it would act once more when force is asked for.
        let inside = if acted.is_some() { Vec::new() } else { inside };
        (0..if acted.is_some() { given_on } else { 0 }).for_each(|_| self.hub().taken_up(ticket, None));
        for (event, coordinators) in inside {
            let incoming = self.junction().incoming(Class::Outside, event).watched(ticket);
            self.junction().give(self.hub(), coordinators, incoming);
        }
        if unwatched { Err(NotAccepted::Full.into()) } else { Ok(acted) }
    }
}

/// What a safety event did that acted by itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Acted {
    /// What it asked for.
    pub requests: Vec<RequestId>,
    /// Another one had asked for that just before, and this one is one with it.
    pub before: bool,
}

/// A safety event that no coordinator hears any more acts by itself: everything safe is applied. Who sends one again where that
/// failed wants it tried again; a component may raise it in each update, and is heeded once in a while.
pub(super) fn make_safe(hub: &Hub, configurator: &ConfiguratorHandle, event: EventName, class: Class) -> Option<Acted> {
    let failed = |id: &RequestId| hub.answer(*id).is_some_and(|answered| !answered.ok);
    let anew = |requests: &[RequestId]| class == Class::Outside && requests.iter().any(failed);
    let Heeded { requests, apply } = hub.halt().heed(event, hub.now(), anew, || hub.number())?;
    for (id, request) in apply.iter().zip(&requests) {
        let ask = Ask::Apply(*id);
        hub.requested(*request, ask, Requester::Safety, Requester::Safety.to_string());
        // A full queue has answered it already.
        let _ = configurator.submit(Batch::one(Request::new(*request, ask, Requester::Safety)));
    }
    Some(Acted { before: apply.is_empty() && !requests.is_empty(), requests })
}
