//! Safe configurations and values that are on their way to the platform when they come: nobody knows whether these are there.

use crate::rig::*;
use davit::model::{Ask, Configuration, RequestId, Value};
use davit::platform::simulated::{Delays, StepPattern};
use davit::stack::{Batch, Request, Scope};
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

/// The undo of a safe one is interrupted by another one of its group: what it had set stays so until that is let go of, whichever way the
/// write that was out went.
#[test]
fn what_one_takes_the_place_of_stays_when_its_undo_is_interrupted() {
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
            assert_eq!(gain(&rig), Value::Float(3.0), "as `low` says: {between} {lands}");
            rig.in_step();
            assert_eq!(rig.ask("hold.undo"), ["hold.undone"]);
            assert_eq!(gain(&rig), Value::Float(7.0), "as `gain` says: {between} {lands}");
            rig.in_step();
            rig.each_answered_once();
        }
    }
}

/// A state that brings something safe with it is left and entered anew, and left again, before any of that has begun, and then another
/// coordinator stops: the undo that this refuses let go of what comes last, and not of what that takes the place of. So it stands in
/// nobody's way who leads down.
#[test]
fn what_is_let_go_before_it_has_begun_is_left() {
    for (grouped, refused) in [("low", 1), ("", 2)] {
        let rig = about_a(grouped);
        let by_state = |number: u64, ask: Ask| Request {
            scope: Some(Scope(7)),
            ..Request::new(RequestId(number), ask, coordinator(COORDINATOR))
        };
        let (enter, leave) = (Ask::Apply(id("low")), Ask::UndoOf(id("low")));
        rig.handle.submit(Batch::one(by_state(1001, enter))).unwrap();
        rig.wait(1.0);
        let again = [by_state(1002, leave), by_state(1003, enter)];
        rig.handle.submit(again.into_iter().collect()).unwrap();
        rig.handle.submit(Batch::one(by_state(1004, leave))).unwrap();
        rig.submit_as("hold", coordinator("c2")).unwrap();
        rig.wait(1.0);
        let events = rig.events();
        assert_eq!(events.iter().filter(|event| *event == "low.undo.failed").count(), refused, "{events:?}");
        rig.handle.leaving(true);
        assert_eq!(rig.ask_as("hold.undo", coordinator("c2")).last().unwrap(), "hold.undone");
        assert_eq!(rig.ask("make.undo"), ["make.undone"], "{grouped}: {:?}", rig.frames());
        assert_eq!(rig.frames(), [""; 0]);
        rig.in_step();
    }
}
