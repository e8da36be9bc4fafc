//! Signals, `davit shutdown` and a script's end on the program itself: the stages of stopping, and the exit status.

use crate::demo::Demo;
use crate::foreground::{Foreground, full_pipe, until};
use crate::kept::process;
use std::fs::File;
use std::os::unix::process::CommandExt;
use std::process::Stdio;

/// `e_shutdown` leads to where it waits for what nobody says.
fn waiting(demo: &Demo) {
    let at = "trans { src = \"operational\", tgt = \"leaving\", events = { \"e_shutdown\" } },";
    let instead = "waiting = state {},\n  trans { src = \"operational\", tgt = \"waiting\", events = { \"e_shutdown\" } },\n  \
        trans { src = \"waiting\", tgt = \"leaving\", events = { \"e_empty\" } },";
    demo.replace("coordinator.lua", at, instead);
}

/// The last call of its bring-up takes long.
fn slow(demo: &Demo) {
    let faults = "faults:\n  - { step: \"operation_call source.reset\", how: slow, takes_s: 600 }\n";
    let deployment =
        demo.read("deployment.yaml").replace("failed: [failed], within_s: 5", "failed: [failed], within_s: 900");
    demo.write("deployment.yaml", &format!("{deployment}{faults}"));
    let call = "slow = Configuration { group = \"speed\", timeout = 900.0, operation_call(\"source.reset\", 0.1),";
    demo.replace("configurations.lua", "slow = Configuration { group = \"speed\",", call);
}

fn deploy(demo: &Demo, out: &str) -> Foreground {
    let mut command = demo.command(&["deploy", "deployment.yaml", "--color", "never"]);
    command.stdout(Stdio::from(File::create(demo.path(out)).unwrap())).stderr(Stdio::null());
    Foreground::start(&mut command)
}

#[test]
fn every_signal_that_asks_for_the_end_is_led_down() {
    for signal in [libc::SIGINT, libc::SIGTERM, libc::SIGHUP, libc::SIGQUIT, libc::SIGPWR] {
        let demo = Demo::new();
        let deployed = deploy(&demo, "out");
        demo.until_phase("up");
        // What asks for something that is not offered ends nothing.
        [libc::SIGUSR1, libc::SIGUSR2, libc::SIGALRM, libc::SIGPROF].iter().for_each(|other| deployed.signal(*other));
        assert_eq!(demo.run(&["status"]).code, 0);
        deployed.signal(signal);
        assert_eq!(deployed.end().code(), Some(0), "{signal}");
        assert!(demo.read("out").contains("demo down, nothing is left"), "{}", demo.read("out"));
    }
}

/// Also while it comes up, with a step that would take ten minutes.
#[test]
fn a_signal_while_it_comes_up_is_led_down() {
    let demo = Demo::new();
    slow(&demo);
    let deployed = deploy(&demo, "out");
    until("the call", || demo.read("out").contains("slow_mode").then_some(()));
    deployed.signal(libc::SIGTERM);
    let ended = deployed.end();
    let out = demo.read("out");
    assert!(out.contains("interrupted while deploying"), "{out}");
    assert!(ended.code() == Some(0) && out.contains("demo down, nothing is left"), "{ended} {out}");
}

#[test]
fn what_its_coordinator_does_not_do_is_told_by_the_exit_status() {
    let demo = Demo::new();
    waiting(&demo);
    demo.replace("deployment.yaml", "down: idle,      within_s: 5", "down: idle,      within_s: 1");
    let deployed = deploy(&demo, "out");
    demo.until_phase("up");
    let down = demo.run(&["shutdown", "--json"]);
    assert_eq!((down.code, &down.json()["stage"]), (4, &"taken_back".into()), "{}{}", down.out, down.err);
    assert_eq!(deployed.end().code(), Some(4));
    assert!(demo.read("out").contains("without its coordinator, nothing is left"), "{}", demo.read("out"));
}

/// A second signal does not wait for the coordinator, and neither does `--force`; meanwhile nobody changes anything.
#[test]
fn a_second_signal_and_force_begin_with_force() {
    for by_signal in [true, false] {
        let demo = Demo::new();
        waiting(&demo);
        demo.replace("deployment.yaml", "down: idle,      within_s: 5", "down: idle,      within_s: 900");
        demo.replace("deployment.yaml", "emits: [e_ready]", "emits: [e_ready]\nsafety: [e_empty]");
        let deployed = deploy(&demo, "out");
        demo.until_phase("up");
        deployed.signal(libc::SIGINT);
        demo.until_phase("shutting_down");
        for refused in [vec!["apply", "fast", "--force"], vec!["undo"], vec!["commit"], vec!["event", "e_fast"]] {
            let ran = demo.run(&refused);
            assert!(ran.code == 1 && ran.err.contains("is being stopped"), "{refused:?} {}{}", ran.out, ran.err);
        }
        let status = demo.run(&["status"]);
        assert!(status.out.contains("stopping     by its coordinator"), "{}", status.out);
        if by_signal {
            deployed.signal_again(libc::SIGINT);
        } else {
            assert_eq!(demo.run(&["shutdown", "--force"]).code, 4);
        }
        assert_eq!(deployed.end().code(), Some(4));
        assert!(demo.read("out").contains("demo down by force, nothing is left"), "{}", demo.read("out"));
    }
}

/// From when others can see it on: here it has its socket, and waits for who reads why it is not kept.
#[test]
fn a_signal_before_it_comes_up_is_led_down() {
    let demo = Demo::new();
    demo.write("state", "no directory");
    let (_nobody, errors) = full_pipe();
    let mut command = demo.command(&["deploy", "deployment.yaml", "--in-background"]);
    command.stdout(Stdio::from(File::create(demo.path("out")).unwrap())).stderr(Stdio::from(errors));
    let deployed = Foreground::start(&mut command);
    until("its socket", || demo.path("davit/demo.sock").exists().then_some(()));
    deployed.signal(libc::SIGTERM);
    let ended = deployed.end();
    assert!(ended.code() == Some(1) && demo.read("out").contains("interrupted"), "{ended} {}", demo.read("out"));
    assert!(!demo.path("davit/demo.sock").exists(), "it ended in order");
}

/// The process in the background is told of the command's signals, and what becomes of it is said.
#[test]
fn an_interrupted_command_says_that_what_it_started_is_not_up() {
    for interrupted in [true, false] {
        let demo = Demo::new();
        slow(&demo);
        waiting(&demo);
        demo.replace("deployment.yaml", "down: idle,      within_s: 5", "down: idle,      within_s: 900");
        let mut command = demo.command(&["deploy", "deployment.yaml", "--detach", "--color", "never"]);
        let errors = File::create(demo.path("err")).unwrap();
        command.stdout(Stdio::from(File::create(demo.path("out")).unwrap())).stderr(Stdio::from(errors));
        let command = Foreground::start(&mut command);
        until("the call", || demo.read("out").contains("slow_mode").then_some(()));
        if interrupted {
            command.signal(libc::SIGINT);
            demo.until_phase("shutting_down");
        }
        // SAFETY: a signal to a process of ours.
        assert_eq!(unsafe { libc::kill(process(&demo, "demo"), libc::SIGKILL) }, 0);
        let (code, words) = (command.end().code(), demo.read("err"));
        assert_eq!(code, Some(if interrupted { 1 } else { 3 }), "{words}");
        assert!(words.contains("not up: ") && words.contains("signal 9"), "{words}");
        assert_eq!(words.contains("interrupted"), interrupted, "{words}");
    }
}

/// Who is killed while it comes up has asked for nothing more.
#[test]
fn what_a_killed_command_was_bringing_up_is_led_down() {
    let demo = Demo::new();
    slow(&demo);
    let mut command = demo.command(&["deploy", "deployment.yaml", "--detach", "--color", "never"]);
    command.stdout(Stdio::from(File::create(demo.path("out")).unwrap())).stderr(Stdio::null());
    let command = Foreground::start(&mut command);
    until("the call", || demo.read("out").contains("slow_mode").then_some(()));
    command.signal(libc::SIGKILL);
    assert_eq!(command.end().code(), None);
    until("it has ended", || (demo.run(&["status"]).code != 0).then_some(()));
    let log = demo.read("state/davit/demo.log");
    assert!(log.contains("\"shutting_down\"") && !log.contains("\"phase\":\"up\""), "{log}");
}

/// A bring-up that fails ends with 1 where its coordinator leads down.
#[test]
fn a_bring_up_that_fails_is_led_down() {
    let demo = Demo::new();
    let faults = "faults:\n  - { step: \"start source\", how: fail }\n";
    demo.write("deployment.yaml", &format!("{}{faults}", demo.read("deployment.yaml")));
    let ran = demo.run(&["deploy", "deployment.yaml"]);
    assert!(ran.code == 1 && ran.out.contains("down, nothing is left"), "{} {}{}", ran.code, ran.out, ran.err);
    // Nobody leads down from `failed`: what was done is taken back, and that is told instead.
    demo.replace(
        "coordinator.lua",
        "trans { src = \"failed\", tgt = \"leaving\", events = { \"e_shutdown\" } },",
        "trans { src = \"failed\", tgt = \"leaving\", events = { \"e_empty\" } },",
    );
    let ran = demo.run(&["deploy", "deployment.yaml"]);
    assert!(ran.code == 4 && ran.out.contains("without its coordinator"), "{} {}{}", ran.code, ran.out, ran.err);
}

/// A script that is interrupted, or ends: what it brought up is led down, and nothing of it stays.
#[test]
fn a_script_is_stopped_by_signals_and_leaves_nothing() {
    for (forced, code) in [(false, 1), (true, 4)] {
        let demo = Demo::new();
        if forced {
            waiting(&demo);
            demo.replace("deployment.yaml", "down: idle,      within_s: 5", "down: idle,      within_s: 900");
        }
        demo.write("story.lua", "deploy('deployment.yaml') say('it is up') pcall(wait, 1000) wait(1000) say('never')");
        let mut command = demo.command(&["run", "story.lua", "--color", "never"]);
        let errors = File::create(demo.path("err")).unwrap();
        command.stdout(Stdio::from(File::create(demo.path("out")).unwrap())).stderr(Stdio::from(errors));
        let running = Foreground::start(&mut command);
        until("it is up", || demo.read("out").contains("it is up").then_some(()));
        running.signal(libc::SIGINT);
        if forced {
            until("waiting", || demo.read("out").contains("root.waiting").then_some(()));
            running.signal_again(libc::SIGINT);
        }
        assert_eq!(running.end().code(), Some(code), "{}{}", demo.read("out"), demo.read("err"));
        assert!(demo.read("err").contains("interrupted from outside"), "{}", demo.read("err"));
        let out = demo.read("out");
        assert!(!out.contains("\nnever\n") && (forced || out.contains("create_all.undone")), "{out}");
    }
    // Its end without `shutdown()` counts as well.
    let demo = Demo::new();
    waiting(&demo);
    demo.write("story.lua", "deploy('deployment.yaml')");
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 4, "{}{}", ran.out, ran.err);
}

/// Whatever it catches, and also where it calls no function of ours; nobody waits for a bound of its instructions.
#[test]
fn a_script_that_catches_its_interruption_is_stopped_all_the_same() {
    for goes_on in [
        "while not pcall(wait_state, 'root.failed', 1) do end",
        "while true do pcall(wait, 1) end",
        "while true do xpcall(wait, function() return 'no' end, 0.001) end",
        "while true do end",
        "while true do pcall(function() while true do end end) end",
        "while true do ('x'):gsub('x', function() pcall(wait, 1) end) end",
    ] {
        let demo = Demo::new();
        demo.write("story.lua", &format!("deploy('deployment.yaml') say('it is up') {goes_on}"));
        let mut command = demo.command(&["run", "story.lua", "--color", "never"]);
        let errors = File::create(demo.path("err")).unwrap();
        command.stdout(Stdio::from(File::create(demo.path("out")).unwrap())).stderr(Stdio::from(errors));
        let running = Foreground::start(&mut command);
        until("it is up", || demo.read("out").contains("it is up").then_some(()));
        running.signal(libc::SIGTERM);
        assert_eq!(running.end().code(), Some(1), "{goes_on}: {}{}", demo.read("out"), demo.read("err"));
        assert!(demo.read("err").contains("interrupted from outside"), "{goes_on}: {}", demo.read("err"));
        assert!(demo.read("out").contains("create_all.undone"), "{goes_on}: {}", demo.read("out"));
    }
}

/// In which an emergency is left on that event alone.
fn with_an_emergency(left_on: &str) -> Demo {
    let demo = Demo::new();
    demo.write(
        "deployment.yaml",
        "davit: 1
name: small
platform: simulated
types:
  T: { properties: { g: { type: float, default: 1.0 } } }
configurations: [configurations.lua]
coordinator: coordinator.lua
safety: [e_estop]
deploy:   { event: e_start, up: up, within_s: 20 }
shutdown: { event: e_stop, down: idle, within_s: 1 }
",
    );
    demo.write(
        "configurations.lua",
        "ConfiguratorConf { base = Configuration { create(\"a\", \"T\"), post_conf_state = { \"a:running\" } },
          calm = Configuration { safe = true, property_set(\"a.g\", 0.0) },
          fast = Configuration { property_set(\"a.g\", 9.0) } }",
    );
    demo.write(
        "coordinator.lua",
        "return state {
          idle = state {}, up = state { entry = \"base\" }, leaving = state {}, safe = state { entry = \"calm\" },
          gone = state { entry = { \"calm.undo\", \"base.undo\" } },
          trans { src = \"initial\", tgt = \"idle\" }, trans { src = \"idle\", tgt = \"up\", events = { \"e_start\" } },
          trans { src = \"up\", tgt = \"leaving\", events = { \"e_stop\" } },
          trans { src = \"up\", tgt = \"safe\", events = { \"e_estop\" } },
          trans { src = \"leaving\", tgt = \"safe\", events = { \"e_estop\" } },
          trans { src = \"safe\", tgt = \"gone\", events = { \"LEFT_ON\" } },
          trans { src = \"gone\", tgt = \"idle\", events = { \"base.undone\" } },
        }",
    );
    demo.replace("coordinator.lua", "LEFT_ON", left_on);
    demo.replace("deployment.yaml", "within_s: 1 }", "within_s: 600 }");
    demo
}

/// The same on the way down.
fn stopped_in_an_emergency(left_on: &str) -> (Demo, Foreground) {
    let demo = with_an_emergency(left_on);
    let deployed = deploy(&demo, "out");
    demo.until_phase("up");
    deployed.signal(libc::SIGHUP);
    demo.until_phase("shutting_down");
    let status = demo.run(&["status"]);
    assert!(!status.out.contains("stands still"), "{}", status.out);
    let emergency = demo.run(&["event", "e_estop", "--wait", "calm.ok"]);
    assert_eq!(emergency.code, 0, "{}{}", emergency.out, emergency.err);
    (demo, deployed)
}

/// A terminal that goes while something safe is in force asks for no motion; whoever comes next leads it down.
#[test]
fn a_terminal_that_goes_in_an_emergency_moves_nothing() {
    let demo = with_an_emergency("e_stop");
    let deployed = deploy(&demo, "out");
    demo.until_phase("up");
    let emergency = demo.run(&["event", "e_estop", "--wait", "calm.ok"]);
    assert_eq!(emergency.code, 0, "{}{}", emergency.out, emergency.err);
    for _ in 0..2 {
        deployed.signal(libc::SIGHUP);
        until("what is said of it", || demo.read("out").contains("the terminal is gone").then_some(()));
    }
    let status = demo.run(&["status", "--json"]).json();
    assert!(status["phase"] == "up" && status["stack"].as_array().is_some_and(|all| all.len() == 2), "{status}");
    let down = demo.run(&["shutdown"]);
    assert_eq!((down.code, deployed.end().code()), (0, Some(0)), "{}{}", down.out, down.err);
}

/// An emergency while it is led down, with its terminal closed: who asks is told what is in force, since when, and what leads on.
#[test]
fn what_stands_still_after_an_emergency_says_what_it_waits_for() {
    let (demo, deployed) = stopped_in_an_emergency("e_stop");
    let status = demo.run(&["status"]);
    let says = "stands still, `calm` is in force since ";
    let leads_on =
        "`davit shutdown` raises `e_stop` once more, which its coordinator hears there; `davit shutdown --force`";
    assert!(status.out.contains(says) && status.out.contains(leads_on), "{}", status.out);
    let json = demo.run(&["status", "--json"]).json();
    assert_eq!(json["stopping"]["stands_still"]["safe"], "calm", "{json:#}");
    // What it said leads on does.
    let down = demo.run(&["shutdown"]);
    assert_eq!(down.code, 0, "{}{}", down.out, down.err);
    assert_eq!(deployed.end().code(), Some(0), "{}", demo.read("out"));
}

/// Two signals have asked for force, and since an emergency that waits for people: one more asks for it anew, and ends nothing at once.
#[test]
fn where_force_waits_for_people_one_more_signal_asks_for_it() {
    let demo = with_an_emergency("e_stop");
    demo.replace("deployment.yaml", "within_s: 600 }", "within_s: 600, rest: [rest] }");
    demo.replace(
        "deployment.yaml",
        "platform: simulated",
        "platform: simulated\nfaults: [{ step: operation_call, how: slow, takes_s: 3 }]",
    );
    demo.replace(
        "deployment.yaml",
        "  T: { properties",
        "  T: { operations: { lower: { moves: true, effect: irreversible } }, properties",
    );
    demo.replace("deployment.yaml", "safety:", "limits: { step_timeout_s: 30 }\nsafety:");
    demo.replace(
        "configurations.lua",
        "fast =",
        "rest = Configuration { irreversible = true, operation_call(\"a.lower\") }, fast =",
    );
    let deployed = deploy(&demo, "out");
    demo.until_phase("up");
    deployed.signal(libc::SIGINT);
    demo.until_phase("shutting_down");
    deployed.signal_again(libc::SIGINT);
    let stopping = || demo.run(&["status", "--json"]).json()["stopping"].clone();
    until("it is forced", || (stopping()["stage"] == "forced").then_some(()));
    assert_eq!(demo.run(&["event", "e_estop"]).code, 0);
    until("it waits for people", || (stopping()["held"] == true).then_some(()));
    deployed.signal_again(libc::SIGINT);
    assert_eq!(deployed.end().code(), Some(4));
    let told = demo.read("out");
    assert!(told.contains("until a signal (Ctrl-C) or `davit shutdown --force` asks for force anew"), "{told}");
    assert!(told.contains("small down by force, nothing is left"), "{told}");
}

/// A command ends after its `--within`: with the deployment's word where that lives, and what it says is not that nobody answers.
#[test]
fn who_waits_for_less_than_it_takes_is_told_so() {
    let (demo, deployed) = stopped_in_an_emergency("e_estop");
    let late = demo.run(&["shutdown", "--within", "0.1"]);
    assert_eq!(late.code, 1, "{}{}", late.out, late.err);
    for words in ["it is not down yet", "`calm` is in force since ", "cli::refused"] {
        assert!(late.err.contains(words), "{words}: {}", late.err);
    }
    // One that lives no more says nothing, however it is asked.
    deployed.signal(libc::SIGSTOP);
    let silent: [&[&str]; 10] = [
        &["shutdown"],
        &["event", "e_estop"],
        &["apply", "calm"],
        &["apply", "calm", "--no-wait"],
        &["undo"],
        &["commit"],
        &["get", "a.g"],
        &["set", "a.g", "2"],
        &["drift"],
        &["recover", "--back"],
    ];
    for command in silent {
        let ran = demo.run(&[command, &["--within", "0.1"]].concat());
        assert!(ran.code == 1 && ran.err.contains("cli::no_answer"), "{command:?} {}{}", ran.out, ran.err);
        let (_, waited) = ran.err.split_once("nothing came within ").expect("for how long");
        let waited: f64 = waited.split_whitespace().next().and_then(|it| it.parse().ok()).expect("a number");
        assert!(waited <= 0.1 + davit::limits::ANSWER_WAY.as_secs_f64() + 0.05, "{command:?} {waited}");
    }
}

/// The coordinator leads: what is safe already hears no emergency. Who sends one is told what was applied over that, and what to do.
#[test]
fn an_emergency_that_changes_nothing_says_what_was_applied_over_what_is_safe() {
    let demo = with_an_emergency("e_stop");
    let _deployed = deploy(&demo, "out");
    demo.until_phase("up");
    assert_eq!(demo.run(&["event", "e_estop", "--wait", "calm.ok"]).code, 0);
    let again = demo.run(&["event", "e_estop"]);
    assert!(again.code == 1 && again.err.is_empty(), "{}{}", again.out, again.err);
    assert_eq!(demo.run(&["apply", "fast", "--force"]).code, 0);
    let again = demo.run(&["event", "e_estop"]);
    assert!(again.code == 1 && again.err.contains("since then came `fast` by operator"), "{}{}", again.out, again.err);
    assert!(again.err.contains("`davit apply calm`"), "{}", again.err);
    assert_eq!(demo.run(&["apply", "calm"]).code, 0, "what it says helps");
    let again = demo.run(&["event", "e_estop"]);
    assert!(again.code == 1 && again.err.is_empty(), "{}{}", again.out, again.err);
}

/// At the end of a script in simulated time nobody is there to be asked: what something safe holds stays, is named, and the exit
/// status says so. Without an emergency force removes everything.
#[test]
fn the_end_of_a_script_leaves_what_is_safe_and_says_so() {
    let ends = |script: &str| {
        let demo = with_an_emergency("e_estop");
        demo.write("story.lua", script);
        let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
        assert_eq!(ran.code, 4, "{}{}", ran.out, ran.err);
        ran.out + &ran.err
    };
    let quiet = |script: &str| {
        let demo = with_an_emergency("e_estop");
        demo.write("story.lua", script);
        demo.run(&["run", "story.lua", "--clock", "simulated", "--quiet"])
    };
    let removed = quiet("deploy('deployment.yaml')");
    assert!(removed.code == 4 && removed.out.contains("`base` undone"), "{}{}", removed.out, removed.err);
    let held = ends("deploy('deployment.yaml') raise('e_estop') wait_state('root.safe', 5)");
    let removed = ends("deploy('deployment.yaml')");
    assert!(held.contains("what is left stays as it is") && held.contains("left  a (running)"), "{held}");
    assert!(removed.contains("`base` undone") && !removed.contains("left  "), "{removed}");
}

/// A terminal that is closed tells so several times, and asks for no force; what would only stop or end the process does nothing.
#[test]
fn a_terminal_that_closes_is_one_signal() {
    let demo = Demo::new();
    waiting(&demo);
    demo.replace("deployment.yaml", "down: idle,      within_s: 5", "down: idle,      within_s: 900");
    let deployed = deploy(&demo, "out");
    demo.until_phase("up");
    for nothing in [libc::SIGTTOU, libc::SIGTTIN, libc::SIGXFSZ, libc::SIGTSTP] {
        deployed.signal(nothing);
    }
    assert_eq!(demo.run(&["status", "--json"]).json()["phase"], "up");
    for _ in 0..2 {
        deployed.signal(libc::SIGHUP);
    }
    demo.until_phase("shutting_down");
    for _ in 0..3 {
        deployed.signal(libc::SIGHUP);
        let status = demo.run(&["status"]);
        assert!(status.out.contains("stopping     by its coordinator"), "{}", status.out);
    }
    // A key that is held down asks for force, and not for the end at once.
    deployed.signal_again(libc::SIGINT);
    for _ in 0..5 {
        deployed.signal(libc::SIGINT);
    }
    assert_eq!(deployed.end().code(), Some(4));
    assert!(demo.read("out").contains("demo down by force, nothing is left"), "{}", demo.read("out"));
}

/// What a shell without a terminal, or `nohup`, has it ignore stays ignored; and a limit of processor time is led down at, also where
/// both of its limits are the same.
#[test]
fn what_it_was_started_with_is_heeded() {
    let demo = Demo::new();
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let limits = libc::rlimit { rlim_cur: 40, rlim_max: 40 };
    // SAFETY: between fork and exec nothing is called that may not be.
    unsafe {
        command.pre_exec(move || {
            libc::signal(libc::SIGHUP, libc::SIG_IGN);
            match libc::setrlimit(libc::RLIMIT_CPU, &raw const limits) {
                0 => Ok(()),
                _ => Err(std::io::Error::last_os_error()),
            }
        });
    }
    let deployed = Foreground::start(&mut command);
    demo.until_phase("up");
    deployed.signal(libc::SIGHUP);
    assert_eq!(demo.run(&["status", "--json"]).json()["phase"], "up");
    let limits = std::fs::read_to_string(format!("/proc/{}/limits", deployed.id())).unwrap();
    let of = limits.lines().find(|line| line.starts_with("Max cpu time")).unwrap();
    assert_eq!(of.split_whitespace().skip(3).take(2).collect::<Vec<_>>(), ["30", "40"], "{of}");
    deployed.signal(libc::SIGXCPU);
    assert_eq!(deployed.end().code(), Some(0));
    assert!(!demo.path("davit/demo.sock").exists());
}

/// On the real clock a script's deployment is one that others find: nobody else has its name, and whoever ends it ends the script.
#[test]
fn a_scripts_deployment_has_its_name() {
    let demo = Demo::new();
    demo.write("story.lua", "deploy('deployment.yaml') say('it is up') wait(1000) say('never')");
    let mut command = demo.command(&["run", "story.lua", "--color", "never"]);
    let errors = File::create(demo.path("err")).unwrap();
    command.stdout(Stdio::from(File::create(demo.path("out")).unwrap())).stderr(Stdio::from(errors));
    let running = Foreground::start(&mut command);
    demo.until_phase("up");
    for second in [vec!["run", "story.lua"], vec!["deploy", "deployment.yaml"]] {
        let ran = demo.run(&second);
        assert!(
            ran.code == 1 && ran.err.contains("a deployment named `demo` is already running"),
            "{}{}",
            ran.out,
            ran.err
        );
    }
    let raised = demo.run(&["event", "e_fast", "--wait", "fast.ok", "--within", "80"]);
    assert_eq!(raised.code, 0, "{}{}", raised.out, raised.err);
    let listed = demo.run(&["list"]);
    assert!(listed.code == 0 && listed.out.contains("demo"), "{}{}", listed.out, listed.err);
    let ran = demo.run(&["shutdown"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    assert_eq!(running.end().code(), Some(1), "{}", demo.read("err"));
    assert!(!demo.read("out").contains("\nnever\n"), "{}", demo.read("out"));
    // It is free again, and in simulated time nobody has it.
    demo.write("story.lua", "deploy('deployment.yaml') shutdown() deploy('deployment.yaml')");
    let deployed = deploy(&demo, "other");
    demo.until_phase("up");
    assert_eq!(demo.run(&["run", "story.lua", "--clock", "simulated"]).code, 0);
    drop(deployed);
}

/// Who asks its deployment to end ends the script: in a loop that catches everything, and while it shuts down by itself to deploy again.
#[test]
fn whoever_ends_its_deployment_ends_a_script_whatever_that_catches() {
    for story in [
        "deploy('deployment.yaml') while true do pcall(wait, 0.1) end",
        "while true do pcall(deploy, 'deployment.yaml') pcall(wait, 1000) pcall(shutdown) end",
    ] {
        let demo = Demo::new();
        demo.write("story.lua", story);
        let mut command = demo.command(&["run", "story.lua", "--color", "never"]);
        let errors = File::create(demo.path("err")).unwrap();
        command.stdout(Stdio::from(File::create(demo.path("out")).unwrap())).stderr(Stdio::from(errors));
        let running = Foreground::start(&mut command);
        demo.until_phase("up");
        let ran = demo.run(&["shutdown"]);
        assert_eq!(ran.code, 0, "{story}: {}{}", ran.out, ran.err);
        assert_eq!(running.end().code(), Some(1), "{story}: {}", demo.read("err"));
        assert!(demo.read("err").contains("interrupted"), "{story}: {}", demo.read("err"));
        assert_eq!(demo.read("out").matches("root.operational").count(), 1, "{story}: {}", demo.read("out"));
    }
}
