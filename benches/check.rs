//! What checking costs: states a second and bytes a state, for generated families and the shipped deployments.
//!
//! A family: a hub and n modes, each of which a state brings with it and each of whose undos may fail; and coordinators of ten such
//! modes each beside each other that have nothing to do with each other; and two youBots written flat. `cargo bench --bench check`; other files by
//! `cargo bench --bench check -- FILE…`.

#[path = "../tests/support/flat.rs"]
mod flat;

use davit::app;
use davit::check::run;
use davit::lang::LoadOptions;
use davit::libraries;
use std::alloc::{GlobalAlloc, Layout};
use std::fmt::Write;
use std::path::{Path, PathBuf};
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

fn coordinator(number: usize, n: usize) -> String {
    let (base, mut up) = (format!("base{number}"), String::new());
    for i in 0..n {
        let _ = writeln!(
            up,
            "m{i} = state {{ config = 's{number}_{i}' }}, trans {{ src = 'hub', tgt = 'm{i}', events = {{ 'e{number}_{i}' }} }},
             trans {{ src = 'm{i}', tgt = 'hub', events = {{ 'e{number}_back', 's{number}_{i}.failed', 's{number}_{i}.broken' }} }},"
        );
    }
    format!(
        "return state {{ idle = state {{}}, starting = state {{ entry = '{base}' }},
         up = state {{ hub = state {{}}, trans {{ src = 'initial', tgt = 'hub' }}, {up} }},
         leaving = state {{ entry = '{base}.undo' }}, again = state {{ entry = '{base}.undo' }},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'starting', events = {{ 'e_start' }} }},
         trans {{ src = 'starting', tgt = 'up', events = {{ '{base}.ok' }} }},
         trans {{ src = 'starting', tgt = 'idle', events = {{ '{base}.failed' }} }},
         trans {{ src = 'starting', tgt = 'leaving', events = {{ 'e_stop', '{base}.broken' }} }},
         trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_stop' }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ '{base}.undone' }} }},
         trans {{ src = 'leaving', tgt = 'again', events = {{ '{base}.undo.failed', '{base}.undo.broken' }} }},
         trans {{ src = 'again', tgt = 'leaving', events = {{ '{base}.undo.failed', '{base}.undo.broken' }} }},
         trans {{ src = 'again', tgt = 'idle', events = {{ '{base}.undone' }} }} }}"
    )
}

/// So many coordinators with so many modes each.
fn write(folder: &Path, coordinators: usize, n: usize) -> PathBuf {
    let mut configurations = String::from("ConfiguratorConf {\n");
    let mut names = Vec::new();
    for number in 0..coordinators {
        let of = |text: &dyn Fn(usize) -> String| (0..n).map(text).collect::<Vec<_>>().join(", ");
        let creates = of(&|i| format!("create('c{number}_{i}', 'G')"));
        let states = of(&|i| format!("'c{number}_{i}:running'"));
        let _ =
            writeln!(configurations, "base{number} = Configuration {{ {creates}, post_conf_state = {{ {states} }} }},");
        for i in 0..n {
            let _ =
                writeln!(configurations, "s{number}_{i} = Configuration {{ property_set('c{number}_{i}.k', 1.0) }},");
        }
        std::fs::write(folder.join(format!("k{number}.lua")), coordinator(number, n)).expect("a folder of ours");
        names.push(format!("k{number}"));
    }
    configurations.push('}');
    std::fs::write(folder.join("c.lua"), configurations).expect("a folder of ours");
    let of = |text: &dyn Fn(&String) -> String| names.iter().map(text).collect::<Vec<_>>().join(", ");
    let deployment = format!(
        "davit: 1\nname: family\nplatform: simulated\n\
         types: {{ G: {{ properties: {{ k: {{ type: float, default: 0.0 }} }} }} }}\nconfigurations: [c.lua]\n\
         coordinators: {{ {} }}\ndeploy: {{ event: e_start, up: [{}], within_s: 5 }}\n\
         shutdown: {{ event: e_stop, down: [{}], within_s: 5 }}\n",
        of(&|name| format!("{name}: {name}.lua")),
        of(&|name| format!("{name}:up")),
        of(&|name| format!("{name}:idle")),
    );
    let file = folder.join("family.yaml");
    std::fs::write(&file, deployment).expect("a folder of ours");
    file
}

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
        row(&format!("{coordinators} x {n} modes"), &write(folder.path(), coordinators, n));
    }
    let folder = tempfile::tempdir().expect("a folder of ours");
    row("two youBots", &flat::youbots(folder.path(), &["l_", "r_"]));
    for name in ["hello", "youbot_arm", "youbot_arm_scoped", "generic_arm"] {
        row(name, &Path::new(env!("CARGO_MANIFEST_DIR")).join("deployments").join(name).with_extension("yaml"));
    }
}
