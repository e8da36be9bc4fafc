//! Safe configurations and values that are on their way to the platform when they come: nobody knows whether these are there.

use crate::rig::*;
use davit::model::{Configuration, Value};
use davit::platform::simulated::{Delays, StepPattern};
use std::time::Duration;

/// `A` with `k` 3, and a group of three of which two are safe.
fn about_a(grouped: &str) -> Rig {
    let all = [
        configuration("make", "", "create A; create B; set A.k 3", "A:running"),
        configuration("gain", "", "set A.k 7", ""),
        configuration("low", "", "set A.k 3; call B.open", ""),
        configuration("hold", "", "call B.open", ""),
    ];
    let all = all.into_iter().map(|one| Configuration {
        safe: ["low", "hold"].contains(&one.id.as_str()),
        group: grouped.split(' ').any(|of| of == one.id.as_str()).then(|| ident("g")),
        ..one
    });
    let rig = Rig::new(all.collect());
    assert_eq!(rig.ask("make"), ["make.ok"]);
    rig
}

fn gain(rig: &Rig) -> Value {
    rig.see().components[&name("A")].properties[&ident("k")].clone()
}

fn slow(rig: &Rig, pattern: &str, seconds: f64) {
    let of = vec![(StepPattern::new(pattern), Duration::from_secs_f64(seconds))];
    rig.platform.set_delays(Delays { of, ..Delays::default() });
}

/// The write of 7 may have come there and its answer be late: that `k` is 3 already is no reason for a safe one not to write 3.
#[test]
fn what_is_as_wanted_for_all_that_is_known_is_written_where_something_else_is_on_its_way() {
    for (grouped, frames) in [("", "make low"), ("gain low", "make low")] {
        let rig = about_a(grouped);
        slow(&rig, "property_set A.k = 7.0", 0.5);
        rig.submit("gain");
        rig.wait(0.1);
        rig.platform.record();
        rig.submit("low");
        rig.wait(0.1);
        let steps: Vec<String> = rig.platform.record().iter().map(ToString::to_string).collect();
        assert!(steps.iter().any(|step| step.starts_with("property_set A.k")), "{steps:?}");
        rig.wait(50.0);
        assert_eq!(rig.events()[1..], ["low.ok", "gain.failed"]);
        assert_eq!((gain(&rig), rig.frames().join(" ")), (Value::Float(3.0), frames.to_owned()));
        assert_eq!(rig.ask("low.undo"), ["low.undone"]);
        assert_eq!(gain(&rig), Value::Float(3.0));
        rig.in_step();
        rig.each_answered_once();
    }
}

/// The undo of a safe one is interrupted by another one of its group: what it had set is not in force any more, whichever way the
/// write that was out went.
#[test]
fn what_one_takes_the_place_of_does_not_come_back_with_what_it_interrupted() {
    for between in [false, true] {
        for lands in [0.05, 0.15, 0.3] {
            let rig = about_a("low hold");
            assert_eq!(rig.ask("gain"), ["gain.ok"]);
            assert_eq!(rig.ask("low"), ["low.ok"]);
            slow(&rig, "property_set A.k = 7.0", lands);
            rig.submit("low.undo");
            rig.wait(0.02);
            slow(&rig, "operation_call", 0.3);
            if between {
                rig.submit("low");
                rig.wait(0.1);
            }
            rig.submit("hold");
            rig.wait(50.0);
            rig.platform.set_delays(Delays::default());
            assert_eq!(rig.frames(), ["make", "gain", "hold"], "{between} {lands}");
            assert_eq!(gain(&rig), Value::Float(7.0), "as `gain` says: {between} {lands}");
            rig.in_step();
            rig.each_answered_once();
        }
    }
}
