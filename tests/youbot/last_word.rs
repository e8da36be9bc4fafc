//! The last word counts: a stop that comes while the robot is stopped already, or on its way out of that, is heard, and it
//! stays braked until somebody asks once more.

use crate::live::{Live, jolt};
use davit::model::{Ask, ComponentName, ConfigId, EventName, Step, Transition};
use davit::session::Happening;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A hand that brings the arms together and holds them there.
const HAND: &str = "free 0.5; align 600";

fn insists(live: &Live, id: &str) {
    live.session.request(Ask::Apply(ConfigId::new(id).unwrap()), "test", true);
}

/// Raises an event when it comes to a state the first time, before anything else is heard there.
fn when_in(live: &Live, state: &'static str, event: &'static str) {
    let (session, done) = (Arc::downgrade(&live.session), AtomicBool::new(false));
    live.session.hub().observe(Arc::new(move |_, what| {
        let Happening::State { active } = what else { return };
        if active.last().is_some_and(|place| place.ends_with(state)) && !done.swap(true, Ordering::Relaxed) {
            let session = session.upgrade().expect("it is alive");
            session.raise(EventName::new(event).unwrap(), "test");
        }
    }));
}

fn monitors(live: &Live, transition: Transition) {
    live.step(&Step::State { component: ComponentName::new("Monitors").unwrap(), transition });
}

/// It has come to rest in that state, and stays there at rest with the drives holding.
fn stays(live: &Live, state: &str, what: &str) {
    live.run(0.3);
    live.rows();
    live.run(1.0);
    let rows = live.rows();
    let fastest = rows.iter().map(|row| row.speed.norm()).fold(0.0, f64::max);
    assert!(live.place().ends_with(state), "{what}: in {}\n{}", live.place(), live.story(live.now() - 3.0));
    assert!(fastest < 0.02, "{what}: {fastest} m/s in {state}");
    assert!(rows.iter().all(|row| row.mode == 1), "{what}: the drives do not hold in {state}");
}

fn released(live: &Live, what: &str) {
    live.raise("e_reset");
    live.run(0.3);
    assert!(live.session.in_state("operational"), "{what}: in {}", live.place());
    assert_eq!(live.rows().last().unwrap().mode, 6, "{what}");
}

fn last_words(name: &str) {
    let live = Live::with_hand(name, HAND);
    live.bring_up();
    live.until_state("copying", 5.0);

    // The controller is lost, which goes on by itself; a stop does not.
    when_in(&live, "losing.on", "e_estop");
    live.raise("e_controller_lost");
    stays(&live, "fault.waiting", "a stop behind a controller that was lost");

    // A reset that was raised before the stop, and not taken up before it.
    live.raise("e_reset");
    live.raise("e_estop");
    stays(&live, "fault.waiting", "a stop behind a reset");

    // An operator insists on moving what is stopped.
    live.rows();
    insists(&live, "park");
    live.run(0.6);
    assert!(live.rows().last().unwrap().speed.norm() > 0.05, "it does not park");
    let t = live.now();
    live.raise("e_OVERCURRENT");
    stays(&live, "fault.waiting", "a fault while an operator moves it");
    assert!(live.first("park.broken", t).is_some(), "{}", live.story(t));

    // Whatever the drives were told meanwhile, they take torques where it operates.
    insists(&live, "hold");
    live.run(0.1);
    released(&live, "after `hold`");
    let rows = live.rows();
    let (step, at) = jolt(&rows);
    assert!(step < 0.5, "{step} N m in 1 ms at {at} s\n{}", live.story(at - 0.1));

    // Nobody watches any more: it does not operate before somebody does.
    monitors(&live, Transition::Stop);
    live.until_state("fault.waiting", 0.1);
    live.raise("e_reset");
    stays(&live, "fault.waiting", "released while nobody watches");
    monitors(&live, Transition::Start);
    released(&live, "somebody watches again");

    // On the way down, and the order to go on before the stop.
    live.raise("e_shutdown");
    live.until_state("parking", 1.0);
    live.run(0.3);
    live.raise("e_estop");
    stays(&live, "lowering.waiting", "a stop while it parks");
    live.raise("e_shutdown");
    live.raise("e_estop");
    stays(&live, "lowering.waiting", "a stop behind the order to go down");
    live.raise("e_shutdown");
    live.until_state("idle", 20.0);
    assert_eq!(live.first("e_arm_dropped", 0.0), None);
    live.clock.shutdown();
}

#[test]
fn a_stop_is_the_last_word() {
    last_words("youbot_arm");
}

#[test]
fn a_stop_is_the_last_word_scoped() {
    last_words("youbot_arm_scoped");
}

/// Released on the way down, the drives take torques again, and nobody watches: it is stopped, however often it is released. The
/// order to go down is followed all the same.
fn unwatched_on_the_way_down(name: &str) {
    let live = Live::with_hand(name, HAND);
    live.bring_up();
    live.until_state("copying", 5.0);
    when_in(&live, "quieting.operated", "e_estop");
    live.raise("e_shutdown");
    stays(&live, "lowering.waiting", "a stop at the beginning of the way down");
    live.raise("e_reset");
    live.run(0.2);
    assert!(live.place().ends_with("stranded.before_parking"), "{}", live.place());
    assert_eq!(live.rows().last().unwrap().mode, 6, "they took torques, and are released");

    let t = live.now();
    monitors(&live, Transition::Stop);
    stays(&live, "lowering.waiting", "nobody watches where it waits to go down");
    let told = live.first("e_watch_lost", t).expect("it is told");
    assert!(live.first("safe_hold.ok", t).is_some_and(|at| at - told < 0.01), "{}", live.story(t));
    live.raise("e_reset");
    live.run(1.0);
    stays(&live, "lowering.waiting", "released once more");
    live.raise("e_shutdown");
    live.until("parked", 10.0, |live| live.first("park.ok", t).is_some());
    assert_eq!(live.first("e_arm_dropped", 0.0), None);
    live.clock.shutdown();
}

#[test]
fn unwatched_it_is_stopped_on_the_way_down_too() {
    for name in ["youbot_arm", "youbot_arm_scoped"] {
        unwatched_on_the_way_down(name);
    }
}

/// A stop behind the order to let go, while an operator moves what is stopped: it brakes that at once, and does not wait until nothing moves any
/// more so that it can be let go of.
fn moved_while_it_is_let_go_of(place: &str, lets_go: &str) {
    let what = format!("{place}, {lets_go}");
    let live = Live::with_hand("youbot_arm", HAND);
    match place {
        "halted" => {
            live.raise("e_start");
            live.until_state("deploying.unfolding", 5.0);
            live.run(0.8);
        }
        _ => {
            live.bring_up();
            live.until_state("copying", 5.0);
        }
    }
    if place == "lowering" {
        live.raise("e_shutdown");
        live.until_state("parking", 1.0);
        live.run(0.3);
    }
    live.raise("e_estop");
    stays(&live, &format!("{place}.waiting"), &what);
    live.rows();
    insists(&live, "park");
    live.run(0.4);
    live.raise(lets_go);
    live.run(0.2);
    // In `fault` the drives' errors are cleared first, which waits as well.
    let waits = live.place().contains("releasing") || live.place().ends_with("fault.clearing");
    assert!(waits, "{what}: in {}\n{}", live.place(), live.story(live.now() - 1.0));
    assert!(live.rows().last().unwrap().speed.norm() > 0.02, "{what}: it does not move");
    live.raise("e_estop");
    stays(&live, &format!("{place}.waiting"), &what);
    // On the way back nobody has asked for what would unfold the arm again, which an operator has folded: that is for the operator to undo.
    if place != "halted" {
        live.raise("e_shutdown");
        live.until_state("idle", 30.0);
    }
    assert_eq!(live.first("e_arm_dropped", 0.0), None, "{what}");
    live.clock.shutdown();
}

#[test]
fn a_stop_brakes_what_is_moved_while_it_is_let_go_of() {
    for place in ["fault", "lowering", "halted"] {
        for lets_go in ["e_reset", "e_shutdown"] {
            moved_while_it_is_let_go_of(place, lets_go);
        }
    }
}
