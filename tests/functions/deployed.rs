//! A coordinator with functions at work in a deployment.

use davit::app;
use davit::lang::{LoadOptions, Sources};
use davit::platform::simulated::{Simulated, SimulatedOptions};
use davit::session::Happening;
use davit::time::Clock;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

pub const DEPLOYMENT: &str = "
davit: 1
name: functions
platform: simulated
types:
  Gain: { properties: { k: { type: float, default: 1.0 } }, operations: {}, ports: {} }
configurations: [configurations.lua]
coordinator: coordinator.lua
trusted: true
deploy: { event: e_start, up: operational, failed: [fault], within_s: 20 }
shutdown: { event: e_stop, down: idle, within_s: 20 }
";

pub const CONFIGURATIONS: &str = "ConfiguratorConf { make = Configuration { create('g', 'Gain') } }";

pub const COORDINATOR: &str = r#"
return rfsm.state {
  idle = rfsm.state { entry = function(fsm, s) fsm.visits = (fsm.visits or 0) + 1 end },
  starting = rfsm.state { entry = 'make' },
  operational = rfsm.state {
    doo = function(fsm)
      while true do
        fsm.rounds = (fsm.rounds or 0) + 1
        if fsm.rounds == 5 then print('five rounds') end
        rfsm.yield(true)
      end
    end,
  },
  stopping = rfsm.state { entry = 'make.undo' },
  fault = rfsm.state {},
  rfsm.trans { src = 'initial', tgt = 'idle' },
  rfsm.trans { src = 'idle', tgt = 'starting', events = { 'e_start' }, guard = function(tr, events) return events[1] == 'e_start' end },
  rfsm.trans { src = 'starting', tgt = 'operational', events = { 'make.ok' },
               effect = function(fsm, tr, what, events) print(what .. ' ' .. events[1]) end },
  rfsm.trans { src = 'starting', tgt = 'fault', events = { 'make.failed', 'make.broken' } },
  rfsm.trans { src = 'fault', tgt = 'idle', events = { 'e_stop' } },
  rfsm.trans { src = 'operational', tgt = 'stopping', events = { 'e_stop' } },
  rfsm.trans { src = 'stopping', tgt = 'idle', events = { 'make.undone' } },
  rfsm.trans { src = 'stopping', tgt = 'fault', events = { 'make.undo.failed', 'make.undo.broken' } },
}
"#;

fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// Brings a deployment with this coordinator up, lets `seconds` pass, takes it down; answers what its functions said.
pub fn said_by(coordinator: &str, seconds: u64) -> Vec<String> {
    watched(coordinator, seconds, |_| {})
}

/// The same; `look` sees the session before it is taken down.
fn watched(coordinator: &str, seconds: u64, look: impl FnOnce(&Arc<davit::session::Session>)) -> Vec<String> {
    watched_by(&davit::runtime::Libraries::new().into(), coordinator, seconds, look)
}

/// The same in a program with its own extensions.
fn watched_by(
    program: &app::Extensions,
    coordinator: &str,
    seconds: u64,
    look: impl FnOnce(&Arc<davit::session::Session>),
) -> Vec<String> {
    let files = [("d.yaml", DEPLOYMENT), ("configurations.lua", CONFIGURATIONS), ("coordinator.lua", coordinator)];
    let folder = folder(&files);
    let read = app::read(&folder.path().join("d.yaml"), &LoadOptions::default(), program).unwrap();
    let checked = app::check(read).unwrap_or_else(|refused| panic!("{:?}", refused.findings));
    let clock = Clock::simulated();
    let _me = clock.enter();
    let platform = Arc::new(Simulated::new(checked.catalogue.clone(), clock.clone(), SimulatedOptions::default()));
    let session = app::start_on(&checked, platform, &clock);
    let said: Arc<Mutex<Vec<String>>> = Arc::default();
    let heard = said.clone();
    session.hub().observe(Arc::new(move |_, what| {
        if let Happening::Said { by, text } = what {
            heard.lock().unwrap().push(format!("{by}: {text}"));
        }
    }));
    session.bring_up().expect("up");
    clock.sleep(Duration::from_secs(seconds));
    look(&session);
    session.take_down(false);
    clock.shutdown();
    said.lock().unwrap().clone()
}

#[test]
fn an_activity_that_never_rests_lets_the_time_pass() {
    let text =
        COORDINATOR.replace("rfsm.yield(true)", "rfsm.yield(false)").replace("fsm.rounds == 5", "fsm.rounds == 900");
    assert!(said_by(&text, 1).contains(&"info: five rounds".to_owned()), "a thousand rounds a second");
}

#[test]
fn functions_that_fail_or_hang_keep_no_deployment_from_coming_up() {
    for body in ["error('oh', 0)", "while true do end", "local t = {} for i = 1, 1e9 do t[i] = ('x'):rep(1e6) .. i end"]
    {
        let text = COORDINATOR.replace("entry = 'make' }", &format!("entry = {{ 'make', function() {body} end }} }}"));
        let said = said_by(&text, 1);
        assert!(
            said.iter().any(|s| s.starts_with("err: ENTRY error executing entry of root.starting: ")),
            "{body}: {said:?}"
        );
        assert!(said.contains(&"info: effect make.ok".to_owned()), "{said:?}");
    }
}

/// What the status says of events that functions send faster than the chart takes them.
#[test]
fn events_lost_inside_a_coordinator_are_counted() {
    let text = COORDINATOR.replace(
        "entry = 'make' }",
        "entry = { 'make', function(fsm) for i = 1, 3000 do rfsm.send_events(fsm, 'x') end end } }",
    );
    let mut lost = None;
    let said = watched(&text, 1, |session| lost = Some(session.status().dropped));
    // And the completion of the state, which found no room either.
    assert_eq!(lost.expect("a status").inside, 3000 - 1024 + 1);
    assert_eq!(said.iter().filter(|s| s.contains("1,976 events found no room")).count(), 1, "{said:?}");
}

/// A function that waits outside of Lua, here for a file that nobody writes: told once, and shown in the status; the
/// session ends without waiting for it.
#[cfg(unix)]
#[test]
fn a_coordinator_that_hangs_in_a_function_is_told() {
    let folder = folder(&[
        ("d.yaml", &DEPLOYMENT.replace("trusted: true", "trusted: { open: [io] }")),
        ("configurations.lua", CONFIGURATIONS),
    ]);
    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("it runs").success());
    let text = COORDINATOR.replace("return rfsm.state {", &format!("local function wait() io.open('{}'):read('a') end return rfsm.state {{", pipe.display()))
        .replace("rfsm.trans { src = 'fault'", "rfsm.trans { src = 'operational', tgt = 'operational', events = { 'e_hang' }, effect = wait }, rfsm.trans { src = 'fault'");
    std::fs::write(folder.path().join("coordinator.lua"), text).expect("a file");
    let read =
        app::read(&folder.path().join("d.yaml"), &LoadOptions::default(), davit::runtime::Libraries::new()).unwrap();
    let checked = app::check(read).unwrap_or_else(|refused| panic!("{:?}", refused.findings));
    let clock = Clock::real();
    let _me = clock.enter();
    let platform = Arc::new(Simulated::new(checked.catalogue.clone(), clock.clone(), SimulatedOptions::default()));
    let session = app::start_on(&checked, platform, &clock);
    let told: Arc<Mutex<Vec<(String, f64)>>> = Arc::default();
    let heard = told.clone();
    let driver = Arc::downgrade(&session);
    session.hub().observe(Arc::new(move |_, what| {
        if let Happening::Slow { coordinator, seconds } = what {
            heard.lock().unwrap().push((coordinator.clone(), *seconds));
            if let Some(session) = driver.upgrade() {
                session.command(davit::session::Command::Shutdown { force: true });
            }
        }
    }));
    session.bring_up().expect("up");
    session.raise(davit::model::EventName::new("e_hang").unwrap(), "test");
    session.serve();
    let slow = session.status().slow;
    assert!(slow.len() == 1 && slow.values().all(|seconds| *seconds > 1.0), "{slow:?}");
    assert_eq!(told.lock().unwrap().len(), 1);
    assert!(session.take_down(true).is_clean());
    // So that the thread ends.
    std::fs::write(&pipe, "x").expect("somebody reads");
}

#[test]
fn time_events_and_getevents_run_on_the_projects_clock() {
    let text = COORDINATOR
        .replace("return rfsm.state {", "local n = 0\nreturn rfsm.state { getevents = function() n = n + 1 if n % 100 == 0 then return { 'e_tick' } end return {} end,")
        .replace("doo = function", "not_doo = function")
        .replace(
            "rfsm.trans { src = 'fault'",
            "rfsm.trans { src = 'operational', tgt = 'operational', events = { rfsm_timeevent.e_after(0.3) }, effect = function() print('later') end },
             rfsm.trans { src = 'operational', tgt = 'operational', events = { 'e_tick' }, effect = function() print('tick') end },
             rfsm.trans { src = 'fault'",
        );
    let said = said_by(&text, 2);
    let count = |what: &str| said.iter().filter(|s| s.as_str() == what).count();
    assert!((2..=6).contains(&count("info: tick")) && count("info: later") >= 3, "{said:?}");
}

/// Called at every rest, and again ten milliseconds later; what it sends is taken at once, what goes wrong is told.
#[test]
fn an_idle_hook_is_called_whenever_there_is_nothing_to_do() {
    let text = COORDINATOR
        .replace("return rfsm.state {", "local n, told = 0 return rfsm.state { idle_hook = function(fsm) n = n + 1 if n == 50 then rfsm.send_events(fsm, 'e_tick') end if n == 60 then error('oh', 0) end end,")
        .replace("doo = function", "not_doo = function")
        .replace(
            "rfsm.trans { src = 'fault'",
            "rfsm.trans { src = 'operational', tgt = 'operational', events = { 'e_tick' }, effect = function() print('tick') end },
             rfsm.trans { src = 'fault'",
        );
    let said = said_by(&text, 1);
    let tick = said.iter().position(|s| s == "info: tick").unwrap_or_else(|| panic!("{said:?}"));
    assert!(said[tick..].contains(&"err: HOOK error executing idle_hook: oh".to_owned()), "{said:?}");
}

#[test]
fn a_deployment_with_functions_comes_up_and_goes_down() {
    let files = [("d.yaml", DEPLOYMENT), ("configurations.lua", CONFIGURATIONS), ("coordinator.lua", COORDINATOR)];
    let folder = folder(&files);
    let read =
        app::read(&folder.path().join("d.yaml"), &LoadOptions::default(), davit::runtime::Libraries::new()).unwrap();
    let checked = app::check(read).unwrap();
    assert!(checked.findings.iter().any(|f| f.code == davit::model::codes::COORD_NOT_PURE), "{:?}", checked.findings);
    assert_eq!(said_by(COORDINATOR, 1), ["info: effect make.ok", "info: five rounds"]);
}

#[test]
fn without_trust_the_deployment_is_refused() {
    let text = DEPLOYMENT.replace("trusted: true\n", "");
    let from = Sources::memory([
        ("d.yaml", text.as_str()),
        ("configurations.lua", CONFIGURATIONS),
        ("coordinator.lua", COORDINATOR),
    ]);
    let loaded = davit::lang::load_from(&from, Path::new("d.yaml"), &LoadOptions::default());
    assert!(loaded.deployment.is_none());
    let codes: Vec<_> = loaded.findings.iter().map(|f| f.code).collect();
    assert!(codes.contains(&davit::model::codes::CHART_FUNCTION), "{:?}", loaded.findings);
}

/// Functions see events that no transition lists. Each name is kept for ever, so there is an end of them, whoever gives them.
#[test]
fn names_from_outside_that_only_functions_may_see_are_bounded() {
    use davit::limits::{EVENTS_UNLISTED, UNLISTED_BYTES};
    use davit::session::NotNamed;
    use davit::session::serving::Service;
    let said = watched(COORDINATOR, 1, |session| {
        for number in 0..EVENTS_UNLISTED {
            session.named(&format!("e_unlisted_{number}")).expect("there is room");
        }
        assert!(matches!(session.named("e_one_more"), Err(NotNamed::Many(_))));
        assert_eq!(session.named(&"e".repeat(UNLISTED_BYTES + 1)), Err(NotNamed::Long));
        // What was given before, and what is listed, is heard as before.
        assert!(session.named("e_unlisted_7").is_ok() && session.named("e_start").is_ok());
        let service = davit::session::service::SessionService::new(Arc::downgrade(session));
        let told = service.call(2, "event", &serde_json::json!({ "event": "e_one_more" })).unwrap_err();
        assert!(told.message.contains("each is kept for ever"), "{told:?}");
    });
    assert!(!said.is_empty());
}

/// `operational` asks a function of the program, well and badly.
const ASKING: &str = r#"
return rfsm.state {
  idle = rfsm.state {},
  starting = rfsm.state { entry = 'make' },
  operational = rfsm.state { entry = function() print(gauge('g', { 1, 2.5 })) print(pcall(gauge)) gauge(print) end },
  stopping = rfsm.state { entry = 'make.undo' },
  fault = rfsm.state {},
  rfsm.trans { src = 'initial', tgt = 'idle' },
  rfsm.trans { src = 'idle', tgt = 'starting', events = { 'e_start' } },
  rfsm.trans { src = 'starting', tgt = 'operational', events = { 'make.ok' } },
  rfsm.trans { src = 'starting', tgt = 'fault', events = { 'make.failed', 'make.broken' } },
  rfsm.trans { src = 'fault', tgt = 'idle', events = { 'e_stop' } },
  rfsm.trans { src = 'operational', tgt = 'stopping', events = { 'e_stop' } },
  rfsm.trans { src = 'stopping', tgt = 'idle', events = { 'make.undone' } },
  rfsm.trans { src = 'stopping', tgt = 'fault', events = { 'make.undo.failed', 'make.undo.broken' } },
}
"#;

#[test]
fn functions_of_a_platform_are_waited_for_and_their_errors_are_luas() {
    use davit::model::{PlatformKind, Value};
    let asked: Arc<Mutex<Vec<Vec<Value>>>> = Arc::default();
    let heard = asked.clone();
    let own = app::PlatformMaker::new("simulated", PlatformKind::SIMULATED, |_| Err("it is given".to_owned()));
    let own = own.function("gauge", move |platform, clock, values| {
        clock.sleep(Duration::from_secs(1));
        heard.lock().unwrap().push(values.to_vec());
        let there = platform.observe(clock.now() + Duration::from_secs(1)).map_err(|why| why.to_string())?;
        if values.is_empty() {
            Err("which one?".to_owned())
        } else {
            Ok(there.components.len().to_string().as_str().into())
        }
    });
    let program = app::Extensions::from(davit::runtime::Libraries::new()).with_platform(own);
    let said = watched_by(&program, ASKING, 5, |_| {});
    let list = Value::Array(vec![Value::Int(1), Value::Float(2.5)]);
    assert_eq!(*asked.lock().unwrap(), [vec![Value::str("g"), list], vec![]], "what is no value is not handed on");
    assert_eq!(said[0], "info: 1", "{said:?}");
    assert!(said[1].starts_with("info: false") && said[1].contains("which one?"), "{said:?}");
    assert!(said[2].starts_with("err: ") && said[2].contains("a function is no value"), "{said:?}");
}

#[test]
fn built_in_platforms_have_no_functions() {
    let said = said_by(ASKING, 5);
    assert!(said.len() == 1 && said[0].contains("global 'gauge'"), "{said:?}");
}
