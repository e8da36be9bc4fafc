//! A small deployment with something of everything, in a directory of its own, and the program run on it.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

pub const DEPLOYMENT: &str = r#"davit: 1
name: demo
platform: simulated
types:
  Source:
    ports:
      y: { direction: out, type: float, unit: N }
      n: { direction: out, type: int }
      queue: { direction: in, type: float, buffered: true }
    properties:
      k: { type: float, default: 1.0, min: 0.0, max: 10.0 }
      mode: { type: int, default: 0, tunable: stopped }
      name: { type: string }
    operations:
      reset: { args: [float], effect: none }
      burn: { args: [] }
  Sink:
    ports:
      u: { direction: in, type: float, unit: N }
      w: { direction: in, type: float, unit: m }
      flag: { direction: in, type: bool }
    properties:
      limits: { type: "float[2]", default: [0.0, 1.0] }
activities:
  control: { period_ms: 1.0, priority: 50 }
configurations: [configurations.lua]
coordinator: coordinator.lua
emits: [e_ready]
deploy:   { event: e_start,    up: operational, failed: [failed], within_s: 5 }
shutdown: { event: e_shutdown, down: idle,      within_s: 5 }
"#;

pub const CONFIGURATIONS: &str = r#"ConfiguratorConf {
  create_all = Configuration {
    create("source", "Source", { activity = "control", properties = { name = "first", k = 2.0 } }),
    create("sink", "Sink", { activity = "control" }),
  },
  connect_all = Configuration {
    connect("source.y", "sink.u"),
  },
  start_all = Configuration {
    post_conf_state = { "sink:running", "source:running" },
  },
  slow = Configuration { group = "speed",
    property_set("source.k", 1.0),
    port_write("sink.flag", false),
  },
  fast = Configuration { group = "speed",
    property_set("source.k", 9),
    operation_call("source.reset", 0.5),
    port_write("sink.flag", true),
  },
  rename = Configuration {
    property_set("source.name", "second"),
  },
}
"#;

pub const COORDINATOR: &str = r#"return state {
  idle = state {},
  deploying = state {
    creating = state { entry = "create_all" },
    wiring   = state { entry = "connect_all" },
    starting = state { entry = "start_all" },
    trans { src = "initial",  tgt = "creating" },
    trans { src = "creating", tgt = "wiring",   events = { "create_all.ok" } },
    trans { src = "wiring",   tgt = "starting", events = { "connect_all.ok" } },
  },
  operational = state { entry = "e_ready",
    slow_mode = state { config = "slow" },
    fast_mode = state { config = "fast" },
    trans { src = "initial",   tgt = "slow_mode" },
    trans { src = "slow_mode", tgt = "fast_mode", events = { "e_fast", "slow.failed", "slow.broken" } },
    trans { src = "fast_mode", tgt = "slow_mode", events = { "e_slow", "fast.failed", "fast.broken" } },
  },
  failed = state {},
  leaving = state {
    stopping = state { entry = "start_all.undo" },
    unwiring = state { entry = "connect_all.undo" },
    removing = state { entry = "create_all.undo" },
    trans { src = "initial",  tgt = "stopping" },
    trans { src = "stopping", tgt = "unwiring", events = { "start_all.undone" } },
    trans { src = "unwiring", tgt = "removing", events = { "connect_all.undone" } },
  },
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "deploying", events = { "e_start" } },
  trans { src = "deploying.starting", tgt = "operational", events = { "start_all.ok" } },
  trans { src = "deploying", tgt = "failed",
          events = { "create_all.failed", "connect_all.failed", "start_all.failed",
                     "create_all.broken", "connect_all.broken", "start_all.broken" } },
  trans { src = "deploying", tgt = "leaving", events = { "e_shutdown" } },
  trans { src = "operational", tgt = "leaving", events = { "e_shutdown" } },
  trans { src = "failed", tgt = "leaving", events = { "e_shutdown" } },
  trans { src = "leaving", tgt = "failed",
          events = { "start_all.undo.failed", "connect_all.undo.failed", "create_all.undo.failed",
                     "start_all.undo.broken", "connect_all.undo.broken", "create_all.undo.broken" } },
  trans { src = "leaving.removing", tgt = "idle", events = { "create_all.undone" } },
}
"#;

/// A directory with the demo's files.
pub struct Demo {
    dir: TempDir,
}

/// What a run of the program gave.
pub struct Ran {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl Ran {
    fn from(output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("the program prints UTF-8");
        let ran = Self {
            code: output.status.code().expect("it ends by itself"),
            out: text(output.stdout),
            err: text(output.stderr),
        };
        assert!(!ran.err.contains("panicked"), "{}", ran.err);
        ran
    }

    /// What was printed as JSON.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|e| panic!("{e}:\n{}\n{}", self.out, self.err))
    }
}

/// The program, in a directory.
pub fn program(dir: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_davit"));
    command
        .current_dir(dir)
        .args(args)
        .env_remove("NO_COLOR")
        .env("XDG_RUNTIME_DIR", dir)
        .env("XDG_STATE_HOME", dir.join("state"));
    command
}

/// The program run in the project's own directory.
pub fn at_home(args: &[&str]) -> Ran {
    Ran::from(program(Path::new(env!("CARGO_MANIFEST_DIR")), args).output().expect("the program starts"))
}

/// What starts the tests may have had them ignore signals (a job of a script ignores SIGINT), and programs that they start would.
fn hear_signals() {
    for signal in [libc::SIGINT, libc::SIGQUIT, libc::SIGHUP, libc::SIGTERM] {
        // SAFETY: the default disposition runs no code of ours.
        unsafe { libc::signal(signal, libc::SIG_DFL) };
    }
}

impl Demo {
    /// The demo as it stands above.
    pub fn new() -> Self {
        hear_signals();
        let demo = Self { dir: TempDir::new().expect("a directory") };
        demo.write("deployment.yaml", DEPLOYMENT);
        demo.write("configurations.lua", CONFIGURATIONS);
        demo.write("coordinator.lua", COORDINATOR);
        demo
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("a written file");
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).expect("a file")
    }

    /// Puts `to` in the place of the first `from` of a file; answers the line it stands on.
    pub fn replace(&self, name: &str, from: &str, to: &str) -> usize {
        let text = self.read(name);
        let at = text.find(from).unwrap_or_else(|| panic!("`{from}` is not in {name}"));
        self.write(name, &text.replacen(from, to, 1));
        text[..at].matches('\n').count() + 1
    }

    pub fn run(&self, args: &[&str]) -> Ran {
        Ran::from(program(self.dir.path(), args).output().expect("the program starts"))
    }

    pub fn command(&self, args: &[&str]) -> Command {
        program(self.dir.path(), args)
    }
}
