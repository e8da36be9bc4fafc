//! What checking costs: states a second and bytes a state, for generated families and the shipped deployments.
//!
//! A family: a hub and n modes, each of which a state brings with it and each of whose undos may fail; and coordinators of ten such
//! modes each beside each other that have nothing to do with each other; and two youBots written flat. `cargo bench --bench check`; other files by
//! `cargo bench --bench check -- FILE…`.

#[path = "../tests/support/family.rs"]
mod family;
#[path = "../tests/support/flat.rs"]
mod flat;
#[path = "../tests/support/in_use.rs"]
mod in_use;

use davit::app;
use davit::check::run;
use davit::lang::LoadOptions;
use davit::libraries;
use in_use::InUse;
use std::path::Path;
use std::time::{Duration, Instant};

#[global_allocator]
static ALLOCATOR: InUse<mimalloc::MiMalloc> = InUse(mimalloc::MiMalloc);

#[allow(clippy::disallowed_methods)] // a benchmark measures real time
fn row(name: &str, file: &Path) {
    let mut best: Option<(Duration, usize, usize, bool)> = None;
    let mut memory = 0;
    for run_number in 0..6 {
        in_use::count(run_number == 0);
        let libraries = libraries::builtin();
        let read = app::read(file, &LoadOptions::default(), libraries).unwrap_or_else(|_| panic!("{name} is not read"));
        let before = in_use::now();
        let start = Instant::now();
        let report = run(read.deployment, &read.catalogue);
        let took = start.elapsed();
        if run_number == 0 {
            memory = in_use::most() - before;
            continue;
        }
        let ends = !report.left.iter().any(|left| left.contains("--budget"));
        if best.is_none_or(|best| took < best.0) {
            best = Some((took, report.explored.states, report.explored.transitions, ends));
        }
    }
    let Some((took, states, transitions, ends)) = best else { return };
    println!(
        "{name:<28} {states:>9} {transitions:>11} {:>9.3} {:>10.0} {:>9} {:>6}",
        took.as_secs_f64(),
        states as f64 / took.as_secs_f64(),
        memory / states.max(1),
        if ends { "yes" } else { "no" }
    );
}

fn main() {
    println!(
        "{:<28} {:>9} {:>11} {:>9} {:>10} {:>9} {:>6}",
        "deployment", "states", "transitions", "s", "states/s", "B/state", "ends"
    );
    let files: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    if !files.is_empty() {
        files.iter().for_each(|file| row(file, Path::new(file)));
        return;
    }
    for (coordinators, n) in [(1, 10), (1, 20), (1, 40), (3, 10)] {
        let folder = tempfile::tempdir().expect("a folder of ours");
        row(&format!("{coordinators} x {n} modes"), &family::write(folder.path(), coordinators, n));
    }
    let folder = tempfile::tempdir().expect("a folder of ours");
    row("two youBots", &flat::youbots(folder.path(), &["l_", "r_"]));
    for name in ["hello", "youbot_arm", "youbot_arm_scoped", "generic_arm"] {
        row(name, &Path::new(env!("CARGO_MANIFEST_DIR")).join("deployments").join(name).with_extension("yaml"));
    }
}
