//! The shipped coupling: two robots, each the file of one, in simulated time and with all coordinators in the loop.

use davit::app;
use davit::lang::LoadOptions;
use davit::libraries;
use davit::model::{Ask, ConfigId, EventName, Severity};
use davit::session::{Happening, Session, Stage};
use davit::time::{Clock, Time};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A deployment that is up, and all that has happened.
struct Up {
    clock: Clock,
    session: Arc<Session>,
    heard: Arc<Mutex<Vec<(Time, Happening)>>>,
}

fn up<T>(file: &str, with: impl FnOnce(&Up) -> T) -> T {
    up_at(&Path::new(env!("CARGO_MANIFEST_DIR")).join("deployments").join(file), with)
}

fn up_at<T>(path: &Path, with: impl FnOnce(&Up) -> T) -> T {
    let clock = Clock::simulated();
    let _participant = clock.enter();
    let read = app::read(path, &LoadOptions::default(), libraries::builtin())
        .unwrap_or_else(|refused| panic!("{:?}", refused.findings));
    let checked = app::check(read).unwrap_or_else(|refused| panic!("{:?}", refused.findings));
    let session = app::start(&checked, &clock).unwrap();
    let heard: Arc<Mutex<Vec<(Time, Happening)>>> = Arc::default();
    let own = heard.clone();
    session.hub().observe(Arc::new(move |at, happening| own.lock().unwrap().push((at, happening.clone()))));
    session.bring_up().unwrap();
    let up = Up { clock: clock.clone(), session, heard };
    let result = with(&up);
    if up.session.ended().is_none() {
        let ended = up.session.take_down(false);
        assert!(ended.is_orderly(), "{ended:?}");
    }
    result
}

/// An arm that does not lie on its stops is found where it is: the drives that look for the stops have heard it before they set out.
#[test]
fn an_arm_off_its_stops_is_calibrated() {
    let folder = tempfile::tempdir().unwrap();
    let home = Path::new(env!("CARGO_MANIFEST_DIR"));
    for within in ["deployments", "configs/youbot"] {
        std::fs::create_dir_all(folder.path().join(within)).unwrap();
        for entry in std::fs::read_dir(home.join(within)).unwrap() {
            let from = entry.unwrap().path();
            let text = std::fs::read_to_string(&from).unwrap();
            let text = match from.ends_with("pair.lua") {
                true => {
                    let stops = "\"World.robot1_q_start\", { 0.0, -1.1257, 2.5395, -1.7802, 0.0 }";
                    assert!(text.contains(stops));
                    text.replace(stops, "\"World.robot1_q_start\", { 0.0, -0.8257, 2.2395, -1.4802, 0.0 }")
                }
                false => text,
            };
            std::fs::write(folder.path().join(within).join(from.file_name().unwrap()), text).unwrap();
        }
    }
    let file = folder.path().join("deployments/youbot_coupling.yaml");
    up_at(&file, |up| assert!(up.session.in_state("left:operational") && up.session.in_state("right:operational")));
}

impl Up {
    fn raise(&self, event: &str) {
        self.session.raise(EventName::new(event).unwrap(), "operator");
    }

    fn wait(&self, seconds: f64) {
        self.clock.sleep(Duration::from_secs_f64(seconds));
    }

    fn wait_for(&self, states: &[&str], seconds: f64) {
        let until = self.clock.now() + Duration::from_secs_f64(seconds);
        while !states.iter().all(|state| self.session.in_state(state)) {
            assert!(self.clock.now() < until, "not {states:?} but {:?}", self.session.hub().active());
            self.wait(0.001);
        }
    }

    fn is(&self, state: &str) -> bool {
        self.session.in_state(state)
    }

    /// Whose arm fell, or came down without power.
    fn fallen(&self) -> Vec<String> {
        let fell = |event: &String| event.ends_with("e_arm_dropped") || event.ends_with("e_arm_fell");
        // What lasts is told again.
        let all: std::collections::BTreeSet<String> =
            self.events().into_iter().map(|(_, event)| event).filter(fell).collect();
        all.into_iter().collect()
    }

    /// Events that were heard, with when.
    fn events(&self) -> Vec<(Time, String)> {
        let event = |(at, happening): &(Time, Happening)| match happening {
            Happening::Event { event, .. } => Some((*at, event.clone())),
            _ => None,
        };
        self.heard.lock().unwrap().iter().filter_map(event).collect()
    }

    fn state_since(&self, state: &str) -> Option<Time> {
        let heard = self.heard.lock().unwrap();
        let entered = heard.iter().rev().find(|(_, happening)| {
            matches!(happening, Happening::State { active } if active.last().is_some_and(|leaf| leaf == state))
        });
        entered.map(|(at, _)| *at)
    }
}

fn seconds(time: Time) -> f64 {
    time.as_secs_f64()
}

#[test]
fn both_come_up_side_by_side_and_couple() {
    let alone = up("youbot_arm.yaml", |one| seconds(one.clock.now()));
    up("youbot_coupling.yaml", |both| {
        let took = seconds(both.clock.now());
        assert!(took <= 1.1 * alone, "one takes {alone} s, both {took} s");
        both.wait_for(&["left:copying", "right:copying"], 20.0);
        both.wait(5.0);
        assert!(both.is("left:copying") && both.is("right:copying"), "{:?}", both.session.hub().active());
    });
}

#[test]
fn what_one_does_delays_nothing_of_the_other() {
    up("youbot_coupling.yaml", |both| {
        both.wait_for(&["left:copying", "right:copying"], 20.0);
        both.raise("left/e_5dof");
        both.wait(0.0);
        both.wait_for(&["left:five_DOF_mode"], 0.002);
        assert!(both.is("right:eight_DOF_mode"));
        let offered = both.session.offer_watched(EventName::new("e_estop").unwrap(), "operator").unwrap();
        both.wait(0.01);
        assert!(both.is("left:fault") && both.is("right:fault"), "an emergency stop is for both");
        assert_eq!(both.session.hub().was_heard(offered.ticket), Some(true), "who sends it is told so");
        both.raise("left/e_reset");
        both.wait(0.5);
        assert!(both.is("left:operational") && both.is("right:fault"), "{:?}", both.session.hub().active());
        both.raise("right/e_reset");
        both.wait_for(&["left:copying", "right:copying"], 10.0);
    });
}

/// Parking takes seconds; what an operator asks of one robot meanwhile is answered at the instant it is asked.
#[test]
fn what_is_asked_of_one_begins_at_once_while_the_other_one_parks() {
    up("youbot_coupling.yaml", |both| {
        both.wait_for(&["left:copying", "right:copying"], 20.0);
        let begun = both.clock.now();
        both.raise("e_shutdown");
        both.wait_for(&["left:parking", "right:parking"], 1.0);
        both.wait(1.0);
        for robot in ["left", "right"] {
            let tuned = ConfigId::new(&format!("{robot}/profile_stiff")).unwrap();
            both.session.request(Ask::Apply(tuned), "operator", true);
        }
        both.wait(1.0);
        assert!(both.is("left:parking") && both.is("right:parking"), "{:?}", both.session.hub().active());
        both.wait_for(&["pair:idle"], 10.0);
        let heard: Vec<_> = both.heard.lock().unwrap().iter().filter(|(at, _)| *at >= begun).cloned().collect();
        // What was asked, and how long its answer took.
        let asked = heard.iter().filter_map(|(at, happening)| match happening {
            Happening::Requested { request: Some(request), ask, .. } => Some((*request, *at, ask.clone())),
            _ => None,
        });
        let took: Vec<(String, f64)> = asked
            .map(|(request, at, ask)| {
                let of = |it: &Happening| matches!(it, Happening::Answered(told) if told.request == request);
                let answer = heard.iter().find(|(_, it)| of(it));
                (ask, seconds(answer.expect("it is answered").0) - seconds(at))
            })
            .collect();
        let of = |wanted: &str| -> Vec<f64> {
            took.iter().filter(|(ask, _)| ask.contains(wanted)).map(|(_, took)| *took).collect()
        };
        assert_eq!((of("left/profile_stiff"), of("right/profile_stiff")), (vec![0.0], vec![0.0]), "{took:?}");
        assert!(of("left/park").iter().chain(&of("right/park")).all(|parked| *parked > 3.0), "{took:?}");
        assert!(!of("left/park").is_empty() && !of("right/park").is_empty(), "{took:?}");
    });
}

#[test]
fn each_is_told_of_once_and_only_its_parent_hears() {
    up("youbot_coupling.yaml", |both| {
        both.wait(0.1);
        let told = |word: &str| both.events().iter().filter(|(_, event)| event == word).count();
        assert_eq!((told("left/up"), told("right/up")), (1, 1), "{:?}", both.events());
        assert_eq!((told("left/failed"), told("left/down")), (0, 0));
        // Nothing of one's own is heard under the name that it has in its file.
        let bare = |event: &str| !event.contains('/') && event != "e_start";
        assert!(!both.events().iter().any(|(_, event)| bare(event)), "{:?}", both.events());
        let joined = both.state_since("pair:root.alive.joined").unwrap();
        let last = both.events().iter().filter(|(_, event)| event.ends_with("/up")).map(|(at, _)| *at).max().unwrap();
        assert!(joined >= last);
    });
}

/// Force lowers the arms of both before it takes anything away, side by side: what each robot's file names for that.
#[test]
fn force_lowers_both_arms() {
    up("youbot_coupling.yaml", |both| {
        both.wait_for(&["left:copying", "right:copying"], 20.0);
        let began = both.clock.now();
        let ended = both.session.take_down(true);
        let took = seconds(both.clock.now()) - seconds(began);
        assert!(ended.is_clean() && ended.stage == Stage::Forced, "{ended:?}");
        assert!(took < 6.0, "side by side: {took} s");
        let rests = |note: &&String| note.ends_with("to come to rest, applied");
        assert_eq!(ended.forced.iter().filter(rests).count(), 4, "{ended:?}");
        assert_eq!(both.fallen(), [""; 0]);
    });
}

/// What stands still after an emergency is moved by nobody; the other robot's arm is lowered all the same.
#[test]
fn force_lowers_the_arm_of_who_is_not_held() {
    up("youbot_coupling.yaml", |both| {
        both.wait_for(&["left:copying", "right:copying"], 20.0);
        both.raise("left/e_estop");
        both.wait(0.5);
        assert!(both.is("left:fault") && !both.is("right:fault"), "{:?}", both.session.hub().active());
        let ended = both.session.take_down(true);
        assert!(ended.is_clean() && ended.stage == Stage::Forced, "{ended:?}");
        assert_eq!(both.fallen(), ["left/e_arm_dropped"], "support the arm of who was stopped: {ended:?}");
        assert!(!ended.forced.iter().any(|note| note.contains("`left/park`")), "{ended:?}");
    });
}

/// To whom an event is raised is said of those inside of subsystems, too: what is given on goes to nobody else.
#[test]
fn an_event_of_safety_is_given_to_whom_it_is_meant_for_alone() {
    let script = tempfile::Builder::new().suffix(".lua").tempfile().unwrap();
    let deployment = concat!(env!("CARGO_MANIFEST_DIR"), "/deployments/youbot_coupling.yaml");
    let text = format!(
        "deploy({deployment:?})
         for _, robot in ipairs{{ 'left', 'right' }} do wait_state(robot .. ':copying', 20) end
         raise('e_estop', {{ to = {{}} }})
         -- Nor does a slip in it make it nobody's.
         assert(not pcall(raise, 'e_estop', {{ to = {{ a = 'left' }} }}))
         assert(not pcall(raise, 'e_shutdown', {{ to = 'left' }}))
         assert(not pcall(raise, 'left/e_estop', {{ to = 'right' }}))
         wait(0.2)
         for _, robot in ipairs{{ 'left', 'right' }} do wait_state(robot .. ':copying', 0) end
         raise('e_estop', {{ to = {{ 'left' }} }})
         wait_state('left:fault', 0.01)
         wait_state('right:operational', 0)"
    );
    std::fs::write(script.path(), text).unwrap();
    crate::scenarios::script(script.path(), &[]);
}

/// Eight robots in four couplings take, beside the file of one robot, less than twice what the two of one coupling take.
#[test]
fn eight_robots_are_checked_as_two_are() {
    let states = |file: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        let read = app::read(&path, &LoadOptions::default(), libraries::builtin())
            .unwrap_or_else(|refused| panic!("{:?}", refused.findings));
        let report = davit::check::run(read.deployment, &read.catalogue);
        let worse: Vec<_> = report.findings.iter().filter(|found| found.severity > Severity::Info).collect();
        assert!(worse.is_empty(), "{file}: {worse:#?}");
        report.explored.states
    };
    let files = ["deployments/youbot_robot.yaml", "deployments/youbot_coupling.yaml", "examples/fleet/fleet.yaml"];
    let [robot, two, eight] = files.map(states);
    assert!(robot < two && eight - robot < 2 * (two - robot), "{robot} {two} {eight}");
}
