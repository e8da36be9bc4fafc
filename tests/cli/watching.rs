//! `davit watch`: drawn anew on a terminal, lines elsewhere; whatever becomes of it, the deployment goes on.

use crate::demo::Demo;
use crate::foreground::{Foreground, read_until, terminal};
use crate::kept::{deploy, kill};
use std::io::{BufRead, BufReader, Write};
use std::process::Stdio;

/// Takes the deployment down whatever the test found.
struct Deployed(Demo);

impl Drop for Deployed {
    fn drop(&mut self) {
        let _ = self.0.command(&["shutdown", "--force"]).output();
    }
}

const CONFIGURATIONS: &str = "ConfiguratorConf {
  create_all = Configuration { create('source', 'standard.Constant', { activity = 'control', properties = { value = 2.5 } }),
                               create('watcher', 'davit.Monitors', { activity = 'control' }) },
  connect_all = Configuration {},
  start_all = Configuration { post_conf_state = { 'source:running', 'watcher:running' } },
  slow = Configuration { property_set('source.value', 2.5) },
  fast = Configuration { property_set('source.value', 7.0), property_set('watcher.low', true) },
}
";

const MONITORS: &str = "monitors:
  high: { when: { above: [source.y, 4] }, event: e_high }
  low: { when: { below: [source.y, 1] }, event: e_low, enabled: false }
";

/// With components that run, and monitors.
fn live() -> Deployed {
    let demo = files();
    deploy(&demo, "deployment.yaml");
    Deployed(demo)
}

fn files() -> Demo {
    let demo = Demo::new();
    let text = demo.read("deployment.yaml").replace("platform: simulated", "platform: embedded\nlibraries: [standard]");
    let types = text.find("types:").unwrap()..text.find("activities:").unwrap();
    demo.write(
        "deployment.yaml",
        &format!("{}{}monitors: [monitors.yaml]\n", &text[..types.start], &text[types.end..]),
    );
    demo.write("configurations.lua", CONFIGURATIONS);
    demo.write("monitors.yaml", MONITORS);
    demo
}

/// Two of them in one deployment.
const BOTH: &str = "davit: 1
name: both
platform: embedded
libraries: [standard]
subsystems: { one: { deployment: deployment.yaml }, two: { deployment: deployment.yaml } }
configurations: []
coordinator: both.lua
deploy: { event: e_start, up: on, within_s: 60 }
shutdown: { event: e_shutdown, down: idle, within_s: 60 }
";

const BEGINS_BOTH: &str = "return state {
  idle = state {}, one = state {}, two = state {}, on = state {}, lowering = state {},
  trans { src = 'initial', tgt = 'idle' },
  trans { src = 'idle', tgt = 'one', events = { 'e_start' }, effect = { 'one/e_start' } },
  trans { src = 'one', tgt = 'two', events = { 'one/up' }, effect = { 'two/e_start' } },
  trans { src = 'two', tgt = 'on', events = { 'two/up' } },
  trans { src = 'on', tgt = 'lowering', events = { 'e_shutdown' }, effect = { 'one/e_shutdown', 'two/e_shutdown' } },
  trans { src = 'lowering', tgt = 'idle', events = { 'one/down', 'two/down' } },
}
";

/// Monitors of one name in two subsystems are told apart, as everything is: by the path.
#[test]
fn monitors_of_subsystems_have_their_paths() {
    let demo = files();
    demo.write("both.yaml", BOTH);
    demo.write("both.lua", BEGINS_BOTH);
    deploy(&demo, "both.yaml");
    let deployed = Deployed(demo);
    let line = |args: &[&str]| {
        let ran = deployed.0.run(&[&["watch", "--count", "1"], args].concat());
        assert_eq!((ran.code, ran.out.lines().count()), (0, 1), "{}{}", ran.out, ran.err);
        ran.out
    };
    let all = line(&[]);
    for words in ["  one/high: ", "  one/low: off", "  two/high: ", "  two/low: off"] {
        assert!(all.contains(words), "{words}: {all}");
    }
    let inside = line(&["--in", "one"]);
    assert!(inside.contains("  high: ") && !inside.contains("two"), "by the names of the file: {inside}");
    let folded = line(&["--depth", "0"]);
    assert!(!folded.contains("high"), "what is folded is not told one by one: {folded}");
}

#[test]
fn monitors_are_shown_with_what_they_say() {
    let deployed = live();
    let run = |args: &[&str]| deployed.0.run(args);
    // As often as it takes: the machine may be busy.
    let look = |wanted: &dyn Fn(&serde_json::Value) -> bool| {
        crate::foreground::until("monitors say something", || {
            let ran = run(&["watch", "--json", "--count", "1"]);
            assert_eq!((ran.code, ran.out.lines().count()), (0, 1), "{}{}", ran.out, ran.err);
            Some(ran.json()).filter(wanted)
        })
    };
    let seen = look(&|seen| seen["monitors"][0]["verdict"].is_boolean());
    let [high, low] = &seen["monitors"].as_array().expect("monitors")[..] else { panic!("{seen}") };
    assert_eq!(
        (&high["name"], &high["enabled"], &high["verdict"]),
        (&"high".into(), &true.into(), &false.into()),
        "{seen}"
    );
    assert_eq!(high["robustness"], -1.5, "{seen}");
    assert_eq!((&low["enabled"], &low["verdict"]), (&false.into(), &serde_json::Value::Null), "{seen}");
    assert_eq!(seen["status"]["phase"], "up");
    assert_eq!(seen["activities"][0]["name"], "control", "{seen}");
    assert_eq!(run(&["event", "e_fast", "--wait", "fast.ok"]).code, 0);
    let seen = look(&|seen| seen["monitors"][0]["verdict"] == true && seen["monitors"][1]["verdict"].is_boolean());
    assert_eq!((&seen["monitors"][0]["robustness"], &seen["monitors"][1]["robustness"]), (&3.0.into(), &(-6.0).into()));

    let lines = run(&["watch", "--count", "2", "--every", "0.01"]);
    assert_eq!(lines.out.lines().count(), 2, "{}", lines.out);
    for line in lines.out.lines() {
        for words in ["up", "root.operational.fast_mode", "4 frames", "high: true +3.0000"] {
            assert!(line.contains(words), "{words}: {line}");
        }
    }
}

#[test]
fn a_terminal_that_is_stopped_is_nothing_to_the_deployment() {
    let deployed = live();
    let demo = &deployed.0;
    let (mut person, program) = terminal();
    let mut command = demo.command(&["watch", "--every", "0.05", "--color", "never"]);
    command.env("TERM", "xterm").stdout(Stdio::from(program.try_clone().unwrap())).stderr(Stdio::null());
    let watch = Foreground::start(&mut command);
    drop(command);
    let seen = read_until(&mut person, "missed");
    for words in ["demo  up", "root.operational.slow_mode", ", newest first", "source", "high", "control"] {
        assert!(seen.contains(words), "{words}: {seen}");
    }
    // It is drawn anew, where it was: lines are cleared for that.
    let again = read_until(&mut person, "\x1b[2K");
    assert!(again.contains("\x1b[2K"), "{again}");
    // Ctrl-S.
    person.write_all(b"\x13").unwrap();
    let fast = demo.run(&["event", "e_fast", "--wait", "fast.ok", "--within", "60"]);
    assert_eq!(fast.code, 0, "the coordinator reacts: {}{}", fast.out, fast.err);
    // Ctrl-Q; and a signal ends it, and nothing else. (Not Ctrl-C: what a shell has started in the background does not hear it.)
    person.write_all(b"\x11").unwrap();
    assert!(read_until(&mut person, "root.operational.fast_mode").contains("fast_mode"));
    watch.signal(libc::SIGTERM);
    assert!(!watch.end().success());
    assert_eq!(demo.run(&["status", "--json"]).json()["phase"], "up");
}

#[test]
fn it_ends_with_the_deployment_and_says_how_that_was() {
    for killed in [false, true] {
        let deployed = Deployed(Demo::new());
        let demo = &deployed.0;
        deploy(demo, "deployment.yaml");
        let mut command = demo.command(&["watch", "--every", "0.05"]);
        let (read, write) = std::io::pipe().expect("a pipe");
        let watch = Foreground::start(command.stdout(write).stderr(Stdio::null()));
        drop(command);
        let mut lines = BufReader::new(read).lines();
        assert!(lines.next().expect("a line").unwrap().contains("up  root.operational.slow_mode"));
        if killed {
            kill(demo, "demo");
        } else {
            assert_eq!(demo.run(&["shutdown"]).code, 0);
        }
        assert_eq!(watch.end().code(), Some(if killed { 4 } else { 0 }));
        let last = lines.last().expect("a last line").unwrap();
        let said = if killed { "demo  died  killed, or crashed" } else { "`demo` ended at 2" };
        assert!(last.contains(said), "{last}");
    }
}

#[test]
fn one_that_stands_still_is_said_not_to_answer_until_it_does() {
    let deployed = Deployed(Demo::new());
    let demo = &deployed.0;
    deploy(demo, "deployment.yaml");
    let mut command = demo.command(&["watch", "--every", "0.05"]);
    let (read, write) = std::io::pipe().expect("a pipe");
    let watch = Foreground::start(command.stdout(write).stderr(Stdio::null()));
    drop(command);
    let mut lines = BufReader::new(read).lines();
    let mut until = |words: &str| {
        let mut seen = lines.by_ref().map(|line| line.expect("a line"));
        seen.find(|line| line.contains(words)).unwrap_or_else(|| panic!("no `{words}`"))
    };
    until("up  root.operational.slow_mode");
    let pid = crate::kept::process(demo, "demo");
    let stopped = Stopped::new(pid);
    let said = until("does not answer");
    assert!(said.starts_with("demo  does not answer for "), "{said}");
    // So does one that begins to look.
    let look = demo.run(&["watch", "--count", "1", "--json"]);
    assert_eq!((look.code, &look.json()["phase"]), (1, &serde_json::Value::Null), "{}", look.out);
    assert!(look.json()["why"].as_str().is_some_and(|why| why.contains("does not answer")), "{}", look.out);
    drop(stopped);
    until("up  root.operational.slow_mode");
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    assert_eq!(watch.end().code(), Some(0));
}

/// A process stands still, until this is dropped.
struct Stopped(i32);

impl Stopped {
    fn new(process: i32) -> Self {
        // SAFETY: a signal to a process of ours.
        assert_eq!(unsafe { libc::kill(process, libc::SIGSTOP) }, 0);
        Self(process)
    }
}

impl Drop for Stopped {
    fn drop(&mut self) {
        // SAFETY: a signal to a process of ours.
        unsafe { libc::kill(self.0, libc::SIGCONT) };
    }
}

/// What goes on printing ends where nothing can be printed, and says why.
#[test]
fn a_full_disk_ends_what_goes_on() {
    let deployed = live();
    for args in [&["watch", "--every", "0.01"][..], &["watch", "--json", "--every", "0.01"], &["log", "--follow"]] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let ran = deployed.0.command(args).stdout(Stdio::from(full)).stderr(Stdio::piped()).spawn().unwrap();
        // Something to follow, as long as it does.
        let ended = std::thread::scope(|scope| {
            let waits = scope.spawn(|| ran.wait_with_output().unwrap());
            crate::foreground::until("it ends", || {
                deployed.0.run(&["apply", "slow", "--force", "--no-wait"]);
                waits.is_finished().then_some(())
            });
            waits.join().unwrap()
        });
        assert_eq!(ended.status.code(), Some(2), "{args:?}");
        assert!(String::from_utf8_lossy(&ended.stderr).contains("No space left"), "{args:?} {ended:?}");
    }
}
