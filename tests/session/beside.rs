//! Coordinators side by side on one configurator: each undoes its own frames, in any order, and breaks no other's.

use davit::app::{self, Checked, Refused};
use davit::lang::LoadOptions;
use davit::libraries;
use davit::model::codes;
use davit::session::{Happening, Phase, Session};
use davit::time::Clock;
use proptest::prelude::*;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};
use std::time::Duration;

const TYPES: &str = "types:
  Drive:
    ports: { out: { direction: out, type: float } }
    properties: { gain: { type: float, default: 1.0 } }
";

/// Files of a deployment, read and checked.
fn files(deployment: &str, others: &[(&str, &str)]) -> Result<Checked, Refused> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in others {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let file = folder.path().join("two.yaml");
    std::fs::write(&file, format!("davit: 1\nname: two\nplatform: simulated\n{TYPES}{deployment}")).unwrap();
    app::read(&file, &LoadOptions::default(), libraries::builtin()).and_then(app::check)
}

fn accepted(deployment: &str, others: &[(&str, &str)]) -> Checked {
    files(deployment, others).unwrap_or_else(|refused| panic!("{:#?}", refused.findings))
}

/// A state holds a configuration as long as it is active.
fn holder(name: &str) -> String {
    format!(
        "return state {{
          idle = state {{}}, fault = state {{}},
          on = state {{ config = \"{name}_base\", low = state {{}}, high = state {{ config = \"{name}_high\" }},
            trans {{ src = \"initial\", tgt = \"low\" }},
            trans {{ src = \"low\", tgt = \"high\", events = {{ \"e_{name}_up\" }} }},
            trans {{ src = \"high\", tgt = \"low\", events = {{ \"e_{name}_down\", \"{name}_high.failed\", \"{name}_high.broken\" }} }},
          }},
          trans {{ src = \"initial\", tgt = \"idle\" }},
          trans {{ src = \"idle\", tgt = \"on\", events = {{ \"e_start\", \"e_{name}_on\" }} }},
          trans {{ src = \"on\", tgt = \"fault\", events = {{ \"{name}_base.failed\", \"{name}_base.broken\" }} }},
          trans {{ src = \"fault\", tgt = \"idle\", events = {{ \"e_shutdown\" }} }},
          trans {{ src = \"on\", tgt = \"idle\", events = {{ \"e_shutdown\", \"e_{name}_off\" }} }},
        }}"
    )
}

const HOLDS: &str = "configurations: [conf.lua]
coordinators: { arm: arm.lua, gripper: gripper.lua }
deploy: { event: e_start, up: on, failed: [fault], within_s: 5 }
shutdown: { event: e_shutdown, down: [arm:idle, gripper:root.idle], within_s: 5 }
";

fn configurations(component: impl Fn(&str) -> &str) -> String {
    let of = |name: &str| {
        let component = component(name);
        format!(
            "{name}_base = Configuration {{ create(\"{name}Drive\", \"Drive\"), post_conf_state = {{ \"{name}Drive:running\" }} }},
             {name}_high = Configuration {{ property_set(\"{component}.gain\", {gain}) }},",
            gain = if name == "arm" { "5.0" } else { "7.0" }
        )
    };
    format!("ConfiguratorConf {{ {} {} }}", of("arm"), of("gripper"))
}

fn two() -> Checked {
    let own = configurations(|name| if name == "arm" { "armDrive" } else { "gripperDrive" });
    accepted(HOLDS, &[("conf.lua", &own), ("arm.lua", &holder("arm")), ("gripper.lua", &holder("gripper"))])
}

/// A session in simulated time, and what happens in it.
struct Run {
    session: Arc<Session>,
    clock: Clock,
    heard: Arc<Mutex<Vec<Happening>>>,
}

impl Run {
    fn with(checked: &Checked, what: impl FnOnce(&Self)) {
        let clock = Clock::simulated();
        let _me = clock.enter();
        let session = app::start(checked, &clock).unwrap();
        let heard = Arc::new(Mutex::new(Vec::new()));
        let log = heard.clone();
        session.hub().observe(Arc::new(move |_, what| log.lock().unwrap().push(what.clone())));
        let run = Self { session, clock: clock.clone(), heard };
        what(&run);
        clock.shutdown();
    }

    fn event(&self, name: &str) {
        self.session.raise(davit::model::EventName::new(name).unwrap(), "test");
        self.clock.sleep(Duration::from_millis(100));
    }

    /// `CONFIGURATION by REQUESTER`, in no order.
    fn frames(&self) -> BTreeSet<String> {
        let stack = self.session.status().stack.unwrap();
        assert!(stack.iter().all(|frame| frame.parts == 1));
        let set: BTreeSet<String> = stack.iter().map(|f| format!("{} by {}", f.configuration, f.by)).collect();
        assert_eq!(set.len(), stack.len(), "no frame twice");
        set
    }

    /// What the active states imply.
    fn implied(&self) -> BTreeSet<String> {
        let mut set = BTreeSet::new();
        for (name, states) in self.session.status().coordinators {
            for state in states {
                match state.rsplit('.').next().unwrap() {
                    "on" => _ = set.insert(format!("{name}_base by {name}")),
                    "high" => _ = set.insert(format!("{name}_high by {name}")),
                    _ => {}
                }
            }
        }
        set
    }

    fn reasons(&self) -> Vec<String> {
        let heard = self.heard.lock().unwrap();
        let answers = heard.iter().filter_map(|what| match what {
            Happening::Answered(answered) if !answered.ok && !answered.answer.ends_with(".cancelled") => Some(answered),
            _ => None,
        });
        answers.flat_map(|a| a.reasons.iter().map(move |r| format!("{}: {r}", a.answer))).collect()
    }
}

/// That a coordinator begins in *down* stands in nobody's way, nor waits for what another one asks for.
#[test]
fn both_come_up_in_the_time_of_one() {
    let own = configurations(|name| if name == "arm" { "armDrive" } else { "gripperDrive" });
    let slow = |component: &str| format!("{{ step: configure {component}, how: slow, times: 1, takes_s: 0.8 }}");
    let faults = format!("{HOLDS}faults: [{}, {}]\n", slow("armDrive"), slow("gripperDrive"));
    let others = [("conf.lua", &*own), ("arm.lua", &holder("arm")), ("gripper.lua", &holder("gripper"))];
    Run::with(&accepted(&faults, &others), |run| {
        run.session.bring_up().unwrap();
        assert_eq!(run.session.status().at, 0.8);
        assert!(run.session.take_down(false).is_orderly());
        // In force is nothing of it.
        assert!(run.frames().is_empty());
    });
}

/// Nor does it where it has come there: what others ask for is done meanwhile, and what it asks for next.
#[test]
fn who_is_down_keeps_nobody_waiting() {
    let own = configurations(|name| if name == "arm" { "armDrive" } else { "gripperDrive" });
    let slow = format!("{HOLDS}faults: [{{ step: configure gripperDrive, how: slow, times: 2, takes_s: 0.8 }}]\n");
    // It comes down when what it has undone is answered.
    let waits = holder("arm").replacen(
        "trans { src = \"on\", tgt = \"idle\", events",
        "leaving = state {}, trans { src = \"leaving\", tgt = \"idle\",
           events = { \"arm_base.undone\", \"arm_base.undo.failed\", \"arm_base.undo.broken\" } },
          trans { src = \"on\", tgt = \"leaving\", events",
        1,
    );
    assert!(waits.contains("leaving"));
    let others = [("conf.lua", &*own), ("arm.lua", &*waits), ("gripper.lua", &holder("gripper"))];
    Run::with(&accepted(&slow, &others), |run| {
        run.session.bring_up().unwrap();
        run.event("e_gripper_off");
        run.event("e_gripper_on");
        run.event("e_arm_off");
        run.event("e_arm_on");
        assert_eq!(run.frames(), ["arm_base by arm".to_owned()].into(), "the gripper is still being made");
        run.clock.sleep(Duration::from_secs(1));
        assert_eq!(run.frames(), run.implied());
        assert!(run.session.take_down(false).is_orderly());
        assert!(run.frames().is_empty());
    });
}

/// The event that begins it comes while one still does what it asks for at its beginning, and hears nothing of it then.
#[test]
fn who_has_something_to_do_at_the_beginning_comes_up_too() {
    let own = configurations(|name| if name == "arm" { "armDrive" } else { "gripperDrive" });
    let boots = holder("arm").replacen(
        "trans { src = \"initial\", tgt = \"idle\" },",
        "boot = state { entry = \"arm_base\" }, booted = state { entry = \"arm_base.undo\" },
          trans { src = \"initial\", tgt = \"boot\" },
          trans { src = \"boot\", tgt = \"booted\", events = { \"arm_base.ok\", \"arm_base.failed\", \"arm_base.broken\" } },
          trans { src = \"booted\", tgt = \"idle\", events = { \"arm_base.undone\", \"arm_base.undo.failed\", \"arm_base.undo.broken\" } },",
        1,
    );
    let others = [("conf.lua", &*own), ("arm.lua", &*boots), ("gripper.lua", &holder("gripper"))];
    Run::with(&accepted(HOLDS, &others), |run| {
        run.session.bring_up().unwrap();
        assert_eq!(run.frames(), run.implied());
        assert!(run.session.in_state("arm:on") && run.session.in_state("gripper:on"));
        assert!(run.session.take_down(false).is_orderly());
    });
}

#[test]
fn each_comes_up_undoes_its_own_and_goes_down() {
    let checked = two();
    assert!(checked.findings.iter().all(|f| f.code != codes::COORD_SHARED), "{:?}", checked.findings);
    Run::with(&checked, |run| {
        run.session.bring_up().unwrap();
        assert_eq!(run.session.status().phase, Phase::Up);
        run.event("e_arm_up");
        run.event("e_gripper_up");
        let all = ["arm_base by arm", "arm_high by arm", "gripper_base by gripper", "gripper_high by gripper"];
        assert_eq!(run.frames(), all.iter().map(ToString::to_string).collect());
        // The arm's frames are the oldest and lie between the gripper's.
        run.event("e_arm_off");
        assert_eq!(run.frames(), all[2..].iter().map(ToString::to_string).collect());
        assert!(run.session.in_state("gripper:high") && run.session.in_state("arm:idle"));
        assert!(!run.session.in_state("idle"), "a name without a coordinator is meant of all");
        run.event("e_arm_on");
        run.event("e_gripper_off");
        assert_eq!(run.frames(), all[..1].iter().map(ToString::to_string).collect());
        let ended = run.session.take_down(false);
        assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
        assert!(run.reasons().is_empty(), "{:?}", run.reasons());
    });
}

#[test]
fn a_conflict_is_refused_and_names_the_others_frame() {
    // Here the gripper's `high` sets the arm's gain: `check` says so, and the arm's frames wait for the gripper's.
    let shared = configurations(|_| "armDrive");
    let checked =
        accepted(HOLDS, &[("conf.lua", &shared), ("arm.lua", &holder("arm")), ("gripper.lua", &holder("gripper"))]);
    let said: Vec<_> = checked.findings.iter().filter(|f| f.code == codes::COORD_SHARED).collect();
    assert!(
        matches!(&said[..], [one] if one.message.contains("`arm`") && one.message.contains("`armDrive`")),
        "{said:?}"
    );
    Run::with(&checked, |run| {
        run.session.bring_up().unwrap();
        run.event("e_gripper_up");
        run.event("e_arm_off");
        let refused = run.reasons();
        assert!(
            refused.iter().any(|r| r.starts_with("arm_base.undo.failed")
                && r.contains("`gripper_high` (a frame of gripper)")
                && r.contains("armDrive")),
            "{refused:?}"
        );
        assert!(run.frames().contains("gripper_high by gripper"));
        assert!(
            run.session.system().unwrap().components.keys().any(|name| name.as_str() == "armDrive"),
            "nothing is broken"
        );
    });
}

#[test]
fn the_top_and_the_groups_of_another_are_left_alone() {
    let greedy = |name: &str| {
        format!(
            "return state {{
              idle = state {{}}, on = state {{ plain = state {{}}, mode = state {{}}, popped = state {{}},
                trans {{ src = \"initial\", tgt = \"plain\" }},
                trans {{ src = \"plain\", tgt = \"mode\", events = {{ \"e_{name}_mode\" }}, effect = \"{name}_mode\" }},
                trans {{ src = \"mode\", tgt = \"popped\", events = {{ \"e_{name}_pop\" }}, effect = \"undo\" }},
              }},
              trans {{ src = \"initial\", tgt = \"idle\" }},
              trans {{ src = \"idle\", tgt = \"on\", events = {{ \"e_start\" }}, effect = \"{name}_base\" }},
              trans {{ src = \"on\", tgt = \"idle\", events = {{ \"e_shutdown\" }}, effect = {{ \"{name}_mode.undo\", \"{name}_base.undo\" }} }},
            }}"
        )
    };
    let conf = "ConfiguratorConf {
      arm_base = Configuration { create(\"a\", \"Drive\") }, gripper_base = Configuration { create(\"g\", \"Drive\") },
      arm_mode = Configuration { group = \"mode\", property_set(\"a.gain\", 2.0) },
      gripper_mode = Configuration { group = \"mode\", property_set(\"g.gain\", 2.0) },
    }";
    let deployment = HOLDS.replace(", failed: [fault]", "");
    let checked =
        accepted(&deployment, &[("conf.lua", conf), ("arm.lua", &greedy("arm")), ("gripper.lua", &greedy("gripper"))]);
    let said = checked.findings.iter().filter(|f| f.code == codes::COORD_SHARED).count();
    assert_eq!(said, 1, "the group: {:?}", checked.findings);
    Run::with(&checked, |run| {
        run.session.bring_up().unwrap();
        run.event("e_arm_mode");
        run.event("e_gripper_mode");
        run.event("e_gripper_pop");
        let refused = run.reasons();
        let names = "`arm_mode` is a frame of the coordinator `arm`, not of `gripper`";
        let found = refused.iter().any(|r| r.starts_with("gripper_mode.failed") && r.contains(names));
        assert!(found, "{refused:?}");
        // It undoes the newest frame of its own.
        assert!(run.frames().contains("arm_mode by arm") && !run.frames().contains("gripper_base"));
        run.event("e_arm_pop");
        assert!(!run.frames().contains("arm_mode by arm"));
    });
}

#[test]
fn one_coordinator_commands_another_by_events() {
    // The boss asks for nothing itself: it tells the hand, and waits until the hand says that it holds.
    let boss = "return state {
      idle = state {}, closing = state { entry = \"e_close\" }, held = state {}, opening = state { entry = \"e_open\" },
      trans { src = \"initial\", tgt = \"idle\" },
      trans { src = \"idle\", tgt = \"closing\", events = { \"e_start\" } },
      trans { src = \"closing\", tgt = \"held\", events = { \"e_holds\" } },
      trans { src = \"held\", tgt = \"opening\", events = { \"e_shutdown\" } },
      trans { src = \"opening\", tgt = \"idle\", events = { \"e_free\" } },
    }";
    let hand = "return state {
      open = state {}, shut = state { entry = \"grip\" }, sure = state { entry = \"e_holds\" },
      loose = state { entry = \"grip.undo\" },
      trans { src = \"initial\", tgt = \"open\" },
      trans { src = \"open\", tgt = \"shut\", events = { \"e_close\" } },
      trans { src = \"shut\", tgt = \"open\", events = { \"grip.failed\", \"grip.broken\" } },
      trans { src = \"shut\", tgt = \"sure\", events = { \"grip.ok\" } },
      trans { src = \"sure\", tgt = \"loose\", events = { \"e_open\" } },
      trans { src = \"loose\", tgt = \"open\", events = { \"grip.undone\", \"grip.undo.failed\", \"grip.undo.broken\" }, effect = \"e_free\" },
    }";
    let deployment = "configurations: [conf.lua]
coordinator: boss.lua
coordinators: { hand: hand.lua }
deploy: { event: e_start, up: [held, hand:sure], within_s: 5 }
shutdown: { event: e_shutdown, down: [idle, hand:open], within_s: 5 }
";
    let conf = "ConfiguratorConf { grip = Configuration { create(\"g\", \"Drive\") } }";
    let checked = accepted(deployment, &[("conf.lua", conf), ("boss.lua", boss), ("hand.lua", hand)]);
    Run::with(&checked, |run| {
        run.session.bring_up().unwrap();
        assert_eq!(run.frames(), ["grip by hand".to_owned()].into());
        let ended = run.session.take_down(false);
        assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
    });
}

#[test]
fn what_is_wrong_with_the_names_is_said() {
    let own = configurations(|name| if name == "arm" { "armDrive" } else { "gripperDrive" });
    let try_with = |old: &str, new: &str| {
        let text = HOLDS.replace(old, new);
        assert_ne!(text, HOLDS);
        let others = [("conf.lua", &own[..]), ("arm.lua", &holder("arm")[..]), ("gripper.lua", &holder("gripper")[..])];
        let refused = files(&text, &others).err().unwrap_or_else(|| panic!("{new} is accepted"));
        let first = refused.findings.first().unwrap().clone();
        (first.code, format!("{} / {}", first.message, first.help.unwrap_or_default()))
    };
    let (code, text) = try_with("gripper:root.idle", "griper:idle");
    assert_eq!(code, codes::DEPLOY_UNKNOWN_STATE);
    assert!(text.contains("there is no coordinator `griper`") && text.contains("did you mean `gripper`"), "{text}");
    let (code, text) = try_with("[arm:idle, gripper:root.idle]", "arm:idle");
    assert_eq!(code, codes::DEPLOY_UNKNOWN_STATE);
    assert!(text.contains("no state is named that means down of the coordinator `gripper`"), "{text}");
    let (code, text) = try_with("[arm:idle,", "[arm:idle, arm:on,");
    assert_eq!(code, codes::TEXT_BAD_VALUE);
    assert!(text.contains("two states mean down of the coordinator `arm`"), "{text}");
    let (code, text) = try_with("up: on", "up: onn");
    assert_eq!(code, codes::DEPLOY_UNKNOWN_STATE);
    assert!(text.contains("did you mean `on`"), "{text}");
    let (code, text) = try_with("failed: [fault]", "failed: [falt]");
    assert_eq!(code, codes::DEPLOY_UNKNOWN_STATE);
    assert!(text.contains("did you mean `fault`"), "{text}");
    let (code, text) = try_with("coordinators: { arm: arm.lua,", "coordinator: arm.lua\ncoordinators: { two: arm.lua,");
    assert_eq!(code, codes::TEXT_DUPLICATE_KEY);
    assert!(text.contains("two coordinators `two`"), "{text}");
}

#[test]
fn a_configuration_that_is_undone_unless_confirmed_wants_to_be_heard() {
    let chart = |hears: &str| {
        format!(
            "return state {{
              idle = state {{}}, on = state {{ entry = \"base\" }}, fault = state {{}},
              trans {{ src = \"initial\", tgt = \"idle\" }},
              trans {{ src = \"idle\", tgt = \"on\", events = {{ \"e_start\" }} }},
              trans {{ src = \"on\", tgt = \"fault\", events = {{ \"base.failed\", \"base.broken\"{hears} }} }},
              trans {{ src = \"on\", tgt = \"idle\", events = {{ \"e_shutdown\", \"e_sure\" }}, effect = \"base.undo\" }},
              trans {{ src = \"fault\", tgt = \"idle\", events = {{ \"e_shutdown\" }} }},
            }}"
        )
    };
    let deployment = "configurations: [conf.lua]
coordinator: one.lua
deploy: { event: e_start, up: on, within_s: 5 }
shutdown: { event: e_shutdown, down: idle, within_s: 5 }
";
    let conf =
        |confirm: &str| format!("ConfiguratorConf {{ base = Configuration {{ create(\"a\", \"Drive\"){confirm} }} }}");
    let said = |confirm: &str, hears: &str| {
        let checked = accepted(deployment, &[("conf.lua", &conf(confirm)), ("one.lua", &chart(hears))]);
        // Where one that is heard somewhere comes unheard is followed, and told by another finding.
        let about = |f: &davit::model::Finding| f.code != codes::COORD_REVERTED_UNHEARD;
        let found = checked.findings.into_iter().find(|f| f.message.contains("base.reverted") && about(f));
        found.map(|f| (f.code, f.severity))
    };
    let confirm = ", confirm = { event = \"e_sure\", within = 1.0 }";
    let warning = davit::model::Severity::Warning;
    assert_eq!(said(confirm, ""), Some((codes::COORD_FAILURE_UNHANDLED, warning)));
    assert_eq!(said(confirm, ", \"base.reverted\""), None);
    assert_eq!(said("", ""), None);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is asked in whatever order, quickly or slowly: once all is answered, each one's frames are those that its
    /// active states imply, and no request was refused because of the other.
    #[test]
    fn the_frames_of_each_are_what_its_states_imply(orders in proptest::collection::vec((0..8_usize, any::<bool>()), 1..40)) {
        const EVENTS: [&str; 8] = [
            "e_arm_on", "e_arm_off", "e_arm_up", "e_arm_down",
            "e_gripper_on", "e_gripper_off", "e_gripper_up", "e_gripper_down",
        ];
        let checked = two();
        let mut failed = None;
        Run::with(&checked, |run| {
            for (at, (event, slow)) in orders.iter().enumerate() {
                run.session.raise(davit::model::EventName::new(EVENTS[*event]).unwrap(), "test");
                if *slow || at + 1 == orders.len() {
                    run.clock.sleep(Duration::from_secs(1));
                    let (frames, implied) = (run.frames(), run.implied());
                    if frames != implied {
                        failed = Some(format!("after {at} events: {frames:?}, but the states imply {implied:?}"));
                        return;
                    }
                }
            }
            let ended = run.session.take_down(false);
            if !ended.is_clean() || !ended.forced.is_empty() || !run.reasons().is_empty() {
                failed = Some(format!("{ended:?} {:?}", run.reasons()));
            }
        });
        prop_assert!(failed.is_none(), "{}", failed.unwrap_or_default());
    }
}
