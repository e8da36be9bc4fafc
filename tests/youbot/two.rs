//! Two robots in one deployment, flat under `left/` and `right/`: what one is doing delays nothing of the other.
//!
//! The files are the shipped ones of one robot, each name of a component, a configuration and an event with its side before
//! it. The monitors stay away: here the test says what they would.

use davit::app;
use davit::lang::LoadOptions;
use davit::libraries;
use davit::model::EventName;
use davit::session::Happening;
use davit::time::Clock;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

const SIDES: [&str; 2] = ["left", "right"];

fn shipped(file: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/youbot").join(file)).unwrap()
}

/// A text with each of its string literals seen through `with`; without comments.
fn literals(text: &str, with: impl Fn(&str) -> String) -> String {
    let code: Vec<&str> = text.lines().map(|line| line.split("--").next().unwrap_or_default()).collect();
    let code = code.join("\n");
    let parts = code.split('"').enumerate();
    parts.map(|(i, part)| if i % 2 == 1 { format!("\"{}\"", with(part)) } else { part.to_owned() }).collect()
}

/// The names that stand at the beginning of a line before `= Configuration`.
fn configurations(text: &str) -> Vec<String> {
    let named = |line: &str| line.split_once("= Configuration").map(|(id, _)| id.trim().to_owned());
    text.lines().filter_map(named).filter(|id| !id.starts_with("--")).collect()
}

/// The components that a text creates.
fn components(text: &str) -> Vec<String> {
    text.split("create(\"").skip(1).filter_map(|rest| rest.split('"').next()).map(str::to_owned).collect()
}

struct Robot {
    side: &'static str,
    ids: Vec<String>,
    components: Vec<String>,
}

impl Robot {
    fn new(side: &'static str) -> Self {
        let text = without_monitors() + &shipped("coupling.lua");
        Self { side, ids: configurations(&text), components: components(&text) }
    }

    fn configurations(&self) -> String {
        let own = |name: &str| self.components.iter().any(|c| c == name);
        let text = without_monitors() + "\n@\n" + &shipped("coupling.lua");
        // `_default` would be the other robot as well.
        let text = literals(&text, |word| {
            let (name, rest) = word.split_at(word.find(['.', ':']).unwrap_or(word.len()));
            match name {
                "_default" => {
                    let all = self.components.iter().map(|c| format!("{}/{c}{rest}", self.side));
                    all.collect::<Vec<_>>().join("\", \"")
                }
                // Types of the library, which has the name of the driver.
                "youbot" if rest.starts_with('.') && rest[1..].starts_with(char::is_uppercase) => word.to_owned(),
                "profile" => format!("{}_profile", self.side),
                // Each has a bus of its own.
                "sim0" => format!("{}_sim0", self.side),
                _ if own(name) => format!("{}/{word}", self.side),
                _ => word.to_owned(),
            }
        });
        let named = self.ids.iter().fold(text, |text, id| {
            let lines = text.lines().map(|line| match line.split_once("= Configuration") {
                Some((name, rest)) if name.trim() == id => format!("{}_{id} = Configuration{rest}", self.side),
                _ => line.to_owned(),
            });
            lines.collect::<Vec<_>>().join("\n")
        });
        named.replace("\n@\n", "\n")
    }

    /// One that was led down alone stays down: until the other one is down as well, what it did before is in force, and `check` finds
    /// what is refused because of that when it is brought up again.
    fn coordinator(&self) -> String {
        // Nobody waits for its parts, nor has hold of them.
        let mut text = shipped("coordinator.lua")
            .replace("{ \"e_built\", \"connect_all\" }", "\"connect_all\"")
            .replace("letting_go     = state { entry = \"e_leaving\" }", "letting_go = state {}")
            .replace("letting_go   = state { entry = \"e_leaving\" }", "letting_go = state {}")
            .replace("e_released", "e_done");
        assert!(!text.contains("e_built") && !text.contains("e_leaving"));
        for (once, instead) in [
            (
                "  idle = state {},",
                "  idle = state { fresh = state {}, gone = state {}, trans { src = \"initial\", tgt = \"fresh\" } },",
            ),
            ("src = \"idle\",      tgt = \"deploying\"", "src = \".idle.fresh\", tgt = \"deploying\""),
            (
                "tgt = \"idle\",        events = { \"create_core.undone\" }",
                "tgt = \".idle.gone\", events = { \"create_core.undone\" }",
            ),
            (
                "tgt = \"idle\", events = { \"destroy_all.ok\" }",
                "tgt = \".idle.gone\", events = { \"destroy_all.ok\" }",
            ),
        ] {
            assert_eq!(text.matches(once).count(), 1, "{once}");
            text = text.replace(once, instead);
        }
        literals(&text, |word| {
            let (name, _) = word.split_at(word.find('.').unwrap_or(word.len()));
            match word {
                "e_start" | "e_done" => word.to_owned(),
                "e_shutdown" => format!("e_shutdown\", \"e_{}_down", self.side),
                _ if word.starts_with("e_") => format!("e_{}_{}", self.side, &word[2..]),
                _ if self.ids.iter().any(|id| id == name) => format!("{}_{word}", self.side),
                _ => word.to_owned(),
            }
        })
    }
}

fn without_monitors() -> String {
    let text = ["Monitors", "Mode_Switch"]
        .iter()
        .fold(shipped("configurations.lua"), |text, gone| text.replace(&format!("destroy(\"{gone}\"), "), ""));
    let left = |line: &&str| !(line.contains("\"Monitors") || line.contains("Mode_Switch"));
    text.lines().filter(left).map(|line| line.to_owned() + "\n").collect()
}

#[test]
fn what_one_robot_does_delays_nothing_of_the_other() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: String| std::fs::write(folder.path().join(name), text).unwrap();
    for side in SIDES {
        let robot = Robot::new(side);
        assert!(robot.ids.len() > 20 && robot.components.len() > 8, "{:?} {:?}", robot.ids, robot.components);
        write(&format!("{side}_configurations.lua"), robot.configurations());
        write(&format!("{side}_coordinator.lua"), robot.coordinator());
    }
    write(
        "two.yaml",
        "davit: 1
name: two_robots
platform: embedded
libraries: [youbot]
with: { stand_in: true }
activities:
  world:   { period_ms: 0.5, priority: 90 }
  control: { period_ms: 1.0, priority: 80 }
  link:    { period_ms: 1.0, priority: 70 }
  base:    { period_ms: 4.0, priority: 60 }
  safety:  { period_ms: 5.0, priority: 75 }
  watch:   { period_ms: 10.0, priority: 40 }
configurations: [left_configurations.lua, right_configurations.lua]
coordinators: { left: left_coordinator.lua, right: right_coordinator.lua }
deploy:   { event: e_start,    up: operational, within_s: 20 }
shutdown: { event: e_shutdown, down: idle,      within_s: 20 }
limits:   { stack: 64, step_timeout_s: 1.0 }
"
        .to_owned(),
    );
    let checked = app::read(&folder.path().join("two.yaml"), &LoadOptions::default(), libraries::builtin())
        .and_then(app::check)
        .unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
    let clock = Clock::simulated();
    let _me = clock.enter();
    let session = app::start(&checked, &clock).unwrap();
    let heard: Arc<Mutex<Vec<(f64, String)>>> = Arc::default();
    let log = heard.clone();
    session.hub().observe(Arc::new(move |at, what| {
        if let Happening::Answered(answered) = what {
            log.lock().unwrap().push((at.as_secs_f64(), answered.answer.clone()));
        }
    }));
    session.bring_up().unwrap_or_else(|not| panic!("{not:?}"));
    let raise = |name: &str| session.raise(EventName::new(name).unwrap(), "test");
    let when = |answer: &str| heard.lock().unwrap().iter().rev().find(|(_, a)| a == answer).map(|(at, _)| *at);
    for side in SIDES {
        raise(&format!("e_{side}_qos_ok"));
        clock.sleep(Duration::from_millis(100));
        raise(&format!("e_{side}_aligned"));
        clock.sleep(Duration::from_millis(100));
        assert!(when(&format!("{side}_enable_copying.ok")).is_some(), "{:?}", heard.lock().unwrap());
    }
    raise("e_left_down");
    clock.sleep(Duration::from_secs(1));
    assert_eq!(when("left_park.ok"), None, "it parks");
    let asked = clock.now().as_secs_f64();
    raise("e_right_misaligned");
    clock.sleep(Duration::from_secs(1));
    assert_eq!(when("right_disable_copying.ok"), Some(asked), "at once");
    assert_eq!(when("left_park.ok"), None, "it still parks");
    clock.sleep(Duration::from_secs(8));
    assert!(when("left_park.ok").is_some(), "{:?}", heard.lock().unwrap());
    let ended = session.take_down(false);
    assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
    clock.shutdown();
}
