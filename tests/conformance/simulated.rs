//! The simulated platform, to be tested.

use crate::bed::{Bed, Made, Trouble, WORK, name, types};
use davit::model::{Catalogue, EventName};
use davit::platform::simulated::{Delays, Fault, FaultRule, Faults, Options, Simulated, StepPattern};
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
        let rules = trouble.iter().filter(|(_, trouble)| *trouble != Trouble::Long).map(|(hook, trouble)| {
            let fault = match trouble {
                Trouble::Fail => Fault::Fail,
                Trouble::Panic => Fault::Panic,
                Trouble::Deaf => Fault::Deaf,
                Trouble::Long => unreachable!("left out above"),
                // The platform counts from the deadline, the test from the call.
                Trouble::Hang(after) => {
                    Fault::Hang { returns: after.map(|d| d.checked_sub(crate::bed::LIMIT).unwrap_or(Duration::ZERO)) }
                }
            };
            let step = if *hook == "work" { "operation_call bad.work".to_owned() } else { format!("{hook} bad") };
            FaultRule::on(&step, fault)
        });
        let long = trouble.iter().any(|(_, trouble)| matches!(trouble, Trouble::Long | Trouble::Deaf));
        let of = if long { vec![(StepPattern::new("operation_call bad.work"), WORK)] } else { Vec::new() };
        let delays = Delays { of, ..Delays::default() };
        let options = Options { faults: Faults::new(rules), delays, ..Options::default() };
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
