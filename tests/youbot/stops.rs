//! How the shipped deployments are stopped, whatever asks for it and whenever: the arm is never dropped.

use crate::live::{Live, Row};
use davit::cli::exit::Exit;
use davit::libraries::youbot::base::Twist2;
use davit::libraries::youbot::rigid_body::J5;
use davit::libraries::youbot::world::RobotBody;
use davit::session::{Command, Ended, Session, Stage};
use nalgebra::Vector3;
use std::collections::BTreeSet;
use std::sync::Arc;

/// A hand that brings the arms together and sways, sooner than the shipped one.
const HAND: &str = "free 0.5; align 1.5; sway 600 0.06 0 0 0.15";

/// What asks for the end. Every signal and `davit shutdown` leave the same command; twice is by force.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stop {
    Once,
    /// Asked for again so much later.
    Twice(f64),
    /// An emergency, and the end half a second later.
    AfterEstop,
    /// Force, on the way down that was asked for at [`ORDERED`].
    ForceOnTheWay,
    /// An emergency there, and half a second later it is asked for again.
    EstopOnTheWay,
}

/// When those that are stopped on the way down were asked to go down: in operation, in s.
const ORDERED: f64 = 9.0;

/// What came of it.
struct Came {
    at: f64,
    place: String,
    ended: Ended,
    /// From the instant on, in s; negative where it had ended before.
    took: f64,
    /// Whether the drives went off while they held the arm up.
    dropped: bool,
    /// The tool's speed 0.3 s later and from then on, in m/s: of an emergency as long as nobody has asked for more.
    speed: f64,
    /// How far the tool came down in m: in an emergency while it was stopped, and when the drives went off.
    drop: f64,
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
    let estop = matches!(stop, Stop::AfterEstop | Stop::EstopOnTheWay);
    somebody(&live, at, move |session| {
        *seen.lock().unwrap() = session.hub().active().last().cloned().unwrap_or_default();
        match estop {
            true => session.raise(davit::model::EventName::new("e_estop").unwrap(), "test"),
            false => ask(session, stop == Stop::ForceOnTheWay),
        }
    });
    if let Stop::Twice(later) = stop {
        somebody(&live, at + later, |session| ask(session, true));
    }
    if estop {
        somebody(&live, at + AGAIN, |session| ask(session, false));
    }
    if matches!(stop, Stop::ForceOnTheWay | Stop::EstopOnTheWay) {
        somebody(&live, ORDERED, |session| ask(session, false));
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
    let last = rows.last();
    let stands = rows.iter().filter(|row| estop && row.t >= began + at && row.t < began + at + AGAIN);
    let before = stands.clone().next().map_or(0.0, |row| row.tool.z);
    let sank = stands.map(|row| before - row.tool.z).fold(0.0, f64::max);
    let later = rows.iter().filter(|row| row.t >= began + at + 0.3 && (!estop || row.t < began + at + AGAIN));
    let came = Came {
        at,
        place: place.lock().unwrap().clone(),
        ended,
        took,
        dropped: live.first("e_arm_dropped", 0.0).is_some(),
        speed: later.map(|row| row.speed.norm()).fold(0.0, f64::max),
        drop: last.map_or(0.0, falls).max(sank),
    };
    println!("{name} {stop:?} {}", line(&came));
    live.clock.shutdown();
    came
}

/// Until an emergency is followed by an order, in s.
const AGAIN: f64 = 0.5;

/// How far the tool comes down, in m, where the drives go off as that row shows the arm.
fn falls(row: &Row) -> f64 {
    let mut body = RobotBody::new(J5::from(row.joints.pos), 1.0);
    let before = body.tool().position.z;
    for _ in 0..1000 {
        body.advance(&J5::zeros(), Twist2::default(), &Vector3::zeros(), true, 0.001);
    }
    before - body.tool().position.z
}

fn line(came: &Came) -> String {
    format!(
        "{:6.2} s  {:<40} {:?} in {:.2} s, {:.3} m/s, {:.1} mm{}{}",
        came.at,
        came.place,
        came.ended.stage,
        came.took,
        came.speed,
        came.drop * 1e3,
        if came.dropped { ", DROPPED" } else { "" },
        if came.ended.is_clean() { "" } else { ", LEFT" },
    )
}

/// Instants of the bring-up, which takes some eight seconds, and of operation.
fn instants(step: f64, until: f64) -> impl Iterator<Item = f64> {
    (0..).map(move |i| 0.01 + f64::from(i) * step).take_while(move |at| *at < until)
}

/// All that comes of being stopped so: at every `step` seconds of bring-up and operation, or of the way down.
fn all(name: &str, stop: Stop, step: f64) -> Vec<Came> {
    let on_the_way = matches!(stop, Stop::EstopOnTheWay | Stop::ForceOnTheWay);
    let until = if on_the_way { ORDERED + 10.0 } else { 12.0 };
    let all = instants(step, until).filter(|at| !on_the_way || *at > ORDERED);
    all.map(|at| stopped(name, at, stop)).take_while(|came| came.took > -0.001).collect()
}

/// What is wrong with that. Its coordinator leads down from everywhere, in time and in order; by force the arm is lowered before
/// the drives go off, also on the way down; after an emergency nothing moves.
fn wrong(stop: Stop, came: &Came) -> Option<String> {
    let told = |what: &str| Some(format!("{what}: {stop:?} {}\n{:?}", line(came), came.ended));
    let (forced, estop) = match stop {
        Stop::Once => (None, false),
        Stop::AfterEstop | Stop::EstopOnTheWay => (None, true),
        Stop::ForceOnTheWay => (Some(0.0), false),
        Stop::Twice(later) => (Some(later), false),
    };
    match forced {
        _ if came.dropped || came.drop > 0.02 => told("it falls"),
        _ if estop && came.speed > 0.02 => told("it moves 0.3 s after an emergency"),
        None if !came.ended.is_orderly() => told("it is not led down"),
        Some(_) if !came.ended.is_clean() => told("something is left"),
        Some(later) if came.ended.stage != Stage::Forced && came.took > later + 0.1 => told("not by force"),
        _ => None,
    }
}

fn at_any_time(name: &str, stops: &[Stop], every: f64) {
    for stop in stops {
        let all = all(name, *stop, step(every));
        assert!(all.len() > 1, "{stop:?}");
        let wrong: Vec<String> = all.iter().filter_map(|came| wrong(*stop, came)).collect();
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }
}

#[test]
fn a_signal_at_any_time_is_led_down() {
    at_any_time("youbot_arm", &[Stop::Once], 0.25);
}

#[test]
fn a_signal_at_any_time_is_led_down_scoped() {
    at_any_time("youbot_arm_scoped", &[Stop::Once], 0.25);
}

#[test]
fn nothing_moves_after_an_emergency_at_any_time() {
    at_any_time("youbot_arm", &[Stop::AfterEstop, Stop::EstopOnTheWay], 0.25);
}

#[test]
fn nothing_moves_after_an_emergency_at_any_time_scoped() {
    at_any_time("youbot_arm_scoped", &[Stop::AfterEstop, Stop::EstopOnTheWay], 0.25);
}

#[test]
fn force_at_any_time_lowers_the_arm() {
    at_any_time("youbot_arm", &[Stop::Twice(0.0), Stop::ForceOnTheWay], 0.25);
    at_any_time("youbot_arm", &[Stop::Twice(1.0)], 3.0);
}

#[test]
fn force_at_any_time_lowers_the_arm_scoped() {
    at_any_time("youbot_arm_scoped", &[Stop::Twice(0.0), Stop::ForceOnTheWay], 0.25);
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

/// The table of docs/youbot.md: `cargo test --release --test youbot -- --ignored --nocapture --exact stops::table`.
#[test]
#[ignore = "prints the table of docs/youbot.md"]
fn table() {
    const WAYS: [(Stop, &str); 5] = [
        (Stop::AfterEstop, "`e_estop`"),
        (Stop::Once, "a signal"),
        (Stop::Twice(0.0), "force"),
        (Stop::EstopOnTheWay, "`e_estop`"),
        (Stop::ForceOnTheWay, "force"),
    ];
    let (mut rows, mut found) = (String::new(), Vec::new());
    for name in ["youbot_arm", "youbot_arm_scoped"] {
        for (stop, asked) in WAYS {
            let on_the_way = matches!(stop, Stop::EstopOnTheWay | Stop::ForceOnTheWay);
            let all = all(name, stop, step(0.25));
            found.extend(all.iter().filter_map(|came| wrong(stop, came)));
            let phase = |came: &Came| match () {
                () if on_the_way => "the way down",
                () if came.place.contains("deploying") || came.place.is_empty() => "the bring-up",
                () => "operation",
            };
            for phases in all.chunk_by(|a, b| phase(a) == phase(b)) {
                let most = |of: fn(&Came) -> f64| phases.iter().map(of).fold(0.0, f64::max);
                let exits: BTreeSet<u8> =
                    phases.iter().map(|came| Exit::of_stop(&came.ended, Exit::Done).code()).collect();
                rows += &format!(
                    "| `{name}` | {} | {asked} | {} | {:.3} | {:.1} | {} | {:.1} s | {} |\n",
                    phase(&phases[0]),
                    phases.len(),
                    most(|came| came.speed),
                    most(|came| came.drop * 1e3),
                    phases.iter().filter(|came| came.dropped).count(),
                    most(|came| came.took),
                    exits.iter().map(u8::to_string).collect::<Vec<_>>().join(", "),
                );
            }
        }
    }
    println!("| deployment | in | asked | times | m/s | mm | dropped | within | exit status |");
    println!("|---|---|---|---|---|---|---|---|---|\n{rows}");
    assert!(found.is_empty(), "{}", found.join("\n"));
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
