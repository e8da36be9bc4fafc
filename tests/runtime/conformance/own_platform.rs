//! The platform of the example, as a program that brings one tries it: docs/platforms.md shows these lines.

#[path = "../../../examples/own_platform/bus.rs"]
mod bus;

use bus::Bus;
use davit::platforms::conformance::{Bed, BedTrouble, StandIn, UnderTest, run};
use std::sync::Arc;

struct BusBed;

impl Bed for BusBed {
    fn make(&self, trouble: &[(&'static str, BedTrouble)]) -> UnderTest {
        // What is at the other end: it fails, panics and hangs as it is told to.
        let (books, made) = StandIn::with(trouble);
        let bus = Bus::new(Box::new(std::io::sink()), String::new(), books);
        UnderTest { platform: Arc::new(bus), ..made }
    }
}

#[test]
fn the_bus_keeps_the_rules() {
    let report = run(&BusBed);
    assert!(report.is_kept(), "{report}");
    let skipped: Vec<&str> = report.skipped().map(|(rule, _)| rule.name).collect();
    assert_eq!(skipped, ["prepared_steps_do_what_executed_ones_do"], "it prepares nothing, and need not");
}
