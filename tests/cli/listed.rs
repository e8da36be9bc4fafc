//! What an operator may apply: what the deployment lists, what is safe, and the rest by force.

use crate::demo::{Demo, Ran};
use crate::small;

const DEPLOYMENT: &str = "davit: 1
name: small
platform: simulated
types:
  T:
    properties: { k: { type: float, default: 1.0 }, g: { type: float, default: 1.0 } }
    operations: { home: { effect: none, moves: true } }
configurations: [conf.lua]
coordinator: coordinator.lua
operator: [kick, home]
deploy:   { event: e_start, up: up, within_s: 5 }
shutdown: { event: e_stop, down: idle, within_s: 5 }
";

const CONFIGURATIONS: &str = r#"ConfiguratorConf {
  base = Configuration { create("a", "T"), create("b", "T"), post_conf_state = { "_default:running" } },
  calm = Configuration { safe = true, property_set("a.g", 0.0) },
  home = Configuration { operation_call("b.home") },
  kick = Configuration { property_set("a.k", 5.0) },
  mean = Configuration { property_set("b.k", 6.0) },
}
"#;

fn run(script: &str) -> Ran {
    small::run(DEPLOYMENT, CONFIGURATIONS, &format!("deploy('deployment.yaml')\n{script}"))
}

/// However often it was applied before: a plan that is kept is no way around.
#[test]
fn an_operator_applies_what_is_listed_or_safe_and_the_rest_by_force() {
    let ran = run("apply('kick') wait_answer('kick.ok', 1) undo() wait_answer('undo.done', 1)
        for _ = 1, 3 do
          apply('mean') wait_answer('mean.failed', 1) assert(property('b.k') == 1.0)
          apply('mean', {force = true}) wait_answer('mean.ok', 1) assert(property('b.k') == 6.0)
          undo() wait_answer('undo.done', 1) assert(property('b.k') == 1.0)
        end
        apply('calm') wait_answer('calm.ok', 1)
        -- Listed, and yet it moves while something safe is in force.
        apply('home') wait_answer('home.failed', 1) apply('home', {force = true}) wait_answer('home.ok', 1)
        undo() wait_answer('undo.done', 1) undo() wait_answer('undo.done', 1)");
    let told = ran.out + &ran.err;
    assert_eq!(ran.code, 0, "{told}");
    assert!(told.contains("`operator:` does not list `mean`") && told.contains("{force = true}"), "{told}");
    assert!(told.contains("moves, and the safe configuration `calm` is in force"), "{told}");
    let explained = Demo::new().run(&["explain", "run::not_listed"]);
    assert!(explained.code == 0 && explained.out.contains("`operator:`"), "{}", explained.out);
}
