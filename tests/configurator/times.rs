//! How long what is asked for may take: each configuration as long as it gives itself, whatever is asked for with it.

use crate::rig::*;
use davit::model::*;
use davit::platform::simulated::{Fault, FaultRule, Faults, SimulatedOptions};
use std::sync::Arc;
use std::time::Duration;

/// A call that takes so long; one step may take one second.
fn rig(slow: &[(&str, f64)]) -> Rig {
    let mut all = vec![
        configuration("base", "", "create A; create B; create C", "_default:running"),
        configuration("mode", "", "set A.k 1", ""),
        configuration("quick", "", "set B.k 2", ""),
        configuration("long", "", "call C.open", ""),
        configuration("longer", "", "call C.open", ""),
        configuration("brake", "", "call A.open", ""),
    ];
    for configuration in &mut all {
        configuration.safe = configuration.id == id("brake");
        let own = match configuration.id.as_str() {
            "quick" => Some(0.5),
            "longer" | "brake" => Some(5.0),
            _ => None,
        };
        configuration.timeout = own.map(Duration::from_secs_f64);
    }
    let limits = DeploymentLimits { step_timeout: Duration::from_secs(1), ..DeploymentLimits::default() };
    let rig = Rig::full(
        all,
        SimulatedOptions { blocking: true, ..SimulatedOptions::default() },
        |platform| Arc::new(platform),
        limits,
    );
    assert_eq!(rig.ask("base mode"), ["base.ok", "mode.ok"]);
    let rules = slow.iter().map(|(step, s)| FaultRule::on(step, Fault::Slow(Duration::from_secs_f64(*s))));
    rig.platform.set_faults(Faults::new(rules));
    rig
}

/// Undone and pushed in one step is one transaction: the time of one of its configurations is none of the others'.
#[test]
fn what_is_asked_for_together_keeps_its_own_time() {
    let long = rig(&[("operation_call C.open", 0.9)]);
    assert_eq!(long.ask("mode.undo quick long"), ["mode.undone", "quick.ok", "long.ok"]);
    long.in_step();
    // Nor is more given to one because another has more.
    let quick = rig(&[("property_set B.k", 0.7)]);
    let told = quick.ask("mode.undo quick longer");
    assert!(told.contains(&"quick.failed".to_owned()), "{told:?}");
    let longer = rig(&[("operation_call C.open", 3.0)]);
    assert_eq!(longer.ask("mode.undo quick longer"), ["mode.undone", "quick.ok", "longer.ok"]);
    longer.in_step();
    longer.each_answered_once();
}

#[test]
fn what_is_safe_has_the_time_that_it_gives_itself() {
    let rig = rig(&[("operation_call A.open", 3.0)]);
    assert_eq!(rig.ask("brake"), ["brake.ok"]);
    rig.in_step();
    assert!(rig.platform_quarantined().is_empty());
}
