//! How the shipped deployments are stopped, whatever asks for it and whenever: the arm is never dropped.

use crate::live::Live;
use davit::session::{Command, Ended, Session, Stage};
use std::sync::Arc;

/// A hand that brings the arms together and sways, sooner than the shipped one.
const HAND: &str = "free 0.5; align 1.5; sway 600 0.06 0 0 0.15";

/// What asks for the end. A signal and `davit shutdown` leave the same command; twice is by force.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stop {
    Once,
    /// Asked for again so much later.
    Twice(f64),
    /// An emergency, and the end half a second later.
    AfterEstop,
}

/// What came of it.
struct Came {
    at: f64,
    place: String,
    ended: Ended,
    took: f64,
    /// Whether the drives went off while they held the arm up.
    dropped: bool,
    /// How fast the tool was when they did, in m/s.
    fastest: f64,
}

fn somebody(live: &Live, at: f64, what: impl FnOnce(&Session) + Send + 'static) {
    let (clock, session) = (live.clock.clone(), live.session.clone());
    let until = live.clock.now() + std::time::Duration::from_secs_f64(at);
    live.clock.spawn("somebody", move || {
        clock.sleep_until(until);
        what(&session);
    });
}

fn ask(session: &Session, force: bool) {
    session.command(Command::Shutdown { force });
}

/// Brought up, served and stopped as `davit deploy` does it, asked to stop `at` seconds after the beginning.
fn stopped(name: &str, at: f64, stop: Stop) -> Came {
    let live = Live::with_hand(name, HAND);
    let place = Arc::new(std::sync::Mutex::new(String::new()));
    let seen = place.clone();
    somebody(&live, at, move |session| {
        *seen.lock().unwrap() = session.hub().active().last().cloned().unwrap_or_default();
        match stop {
            Stop::AfterEstop => session.raise(davit::model::EventName::new("e_estop").unwrap(), "test"),
            _ => ask(session, false),
        }
    });
    match stop {
        Stop::Once => {}
        Stop::Twice(later) => somebody(&live, at + later, |session| ask(session, true)),
        Stop::AfterEstop => somebody(&live, at + 0.5, |session| ask(session, false)),
    }
    let began = live.now();
    let ended = match live.session.bring_up() {
        Err(not_up) => not_up.ended,
        Ok(()) => {
            let Command::Shutdown { force } = live.session.serve();
            live.session.take_down(force)
        }
    };
    let took = live.now() - began - at;
    let rows = live.rows();
    // How fast the tool still was when the drives went off.
    let fastest = rows.last().map_or(0.0, |row| row.speed.norm());
    let came = Came {
        at,
        place: place.lock().unwrap().clone(),
        ended,
        took,
        dropped: live.first("e_arm_dropped", 0.0).is_some(),
        fastest,
    };
    println!("{name} {stop:?} {}", line(&came));
    live.clock.shutdown();
    came
}

fn line(came: &Came) -> String {
    format!(
        "{:6.2} s  {:<40} {:?} in {:.2} s, {:.3} m/s{}{}",
        came.at,
        came.place,
        came.ended.stage,
        came.took,
        came.fastest,
        if came.dropped { ", DROPPED" } else { "" },
        if came.ended.is_clean() { "" } else { ", LEFT" },
    )
}

/// Instants of the bring-up, which takes some eight seconds, and of operation.
fn instants(step: f64, until: f64) -> impl Iterator<Item = f64> {
    (0..).map(move |i| 0.01 + f64::from(i) * step).take_while(move |at| *at < until)
}

/// Its coordinator leads down from everywhere, in time and in order.
fn in_order(name: &str, stop: Stop, step: f64) {
    for at in instants(step, 12.0) {
        let came = stopped(name, at, stop);
        assert!(came.ended.is_orderly(), "{}\n{:?}", line(&came), came.ended);
        assert!(!came.dropped && came.fastest < 0.02, "{}", line(&came));
    }
}

#[test]
fn a_signal_at_any_time_is_led_down() {
    in_order("youbot_arm", Stop::Once, step(1.5));
}

#[test]
fn a_signal_at_any_time_is_led_down_scoped() {
    in_order("youbot_arm_scoped", Stop::Once, step(2.5));
}

#[test]
fn a_signal_after_an_emergency_is_led_down() {
    in_order("youbot_arm", Stop::AfterEstop, step(2.0));
}

/// By force the arm is lowered before the drives go off, from everywhere and also on the way down.
#[test]
fn force_at_any_time_lowers_the_arm() {
    for (later, every) in [(0.0, 2.0), (1.0, 3.0)] {
        for at in instants(step(every), 12.0) {
            let came = stopped("youbot_arm", at, Stop::Twice(later));
            assert!(came.ended.is_clean(), "{}\n{:?}", line(&came), came.ended);
            assert!(!came.dropped, "{}\n{:?}", line(&came), came.ended);
            assert!(came.ended.stage == Stage::Forced || came.took < later + 0.1, "{}", line(&came));
        }
    }
}

/// Stopped in an emergency while it parks, it stays where it is: for longer than any stage has, and until somebody asks again.
#[test]
fn an_emergency_while_it_parks_waits_for_people() {
    let live = Live::with_hand("youbot_arm", HAND);
    live.bring_up();
    let parks = 1.0;
    somebody(&live, parks, |session| session.raise(davit::model::EventName::new("e_estop").unwrap(), "test"));
    somebody(&live, parks + 21.0, |session| {
        let status = session.status();
        assert_eq!(status.stopping.map(|view| view.stage), Some(Stage::Led));
        assert_eq!(status.coordinator.last().map(String::as_str), Some("root.lowering.waiting"));
        ask(session, false);
    });
    let began = live.now();
    let ended = live.session.take_down(false);
    let rows = live.rows();
    let place = |at: f64| rows.iter().find(|row| row.t >= began + at).expect("the probe lives").tool;
    let moved = (place(parks + 0.3) - place(parks + 20.9)).norm();
    assert!(moved < 0.005, "it moved {moved} m after the emergency");
    assert!(live.now() - began > parks + 21.0 && ended.is_orderly(), "{ended:?}\n{}", live.story(began));
    assert_eq!(live.first("e_arm_dropped", 0.0), None);
    live.clock.shutdown();
}

/// The table of docs/youbot.md: `DAVIT_STOPS_EVERY=3 cargo test --test youbot -- --ignored --nocapture --exact stops::table`.
#[test]
#[ignore = "prints the table of docs/youbot.md"]
fn table() {
    let mut rows = String::new();
    let mut wrong = Vec::new();
    for at in instants(step(3.0), 12.0) {
        let ways = [Stop::Once, Stop::AfterEstop, Stop::Twice(0.0), Stop::Twice(1.0)];
        let all: Vec<Came> = ways.iter().map(|way| stopped("youbot_arm", at, *way)).collect();
        let cell = |came: &Came| {
            let how = if came.ended.is_orderly() { "" } else { " (by force)" };
            format!("{:.1} s{how}{}", came.took, if came.dropped { " **dropped**" } else { "" })
        };
        wrong.extend(all.iter().filter(|came| came.dropped || !came.ended.is_clean()).map(line));
        let place = all[0].place.trim_start_matches("root.");
        let cells: Vec<String> = all.iter().map(cell).collect();
        rows += &format!("| {at:.2} s | `{place}` | {} |\n", cells.join(" | "));
    }
    println!("| asked after | in | a signal | 0.5 s after `e_estop` | two signals at once | the second 1 s later |");
    println!("|---|---|---|---|---|---|\n{rows}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The long run asks for every 20 ms: `DAVIT_STOPS_EVERY=0.02`.
fn step(usual: f64) -> f64 {
    std::env::var("DAVIT_STOPS_EVERY").ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// Two have stopped it: that one of them lets go is not enough.
#[test]
fn the_drives_hold_until_whoever_stopped_it_last_lets_go() {
    let safe_hold = davit::model::ConfigId::new("safe_hold").unwrap();
    for operator_first in [false, true] {
        let live = Live::copying("youbot_arm");
        let apply = || {
            live.session.request(davit::model::Ask::Apply(safe_hold), "operator", false);
            live.run(0.5);
        };
        if operator_first {
            apply();
        }
        live.raise("e_estop");
        live.run(0.5);
        if !operator_first {
            apply();
        }
        let holds = |live: &Live| {
            let in_force =
                live.session.status().stack.unwrap().iter().filter(|f| f.configuration.as_str() == "safe_hold").count();
            (in_force, live.rows().iter().all(|row| row.mode != 6))
        };
        live.rows();
        live.run(0.1);
        assert_eq!(holds(&live), (2, true), "{}", live.story(0.0));
        let release = |operator: bool| match operator {
            true => _ = live.session.request(davit::model::Ask::UndoOf(safe_hold), "operator", false),
            false => live.raise("e_reset"),
        };
        release(!operator_first);
        live.run(1.0);
        // A reset is refused by the drives as long as an operator has them brake: it stays stopped, and says so.
        let left = if operator_first { 2 } else { 1 };
        assert_eq!(holds(&live), (left, true), "{}", live.story(0.0));
        assert_eq!(live.first("resume.failed", 0.0).is_some(), operator_first);
        if operator_first {
            assert!(live.place().ends_with("fault.waiting"), "{}", live.place());
            release(true);
            live.run(1.0);
            assert_eq!(holds(&live), (1, true), "{}", live.story(0.0));
        }
        release(false);
        live.run(1.0);
        assert_eq!(holds(&live), (0, false), "{}", live.story(0.0));
        assert!(live.session.in_state("operational"), "{}", live.place());
        live.down();
    }
}
