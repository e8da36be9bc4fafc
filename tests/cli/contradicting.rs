//! Options that say nothing beside what else is asked for are refused, and not passed over.

use crate::demo::Demo;

fn refused(demo: &Demo, args: &[&str], words: &str) {
    let ran = demo.run(args);
    assert!(ran.code == 2 && ran.out.is_empty(), "{args:?}: {}{}", ran.out, ran.err);
    assert!(ran.err.contains("cli::contradicts") && ran.err.contains(words), "{args:?}: {}", ran.err);
}

#[test]
fn only_coordinators_are_drawn_live() {
    let demo = Demo::new();
    refused(&demo, &["graph", "deployment.yaml", "--live"], "--what coordinator");
    refused(&demo, &["graph", "deployment.yaml", "--what", "plan", "--live"], "--what coordinator");
    let none = demo.run(&["graph", "deployment.yaml", "--what", "coordinator", "--live"]);
    assert!(none.code == 1 && none.err.contains("cli::not_running"), "{}", none.err);
}

#[test]
fn real_time_has_no_pace() {
    let demo = Demo::new();
    for more in [&[][..], &["--detach"], &["--clock", "real"]] {
        refused(&demo, &[&["deploy", "missing.yaml", "--pace", "3"], more].concat(), "--clock simulated");
    }
}
