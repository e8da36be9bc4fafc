//! The gate of a component: one visitor at a time, whoever tries.

use crate::gate::{Closed, Gate, GateGuard, Gated};
use crate::model::{RunState, Transition};
use crate::sync::Arc;
use loom::thread;

/// A component of which loom sees every access that is not alone.
struct Visited(Gate<u32>);

// SAFETY: a field is always the same.
unsafe impl Gated for Visited {
    type Behind = u32;

    fn gate(&self) -> &Gate<u32> {
        &self.0
    }
}

fn in_state(state: RunState) -> Arc<Visited> {
    let visited = Arc::new(Visited(Gate::new(0)));
    GateGuard::idle(&*visited, false, |_| true).unwrap().leave(Some(state));
    visited
}

fn visits(visited: &Visited) -> u32 {
    GateGuard::for_operation(visited, true).unwrap().with(|_, n| *n)
}

#[test]
fn an_update_and_a_step_never_meet() {
    loom::model(|| {
        let visited = in_state(RunState::Running);
        let other = visited.clone();
        let stepping = thread::spawn(move || {
            other.0.shift(Transition::Stop, false).unwrap();
            match GateGuard::idle(&*other, false, |_| true) {
                Ok(mut inside) => {
                    inside.with(|_, n| *n += 1);
                    1
                }
                Err(why) => {
                    assert_eq!(why, Closed::Busy);
                    0
                }
            }
        });
        let mut done = 0;
        for _ in 0..2 {
            if let Some(mut inside) = GateGuard::running(&*visited) {
                inside.with(|_, n| *n += 1);
                inside.leave(None);
                done += 1;
            }
        }
        done += stepping.join().unwrap();
        assert_eq!(visits(&visited), done, "no visit is lost");
        assert_eq!(visited.0.state(), RunState::Stopped, "an update that ends does not start it again");
    });
}

#[test]
fn the_first_update_sees_what_the_hook_before_it_did() {
    loom::model(|| {
        let visited = in_state(RunState::Stopped);
        let mut inside = GateGuard::idle(&*visited, false, |_| true).unwrap().sent(&visited);
        let starting = thread::spawn(move || {
            inside.with(|_, n| *n += 1);
            inside.leave(Some(RunState::Running));
        });
        // As an activity does, beat after beat.
        let mut inside = loop {
            match GateGuard::running(&*visited) {
                Some(inside) => break inside,
                None => thread::yield_now(),
            }
        };
        inside.with(|_, n| {
            assert_eq!(*n, 1);
            *n += 1;
        });
        drop(inside);
        starting.join().unwrap();
        assert_eq!(visited.0.state(), RunState::Running);
    });
}

#[test]
fn of_two_that_try_one_is_inside() {
    loom::model(|| {
        let visited = in_state(RunState::Stopped);
        let visit = |visited: Arc<Visited>| {
            assert!(GateGuard::running(&*visited).is_none(), "it does not run");
            match GateGuard::idle(&*visited, false, |_| true) {
                Ok(mut inside) => {
                    inside.with(|_, n| *n += 1);
                    1
                }
                Err(_) => 0,
            }
        };
        let other = visited.clone();
        let trying = thread::spawn(move || visit(other));
        let done = visit(visited.clone()) + trying.join().unwrap();
        assert!(done >= 1);
        assert_eq!(visits(&visited), done);
    });
}

#[test]
fn a_right_that_is_sent_leaves_once_used_or_not() {
    for used in [true, false] {
        loom::model(move || {
            let visited = in_state(RunState::Stopped);
            let mut inside = GateGuard::idle(&*visited, false, |_| true).unwrap().sent(&visited);
            let working = thread::spawn(move || {
                if used {
                    inside.with(|_, n| *n += 1);
                    inside.leave(Some(RunState::Running));
                }
            });
            // Another one tries meanwhile; it comes in only where the first one has left.
            let came = GateGuard::for_operation(&*visited, false).map(|mut inside| inside.with(|_, n| *n += 1)).is_ok();
            working.join().unwrap();
            assert_eq!(visits(&visited), u32::from(used) + u32::from(came));
            assert!(!visited.0.is_busy());
        });
    }
}

/// Who gives a call up and who returns from it agree on which of the two cleans up: one of them, whichever is first.
#[test]
fn what_returns_late_is_cleaned_up_once() {
    loom::model(|| {
        let visited = in_state(RunState::Stopped);
        let inside = GateGuard::idle(&*visited, false, |_| true).unwrap().sent(&visited);
        let working = thread::spawn(move || inside.leave(None).quarantined);
        let given_up = visited.0.quarantine().is_some();
        let told_so = working.join().unwrap();
        assert_eq!(given_up, told_so);
        assert_eq!(visited.0.is_lost(), given_up);
        assert_eq!(GateGuard::idle(&*visited, true, |_| true).is_err(), given_up, "nobody comes in any more");
        assert!(GateGuard::returned(&*visited).is_some(), "but for who cleans up");
    });
}

#[test]
#[should_panic(expected = "of another gate")]
fn a_right_is_one_of_its_own_gate() {
    loom::model(|| {
        let (one, other) = (in_state(RunState::Stopped), in_state(RunState::Stopped));
        let _ = GateGuard::idle(&*one, false, |_| true).unwrap().sent(&other);
    });
}
