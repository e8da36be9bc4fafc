//! What signals ask for, by when they come.

use super::*;
use std::time::Duration;

/// What signals ask for that come after so many milliseconds.
fn asked(signals: &[(u64, i32)]) -> Vec<Asks> {
    let mut seen = SignalSeen::default();
    let at = |ms: u64| Time(0) + Duration::from_millis(ms);
    signals.iter().map(|(ms, signal)| seen.asks(*signal, at(*ms), false)).collect()
}

/// After an emergency stopping stands still until somebody asks for force: who does so by a signal does not end the process.
#[test]
fn where_force_is_waited_for_a_signal_asks_for_it() {
    let mut seen = SignalSeen::default();
    let mut asks = |ms: u64, held| seen.asks(SIGINT, Time(0) + Duration::from_millis(ms), held);
    assert_eq!([asks(0, false), asks(1000, false)], [Asks::Stop, Asks::Force]);
    assert_eq!([asks(3000, true), asks(5000, true)], [Asks::Force, Asks::Force]);
    assert_eq!(asks(7000, false), Asks::Leave);
}

/// The same where `davit shutdown` has asked for the end, and no signal has come yet; but a terminal that is gone forces nothing.
#[test]
fn where_force_is_waited_for_the_first_signal_asks_for_it() {
    let asks = |signal| SignalSeen::default().asks(signal, Time(0), true);
    assert_eq!([asks(SIGINT), asks(SIGTERM), asks(SIGHUP)], [Asks::Force, Asks::Force, Asks::Stop]);
}

#[test]
fn one_cause_is_one_signal() {
    use Asks::{Force, Leave, Nothing, Stop};
    assert_eq!(asked(&[(0, SIGINT), (500, SIGINT), (1500, SIGINT)]), [Stop, Force, Leave]);
    assert_eq!(asked(&[(0, SIGTERM), (150, SIGTERM)]), [Stop, Force]);
    for pair in [[SIGINT, SIGINT], [SIGQUIT, SIGQUIT], [SIGTERM, SIGINT], [SIGHUP, SIGINT], [SIGINT, SIGHUP]] {
        assert_eq!(asked(&[(0, pair[0]), (3, pair[1])]), [Stop, Nothing]);
    }
    // Who closes the window, at any time; then a person, or a deadline, goes on.
    assert_eq!(asked(&[(0, SIGHUP), (700, SIGHUP), (900, SIGXCPU), (1000, SIGTERM)]), [Stop, Nothing, Nothing, Force]);
    assert_eq!(asked(&[(0, SIGINT), (900, SIGHUP)]), [Stop, Nothing]);
}

#[test]
fn a_key_that_is_held_down_does_not_end_it_at_once() {
    for every in [33, 92, 120, 400] {
        let held: Vec<(u64, i32)> =
            std::iter::once(0).chain((0..50).map(|n| 500 + n * every)).map(|ms| (ms, SIGINT)).collect();
        let asked = asked(&held);
        assert_eq!(asked[..2], [Asks::Stop, Asks::Force]);
        assert!(asked[2..].iter().all(|asked| *asked == Asks::Nothing), "{every} {asked:?}");
    }
}
