//! How much `check` follows: `--budget`, and Ctrl-C.

use crate::demo::{Demo, at_home};
use crate::foreground::{Foreground, LIMIT, read_until, terminal, until};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read;
use std::os::fd::AsRawFd;
use std::os::unix::process::ExitStatusExt;
use std::process::Stdio;
use std::sync::mpsc;

/// Switches that have nothing to do with each other, each on or off by its own event: of `n` there are as many states as
/// subsets, and more.
fn switches(n: usize) -> Demo {
    let demo = Demo::new();
    let (mut configurations, mut coordinator) = (String::new(), String::new());
    for i in 0..n {
        configurations += &format!("  c{i} = Configuration {{ create('k{i}', 'Sink') }},\n");
        coordinator += &format!(
            "  trans {{ src = 'up', tgt = 'up', events = {{ 'e_on{i}' }}, effect = 'c{i}' }},\n  \
             trans {{ src = 'up', tgt = 'up', events = {{ 'e_off{i}' }}, effect = 'c{i}.undo' }},\n"
        );
    }
    demo.write("configurations.lua", &format!("ConfiguratorConf {{\n{configurations}}}\n"));
    demo.write(
        "coordinator.lua",
        &format!(
            "return state {{\n  idle = state {{}}, up = state {{}},\n{coordinator}  \
             trans {{ src = 'initial', tgt = 'idle' }},\n  \
             trans {{ src = 'idle', tgt = 'up', events = {{ 'e_start' }} }},\n  \
             trans {{ src = 'up', tgt = 'idle', events = {{ 'e_shutdown' }} }},\n}}\n"
        ),
    );
    demo.replace("deployment.yaml", "emits: [e_ready]\n", "");
    demo.replace("deployment.yaml", "up: operational, failed: [failed],", "up: up,");
    demo
}

#[test]
fn a_budget_says_how_much_is_followed() {
    let demo = switches(6);
    let with = |budget: &str| demo.run(&["check", "deployment.yaml", "--json", "--budget", budget]).json();
    let transitions = |budget: &str| with(budget)["explored"]["transitions"].as_u64().expect("a number");
    let (few, more) = (transitions("1k"), transitions("20K"));
    // What follows from the state that was looked at last is followed.
    assert!((600..1_100).contains(&few) && more > 10_000, "{few}, {more}");
    let told = with("1000")["left"].to_string();
    assert!(told.contains("after the first 1000 transitions"), "{told}");
    let told = with("20k,1MB");
    assert!(told["left"].to_string().contains("more memory than `--budget` gives"), "{told}");
    assert_eq!(told["explored"]["complete"], false, "{told}");
    let (few, all) = (with("1Kstates"), with("1G"));
    let states = |of: &serde_json::Value| of["explored"]["states"].as_u64().expect("a number");
    assert!((600..1_100).contains(&states(&few)) && states(&all) > 1_100, "{few}, {all}");
    let told = few["left"].to_string();
    assert!(told.contains("after the first 1000 states was not followed") && !told.contains("transitions"), "{told}");
    // Of two bounds that is told which is met.
    let told = with("300,1Mstates")["left"].to_string();
    assert!(told.contains("after the first 300 transitions") && !told.contains("states was"), "{told}");
    assert_eq!(with("1000000,100Mstates")["left"], all["left"]);
    let ran = demo.run(&["check", "deployment.yaml", "--budget", "1kstates"]);
    assert!(ran.out.contains("not followed further: the budget is 1000 states, and"), "{}", ran.out);
    let ran = demo.run(&["check", "deployment.yaml", "--budget", "1k"]);
    assert!(ran.out.contains("the budget is 1000 transitions"), "{}", ran.out);
}

#[test]
fn a_budget_that_is_none_is_told() {
    for (budget, told) in [
        (
            "lots",
            "a number of transitions (`2000000`, `2M`), states (`500Kstates`), memory (`2GB`), or several, each once: `2M,2GB`",
        ),
        ("2states,3states", "`3states`: a number of transitions"),
        ("2GBstates", "`2GBstates`: a number of transitions"),
        ("0states", "`0states`: between 1 and 1000000000 states"),
        ("2M,3M", "`3M`: a number of transitions"),
        ("0", "between 1 and 1000000000 transitions"),
        ("99999999999999999999", "a number of transitions"),
        ("0.5k,-1GB", "`-1GB`: a number"),
    ] {
        let ran = at_home(&["check", "deployments/hello.yaml", "--budget", budget]);
        assert!(ran.code == 2 && ran.err.contains(told), "{budget}: {}", ran.err);
    }
    let help = at_home(&["check", "--help"]).out;
    assert!(help.contains("[default: 800000]"), "{help}");
}

/// It watches for signals once it follows.
fn until_it_follows(checking: &Foreground) {
    let caught = || {
        let status = std::fs::read_to_string(format!("/proc/{}/status", checking.id())).ok()?;
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"))?.trim().to_owned();
        let caught = u64::from_str_radix(&caught, 16).ok()?;
        (caught & (1 << (libc::SIGINT - 1)) != 0).then_some(())
    };
    until("it watches for signals", caught);
}

/// The first signal tells what was found so far.
#[test]
fn an_interrupted_check_tells_what_it_found() {
    let demo = switches(12);
    let (out, err) = (demo.path("out"), demo.path("err"));
    let mut command = demo.command(&["check", "deployment.yaml", "--budget", "1G"]);
    command.stdout(File::create(&out).expect("a file")).stderr(Stdio::from(File::create(&err).expect("a file")));
    let checking = Foreground::start(&mut command);
    // The second signal ends it at once, so that only one is sent.
    until_it_follows(&checking);
    checking.signal(libc::SIGINT);
    let status = checking.end();
    let told = demo.read("out");
    assert_eq!(status.code(), Some(1), "{told}\n{}", demo.read("err"));
    assert!(told.contains("what was left when it was interrupted was not followed"), "{told}");
    assert!(told.contains("not all there are") && !told.contains("never"), "{told}");
}

/// A script that is to end while its deployment is being checked brings nothing up.
#[test]
fn an_interrupted_script_checks_no_further_and_brings_nothing_up() {
    let demo = switches(40);
    demo.write("script.lua", "deploy('deployment.yaml')\nshutdown()\n");
    let (out, err) = (demo.path("out"), demo.path("err"));
    let mut command = demo.command(&["run", "script.lua"]);
    command.stdout(File::create(&out).expect("a file")).stderr(Stdio::from(File::create(&err).expect("a file")));
    let running = Foreground::start(&mut command);
    until_it_follows(&running);
    running.signal(libc::SIGINT);
    let status = running.end();
    let told = demo.read("out") + &demo.read("err");
    assert_eq!(status.code(), Some(1), "{told}");
    assert!(told.contains("interrupted") && !told.contains(" in  ") && !told.contains("refused"), "{told}");
}

/// Who deploys is told that nothing was begun, and the process ends as it does by that signal.
#[test]
fn an_interrupted_deploy_says_that_nothing_was_begun() {
    let demo = switches(40);
    let err = demo.path("err");
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    command.stdout(Stdio::null()).stderr(Stdio::from(File::create(&err).expect("a file")));
    let deploying = Foreground::start(&mut command);
    until_it_follows(&deploying);
    deploying.signal(libc::SIGINT);
    let status = deploying.end();
    assert_eq!(status.signal(), Some(libc::SIGINT), "{}", demo.read("err"));
    assert_eq!(demo.read("err"), "interrupted while it was being checked: nothing was begun\n");
}

/// A `check` that goes on for long with its errors on a terminal: what is shown there, for whoever receives it, and the process.
fn on_a_terminal(demo: &Demo, more: &[&str]) -> (Foreground, mpsc::Receiver<String>) {
    let (mut person, program) = terminal();
    let size = libc::winsize { ws_row: 24, ws_col: 200, ws_xpixel: 0, ws_ypixel: 0 };
    // SAFETY: the size of an open terminal, read from where it is.
    assert_eq!(unsafe { libc::ioctl(program.as_raw_fd(), libc::TIOCSWINSZ, &raw const size) }, 0);
    let mut command = demo.command(&["check", "deployment.yaml", "--budget", "1G"]);
    command.args(more).env("TERM", "xterm").stdout(File::create(demo.path("out")).expect("a file"));
    command.stderr(Stdio::from(program));
    let checking = Foreground::start(&mut command);
    // Whose end we no longer have is closed when the process ends.
    drop(command);
    let (tell, shown) = mpsc::channel();
    std::thread::spawn(move || {
        let mut chunk = [0; 4096];
        while let Ok(n @ 1..) = person.read(&mut chunk) {
            if tell.send(String::from_utf8_lossy(&chunk[..n]).into_owned()).is_err() {
                // Nobody looks any more: what is written is still taken.
                read_until(&mut person, "\0");
            }
        }
    });
    (checking, shown)
}

/// While it follows a line tells how far it is, how fast, and what ends it. It is gone when what was found is told.
#[test]
fn a_terminal_is_told_how_far_it_is() {
    let demo = switches(16);
    let (checking, shown) = on_a_terminal(&demo, &[]);
    let mut text = String::new();
    // States, transitions and states a second of each line that is whole.
    let lines = |text: &str| {
        let told = text.split("following: ").skip(1);
        let whole = told.filter(|line| line.contains("; Ctrl-C tells what was found so far"));
        let of = |line: &str, unit: &str| {
            let before = line.split(unit).next().unwrap_or_default();
            let number = before.rsplit(|c: char| !c.is_ascii_digit()).next().unwrap_or_default();
            number.parse::<u64>().unwrap_or_else(|_| panic!("no number before `{unit}`: {line}"))
        };
        whole
            .map(|line| (of(line, " states, "), of(line, " of 1000000000 transitions; "), of(line, " states/s")))
            .collect::<BTreeSet<_>>()
    };
    while lines(&text).len() < 3 {
        text += &shown.recv_timeout(LIMIT).unwrap_or_else(|why| panic!("{why}: {text}"));
    }
    checking.signal(libc::SIGINT);
    while let Ok(more) = shown.recv_timeout(LIMIT) {
        text += &more;
    }
    assert_eq!(checking.end().code(), Some(1), "{text}");
    let told: Vec<_> = lines(&text).into_iter().collect();
    assert!(told.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 < pair[1].1), "it goes on: {told:?}");
    assert!(told.iter().all(|(states, transitions, rate)| states < transitions && *rate > 0), "{told:?}");
    let behind = text.rsplit("what was found so far").next().unwrap_or_default();
    assert!(behind.contains("\u{1b}[2K"), "the line is taken away: {text:?}");
    assert!(!demo.read("out").contains("following"), "{}", demo.read("out"));
}

/// Programs read what it comes to: with `--json` no line is drawn for them.
#[test]
fn programs_are_told_the_end_alone() {
    let demo = switches(16);
    let (checking, shown) = on_a_terminal(&demo, &["--json"]);
    // Work for several lines, if there were any: in hundredths of a second of the processor.
    until("it has followed much", || {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", checking.id())).ok()?;
        let spent = stat.rsplit(')').next()?.split_whitespace().nth(11)?.parse::<u64>().ok()?;
        (spent > 300).then_some(())
    });
    checking.signal(libc::SIGINT);
    assert_eq!(checking.end().code(), Some(1));
    assert_eq!(shown.into_iter().collect::<String>(), "");
    assert!(demo.read("out").contains("when it was interrupted"), "{}", demo.read("out"));
}
