//! The scenarios of `examples/scenarios`, as `davit run` runs them in simulated time: each ends well, and within its bounds.

use davit::app::script::{self, Interrupt, ScriptEnd, ScriptOptions};
use davit::lang::LoadOptions;
use davit::libraries;
use davit::time::Clock;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Each with what is set for it here: what takes a minute in the file is shorter.
const SCENARIOS: [(&str, &[(&str, &str)]); 40] = [
    ("beside", &[]),
    ("blocked", &[]),
    ("bring_up", &[]),
    ("clocks", &[]),
    ("configurator", &[]),
    ("contact", &[]),
    ("crash", &[]),
    ("driver", &[]),
    ("energy", &[]),
    ("engaged_in_motion", &[]),
    ("estop", &[]),
    ("hang", &[]),
    ("hang_in_bring_up", &[]),
    ("late", &[]),
    ("latency", &[]),
    ("left_alone", &[("cases", "4")]),
    ("link", &[]),
    ("modes", &[]),
    ("modes_in_motion", &[]),
    ("never_returns", &[]),
    ("one_stops", &[]),
    ("one_way", &[]),
    ("parked_in_contact", &[]),
    ("payload", &[]),
    ("peer_restart", &[]),
    ("pressed", &[]),
    ("push", &[]),
    ("push_on", &[]),
    ("refused", &[]),
    ("rejected", &[]),
    ("repair", &[]),
    ("saturated", &[]),
    ("shutdown_while_copying", &[]),
    ("soft_limit", &[]),
    ("through_the_world", &[]),
    ("torques", &[]),
    ("tracking", &[("seconds", "20")]),
    ("tuned", &[]),
    ("udp", &[]),
    ("variants", &[("pairs", "1"), ("seconds", "7")]),
];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenarios")
}

/// Runs a script on the simulated clock.
pub fn script(file: &Path, set: &[(&str, &str)]) -> ScriptEnd {
    let mut load = LoadOptions::default();
    load.set.extend(set.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())));
    let clock = Clock::simulated();
    let end = script::run(
        file,
        ScriptOptions {
            clock: clock.clone(),
            extensions: libraries::builtin().into(),
            load,
            platform: None,
            observer: None,
            interrupt: Interrupt::default(),
            door: None,
            checking: None,
            say: Box::new(|_| {}),
        },
    );
    clock.shutdown();
    assert!(end.failure.is_none(), "{:?}\n{:#?}", end.failure, end.figures);
    end
}

fn run(name: &str) {
    let (_, set) = SCENARIOS.iter().find(|(scenario, _)| *scenario == name).expect("listed");
    let end = script(&folder().join(format!("{name}.lua")), set);
    assert!(!end.figures.is_empty(), "it measures something");
    let ended = end.ended.expect("it deployed something");
    assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
}

#[test]
fn every_scenario_is_run() {
    let files: BTreeSet<String> =
        std::fs::read_dir(folder()).unwrap().map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    let listed: BTreeSet<String> = SCENARIOS.iter().map(|(name, _)| format!("{name}.lua")).collect();
    assert_eq!(files, listed);
}

/// What is shorter here is run at its full length by CI.
#[test]
fn what_is_shortened_is_run_whole_by_ci() {
    let ci = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(".ci/run")).unwrap();
    let listed = ci.lines().find_map(|line| line.strip_prefix("scenarios=\"")?.strip_suffix('"')).expect("a list");
    let listed: BTreeSet<&str> = listed.split(' ').collect();
    for (name, set) in SCENARIOS {
        assert!(set.is_empty() || listed.contains(name), "{name}");
    }
    let known = SCENARIOS.map(|(name, _)| name);
    assert!(listed.iter().all(|name| known.contains(name)), "{listed:?}");
}

#[test]
fn beside() {
    run("beside");
}

#[test]
fn blocked() {
    run("blocked");
}

#[test]
fn bring_up() {
    run("bring_up");
}

#[test]
fn clocks() {
    run("clocks");
}

#[test]
fn configurator() {
    run("configurator");
}

/// Against the wall by the file's own figures, and the hardest of its grid on the table.
#[test]
fn contact() {
    run("contact");
    script(&folder().join("contact.lua"), &[("place", "table"), ("law", "tank"), ("delay", "0.05")]);
}

#[test]
fn crash() {
    run("crash");
}

#[test]
fn driver() {
    run("driver");
}

#[test]
fn energy() {
    run("energy");
}

#[test]
fn engaged_in_motion() {
    run("engaged_in_motion");
}

#[test]
fn estop() {
    run("estop");
}

/// The same places, by an error of the drives.
#[test]
fn a_drive_s_error_stops_it_wherever_an_emergency_stop_does() {
    script(&folder().join("estop.lua"), &[("by", "overcurrent")]);
}

#[test]
fn hang() {
    run("hang");
}

#[test]
fn hang_in_bring_up() {
    run("hang_in_bring_up");
}

#[test]
fn latency() {
    run("latency");
}

#[test]
fn late() {
    run("late");
}

#[test]
fn left_alone() {
    run("left_alone");
}

#[test]
fn link() {
    run("link");
}

#[test]
fn modes() {
    run("modes");
}

#[test]
fn modes_in_motion() {
    run("modes_in_motion");
}

#[test]
fn one_way() {
    run("one_way");
}

#[test]
fn one_stops() {
    run("one_stops");
}

#[test]
fn peer_restart() {
    run("peer_restart");
}

#[test]
fn parked_in_contact() {
    run("parked_in_contact");
}

#[test]
fn payload() {
    run("payload");
}

#[test]
fn pressed() {
    run("pressed");
}

#[test]
fn push() {
    run("push");
}

#[test]
fn push_on() {
    run("push_on");
}

#[test]
fn refused() {
    run("refused");
}

#[test]
fn repair() {
    run("repair");
}

#[test]
fn saturated() {
    run("saturated");
}

#[test]
fn shutdown_while_copying() {
    run("shutdown_while_copying");
}

#[test]
fn soft_limit() {
    run("soft_limit");
}

#[test]
fn through_the_world() {
    run("through_the_world");
}

#[test]
fn torques() {
    run("torques");
}

#[test]
fn tracking() {
    run("tracking");
}

#[test]
fn tuned() {
    run("tuned");
}

#[test]
fn variants() {
    run("variants");
}

#[test]
fn udp() {
    run("udp");
}
