//! A deployment in memory, of which one file is replaced.

use davit::diagnostics::SourceMap;
use davit::lang::{self, LoadOptions, Loaded, Sources};
use davit::model::Finding;
use std::path::Path;

pub const DEPLOYMENT: &str = "\
davit: 1
name: arm
platform: simulated
types:
  Gain:
    ports:
      u: { direction: in, type: float, unit: N }
      y: { direction: out, type: float, unit: N }
    properties:
      k: { type: float, default: 1.0, min: 0.0, max: 10.0, tunable: stopped }
    operations:
      reset: { args: [float], returns: bool, effect: none, moves: true, settled_by: { below: [self.y, 0.1] } }
activities:
  control: { period_ms: 1.0, priority: 80 }
configurations: [c.lua]
coordinator: k.lua
emits: [e_ready]
deploy: { event: e_start, up: operational, failed: [fault], within_s: 20 }
shutdown: { event: e_shutdown, down: idle, within_s: 20, rest: [up] }
limits: { stack: 32, step_timeout_s: 0.5 }
safety: [e_estop]
operator: [up, A.k]
faults: [{ step: \"start A\", how: fail, times: 2 }]
";

pub const CONFIGURATIONS: &str = "\
ConfiguratorConf {
  up = Configuration { create(\"A\", \"Gain\"), post_conf_state = { '_default:running' } },
}
";

pub const COORDINATOR: &str = "\
return state {
  idle = state {},
  operational = state { config = \"up\" },
  fault = state {},
  trans { src = \"initial\", tgt = \"idle\" },
  trans { src = \"idle\", tgt = \"operational\", events = { \"e_start\" } },
  trans { src = \"operational\", tgt = \"fault\", events = { \"up.failed\" } },
  trans { src = \"operational\", tgt = \"idle\", events = { \"e_shutdown\" } },
  trans { src = \"fault\", tgt = \"idle\", events = { \"e_shutdown\" } },
}
";

/// Loads the deployment with other texts for some of its files, and others beside them.
pub fn load(files: &[(&str, &str)], options: &LoadOptions) -> Loaded {
    let mut all = vec![("d.yaml", DEPLOYMENT), ("c.lua", CONFIGURATIONS), ("k.lua", COORDINATOR)];
    all.retain(|(name, _)| files.iter().all(|(other, _)| other != name));
    all.extend(files);
    lang::load_from(&Sources::memory(all), Path::new("d.yaml"), options)
}

/// Loads the deployment with one text instead of that of its configurations.
pub fn with_configurations(text: &str) -> Loaded {
    load(&[("c.lua", text)], &LoadOptions::default())
}

/// The findings as `code line:column`.
pub fn codes(loaded: &Loaded) -> Vec<String> {
    let places: Vec<_> = davit::diagnostics::to_json(&loaded.findings, &loaded.sources).as_array().unwrap().clone();
    places.iter().map(|f| format!("{} {}:{}", f["code"].as_str().unwrap(), f["line"], f["column"])).collect()
}

/// The findings as a terminal shows them.
pub fn shown(findings: &[Finding], sources: &SourceMap) -> String {
    davit::diagnostics::render(findings, sources, false)
}

/// Panics with the findings where there are any.
pub fn clean(loaded: &Loaded) {
    assert!(loaded.findings.is_empty(), "{}", shown(&loaded.findings, &loaded.sources));
    assert!(loaded.deployment.is_some() && !loaded.unreadable);
}
