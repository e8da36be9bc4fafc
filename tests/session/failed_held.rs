//! A bring-up that fails, or is late, while something safe is in force: what stopping it would let go of, and move, nobody has asked for.

use davit::app;
use davit::lang::LoadOptions;
use davit::libraries;
use davit::model::EventName;
use davit::session::{Command, Happening, NotUp, Session};
use davit::time::{Clock, Time};
use std::sync::Arc;
use std::time::Duration;

/// Two conveyors of the examples, begun and ended together.
const HALL: &str = "davit: 1
name: hall
platform: simulated
types: {}
subsystems: { left: { deployment: conveyor.yaml }, right: { deployment: conveyor.yaml } }
configurations: none.yaml
coordinator: hall.lua
safety: e_stop
deploy:   { event: e_open, up: open, failed: failed, within_s: 300 }
shutdown: { event: e_close, down: shut, within_s: 5 }
faults: [{ step: start left/belt, how: slow, takes_s: 3 }, { step: start right/belt, how: slow, takes_s: 3 }]
";
const HALL_COORDINATOR: &str = "local function both(how)
  return state {
    neither = state {}, left = state {}, right = state {}, both = state {},
    trans { src = 'initial', tgt = 'neither' },
    trans { src = 'neither', tgt = 'left',  events = { 'left/'  .. how } },
    trans { src = 'neither', tgt = 'right', events = { 'right/' .. how } },
    trans { src = 'left',    tgt = 'both',  events = { 'right/' .. how } },
    trans { src = 'right',   tgt = 'both',  events = { 'left/'  .. how } },
  }
end
return state {
  shut = state {}, opening = both('up'), open = state {}, failed = state {}, closing = both('down'),
  trans { src = 'initial', tgt = 'shut' },
  trans { src = 'shut', tgt = 'opening', events = { 'e_open' }, effect = { 'left/e_start', 'right/e_start' } },
  trans { src = 'opening', tgt = 'failed', events = { 'left/failed', 'right/failed' } },
  trans { src = '.opening.both', tgt = 'open', events = { 'e_done' } },
  trans { src = 'opening', tgt = 'closing', events = { 'e_close' }, effect = { 'left/e_end', 'right/e_end' } },
  trans { src = 'failed', tgt = 'closing', events = { 'e_close' }, effect = { 'left/e_end', 'right/e_end' } },
  trans { src = 'open', tgt = 'closing', events = { 'e_close' }, effect = { 'left/e_end', 'right/e_end' } },
  trans { src = 'closing', tgt = 'closing', events = { 'e_close' }, effect = { 'left/e_end', 'right/e_end' } },
  trans { src = '.closing.both', tgt = 'shut', events = { 'e_done' } },
}";
/// Waits for its light, and gives up.
const LAMP: &str = "coordinator:
  states: { off: {}, trying: {}, on: {}, failed: {} }
  transitions:
    - { src: initial, tgt: off }
    - { src: off, tgt: trying, events: e_start }
    - { src: trying, tgt: on, events: e_light }
    - { src: trying, tgt: failed, events: e_after(2) }
    - { src: trying, tgt: off, events: e_end }
    - { src: on, tgt: off, events: e_end }
    - { src: failed, tgt: off, events: e_end }
";

/// Brought up in simulated time, where somebody is waited for; what is raised at which second, and how that ended.
struct Hall {
    session: Arc<Session>,
    clock: Clock,
    _guard: davit::time::Guard,
}

impl Hall {
    fn new(file: &str, change: impl Fn(&str, String) -> String) -> Self {
        Self::with(&[], file, change)
    }

    /// With these files beside it.
    fn with(files: &[(&str, &str)], file: &str, change: impl Fn(&str, String) -> String) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let conveyor = |name: &str| {
            std::fs::read_to_string(format!("{}/examples/conveyor/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
        };
        let write = |name: &str, text: String| std::fs::write(folder.path().join(name), change(name, text)).unwrap();
        ["conveyor.yaml", "configurations.yaml", "coordinator.yaml"]
            .into_iter()
            .for_each(|name| write(name, conveyor(name)));
        let shared = [
            ("hall.yaml", HALL),
            ("hall.lua", HALL_COORDINATOR),
            ("lamp.yaml", LAMP),
            ("none.yaml", "configurations: {}\n"),
        ];
        shared.iter().chain(files).for_each(|(name, text)| write(name, (*text).to_owned()));
        let read = app::read(&folder.path().join(file), &LoadOptions::default(), libraries::builtin());
        let checked = read.and_then(app::check).unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
        let clock = Clock::simulated();
        let guard = clock.enter();
        Self { session: app::start(&checked, &clock).unwrap(), clock, _guard: guard }
    }

    /// Raises these, each at its second.
    fn bring_up(&self, raised: &[(f64, &'static str)]) -> (f64, Result<(), NotUp>) {
        for (at, event) in raised {
            let (clock, session, event, at) = (self.clock.clone(), self.session.clone(), *event, *at);
            self.clock.spawn("somebody", move || {
                clock.sleep(Duration::from_secs_f64(at));
                match event {
                    "shutdown" => session.command(Command::Shutdown { force: false }),
                    event => {
                        session.raise(EventName::new(event).unwrap(), "test");
                    }
                }
            });
        }
        let ended = self.session.bring_up();
        (self.clock.now().since(Time::default()).as_secs_f64(), ended)
    }

    /// When something of that name was told first.
    fn first(&self, what: &str) -> Option<f64> {
        let log = self.session.hub().log(usize::MAX);
        let is = |happening: &Happening| match happening {
            Happening::Event { event, .. } => event == what,
            Happening::Answered(answer) => answer.answer == what,
            Happening::Noted { note } => note.contains(what),
            _ => false,
        };
        log.iter().find(|entry| is(&entry.what)).map(|entry| entry.at)
    }
}

#[test]
fn a_subsystem_that_is_stopped_on_its_way_up_is_not_late() {
    let hall = Hall::new("hall.yaml", |_, text| text);
    let (took, not_up) = hall.bring_up(&[(1.0, "e_stop"), (60.0, "shutdown")]);
    assert!(not_up.unwrap_err().interrupted && took >= 60.0, "{took}");
    assert_eq!(hall.first("left/failed"), None, "its 5 s stand still");
    for held in ["left/hold", "right/hold"] {
        assert!(hall.first(&format!("{held}.ok")).is_some_and(|at| at < 10.0));
        assert!(hall.first(&format!("{held}.undone")).is_some_and(|at| at >= 60.0), "{held} is let go by people");
    }
}

/// A subsystem that is late all the same is told.
#[test]
fn a_subsystem_that_nothing_safe_holds_is_late() {
    let slow = |name: &str, text: String| match name {
        "hall.yaml" => text.replace("takes_s: 3", "takes_s: 8") + "limits: { step_timeout_s: 30 }\n",
        _ => text,
    };
    let hall = Hall::new("hall.yaml", slow);
    let (_, not_up) = hall.bring_up(&[]);
    assert!(not_up.is_err());
    assert!(hall.first("left/failed").is_some_and(|at| (5.0..5.1).contains(&at)), "{:?}", hall.first("left/failed"));
}

#[test]
fn who_resets_one_lets_go_of_no_other() {
    let hall = Hall::new("hall.yaml", |_, text| text);
    let (took, not_up) = hall.bring_up(&[(1.0, "e_stop"), (20.0, "left/e_reset"), (80.0, "right/e_reset")]);
    assert!(!not_up.unwrap_err().interrupted && took >= 80.0, "{took}");
    assert!(hall.first("left/failed").is_some_and(|at| (20.0..21.0).contains(&at)));
    assert!(hall.first("it does not come up, since the coordinator is in `failed`").is_some_and(|at| at < 21.0));
    assert!(hall.first("right/hold.undone").is_some_and(|at| at >= 80.0), "{:?}", hall.first("right/hold.undone"));
}

/// A stop at the very moment when the time of the bring-up is over was before its end.
#[test]
fn a_stop_in_the_last_moment_holds() {
    for delay in ["4.999", "5.0", "5.001"] {
        let late = |name: &str, text: String| match name {
            "conveyor.yaml" => {
                text + &format!(
                    "faults: [{{ step: start belt, how: slow, takes_s: 8 }}]\nlimits: {{ step_timeout_s: 30 }}\n\
                     simulated: {{ reactions: [{{ after: create belt, raise: e_stop, component: belt, delay_s: {delay} }}] }}\n"
                )
            }
            _ => text,
        };
        let hall = Hall::new("conveyor.yaml", late);
        let (took, not_up) = hall.bring_up(&[(60.0, "shutdown")]);
        assert!(not_up.is_err() && took >= 60.0, "{delay}: {took}");
        assert!(hall.first("hold.undone").is_some_and(|at| at >= 60.0), "{delay}: {:?}", hall.first("hold.undone"));
    }
}

/// The same of another coordinator that fails at that very moment, and of a subsystem whose time is over then; and what comes behind it is
/// late all the same.
#[test]
fn a_stop_at_the_very_moment_of_a_failure_holds() {
    for (at, holds) in [(1.999, true), (2.0, true), (2.0005, true), (2.002, false)] {
        let hall = Hall::new("conveyor.yaml", with_a_lamp);
        let (took, not_up) = hall.bring_up(&[(at, "e_stop"), (60.0, "e_reset")]);
        assert!(!not_up.unwrap_err().interrupted, "{at}");
        let undone = hall.first("hold.undone");
        assert_eq!(
            (took >= 60.0, undone.is_none_or(|undone| undone >= 60.0)),
            (holds, true),
            "{at}: {took} {undone:?}"
        );
    }
}

#[test]
fn a_subsystem_is_late_once_what_came_at_that_moment_is_heard() {
    let slow = |name: &str, text: String| match name {
        "hall.yaml" => text.replace("takes_s: 3", "takes_s: 8") + "limits: { step_timeout_s: 30 }\n",
        _ => text,
    };
    for (at, holds) in [(4.999, true), (5.0, true), (5.0005, true), (5.002, false)] {
        let hall = Hall::new("hall.yaml", slow);
        let (_, not_up) = hall.bring_up(&[(at, "e_stop"), (60.0, "shutdown")]);
        assert!(not_up.is_err());
        assert_eq!(hall.first("left/failed").is_none(), holds, "{at}: {:?}", hall.first("left/failed"));
    }
}

/// A stop that is written down already, and takes a while until it is in the inboxes (on the real clock whoever tells it may be interrupted): it counts from
/// where it is told.
#[test]
fn a_stop_that_is_on_the_way_holds() {
    let failing = Hall::new("conveyor.yaml", with_a_lamp);
    let slow = |at_once: bool| {
        move |name: &str, text: String| match name {
            "hall.yaml" => text.replace("takes_s: 3", "takes_s: 8") + "limits: { step_timeout_s: 30 }\n",
            "conveyor.yaml" if at_once => {
                text + "faults: [{ step: start belt, how: slow, takes_s: 8 }]\nlimits: { step_timeout_s: 30 }\n"
            }
            _ => text,
        }
    };
    let late = Hall::new("conveyor.yaml", slow(true));
    let late_inside = Hall::new("hall.yaml", slow(false));
    for (hall, at) in [(failing, 1.9995), (late, 4.9995), (late_inside, 4.9995)] {
        let clock = hall.clock.clone();
        hall.session.hub().observe(Arc::new(move |_, happening: &Happening| {
            if matches!(happening, Happening::Event { event, .. } if event == "e_stop") {
                clock.sleep(Duration::from_millis(3));
            }
        }));
        let (took, not_up) = hall.bring_up(&[(at, "e_stop"), (60.0, "shutdown")]);
        assert!(not_up.is_err() && took >= 60.0, "{at}: {took}");
        assert_eq!(hall.first("left/failed"), None);
    }
}

/// A conveyor that warms up for two seconds, and goes on with that when it is let go.
fn with_warming(text: &str) -> String {
    text
            .replace("        running: { config: slow }", "        warming: {}\n        running: { config: slow }")
            .replace(
                "{ src: starting, tgt: running, events: [run.ok] }",
                "{ src: starting, tgt: warming, events: [run.ok] }\n        - { src: warming, tgt: running, events: [e_after(2)] }",
            )
            .replace(
                "    down:\n",
                "    paused:
      config: hold
      states: { whole: {}, in_part: {} }
      transitions: [{ src: initial, tgt: whole }, { src: whole, tgt: in_part, events: [hold.failed, hold.broken] }]
    down:\n",
            )
            .replace(
                "    - { src: up, tgt: held, events: [e_stop] }",
                "    - { src: up.building, tgt: held, events: [e_stop] }
    - { src: up.starting, tgt: held, events: [e_stop] }
    - { src: up.running, tgt: held, events: [e_stop] }
    - { src: up.warming, tgt: paused, events: [e_stop] }
    - { src: paused, tgt: paused, events: [e_stop] }
    - { src: paused, tgt: up.warming, events: [e_reset] }
    - { src: paused, tgt: down, events: [e_end] }",
            )
}

/// Its time begins anew when it is let go, however long it was held: it comes up two seconds after that.
#[test]
fn the_time_of_a_subsystem_begins_anew_when_it_is_let_go() {
    let warming = |name: &str, text: String| match name {
        "hall.yaml" => text.replace("takes_s: 3", "takes_s: 0.1"),
        "coordinator.yaml" => with_warming(&text),
        _ => text,
    };
    let hall = Hall::new("hall.yaml", warming);
    let (took, up) = hall.bring_up(&[(1.0, "e_stop"), (9.9, "left/e_reset"), (9.9, "right/e_reset")]);
    assert!(up.is_ok() && (11.9..12.0).contains(&took), "{took} {up:?}");
    assert_eq!(hall.first("left/failed"), None);
}

/// One that was held where it had failed, was let go, and fails once more, is stopped at once.
#[test]
fn what_fails_once_more_when_it_is_let_go_is_stopped() {
    let again = |name: &str, text: String| match name {
        "coordinator.yaml" => with_warming(&text),
        "lamp.yaml" => text + "    - { src: failed, tgt: trying, events: e_again }\n",
        _ => with_a_lamp(name, text),
    };
    let hall = Hall::new("conveyor.yaml", again);
    let (took, not_up) = hall.bring_up(&[(1.0, "e_stop"), (3.0, "e_again"), (3.5, "e_reset")]);
    assert!(hall.first("it does not come up, since the coordinator is in `failed`").is_some_and(|at| at < 2.1));
    assert!(not_up.is_err() && hall.first("build.undone").is_some_and(|at| (5.0..5.1).contains(&at)), "{took}");
}

/// What makes itself safe since its bring-up has failed is stopped as ever: nobody has stopped anything.
#[test]
fn to_fail_safely_is_no_emergency() {
    let safely = |name: &str, text: String| match name {
        "conveyor.yaml" => text + "faults: [{ step: start belt, how: fail }]\n",
        "coordinator.yaml" => text.replace("    failed: {}", "    failed: { config: hold }"),
        _ => text,
    };
    let hall = Hall::new("conveyor.yaml", safely);
    let (took, not_up) = hall.bring_up(&[(60.0, "shutdown")]);
    assert!(!not_up.unwrap_err().interrupted && took < 5.0, "{took}");
    assert!(hall.first("hold.ok").is_some(), "it was made safe");
}

/// With a second coordinator, which fails after two seconds.
fn with_a_lamp(name: &str, text: String) -> String {
    match name {
        "conveyor.yaml" => text
            .replace("coordinator: coordinator.yaml", "coordinators: { belt: coordinator.yaml, lamp: lamp.yaml }")
            .replace(
                "up: running, failed: [failed]",
                "up: [belt:running, lamp:on], failed: [belt:failed, lamp:failed]",
            ),
        _ => text,
    }
}

/// Another coordinator of the same file that fails meanwhile.
#[test]
fn another_coordinator_that_fails_ends_no_emergency() {
    let hall = Hall::new("conveyor.yaml", with_a_lamp);
    let (took, not_up) = hall.bring_up(&[(1.0, "e_stop"), (60.0, "e_reset")]);
    assert!(!not_up.unwrap_err().interrupted && took >= 60.0, "{took}");
    assert!(hall.first("hold.undone").is_some_and(|at| at >= 60.0), "{:?}", hall.first("hold.undone"));
}

/// What one made safe that has not failed, without an event of safety, is not that one's way to fail when another one does: neither where it was so before,
/// nor where it is asked for at that moment, nor where that was its answer to it.
#[test]
fn what_one_makes_safe_is_not_let_go_when_another_one_fails() {
    let jams = |name: &str, text: String| match name {
        "coordinator.yaml" => text
            .replace("src: up, tgt: held, events: [e_stop] }", "src: up, tgt: held, events: [e_stop, e_jam, e_dark] }"),
        _ => with_a_lamp(name, text),
    };
    let slowly = |name: &str, text: String| match name {
        "conveyor.yaml" => {
            jams(name, text) + "faults: [{ step: operation_call belt.brake, how: slow, takes_s: 0.5 }]\n"
        }
        _ => jams(name, text),
    };
    let tells = |name: &str, text: String| match name {
        "lamp.yaml" => text.replace("failed: {} }", "failed: { entry: e_dark } }"),
        _ => jams(name, text),
    };
    let before = Hall::new("conveyor.yaml", jams);
    let asked_for = Hall::new("conveyor.yaml", slowly);
    let answer = Hall::new("conveyor.yaml", tells);
    for (hall, raised, at) in [(before, "e_jam", 1.0), (asked_for, "e_jam", 1.9), (answer, "e_other", 1.0)] {
        let (took, not_up) = hall.bring_up(&[(at, raised), (60.0, "e_reset")]);
        assert!(!not_up.unwrap_err().interrupted && took >= 60.0, "{at}: {took}");
        assert!(hall.first("hold.undone").is_some_and(|at| at >= 60.0), "{at}: {:?}", hall.first("hold.undone"));
    }
}

/// What comes at the very moment in which one that has failed is let go is heard first, too.
#[test]
fn a_stop_at_the_moment_of_letting_go_holds() {
    let hall = Hall::new("conveyor.yaml", with_a_lamp);
    let (took, not_up) = hall.bring_up(&[(1.0, "e_stop"), (5.0, "e_reset"), (5.0005, "e_stop"), (60.0, "e_reset")]);
    assert!(!not_up.unwrap_err().interrupted && took >= 60.0, "{took}");
}

/// Who asks is told what lets go of it, and that it is led down then since it has failed; not what only comes back to where it was.
#[test]
fn what_lets_go_of_one_that_has_failed_is_named() {
    let looks = |name: &str, text: String| match name {
        "coordinator.yaml" => text.replace("tgt: held, events: [e_stop] }", "tgt: held, events: [e_stop, e_look] }"),
        _ => with_a_lamp(name, text),
    };
    let hall = Hall::new("conveyor.yaml", looks);
    let (clock, session) = (hall.clock.clone(), hall.session.clone());
    let (told, says) = std::sync::mpsc::channel();
    hall.clock.spawn("somebody", move || {
        clock.sleep(Duration::from_secs_f64(3.0));
        told.send(session.status().stands_still).unwrap();
    });
    let (_, not_up) = hall.bring_up(&[(1.0, "e_stop"), (60.0, "shutdown")]);
    assert!(not_up.is_err());
    let still = says.recv().unwrap().expect("it stands still").leads_on;
    let expected = "`davit event e_reset` lets go of it, and since the coordinator is in `failed` it is led down then";
    assert!(still.starts_with(expected), "{still}");
}

/// Where to be stopped means to have failed, that is no reason to let go either, and what makes it safe is waited for.
#[test]
fn to_have_failed_by_the_emergency_itself_lets_go_of_nothing() {
    let three = |name: &str, text: String| match name {
        "conveyor.yaml" => {
            text.replace("failed: [failed]", "failed: [failed, held]")
                + "faults: [{ step: start belt, how: slow, takes_s: 3 }]\n"
        }
        _ => text,
    };
    let hall = Hall::new("conveyor.yaml", three);
    let (took, not_up) = hall.bring_up(&[(1.0, "e_stop"), (60.0, "shutdown")]);
    assert!(not_up.unwrap_err().interrupted && took >= 60.0, "{took}");
    assert!(hall.first("hold.undone").is_some_and(|at| at >= 60.0), "{:?}", hall.first("hold.undone"));
}

/// What is stopped on its way down, deeper than in a subsystem: whoever hears the end of the deployment is named, not force alone.
#[test]
fn what_leads_on_from_a_stop_further_down_is_named() {
    let line = "davit: 1
name: line
platform: simulated
types: {}
subsystems: { inner: { deployment: conveyor.yaml } }
configurations: none.yaml
coordinator: line.lua
safety: e_stop
deploy:   { event: e_start, up: on, failed: failed, within_s: 8 }
shutdown: { event: e_end, down: off, within_s: 8 }
";
    let chart = "return state {
  off = state {}, raising = state { entry = 'inner/e_start' }, on = state {}, failed = state {}, ending = state { entry = 'inner/e_end' },
  trans { src = 'initial', tgt = 'off' },
  trans { src = 'off', tgt = 'raising', events = { 'e_start' } },
  trans { src = 'raising', tgt = 'on', events = { 'inner/up' } },
  trans { src = 'raising', tgt = 'failed', events = { 'inner/failed' } },
  trans { src = 'raising', tgt = 'ending', events = { 'e_end' } },
  trans { src = 'failed', tgt = 'ending', events = { 'e_end' } },
  trans { src = 'on', tgt = 'ending', events = { 'e_end' } },
  trans { src = 'ending', tgt = 'ending', events = { 'e_end' } },
  trans { src = 'ending', tgt = 'off', events = { 'inner/down', 'inner/e_end.ignored' } },
}";
    let deeper = |name: &str, text: String| match name {
        "hall.yaml" => {
            let (text, _) = text.split_once("faults:").unwrap();
            text.replace("left: { deployment: conveyor.yaml }", "left: { deployment: line.yaml }")
                + "faults: [{ step: stop left/inner/belt, how: slow, takes_s: 3 }]\nlimits: { step_timeout_s: 30 }\n"
        }
        _ => text,
    };
    let hall = Hall::with(&[("line.yaml", line), ("line.lua", chart)], "hall.yaml", deeper);
    let (_, up) = hall.bring_up(&[]);
    up.unwrap();
    let (clock, session) = (hall.clock.clone(), hall.session.clone());
    let (told, says) = std::sync::mpsc::channel();
    hall.clock.spawn("somebody", move || {
        clock.sleep(Duration::from_secs_f64(0.3));
        session.raise(EventName::new("e_stop").unwrap(), "test");
        clock.sleep(Duration::from_secs_f64(3.5));
        told.send(session.status().stopping.and_then(|stopping| stopping.stands_still())).unwrap();
        session.command(Command::Shutdown { force: false });
        clock.sleep(Duration::from_secs_f64(20.0));
        session.command(Command::Shutdown { force: true });
    });
    let ended = hall.session.take_down(false);
    let still = says.recv().unwrap().expect("it stands still");
    assert!(still.contains("`davit shutdown` raises `e_close` once more, which `hall` hears there"), "{still}");
    assert!(ended.is_clean(), "{ended:?}");
}
