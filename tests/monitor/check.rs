//! Monitors against the deployment: a mistake in every name and event has its code, its place and its help.

use davit::check;
use davit::diagnostics::{render, to_json};
use davit::lang::{LoadOptions, Sources, load_from};
use davit::model::Catalogue;
use std::path::Path;

const DEPLOYMENT: &str = "\
davit: 1
name: arm
platform: simulated
types:
  Arm:
    ports:
      force: { direction: out, type: float }
      state: { direction: out, type: \"{qd: float[3], ok: bool, mode: string}\" }
      events: { direction: out, type: event }
activities:
  control: { period_ms: 1.0 }
configurations: [c.lua]
coordinator: k.lua
monitors: [m.lua]
deploy: { event: e_start, up: up, within_s: 20 }
shutdown: { event: e_shutdown, down: idle, within_s: 20 }
";

const CONFIGURATIONS: &str = "\
ConfiguratorConf {
  build = Configuration { create(\"Arm\", \"Arm\", { activity = \"control\" }), create(\"M\", \"davit.Monitors\"), post_conf_state = { '_default:running' } },
}
";

const COORDINATOR: &str = "\
return state {
  idle = state {},
  up = state { config = \"build\" },
  trans { src = \"initial\", tgt = \"idle\" },
  trans { src = \"idle\", tgt = \"up\", events = { \"e_start\" } },
  trans { src = \"up\", tgt = \"idle\", events = { \"e_shutdown\", \"build.failed\", \"build.broken\", \"e_high\", \"e_low\" } },
}
";

const MONITORS: &str = "\
Monitors {
  high = monitor {
    when = any { above(\"Arm.force\", 2.0), above(\"Arm.state.qd[2]\", 1.0), is_true(\"Arm.state.ok\"), faulted(\"Arm\"),
                 silent(\"Arm.events\", 2), above(activity(\"control\", \"overruns\"), 3) },
    event = \"e_high\", cleared = \"e_low\",
  },
}
";

/// The findings as `code line:column`, and as a terminal shows them.
fn findings(monitors: &str, coordinator: &str) -> (Vec<String>, String) {
    findings_with(CONFIGURATIONS, monitors, coordinator)
}

fn findings_with(configurations: &str, monitors: &str, coordinator: &str) -> (Vec<String>, String) {
    let files = [("d.yaml", DEPLOYMENT), ("c.lua", configurations), ("k.lua", coordinator), ("m.lua", monitors)];
    let loaded = load_from(&Sources::memory(files), Path::new("d.yaml"), &LoadOptions::default());
    let shown = render(&loaded.findings, &loaded.sources, false);
    let deployment = loaded.deployment.unwrap_or_else(|| panic!("{shown}"));
    let mut catalogue = Catalogue::new();
    for ty in &deployment.types {
        catalogue.insert(ty.clone());
    }
    catalogue.extend(&davit::libraries::monitors::library(&deployment.monitors).catalogue());
    let report = check::run(deployment, &catalogue);
    // The coordinator of the example has findings of its own, which are no business of monitors; and that the simulated platform evaluates
    // none is a note.
    let own = |code: &str| ["monitor::", "conf::unknown", "coord::near"].iter().any(|start| code.starts_with(start));
    let codes = to_json(&report.findings, &loaded.sources);
    let codes =
        codes.as_array().unwrap().iter().filter(|f| own(f["code"].as_str().unwrap()) && f["severity"] != "info");
    let codes = codes.map(|f| format!("{} {}:{}", f["code"].as_str().unwrap(), f["line"], f["column"])).collect();
    (codes, render(&report.findings, &loaded.sources, false))
}

#[test]
fn a_sound_deployment_has_no_findings() {
    let (codes, shown) = findings(MONITORS, COORDINATOR);
    assert!(codes.is_empty(), "{shown}");
    assert!(shown.contains("the simulated platform evaluates no monitors, and `high` raises nothing there"), "{shown}");
}

#[test]
fn mistakes() {
    let mut wrong = Vec::new();
    for (from, to, expected, hint) in [
        ("\"Arm.force\"", "\"Amr.force\"", "conf::unknown_component 3:25", "`Arm`"),
        ("\"Arm.force\"", "\"Arm.forec\"", "conf::unknown_port 3:29", "`force`"),
        ("\"Arm.force\"", "\"Arm.force[0]\"", "monitor::no_such_part 3:34", "`Arm.force` alone"),
        ("\"Arm.force\"", "\"Arm.events\"", "monitor::not_a_number 3:24", "`silent` take any port"),
        ("Arm.state.qd[2]", "Arm.state.qd[3]", "monitor::no_such_part 3:50", "from 0"),
        ("Arm.state.qd[2]", "Arm.state.qq[2]", "monitor::no_such_part 3:50", "`qd`"),
        ("Arm.state.qd[2]", "Arm.state.qd", "monitor::not_a_number 3:49", "`Arm.state.qd[0]`"),
        ("Arm.state.qd[2]", "Arm.state", "monitor::not_a_number 3:49", "`Arm.state.qd`"),
        ("Arm.state.qd[2]", "Arm.state.mode", "monitor::not_a_number 3:49", "neither a number nor a bool"),
        ("Arm.state.ok", "Arm.state.k", "monitor::no_such_part 3:83", "field"),
        ("faulted(\"Arm\")", "faulted(\"Army\")", "conf::unknown_component 3:107", "`Arm`"),
        ("\"Arm.events\"", "\"Arm.event\"", "conf::unknown_port 4:30", "`events`"),
        ("\"control\"", "\"contrl\"", "conf::unknown_activity 4:58", "`control`"),
        ("\"e_high\"", "\"build.ok\"", "monitor::event_taken 5:13", "another name"),
        ("\"e_high\"", "\"e_done@root.up\"", "monitor::event_taken 5:13", "another name"),
        ("\"e_high\"", "\"e_hihg\"", "monitor::unheard 5:13", "`e_high`"),
    ] {
        assert!(MONITORS.contains(from));
        let (codes, shown) = findings(&MONITORS.replacen(from, to, 1), COORDINATOR);
        let others = ["coord::near_event"];
        let own: Vec<&String> = codes.iter().filter(|c| !others.iter().any(|o| c.starts_with(o))).collect();
        if own != [expected] || !shown.contains(hint) {
            wrong.push(format!("{from} -> {to}\nexpected {expected} with `{hint}`, found {codes:?}\n{shown}"));
        }
    }
    assert!(wrong.is_empty(), "{} answers differ:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn monitors_that_nothing_runs() {
    let without = CONFIGURATIONS.replace(", create(\"M\", \"davit.Monitors\")", "");
    let (codes, shown) = findings_with(&without, MONITORS, COORDINATOR);
    assert_eq!(codes, ["monitor::not_run 14:1"], "{shown}");
}

/// What a monitor raises is known: an event that is nearly one of them is probably meant to be it.
#[test]
fn the_coordinator_knows_the_events_of_monitors() {
    let near = |codes: &[String]| codes.iter().any(|c| c.starts_with("coord::near_event"));
    let (codes, shown) = findings(MONITORS, &COORDINATOR.replace("\"e_low\"", "\"e_low\", \"e_lwo\""));
    assert!(near(&codes) && shown.contains("did you mean `e_low`"), "{shown}");
    // Where nobody hears what the monitor raises, that is told, with what is waited for; not the other way round as well.
    let (codes, shown) = findings(MONITORS, &COORDINATOR.replace("e_low", "e_lwo"));
    assert!(!near(&codes) && shown.contains("did you mean `e_lwo`"), "{shown}");
    assert!(codes.iter().any(|c| c.starts_with("monitor::unheard")), "{shown}");
}
