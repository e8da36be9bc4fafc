//! How much `check` follows: `--budget`, and Ctrl-C.

use crate::demo::{Demo, at_home};
use crate::foreground::{Foreground, until};
use std::fs::File;
use std::process::Stdio;

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
    let ran = demo.run(&["check", "deployment.yaml", "--budget", "1k"]);
    assert!(ran.out.contains("the budget is 1000 transitions"), "{}", ran.out);
}

#[test]
fn a_budget_that_is_none_is_told() {
    for (budget, told) in [
        ("lots", "a number of transitions (`2000000`, `2M`), memory (`2GB`), or `2M,2GB`"),
        ("2M,3M", "`3M`: a number of transitions"),
        ("0", "between 1 and 1000000000 transitions"),
        ("99999999999999999999", "a number of transitions"),
        ("0.5k,-1GB", "`-1GB`: a number"),
    ] {
        let ran = at_home(&["check", "deployments/hello.yaml", "--budget", budget]);
        assert!(ran.code == 2 && ran.err.contains(told), "{budget}: {}", ran.err);
    }
    let help = at_home(&["check", "--help"]).out;
    assert!(help.contains("[default: 600000]"), "{help}");
}

/// The first signal tells what was found so far.
#[test]
fn an_interrupted_check_tells_what_it_found() {
    let demo = switches(12);
    let (out, err) = (demo.path("out"), demo.path("err"));
    let mut command = demo.command(&["check", "deployment.yaml", "--budget", "1G"]);
    command.stdout(File::create(&out).expect("a file")).stderr(Stdio::from(File::create(&err).expect("a file")));
    let checking = Foreground::start(&mut command);
    // It watches for signals once it follows: the second of them ends it at once, so that only one is sent.
    let caught = || {
        let status = std::fs::read_to_string(format!("/proc/{}/status", checking.id())).ok()?;
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"))?.trim().to_owned();
        let caught = u64::from_str_radix(&caught, 16).ok()?;
        (caught & (1 << (libc::SIGINT - 1)) != 0).then_some(())
    };
    until("it watches for signals", caught);
    checking.signal(libc::SIGINT);
    let status = checking.end();
    let told = demo.read("out");
    assert_eq!(status.code(), Some(1), "{told}\n{}", demo.read("err"));
    assert!(told.contains("what was left when it was interrupted was not followed"), "{told}");
    assert!(told.contains("not all there are") && !told.contains("never"), "{told}");
}
