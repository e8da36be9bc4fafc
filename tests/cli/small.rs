//! Scripts on a deployment of two components, which a test says the rest of.

use crate::demo::{Demo, Ran};

const COORDINATOR: &str = r#"return state {
  idle = state {}, building = state { entry = "base" }, up = state {}, removing = state { entry = "base.undo" }, stuck = state {},
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "building", events = { "e_start" } },
  trans { src = "building", tgt = "up", events = { "base.ok" } },
  trans { src = "building", tgt = "removing", events = { "base.failed", "base.broken", "e_stop" } },
  trans { src = "up", tgt = "removing", events = { "e_stop" } },
  trans { src = "removing", tgt = "idle", events = { "base.undone" } },
  trans { src = "removing", tgt = "stuck", events = { "base.undo.failed", "base.undo.broken" } },
  trans { src = "stuck", tgt = "removing", events = { "e_stop" } },
}
"#;

/// Runs a script in simulated time. Its files are `deployment.yaml`, which names the others, `conf.lua` with a configuration
/// `base`, and a coordinator that brings that up and takes it back.
pub fn run(deployment: &str, configurations: &str, script: &str) -> Ran {
    let demo = Demo::new();
    demo.write("deployment.yaml", deployment);
    demo.write("conf.lua", configurations);
    demo.write("coordinator.lua", COORDINATOR);
    demo.write("story.lua", script);
    demo.run(&["run", "story.lua", "--clock", "simulated"])
}
