//! What is wrong is pointed at: the word itself, in whichever file and language it stands, said once, with what was meant.

use super::composed;
use davit::check;
use davit::lang::{self, LoadOptions, Loaded, Sources};
use serde_json::Value;
use std::path::Path;

const LIFT: &str = "davit: 1
name: lift
platform: simulated
types:
  Motor:
    ports: { height: { direction: out, type: float } }
    properties:
      current: { type: float, default: 1.0, min: 0.0, max: 5.0 }
      bus: { type: string, default: can0, tunable: unconfigured }
    operations:
      raise: { effect: { undo: lower } }
      lower: { effect: { undo: raise } }
exports:
  ports: { height: Motor.height }
  from: e_built
emits: [e_built]
configurations: [lift_conf.yaml]
coordinator: lift_coord.yaml
deploy: { event: e_start, up: working, within_s: 5 }
shutdown: { event: e_stop, down: idle, within_s: 5 }
simulated:
  reactions:
    - { after: start Motor, delay_s: 0.2, raise: e_ready, component: Motor }
";
const CONFIGURATIONS: &str = "configurations:
  make:
    changes:
      - create: { component: Motor, type: Motor, properties: { bus: can0 } }
  run: { post_conf_state: [\"Motor:running\", \"_default:running\"] }
  up: { changes: [{ operation_call: { operation: Motor.raise } }] }
  fast: { changes: [{ property_set: { property: Motor.current, value: 4.0 } }] }
";
const COORDINATOR: &str = "coordinator:
  states:
    idle: {}
    making: { entry: [make, e_built] }
    starting: { entry: run }
    working: { entry: [up, fast] }
    leaving: { entry: run.undo }
    removing: { entry: make.undo }
  transitions:
    - { src: initial, tgt: idle }
    - { src: idle, tgt: making, events: [e_start] }
    - { src: making, tgt: starting, events: [make.ok] }
    - { src: starting, tgt: working, events: [e_ready] }
    - { src: working, tgt: leaving, events: [e_stop] }
    - { src: leaving, tgt: removing, events: [run.undone] }
    - { src: removing, tgt: idle, events: [make.undone] }
";

/// What reading finds, or, where it finds nothing, what `check` finds: as JSON has it.
fn findings(loaded: Loaded) -> Vec<Value> {
    let sources = loaded.sources;
    let found = match loaded.deployment {
        Some(deployment) if loaded.findings.is_empty() => {
            let catalogue = composed::catalogue(&deployment);
            check::run(deployment, &catalogue).findings
        }
        _ => loaded.findings,
    };
    davit::diagnostics::to_json(&found, &sources).as_array().unwrap().clone()
}

/// The text of a file from the place of a finding on.
fn pointed<'t>(finding: &Value, text: &'t str) -> &'t str {
    let at = |key: &str| usize::try_from(finding[key].as_u64().unwrap_or(1)).unwrap() - 1;
    let line = text.lines().nth(at("line")).unwrap_or_default();
    let start = line.char_indices().nth(at("column")).map_or(line.len(), |(start, _)| start);
    &line[start..]
}

/// One mistake: the file, what stands there, what is written instead, the code, what is pointed at, a part of the help.
type Row = (&'static str, &'static str, &'static str, &'static str, &'static str, &'static str);

#[test]
fn in_yaml_it_is_the_word_itself() {
    let rows: &[Row] = &[
        ("lift.yaml", "undo: lower", "undo: lwoer", "type::unknown_operation", "lwoer }", "`lower`"),
        ("lift.yaml", "component: Motor", "component: Moter", "conf::unknown_component", "Moter }", "`Motor`"),
        ("lift.yaml", "raise: e_ready", "raise: e_redy", "simulated::unheard", "e_redy,", "`e_ready`"),
        ("lift.yaml", "Motor.height", "Motor.hieght", "compose::unknown", "hieght }", "`height`"),
        ("lift.yaml", "from: e_built", "from: e_build", "compose::unknown", "e_build", "`e_built`"),
        ("lift.yaml", "event: e_start", "event: e_strat", "deploy::event_unheard", "e_strat,", "`e_start`"),
        ("lift.yaml", "up: working", "up: wroking", "deploy::unknown_state", "wroking,", "`working`"),
        ("lift_conf.yaml", "type: Motor", "type: Moter", "conf::unknown_type", "Moter,", "`Motor`"),
        ("lift_conf.yaml", "bus: can0", "buss: can0", "conf::unknown_property", "buss:", "`bus`"),
        ("lift_conf.yaml", "bus: can0", "bus: 1", "conf::bad_value", "bus: 1", "string"),
        ("lift_conf.yaml", "Motor.raise", "Motor.rais", "conf::unknown_operation", "rais }", "`raise`"),
        ("lift_conf.yaml", "Motor.current", "Motor.curent", "conf::unknown_property", "curent,", "`current`"),
        ("lift_conf.yaml", "value: 4.0", "value: 40", "conf::bad_value", "Motor.current,", "float"),
        ("lift_conf.yaml", "_default:", "_defualt:", "conf::unknown_component", "_defualt:", "`_default`"),
        ("lift_coord.yaml", "[make, e", "[mkae, e", "coord::unknown_request", "mkae,", "`make`"),
        ("lift_coord.yaml", "e_built]", "e_biult]", "coord::unknown_request", "e_biult]", "`e_built`"),
        ("lift_coord.yaml", "entry: run.undo", "entry: run.udno", "coord::unknown_request", "run.udno", "`run.undo`"),
        ("lift_coord.yaml", "entry: run.undo", "entry: run.undoo", "coord::unknown_request", "run.undoo", "`run.undo`"),
        ("lift_coord.yaml", "entry: run.undo", "entry: run_undo", "coord::unknown_request", "run_undo", "`run.undo`"),
        (
            "lift_conf.yaml",
            "operation: Motor.raise",
            "operation: Motor.raise, args: [1]",
            "conf::bad_arguments",
            "Motor.raise",
            "`operation_call: { operation: Motor.raise }`",
        ),
        ("lift_coord.yaml", "[make.ok]", "[mkae.ok]", "coord::unknown_answer", "mkae.ok]", "`make.ok`"),
    ];
    let mut wrong = Vec::new();
    for (file, from, to, code, wanted, hint) in rows {
        let texts = [("lift.yaml", LIFT), ("lift_conf.yaml", CONFIGURATIONS), ("lift_coord.yaml", COORDINATOR)];
        let mistaken = |(name, text): (&'static str, &str)| {
            assert!(name != *file || text.contains(from), "{file} has no `{from}`");
            (name, if name == *file { text.replacen(from, to, 1) } else { text.to_owned() })
        };
        let texts = texts.map(mistaken);
        let found =
            findings(lang::load_from(&Sources::memory(texts.clone()), Path::new("lift.yaml"), &LoadOptions::default()));
        let of: Vec<&Value> = found.iter().filter(|finding| finding["code"] == *code).collect();
        let text =
            |finding: &Value| texts.iter().find(|(name, _)| finding["file"] == *name).map(|(_, text)| text.clone());
        let good = matches!(of[..], [one] if one["file"] == *file
            && text(one).is_some_and(|text| pointed(one, &text).starts_with(wanted))
            && one["help"].as_str().is_some_and(|help| help.contains(hint) && help.matches("did you mean").count() < 2)
            && !one["message"].as_str().is_some_and(|message| message.contains("did you mean")));
        // What was meant is not told the other way round as well.
        let twice = found
            .iter()
            .any(|finding| ["coord::near_event", "coord::never_emitted"].iter().any(|code| finding["code"] == *code));
        if !good || twice {
            wrong.push(format!("{to}: wanted {code} at `{wanted}` with {hint}, found {found:#?}"));
        }
    }
    assert!(wrong.is_empty(), "{}:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn in_lua_a_piece_of_a_longer_name_is_not_taken_for_the_word() {
    let pose = "connect('left.pose', 'right.ref')";
    let rows: &[Row] = &[
        (
            "pair_conf.lua",
            pose,
            "connect('right_most.pose', 'right.rfe')",
            "compose::not_exported",
            "'right.rfe'",
            "`ref`",
        ),
        ("pair_conf.lua", pose, "connect('left.pose', 'right.pose')", "conf::not_an_in_port", "right.pose'", ""),
        ("pair.lua", "events = { 'left/up' }", "events = { 'lfet/up' }", "compose::unknown", "'lfet/up'", "`left`"),
    ];
    for (file, from, to, code, wanted, hint) in rows {
        let sources = composed::files(&[(file, from, to)]);
        let Sources::Memory(texts) = &sources else { panic!("they are in memory") };
        let text = String::from_utf8(texts[Path::new(file)].clone()).unwrap();
        let found = findings(composed::load(&sources, "pair.yaml", &[]));
        let one = found.iter().find(|finding| finding["code"] == *code && finding["file"] == *file);
        let one = one.unwrap_or_else(|| panic!("{to}: {found:#?}"));
        assert!(
            pointed(one, &text).starts_with(wanted) && one["help"].as_str().unwrap().contains(hint),
            "{to}: {one:#}"
        );
    }
}
