//! What an operator has put in the way of what a coordinator undoes while it leads down.

use crate::names::event;
use crate::stopping::{Small, force};
use davit::model::{Ask, ConfigId};
use davit::platform::simulated::{Fault, FaultRule, Faults};
use davit::session::{NotRaised, Stage};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What an operator has put on top of what its coordinator takes away goes with it, newest first: nothing is left to the stages
/// that come after.
#[test]
fn what_an_operator_put_in_the_way_goes_with_what_the_coordinator_undoes() {
    let small = Small::up("lowering").with(&["soft", "stiff"]);
    let (ended, _) = small.stop();
    assert!(ended.is_orderly() && ended.forced.is_empty(), "{ended:?} {}", small.why("base.undo.failed"));
    let steps = small.steps();
    let at = |what: &str| steps.iter().position(|step| step == what).unwrap_or_else(|| panic!("{what}: {steps:?}"));
    assert!(at("property_set b.k = 3.0") < at("property_set b.k = 1.0"), "{steps:?}");
    assert!(at("property_set b.k = 1.0") < at("destroy b"), "{steps:?}");
    let told = "`stiff`, `soft` of an operator were undone with it, since they stood in its way";
    assert_eq!(small.why("base.undone"), told);
    small.is_empty();
}

/// The event that ends the deployment is the same one whoever raises it; and what was undone with something stays undone in the
/// next life, in which an operator's frames stand in the way again while it is up.
#[test]
fn who_raises_the_event_that_ends_it_takes_along_too_and_once_it_is_up_again_nothing_is() {
    let small = Small::up("lowering").with(&["soft"]);
    small.session.raise(event("e_stop"), "operator");
    small.clock.sleep(Duration::from_secs(4));
    assert!(
        small.heard("base.undone") && Small::in_force(&small.session).is_empty(),
        "{:?}",
        small.heard.lock().unwrap()
    );
    small.session.raise(event("e_start"), "operator");
    small.clock.sleep(Duration::from_secs(4));
    let small = small.with(&["soft"]);
    let undo = Ask::UndoOf(ConfigId::new("base").unwrap());
    // By force in a coordinator's stead: an operator takes nothing along.
    small.session.request(undo, "operator", true);
    small.clock.sleep(Duration::from_secs(1));
    assert!(small.why("base.undo.failed").contains("cannot be undone before"), "{}", small.why("base.undo.failed"));
    assert_eq!(Small::in_force(&small.session), ["base", "lift", "soft"]);
    let (ended, _) = small.stop();
    assert!(ended.is_orderly(), "{ended:?}");
}

/// Who wants it up again while it is being led down, and is heard by nobody, changes nothing; while it is being stopped that is
/// refused from the first moment on.
#[test]
fn an_event_that_begins_it_and_that_nobody_hears_changes_nothing() {
    let small = Small::up("lowering").with(&["soft"]);
    small.session.raise(event("e_stop"), "operator");
    small.clock.sleep(Duration::from_millis(500));
    small.session.raise(event("e_start"), "operator");
    small.clock.sleep(Duration::from_secs(4));
    assert!(small.heard("base.undone"), "{}", small.why("base.undo.failed"));
    let small = Small::up("lowering").with(&["soft"]);
    let refused = Arc::new(Mutex::new(None));
    let told = refused.clone();
    small.after(0.5, move |session| {
        *told.lock().unwrap() = Some(session.offer(event("e_start"), "operator"));
    });
    let (ended, _) = small.stop();
    assert!(ended.is_orderly() && ended.forced.is_empty(), "{ended:?} {}", small.why("base.undo.failed"));
    let refused = refused.lock().unwrap().take();
    assert!(matches!(refused, Some(Err(NotRaised::Stopping))), "{refused:?}");
}

/// Both or none: when the undo fails, what was undone with it is in force as before.
#[test]
fn when_the_undo_fails_what_went_with_it_is_as_before() {
    let small = Small::new("lowering", vec![FaultRule::on("destroy b", Fault::Fail).times(2)]);
    small.session.bring_up().unwrap();
    let small = small.with(&["soft"]);
    let seen = Arc::new(Mutex::new(None));
    let told = seen.clone();
    small.after(3.0, move |session| {
        *told.lock().unwrap() = Some((Small::in_force(session), format!("{:?}", session.system().unwrap().components)));
    });
    let (ended, _) = small.stop();
    let (frames, system) = seen.lock().unwrap().take().unwrap();
    let why = small.why("base.undo.failed");
    assert!(why.contains("destroy b"), "{why}");
    assert_eq!(frames, ["base", "soft"], "{system}");
    assert!(system.contains("3.0"), "{system}");
    assert!(ended.is_clean() && ended.stage != Stage::Led, "{ended:?}");
}

/// And where even that fails each is left as far as it has gone.
#[test]
fn what_went_with_an_undo_that_broke_is_gone_and_the_rest_of_the_undo_is_left() {
    let faults =
        vec![FaultRule::on("destroy b", Fault::Fail).times(2), FaultRule::on("operation_call b.open", Fault::Fail)];
    let small = Small::up("lowering").with(&["stiff", "look"]);
    small.platform.set_faults(Faults::new(faults));
    let seen = Arc::new(Mutex::new(None));
    let told = seen.clone();
    small.after(3.0, move |session| {
        *told.lock().unwrap() = Some((Small::in_force(session), format!("{:?}", session.system().unwrap().components)));
    });
    let (ended, _) = small.stop();
    let (frames, system) = seen.lock().unwrap().take().unwrap();
    assert!(small.heard("base.undo.broken"), "{:?}", small.heard.lock().unwrap());
    assert_eq!(frames, ["base partial", "stiff"], "{system}");
    assert!(system.contains("4.0"), "{system}");
    assert!(ended.is_clean() && ended.stage != Stage::Led, "{ended:?}");
}

/// What would move when it is taken away is not taken along, and the coordinator is told why.
#[test]
fn what_would_move_is_not_taken_along() {
    let small = Small::up("lowering").with(&["hoist"]);
    let (ended, _) = small.stop();
    assert_eq!(ended.stage, Stage::TakenBack, "{ended:?}");
    let why = small.why("base.undo.failed");
    assert!(why.contains("`base` cannot be undone before `hoist`"), "{why}");
    assert!(why.contains("that is not undone with it: `operation_call b.lower") && why.contains("moves"), "{why}");
    assert!(ended.is_clean(), "{ended:?}");
}

/// Nor is what an operator made safe.
#[test]
fn what_an_operator_made_safe_is_not_taken_along() {
    let small = Small::up("lowering").with(&["calm"]);
    small.after(20.0, force);
    let (ended, _) = small.stop();
    let why = small.why("base.undo.failed");
    assert!(why.contains("that is not undone with it: it is a safe configuration"), "{why}");
    assert!(ended.is_clean() && ended.stage == Stage::Forced, "{ended:?}");
}
