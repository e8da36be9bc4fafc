//! A safety event of a deployment that is given on to its subsystems: what it has done by itself it does not do once more.

use crate::names::event;
use crate::stopping::{Small, force};
use davit::session::Stage;
use std::sync::Arc;

/// With the small one of the stages inside.
const AROUND: &str = "davit: 1
name: around
platform: simulated
types: {}
subsystems: { in: { deployment: d.yaml } }
configurations: [none.yaml]
coordinator: around.lua
safety: [e_estop]
deploy:   { event: e_start, up: up, within_s: 30 }
shutdown: { event: e_stop, down: idle, within_s: 5 }
";

const COORDINATOR: &str = r#"return state {
  idle = state {}, raising = state { entry = "in/e_start" }, up = state {}, lowering = state { entry = "in/e_stop" },
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "raising", events = { "e_start" } },
  trans { src = "raising", tgt = "up", events = { "in/up" } },
  trans { src = "raising", tgt = "lowering", events = { "e_stop" } },
  trans { src = "up", tgt = "lowering", events = { "e_stop" } },
  trans { src = "lowering", tgt = "idle", events = { "in/down", "in/e_stop.ignored" } },
}
"#;

/// It acts while force brings to rest what is inside, and people let go: once.
#[test]
fn an_emergency_that_has_acted_in_a_subsystem_holds_force_up_once() {
    let more = [("around.yaml", AROUND), ("around.lua", COORDINATOR), ("none.yaml", "configurations: {}\n")];
    let around = Small::of("lowering", &more, "around.yaml", Vec::new(), |platform| Arc::new(platform));
    around.session.bring_up().unwrap_or_else(|not| panic!("{not:#?}"));
    around.after(1.0, |session| session.raise(event("e_estop"), "test"));
    around.after(30.0, force);
    around.after(90.0, force);
    let began = around.clock.now();
    let ended = around.session.take_down(true);
    let took = around.clock.now().since(began).as_secs_f64();
    assert!(around.heard("in/calm.ok"), "{:?}", around.heard.lock().unwrap());
    assert!((30.0..33.0).contains(&took) && ended.stage == Stage::Forced, "{took}: {ended:?}");
    around.is_empty();
}
