//! The bed of the simulated platform: for itself, and for platforms that are tried with it at their far end.

use super::Times;
use super::bed::{Bed, BedTrouble, UnderTest};
use super::words::{name, types};
use crate::model::{Catalogue, EventName};
use crate::platform::simulated::{Delays, Fault, FaultRule, Faults, Simulated, SimulatedOptions, StepPattern};
use crate::time::Clock;
use std::sync::Arc;
use std::time::Duration;

/// Makes simulated platforms.
pub struct StandIn;

impl StandIn {
    /// A simulated platform that is in this trouble, on a simulated clock that the calling thread has entered; and what a bed
    /// makes of it, in which whoever has a platform of his own before it puts that.
    pub fn with(trouble: &[(&'static str, BedTrouble)]) -> (Simulated, UnderTest) {
        let clock = Clock::simulated();
        let guard = clock.enter();
        let mut catalogue = Catalogue::new();
        types().into_iter().for_each(|ty| drop(catalogue.insert(ty)));
        let rules = trouble.iter().filter_map(|(hook, trouble)| {
            let fault = match trouble {
                BedTrouble::Fail => Fault::Fail,
                BedTrouble::Panic => Fault::Panic,
                BedTrouble::Deaf => Fault::Deaf,
                // It only takes its time.
                BedTrouble::Long => return None,
                // The platform counts from the deadline, the rules from the call.
                BedTrouble::Hang(after) => Fault::Hang {
                    returns: after.map(|it| it.checked_sub(Times::default().limit).unwrap_or(Duration::ZERO)),
                },
            };
            Some(FaultRule::on(&pattern(hook), fault))
        });
        let long = trouble.iter().any(|(_, trouble)| matches!(trouble, BedTrouble::Long | BedTrouble::Deaf));
        let of = if long { vec![(StepPattern::new(&pattern("work")), Times::default().work)] } else { Vec::new() };
        let delays = Delays { of, ..Delays::default() };
        let options = SimulatedOptions { faults: Faults::new(rules), delays, ..SimulatedOptions::default() };
        let simulated = Simulated::new(catalogue, clock.clone(), options);
        let handle = simulated.clone();
        let raise = move |component: &str, event: &str| {
            if let Ok(event) = EventName::new(event) {
                handle.raise(name(component), event);
            }
        };
        let made = UnderTest {
            platform: Arc::new(simulated.clone()),
            clock,
            raise: Box::new(raise),
            keep: vec![Box::new(guard)],
        };
        (simulated, made)
    }
}

fn pattern(hook: &str) -> String {
    if hook == "work" { "operation_call bad.work".to_owned() } else { format!("{hook} bad") }
}

impl Bed for StandIn {
    fn make(&self, trouble: &[(&'static str, BedTrouble)]) -> UnderTest {
        Self::with(trouble).1
    }
}
