//! What checking costs: states a second and bytes a state, for generated families and the shipped deployments.
//!
//! A family: a hub and n modes, each of which a state brings with it and each of whose undos may fail; and coordinators of ten such
//! modes each beside each other that have nothing to do with each other; and two youBots written flat. `cargo bench --bench check`; other files by
//! `cargo bench --bench check -- FILE…`.

#[path = "../tests/support/family.rs"]
mod family;
#[path = "../tests/support/flat.rs"]
mod flat;

use davit::app;
use davit::check::run;
use davit::lang::LoadOptions;
use davit::libraries;
use std::alloc::{GlobalAlloc, Layout};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// The program's allocator, and how much of it is in use at most.
struct Peak;

static IN_USE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
/// Counting costs a tenth of what is measured: memory is measured in a run of its own.
static COUNTS: AtomicBool = AtomicBool::new(false);

// SAFETY: everything is handed on to the program's allocator as it came.
unsafe impl GlobalAlloc for Peak {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if COUNTS.load(Ordering::Relaxed) {
            let now = IN_USE.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
            PEAK.fetch_max(now, Ordering::Relaxed);
        }
        // SAFETY: as for whoever called this.
        unsafe { mimalloc::MiMalloc.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        if COUNTS.load(Ordering::Relaxed) {
            // What was made before it began to count is not in it.
            let _ = IN_USE
                .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |now| Some(now.saturating_sub(layout.size())));
        }
        // SAFETY: as for whoever called this.
        unsafe { mimalloc::MiMalloc.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Peak = Peak;

#[allow(clippy::disallowed_methods)] // a benchmark measures real time
fn row(name: &str, file: &Path) {
    let mut best: Option<(Duration, usize, usize, bool)> = None;
    let mut memory = 0;
    for run_number in 0..6 {
        COUNTS.store(run_number == 0, Ordering::Relaxed);
        let libraries = libraries::builtin();
        let read = app::read(file, &LoadOptions::default(), libraries).unwrap_or_else(|_| panic!("{name} is not read"));
        let before = IN_USE.load(Ordering::Relaxed);
        PEAK.store(before, Ordering::Relaxed);
        let start = Instant::now();
        let report = run(read.deployment, &read.catalogue);
        let took = start.elapsed();
        if run_number == 0 {
            memory = PEAK.load(Ordering::Relaxed) - before;
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
