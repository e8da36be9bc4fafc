//! Deploying a chain of `standard` components on the embedded platform, from files on disk to running, and undoing it:
//! parsed, checked, planned, with inverses. Prints a table, slope and intercept, the exponent, and memory a component; and
//! the same for a chain of a user's own components, which are made and dropped by a worker under a deadline.
//!
//! `cargo bench --bench deploy`; `cargo bench --bench deploy -- 10 100 1000` for other sizes.

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc; // as in the program

use davit::app;
use davit::lang::LoadOptions;
use davit::libraries;
use davit::runtime::{Builder, Component, Context, In, Library, Out, Prop};
use davit::time::Clock;
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

const DEPLOYMENT: &str = "\
davit: 1
name: chain
platform: embedded
libraries: [standard, own]
activities:
  loop: { period_ms: 1000.0 }
configurations: [configurations.lua]
coordinator: coordinator.lua
deploy:   { event: e_start, up: up,   failed: [failed], within_s: 60 }
shutdown: { event: e_stop,  down: idle, within_s: 600 }
limits:   { step_timeout_s: 60.0 }
";

const COORDINATOR: &str = r#"
return state {
  idle     = state {},
  up       = state { entry = "chain" },
  stopping = state { entry = "chain.undo" },
  failed   = state {},
  trans { src = "initial",  tgt = "idle" },
  trans { src = "idle",     tgt = "up",       events = { "e_start" } },
  trans { src = "up",       tgt = "failed",   events = { "chain.failed", "chain.broken" } },
  trans { src = "up",       tgt = "stopping", events = { "e_stop" } },
  trans { src = "stopping", tgt = "idle",     events = { "chain.undone" } },
  trans { src = "stopping", tgt = "failed",   events = { "chain.undo.failed" } },
  trans { src = "failed",   tgt = "stopping", events = { "e_stop" } },
}
"#;

fn write(folder: &Path, n: usize, ty: &str) {
    let mut lua = String::from("ConfiguratorConf {\n  chain = Configuration {\n");
    for i in 0..n {
        let _ = writeln!(lua, "    create(\"c{i}\", \"{ty}\", {{ activity = \"loop\" }}),");
    }
    for i in 1..n {
        let _ = writeln!(lua, "    connect(\"c{}.y\", \"c{i}.u\"),", i - 1);
    }
    lua.push_str("    post_conf_state = { \"_default:running\" },\n  },\n}\n");
    std::fs::write(folder.join("configurations.lua"), lua).expect("a folder of ours");
    std::fs::write(folder.join("coordinator.lua"), COORDINATOR).expect("a folder of ours");
    std::fs::write(folder.join("chain.yaml"), DEPLOYMENT).expect("a folder of ours");
}

/// Bytes of memory the process holds.
fn resident() -> usize {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    text.split(' ').nth(1).and_then(|pages| pages.parse::<usize>().ok()).unwrap_or(0) * 4096
}

/// As a user's own component: nothing is promised of it.
struct Own {
    u: In<f64>,
    y: Out<f64>,
    k: Prop<f64>,
}

impl Component for Own {
    fn new(b: &mut Builder<Self>) -> Self {
        Self { u: b.input("u"), y: b.output("y"), k: b.property("k", 1.0) }
    }

    fn update(&mut self, _: &mut Context) {
        if let Some(u) = self.u.get() {
            self.y.write(self.k.get() * u);
        }
    }
}

struct Row {
    n: usize,
    load: Duration,
    check: Duration,
    up: Duration,
    down: Duration,
    memory: usize,
}

fn deploy(n: usize, ty: &str) -> Row {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write(folder.path(), n, ty);
    let clock = Clock::real();
    let _me = clock.enter();
    let before = resident();
    #[allow(clippy::disallowed_methods)] // a benchmark measures real time
    let now = Instant::now;
    let t0 = now();
    let libraries = libraries::builtin().with(Library::new("own").with::<Own>("own.Gain"));
    let read = app::read(&folder.path().join("chain.yaml"), &LoadOptions::default(), &libraries);
    let read = read.unwrap_or_else(|refused| panic!("refused: {:?}", refused.findings));
    let t1 = now();
    let checked = app::check(read).unwrap_or_else(|refused| panic!("refused: {:?}", refused.findings));
    let t2 = now();
    let session = app::start(&checked, &clock).expect("an embedded platform");
    session.bring_up().unwrap_or_else(|not_up| panic!("{not_up:?}"));
    let t3 = now();
    let memory = resident().saturating_sub(before);
    let ended = session.take_down(false);
    let t4 = now();
    assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
    clock.shutdown();
    Row { n, load: t1 - t0, check: t2 - t1, up: t3 - t2, down: t4 - t3, memory }
}

fn us(d: Duration) -> f64 {
    d.as_secs_f64() * 1e6
}

/// Slope and intercept of the straight line with the least squared relative error.
#[allow(clippy::cast_precision_loss)]
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let w = |y: f64| 1.0 / (y * y);
    let (mut s, mut sx, mut sy, mut sxx, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (x, y) in points {
        let w = w(*y);
        s += w;
        sx += w * x;
        sy += w * y;
        sxx += w * x * x;
        sxy += w * x * y;
    }
    let slope = (s * sxy - sx * sy) / (s * sxx - sx * sx);
    (slope, (sy - slope * sx) / s)
}

fn main() {
    let sizes: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let sizes = if sizes.is_empty() { vec![10, 30, 100, 300, 1000, 3000, 10_000] } else { sizes };
    deploy(10, "standard.Gain"); // warms up: catalogues, code, memory
    for ty in ["standard.Gain", "own.Gain"] {
        table(ty, &sizes);
    }
}

#[allow(clippy::cast_precision_loss)]
fn table(ty: &str, sizes: &[usize]) {
    println!(
        "\n{ty}\n{:>7} {:>11} {:>11} {:>11} {:>11} {:>11} {:>9}",
        "N", "load µs", "check µs", "up µs", "all µs", "undo µs", "B each"
    );
    let mut all = Vec::new();
    let mut undo = Vec::new();
    for n in sizes.iter().copied() {
        // The best of several: what it costs, not what else the machine does.
        let runs = (3000 / n).clamp(3, 20);
        let best =
            (0..runs).map(|_| deploy(n, ty)).min_by_key(|row| row.load + row.check + row.up).expect("several runs");
        let sum = best.load + best.check + best.up;
        println!(
            "{:>7} {:>11.0} {:>11.0} {:>11.0} {:>11.0} {:>11.0} {:>9}",
            best.n,
            us(best.load),
            us(best.check),
            us(best.up),
            us(sum),
            us(best.down),
            best.memory / best.n
        );
        all.push((best.n as f64, us(sum)));
        undo.push((best.n as f64, us(best.down)));
    }
    for (name, points) in [("deploying", &all), ("undoing", &undo)] {
        let (slope, intercept) = line(points);
        println!("{name}: {slope:.2} µs a component with its connection, beside {intercept:.0} µs");
        let large: Vec<(f64, f64)> = points
            .iter()
            .filter(|(n, _)| *n >= 300.0)
            .map(|(n, t)| (n.ln(), (t - intercept.max(0.0)).max(1.0).ln()))
            .collect();
        if large.len() >= 2 {
            let (first, last) = (large[0], large[large.len() - 1]);
            println!("{name}: exponent {:.2} from N = {:.0}", (last.1 - first.1) / (last.0 - first.0), first.0.exp());
        }
    }
}
