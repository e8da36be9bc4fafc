//! What panics: whoever drives a session, a coordinator's thread, whoever only hears of what happens. The robot is not left up.

use crate::names::event;
use crate::stopping::{Small, force};
use davit::session::{Command, Happening, Phase, Stage};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The next time that it happens whoever tells of it panics: an observer is called in the thread of who acts.
fn panics_at(small: &Small, what: impl Fn(&Happening) -> bool + Send + Sync + 'static) {
    let once = AtomicBool::new(true);
    small.session.hub().observe(Arc::new(move |_, happening| {
        if what(happening) && once.swap(false, Ordering::Relaxed) {
            panic!("on purpose");
        }
    }));
}

fn told(small: &Small, text: &str) -> bool {
    let log = small.session.hub().log(usize::MAX);
    log.iter().any(|entry| matches!(&entry.what, Happening::Noted { note } if note.contains(text)))
}

/// What drives it panics once it is up: its coordinator leads down all the same, and then the panic goes on.
#[test]
fn who_drives_it_may_panic_and_it_is_led_down() {
    let small = Small::new("lowering", Vec::new());
    panics_at(&small, |what| matches!(what, Happening::Phase { phase: Phase::Up }));
    let (panic, ended) = small.session.guarded(|| small.session.bring_up()).expect_err("it panics");
    assert_eq!(panic.downcast_ref::<&str>(), Some(&"on purpose"));
    let ended = ended.expect("it was stopped");
    assert!(ended.is_orderly(), "{ended:?}");
    assert!(told(&small, "what drives `small` has panicked: on purpose"));
    assert!(small.steps().iter().any(|step| step.contains("a.lower")));
    small.is_empty();
    assert!(small.session.guarded(|| small.session.status()).is_ok(), "what does not panic is left alone");
}

/// In the middle of coming up, and again while it is stopped: the next stage does what the one that panicked did not.
#[test]
fn a_stage_that_panics_is_left_to_the_next() {
    let small = Small::new("lowering", Vec::new());
    panics_at(&small, |what| matches!(what, Happening::Phase { phase: Phase::Deploying }));
    panics_at(
        &small,
        |what| matches!(what, Happening::Event { event, from, .. } if event == "e_stop" && from == "deployment"),
    );
    small.session.guarded(|| small.session.bring_up()).expect_err("it panics");
    small.is_empty();

    let small = Small::up("lowering");
    panics_at(
        &small,
        |what| matches!(what, Happening::Event { event, from, .. } if event == "e_stop" && from == "deployment"),
    );
    let (ended, _) = small.stop();
    assert!(ended.stage == Stage::TakenBack && ended.is_clean(), "{ended:?}");
    assert!(ended.forced.iter().any(|note| note.contains("davit itself has panicked: on purpose")), "{ended:?}");
    let steps = small.steps();
    assert!(steps.iter().any(|step| step.contains("a.lower")), "{steps:?}");
    small.is_empty();
}

/// Who hears of a stage and panics keeps nothing from being done.
#[test]
fn who_only_hears_of_a_stage_does_not_change_it() {
    let small = Small::up("lowering");
    panics_at(&small, |what| matches!(what, Happening::Phase { phase: Phase::ShuttingDown }));
    panics_at(&small, |what| matches!(what, Happening::Stopping { .. }));
    panics_at(&small, |what| matches!(what, Happening::Phase { phase: Phase::Down }));
    let (ended, _) = small.stop();
    assert!(ended.is_orderly(), "{ended:?}");
    small.is_empty();
}

/// A coordinator's thread that ends is told of at once, and it is stopped without it.
#[test]
fn a_coordinator_that_ends_is_noticed_at_once() {
    let small = Small::up("lowering");
    panics_at(
        &small,
        |what| matches!(what, Happening::State { active } if active.last().is_some_and(|leaf| leaf.ends_with("safe"))),
    );
    small.after(10.0, |session| session.raise(event("e_estop"), "test"));
    small.after(500.0, |session| session.command(Command::Shutdown { force: false }));
    let began = small.clock.now();
    let command = small.session.serve();
    assert!(small.clock.now().since(began) < Duration::from_secs(11), "nobody noticed it");
    assert_eq!(command, Command::Shutdown { force: false });
    assert!(told(&small, "the coordinator `small` has ended and leads no more: it panicked: on purpose"));
    // It was reacting to an emergency: that acts by itself, and people let go.
    small.after(520.0, force);
    let (ended, took) = small.stop();
    assert!(small.heard("calm.ok"), "{:?}", small.heard.lock().unwrap());
    assert!(ended.stage == Stage::Forced && ended.is_clean() && took > 500.0, "{took} {ended:?}");
    small.is_empty();
}

/// Also while it comes up, and while it leads down.
#[test]
fn a_coordinator_that_ends_on_the_way_up_or_down_is_noticed_at_once() {
    let small = Small::new("lowering", Vec::new());
    panics_at(
        &small,
        |what| matches!(what, Happening::State { active } if active.last().is_some_and(|leaf| leaf.ends_with("up"))),
    );
    let not_up = small.session.bring_up().expect_err("nobody leads it");
    assert_eq!(not_up.why, "a coordinator has ended");
    assert!(not_up.ended.stage == Stage::TakenBack && not_up.ended.is_clean(), "{not_up:?}");
    small.is_empty();

    let small = Small::up("lowering");
    panics_at(
        &small,
        |what| matches!(what, Happening::State { active } if active.last().is_some_and(|leaf| leaf.ends_with("removing"))),
    );
    let (ended, took) = small.stop();
    assert!(ended.stage == Stage::TakenBack && ended.is_clean() && took < 4.0, "{took} {ended:?}");
    assert!(ended.forced.iter().any(|note| note.contains("a coordinator has ended")), "{ended:?}");
}
