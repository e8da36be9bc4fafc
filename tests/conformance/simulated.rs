//! The simulated platform, to be tested.

use crate::bed::{Bed, Made, Trouble, name, types};
use davit::model::{Catalogue, EventName};
use davit::platform::simulated::{Fault, FaultRule, Faults, Options, Simulated};
use davit::time::Clock;
use std::sync::Arc;
use std::time::Duration;

pub struct SimulatedBed;

impl Bed for SimulatedBed {
    fn make(&self, trouble: &[(&'static str, Trouble)]) -> Made {
        let clock = Clock::simulated();
        let guard = clock.enter();
        let mut catalogue = Catalogue::new();
        for ty in types() {
            catalogue.insert(ty);
        }
        // The tests give the component of type `Misbehaving` this name.
        let rules = trouble.iter().map(|(hook, trouble)| {
            let fault = match trouble {
                Trouble::Fail => Fault::Fail,
                Trouble::Panic => Fault::Panic,
                // The platform counts from the deadline, the test from the call.
                Trouble::Hang(after) => {
                    Fault::Hang { returns: after.map(|d| d.checked_sub(crate::bed::LIMIT).unwrap_or(Duration::ZERO)) }
                }
            };
            FaultRule::on(&format!("{hook} bad"), fault)
        });
        let options = Options { faults: Faults::new(rules), ..Options::default() };
        let platform = Simulated::new(catalogue, clock.clone(), options);
        let handle = platform.clone();
        Made {
            platform: Arc::new(platform),
            clock,
            raise: Box::new(move |component, event| handle.raise(name(component), EventName::new(event).unwrap())),
            keep: vec![Box::new(guard)],
        }
    }
}
