//! Where the slow look at what nothing is under way with stands (`observing`).

use super::inbox::PoolTicket;
use crate::limits;
use crate::model::ComponentName;
use crate::time::Time;

/// A look at some components, as the slow one takes it.
pub(super) struct SlowLook {
    pub ticket: PoolTicket,
    /// Each with when the model had touched it last: what is done to it meanwhile makes the look stale.
    pub components: Vec<(ComponentName, Option<u64>)>,
    pub until: Time,
}

/// Where it stands.
#[derive(Default)]
pub(super) struct Observing {
    /// When the next round begins; none: nothing is in force.
    pub next: Option<Time>,
    /// What is left of this round.
    pub rest: Vec<ComponentName>,
    pub out: Option<SlowLook>,
    /// Something was there since the last round began: one is owed also when nothing is any more.
    pub owed: bool,
}

impl Observing {
    /// When it goes on: in any case, and if time goes on anyway.
    pub fn until(&self) -> (Time, Time) {
        match &self.out {
            Some(look) => (look.until, Time::NEVER),
            None => (Time::NEVER, self.next.unwrap_or(Time::NEVER)),
        }
    }

    /// A round begins now, whatever was looked at.
    pub fn at_once(&mut self, now: Time) {
        self.rest.clear();
        self.owed = true;
        self.next = Some(now);
    }

    /// A round is over, or begins to be waited for.
    pub fn later(&mut self, now: Time) {
        self.rest.clear();
        self.next = Some(now + limits::OBSERVE_EVERY);
    }
}
