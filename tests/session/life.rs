//! The story of a deployment in simulated time, on both platforms.

use davit::app::script::{self, Interrupt, ScriptOptions};
use davit::app::{self, Checked, StartError};
use davit::lang::LoadOptions;
use davit::libraries;
use davit::model::{Severity, codes};
use davit::session::rpc;
use davit::session::service::SessionService;
use davit::session::socket::Service;
use davit::session::{Command, Happening, Phase, Session};
use davit::time::Clock;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A file of the project, checked once for all tests.
pub fn checked(file: &str) -> Checked {
    static KNOWN: Mutex<BTreeMap<String, Checked>> = Mutex::new(BTreeMap::new());
    let mut known = KNOWN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    known.entry(file.to_owned()).or_insert_with(|| check(file)).clone()
}

fn check(file: &str) -> Checked {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    app::read(&path, &LoadOptions::default(), libraries::builtin())
        .and_then(app::check)
        .unwrap_or_else(|refused| panic!("{file} is refused: {:?}", refused.findings))
}

/// Everything an observer of a session hears, in words.
fn record(session: &Session) -> Arc<Mutex<Vec<String>>> {
    let heard = Arc::new(Mutex::new(Vec::new()));
    let log = heard.clone();
    session.hub().observe(Arc::new(move |at, what| {
        let line = match what {
            Happening::State { active } => format!("in {}", active.last().map_or("", |s| s.as_str())),
            Happening::Answered(answer) => answer.answer.clone(),
            Happening::Phase { phase } => phase.as_str().to_owned(),
            _ => return,
        };
        log.lock().unwrap().push(format!("{at} {line}"));
    }));
    heard
}

fn up_and_down(file: &str) -> Vec<String> {
    let clock = Clock::simulated();
    let _me = clock.enter();
    let session = app::start(&checked(file), &clock).unwrap();
    let heard = record(&session);
    session.bring_up().unwrap();
    assert_eq!(session.status().phase, Phase::Up);
    assert!(!session.system().unwrap().is_empty());
    let ended = session.take_down(false);
    assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
    assert!(session.platform().observe(clock.now() + Duration::from_secs(1)).unwrap().is_empty());
    clock.shutdown();
    std::mem::take(&mut *heard.lock().unwrap())
}

#[test]
fn every_deployment_comes_up_and_goes_down_to_nothing() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("deployments");
    let mut seen = 0;
    let mut parts = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let file = format!("deployments/{name}");
        if !name.ends_with(".yaml") {
            continue;
        }
        let checked = checked(&file);
        if davit::check::part(&checked.deployment, &checked.catalogue, Severity::Error).is_some() {
            parts.push(name);
        } else {
            up_and_down(&file);
            seen += 1;
        }
    }
    assert!(seen >= 5, "{seen}");
    assert_eq!(parts, ["youbot_robot.yaml"], "a part of something larger comes up in that");
}

#[test]
fn a_part_is_refused_alone_and_says_what_it_lacks() {
    let Err(StartError::Part { finding }) = app::start(&checked("deployments/youbot_robot.yaml"), &Clock::simulated())
    else {
        panic!("it needs a world");
    };
    assert!(finding.is_error() && finding.code == codes::DEPLOY_PART, "{finding:?}");
    for needed in ["`arm_state` (youbot.plant_state)", "`rx` (Link_Rx.rx)"] {
        assert!(finding.message.contains(needed), "{}", finding.message);
    }
    // What it may do without, and what it gives out, is not missing.
    assert!(!finding.message.contains("hand_pose") && !finding.message.contains("tx:"), "{}", finding.message);
}

#[test]
fn simulated_time_tells_the_same_story_twice() {
    let file = "deployments/youbot_arm.yaml";
    let first = up_and_down(file);
    assert_eq!(first, up_and_down(file));
    assert!(first.iter().any(|line| line.ends_with("park.ok")), "{first:?}");
}

#[test]
fn the_examples_stories_run_as_scripts() {
    for story in [
        "examples/youbot_story.lua",
        "examples/side_by_side/story.lua",
        "examples/pair/story.lua",
        "examples/coupling_story.lua",
    ] {
        runs(story);
    }
}

/// A script that ends well, with nothing left and nothing forced.
fn runs(story: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(story);
    let said = Arc::new(Mutex::new(Vec::new()));
    let heard = said.clone();
    let clock = Clock::simulated();
    let end = script::run(
        &path,
        ScriptOptions {
            clock: clock.clone(),
            extensions: libraries::builtin().into(),
            load: LoadOptions::default(),
            platform: None,
            observer: None,
            interrupt: Interrupt::default(),
            door: None,
            checking: None,
            say: Box::new(move |text| heard.lock().unwrap().push(text.to_owned())),
        },
    );
    clock.shutdown();
    assert!(end.failure.is_none(), "{:?}", end.failure);
    let ended = end.ended.expect("it deployed something");
    assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
}

/// Runs a script given as text, beside the deployments of the project.
fn run_text(text: &str) -> (Option<String>, Option<bool>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("script.lua");
    let root = env!("CARGO_MANIFEST_DIR");
    std::fs::write(&path, text.replace("@", &format!("{root}/deployments/"))).unwrap();
    let clock = Clock::simulated();
    let end = script::run(
        &path,
        ScriptOptions {
            clock: clock.clone(),
            extensions: libraries::builtin().into(),
            load: LoadOptions::default(),
            platform: None,
            observer: None,
            interrupt: Interrupt::default(),
            door: None,
            checking: None,
            say: Box::new(|_| {}),
        },
    );
    clock.shutdown();
    (end.failure.map(|f| f.to_string()), end.ended.map(|e| e.is_clean()))
}

#[test]
fn a_script_that_fails_leaves_nothing_behind() {
    for (script, message) in [
        ("deploy('@generic_arm.yaml') assert(false, 'no luck')", "no luck"),
        ("deploy('@generic_arm.yaml') wait_state('idle', 0.5)", "not in `idle` after 0.5 s"),
        ("deploy('@generic_arm.yaml') wait_state('idel', 0.5)", "no state `idel`: did you mean `idle`?"),
        ("deploy('@generic_arm.yaml') raise('e_5dofs')", "did you mean `e_5dof`?"),
        ("deploy('@generic_arm.yaml') apply('eight_DOFF')", "did you mean `eight_DOF`?"),
        ("deploy('@generic_arm.yaml') wait_answer('e_never', 1)", "`e_never` was not heard in 1 s"),
        ("deploy('@generic_arm.yaml') wait_answer('e_shutdwon', 1)", "not heard in 1 s (did you mean `e_shutdown`?)"),
        ("deploy('@generic_arm.yaml') wait_answer('eight_DOF.okk', 1)", "is never heard"),
        ("deploy('@generic_arm.yaml') wait_answer('eight_DOF.done', 1)", "`eight_DOF.ok`"),
        ("deploy('@generic_arm.yaml') wait_answer('eight_DOF.okk', 1)", "did you mean `eight_DOF.ok`?"),
        ("deploy('@generic_arm.yaml') wait_answer('eigth_DOF.ok', 1)", "did you mean `eight_DOF.ok`?"),
        ("deploy('@generic_arm.yaml') wait_answer('undo.dome', 1)", "did you mean `undo.done`?"),
        // What is answered so is meant so.
        (
            "deploy('@generic_arm.yaml') local _, why = pcall(wait_answer, 'undo.done', 0.1)
             error('not heard: ' .. tostring(why:find('did you mean') == nil and why:find('was not heard in') ~= nil), 0)",
            "not heard: true",
        ),
        ("deploy('@generic_arm.yaml') port('follower.folow')", "did you mean `follow`?"),
        ("deploy('@generic_arm.yaml') port('folower.follow')", "did you mean `follower`?"),
        ("deploy('@generic_arm.yaml') undo('eight_DOF', {force = 1})", "`force` is true or false"),
        ("deploy('@generic_arm.yaml') local t = {} while true do t[1] = 1 end", "endless loop"),
        ("deploy('@generic_arm.yaml') while true do pcall(function() while true do end end) end", "endless loop"),
        (
            "deploy('@generic_arm.yaml') xpcall(function() while true do end end, function() while true do end end)",
            "endless loop",
        ),
        (
            "deploy('@generic_arm.yaml')
             local x <close> = setmetatable({}, { __close = function() while true do end end }) while true do end",
            "endless loop",
        ),
        (
            "deploy('@generic_arm.yaml') table.insert(setmetatable({}, { __len = function() return 1e15 end }), 1, 0)",
            "endless loop",
        ),
        (
            "deploy('@generic_arm.yaml') local _ = (('a'):rep(40)):find(('a?'):rep(40) .. ('a'):rep(40) .. 'b')",
            "million instructions",
        ),
        ("deploy('@generic_arm.yaml') local ok, why = pcall(wait, -1) error(type(why) .. ' ' .. why, 0)", "string"),
        (
            "deploy('@generic_arm.yaml') local t = {} while true do t[#t + 1] = ('x'):rep(1e6) .. #t end",
            "more than the 256 MB",
        ),
        ("deploy('@generic_arm.yaml') deploy('@generic_arm.yaml')", "already up"),
    ] {
        let (failure, clean) = run_text(script);
        let failure = failure.unwrap_or_else(|| panic!("no failure: {script}"));
        assert!(failure.contains(message), "{script}: {failure}");
        assert_eq!(clean, Some(true), "{script}");
    }
    // A misspelt name is told before anything is there.
    let (failure, ended) = run_text("deploy('@generic_arm.yaml') asert_running('x')");
    assert!(failure.unwrap().contains("did you mean `assert_running`?"));
    assert_eq!(ended, None);
    let (failure, ended) = run_text("shutdown()");
    assert!(failure.unwrap().contains("nothing is deployed"));
    assert_eq!(ended, None);
    let (failure, ended) = run_text("deploy('@no_such.yaml')");
    assert!(failure.unwrap().contains("is refused"));
    assert_eq!(ended, None);
}

#[test]
fn answers_may_be_waited_for_in_any_order_each_once() {
    let (failure, clean) = run_text(
        "deploy('@generic_arm.yaml') raise('e_5dof') wait(1) \
         wait_answer('five_DOF.ok', 0) wait_answer('e_5dof', 0) wait_answer('five_DOF.ok', 0.1)",
    );
    // Heard in the order of the last, then the first; the third wait finds no second one.
    assert!(failure.clone().is_some_and(|text| text.contains("`five_DOF.ok` was not heard in 0.1 s")), "{failure:?}");
    assert_eq!(clean, Some(true));
    let (failure, _) = run_text(
        "deploy('@generic_arm.yaml') raise('e_5dof') wait_answer('five_DOF.ok', 1) wait_answer('e_5dof', 0) \
         undo() wait_answer('undo.failed', 1) local ok = pcall(wait_answer, 'five_DOF.ok', 0.1) assert(not ok)",
    );
    assert_eq!(failure, None);
}

#[test]
fn an_operator_meddles_with_a_coordinator_only_by_force() {
    let (failure, clean) = run_text(
        "deploy('@generic_arm.yaml') wait_answer('five_DOF.ok', 1) raise('e_aligned') wait_answer('eight_DOF.ok', 1)
         undo('eight_DOF') wait_answer('eight_DOF.undo.failed', 1) assert(property('follower.cart_share') == 0.5)
         undo('eight_DOF', {force = true}) wait_answer('eight_DOF.undone', 1) assert(property('follower.cart_share') ~= 0.5)
         -- What is safe may be applied, what `operator:` does not list only by force.
         apply('safe_hold') wait_answer('safe_hold.ok', 1)
         apply('unfold') wait_answer('unfold.failed', 1)
         apply('unfold', {force = true}) wait_answer('unfold.ok', 20)
         -- Nothing moves while a safe configuration is in force.
         undo() wait_answer('undo.failed', 1)
         undo('unfold', {force = true}) wait_answer('unfold.undone', 20)
         undo() wait_answer('undo.done', 1)
         local ok, why = pcall(apply, 'five_DOF', {forc = true})
         assert(not ok and tostring(why):find('did you mean `force`?'), tostring(why))",
    );
    assert_eq!((failure, clean), (None, Some(true)));
}

#[test]
fn a_script_sees_all_coordinators() {
    let folder = tempfile::tempdir().unwrap();
    let coordinator = |on: &str| {
        format!(
            "return state {{ off = state {{}}, on = state {{ {on} = state {{}}, trans {{ src = 'initial', tgt = '{on}' }} }}, \
             trans {{ src = 'initial', tgt = 'off' }}, trans {{ src = 'off', tgt = 'on', events = {{ 'e_start' }} }}, \
             trans {{ src = 'on', tgt = 'off', events = {{ 'e_stop' }} }} }}"
        )
    };
    let deployment = "
davit: 1
name: two
platform: simulated
libraries: [standard]
configurations: []
coordinators: { arm: arm.lua, grip: grip.lua }
deploy: { event: e_start, up: [arm:on, grip:on], within_s: 5 }
shutdown: { event: e_stop, down: off, within_s: 5 }
";
    let script = "
deploy('two.yaml')
local names = table.concat(active(), ' ')
assert(names == 'arm:root arm:root.on arm:root.on.x grip:root grip:root.on grip:root.on.y', names)
wait_state('arm:x', 1)
local ok, why = pcall(wait_state, 'arm:off', 0.1)
assert(tostring(why):find('the coordinators are in `arm:root.on.x` and `grip:root.on.y`', 1, true), tostring(why))
";
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("arm.lua", &coordinator("x"));
    write("grip.lua", &coordinator("y"));
    write("two.yaml", deployment);
    let (failure, clean) = run_text(&script.replace("two.yaml", folder.path().join("two.yaml").to_str().unwrap()));
    assert_eq!(failure, None);
    assert_eq!(clean, Some(true));
}

#[test]
fn an_operator_pushes_and_undoes() {
    let clock = Clock::simulated();
    let _me = clock.enter();
    let session = app::start(&checked("deployments/youbot_arm.yaml"), &clock).unwrap();
    session.bring_up().unwrap();
    let before = session.system().unwrap();
    let frames = session.status().stack.unwrap().len();
    let soft = session.configurations().into_iter().find(|c| c.as_str() == "profile_soft").unwrap();
    let wait = |request| {
        let deadline = clock.now() + Duration::from_secs(1);
        while session.hub().answer(request).is_none() {
            assert!(session.hub().changed.wait(deadline), "no answer");
        }
        session.hub().answer(request).unwrap()
    };
    assert_eq!(wait(session.request(davit::model::Ask::Apply(soft), "operator", true)).answer, "profile_soft.ok");
    assert_ne!(session.system().unwrap(), before);
    assert_eq!(wait(session.request(davit::model::Ask::Undo, "operator", false)).answer, "undo.done");
    assert_eq!(session.system().unwrap(), before);
    assert_eq!(session.status().stack.unwrap().len(), frames);
    assert!(session.take_down(false).is_clean());
    clock.shutdown();
}

#[test]
fn a_command_during_bring_up_rolls_back() {
    let clock = Clock::simulated();
    let _me = clock.enter();
    let session = app::start(&checked("deployments/youbot_arm.yaml"), &clock).unwrap();
    let asked = Arc::downgrade(&session);
    // In the middle of the unfolding of the arm, the longest step of the bring-up.
    let interrupter = {
        let clock = clock.clone();
        let at = clock.now() + Duration::from_secs(2);
        clock.clone().spawn("interrupter", move || {
            clock.sleep_until(at);
            if let Some(session) = asked.upgrade() {
                session.command(Command::Shutdown { force: false });
            }
        })
    };
    let not_up = session.bring_up().unwrap_err();
    assert!(not_up.interrupted, "{not_up:?}");
    assert!(not_up.ended.is_clean(), "{not_up:?}");
    assert!(session.platform().observe(clock.now() + Duration::from_secs(1)).unwrap().is_empty());
    interrupter.join(clock.now() + Duration::from_secs(1)).unwrap();
    clock.shutdown();
}

#[test]
fn a_parameter_that_a_method_does_not_have_is_refused_and_nothing_is_done() {
    let clock = Clock::simulated();
    let _me = clock.enter();
    let session = app::start(&checked("deployments/hello.yaml"), &clock).unwrap();
    session.bring_up().unwrap();
    let service = SessionService::new(Arc::downgrade(&session));
    service.call(1, "apply", &json!({"configuration": "run", "force": true})).unwrap();
    clock.sleep(Duration::from_secs(1));
    let frames = session.status().stack.unwrap().len();
    for (method, params, near) in [
        ("apply", json!({"configuration": "run", "wiat": true}), "did you mean `wait`?"),
        ("undo", json!({"configuraton": "run"}), "did you mean `configuration`?"),
        ("undo", json!(["run"]), ""),
        ("shutdown", json!({"forced": true}), "did you mean `force`?"),
        ("status", json!({"all": true}), "there are no parameters here"),
    ] {
        let error = service.call(1, method, &params).expect_err(method);
        assert_eq!(error.code, rpc::INVALID_PARAMS, "{method}: {error}");
        assert!(error.data["help"].as_str().unwrap_or_default().contains(near), "{method}: {error:?}");
    }
    clock.sleep(Duration::from_secs(1));
    assert_eq!(session.status().stack.unwrap().len(), frames);
    service.call(1, "undo", &json!({"configuration": "run", "force": null})).unwrap();
    clock.sleep(Duration::from_secs(1));
    assert_eq!(session.status().stack.unwrap().len(), frames - 1);
}
