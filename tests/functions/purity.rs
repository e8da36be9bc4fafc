//! What `check` and `graph` say of functions.

use super::support::{Model, read};
use davit::draw;
use davit::lang::{LoadOptions, Sources, load_from};
use davit::model::codes;
use std::path::Path;

#[test]
fn check_names_every_place_of_a_function() {
    let deployment = super::deployed::DEPLOYMENT;
    let from = Sources::memory([
        ("d.yaml", deployment),
        ("configurations.lua", super::deployed::CONFIGURATIONS),
        ("coordinator.lua", super::deployed::COORDINATOR),
    ]);
    let loaded = load_from(&from, Path::new("d.yaml"), &LoadOptions::default());
    let deployment = loaded.deployment.unwrap_or_else(|| panic!("{:?}", loaded.findings));
    let mut catalogue = davit::model::Catalogue::default();
    for ty in &deployment.types {
        catalogue.insert(ty.clone());
    }
    let report = davit::check::run(deployment, &catalogue);
    let finding = report.findings.iter().find(|f| f.code == codes::COORD_NOT_PURE).expect("said");
    assert!(finding.message.contains("2 states and 2 transitions"), "{}", finding.message);
    let labels: Vec<&str> = finding.labels.iter().map(|label| label.text.as_str()).collect();
    assert!(labels.iter().any(|l| l.starts_with("`root.operational`: doo")), "{labels:?}");
    assert!(
        labels.iter().any(|l| l.contains("`idle` → `starting`") && l.contains("guard") && l.contains("taken")),
        "{labels:?}"
    );
    assert!(labels.iter().all(|l| !l.contains("stopping")), "pure places are not named: {labels:?}");
}

#[test]
fn graph_marks_functions() {
    let text = "return rfsm.state { a = rfsm.state { doo = function() end }, b = rfsm.state {}, rfsm.trans { src='initial', tgt='a' },
        rfsm.trans { src='a', tgt='b', events={ function() end }, guard=function() end, effect=function() end } }";
    let chart = read(&[("model.lua", text)], &[]).coordinator.expect("a chart");
    let picture = draw::coordinator("k", &chart, &[]);
    assert!(picture.title.contains("functions are not verified"), "{}", picture.title);
    assert!(picture.nodes.iter().any(|node| node.lines.contains(&"doo / function".to_owned())));
    assert!(picture.edges.iter().any(|edge| edge.label.iter().any(|l| l.contains("[predicate] [guard] / function"))));
}

/// Plugins add functions to a model that has none: that is told of the plugin, not of the model.
#[test]
fn functions_of_plugins_are_not_the_models_own() {
    let said = |coordinator: &str| {
        let from = Sources::memory([
            ("d.yaml", super::deployed::DEPLOYMENT),
            ("configurations.lua", super::deployed::CONFIGURATIONS),
            ("coordinator.lua", coordinator),
        ]);
        let loaded = load_from(&from, Path::new("d.yaml"), &LoadOptions::default());
        let deployment = loaded.deployment.unwrap_or_else(|| panic!("{:?}", loaded.findings));
        let mut catalogue = davit::model::Catalogue::default();
        for ty in &deployment.types {
            catalogue.insert(ty.clone());
        }
        let report = davit::check::run(deployment, &catalogue);
        let finding = report.findings.into_iter().find(|f| f.code == codes::COORD_NOT_PURE);
        finding.map(|f| (f.message, f.labels.into_iter().map(|label| label.text).collect::<Vec<_>>().join("; ")))
    };
    let model = |plugin: &str, own: &str, events: &str| {
        format!(
            "{plugin}
            return rfsm.state {{
              idle = rfsm.state {{ {own} }}, operational = rfsm.state {{}},
              rfsm.trans {{ src = 'initial', tgt = 'idle' }},
              rfsm.trans {{ src = 'idle', tgt = 'operational', events = {{ {events} }} }},
              rfsm.trans {{ src = 'operational', tgt = 'idle', events = {{ 'e_shutdown' }} }},
            }}"
        )
    };
    assert_eq!(said(&model("", "", "'e_start'")), None);
    let (message, labels) = said(&model("require 'rfsm_emem'", "", "'e_start'")).expect("said");
    assert!(message.contains("no functions of its own, but those of the plugin `emem`"), "{message}");
    assert!(labels.contains("added by the plugin `emem`, here and in another place"), "{labels}");
    let (message, labels) = said(&model("require 'rfsm_await'", "", "'await(e_start, e_more)'")).expect("said");
    assert!(message.contains("no functions of its own, but those of the plugin `await`"), "{message}");
    assert!(labels.contains("added by the plugin `await`, here and in another place"), "{labels}");
    let own = "exit = function() end";
    let (message, labels) = said(&model("require 'rfsm_emem'", own, "'e_start'")).expect("said");
    assert!(message.contains("functions in 1 state and 0 transitions, beside those of the plugin `emem`"), "{message}");
    assert!(labels.contains("`root.idle`: exit") && labels.contains("added by the plugin `emem`"), "{labels}");
}

#[test]
fn a_pure_file_that_gets_a_function_need_not_be_rewritten() {
    let text = |body: &str| {
        format!(
            "return state {{ a = state {{ {body} }}, j = conn {{}}, trans {{ src = 'initial', tgt = 'j' }}, trans {{ src = 'j', tgt = 'a' }} }}"
        )
    };
    let pure = read(&[("model.lua", &text(""))], &[]);
    assert!(pure.coordinator.is_some(), "{:?}", pure.findings);
    let model = Model::of(&[("model.lua", &text("entry = function() print('in') end"))], &[]);
    assert_eq!(model.notes(&["run"]), ["in"]);
}

/// Functions that are called beside the chart: of the root, of step hooks, of the plugin `preview`.
#[test]
fn functions_beside_the_chart_are_told() {
    let said = |coordinator: &str| {
        let from = Sources::memory([
            ("d.yaml", super::deployed::DEPLOYMENT),
            ("configurations.lua", super::deployed::CONFIGURATIONS),
            ("coordinator.lua", coordinator),
        ]);
        let loaded = load_from(&from, Path::new("d.yaml"), &LoadOptions::default());
        let deployment = loaded.deployment.unwrap_or_else(|| panic!("{:?}", loaded.findings));
        let mut catalogue = davit::model::Catalogue::default();
        deployment.types.iter().for_each(|ty| _ = catalogue.insert(ty.clone()));
        let report = davit::check::run(deployment, &catalogue);
        let finding = report.findings.into_iter().find(|f| f.code == codes::COORD_NOT_PURE);
        finding.map(|f| (f.message, f.labels.into_iter().map(|label| label.text).collect::<Vec<_>>().join("; ")))
    };
    let model = |before: &str, root: &str, state: &str, transition: &str| {
        format!(
            "{before} return rfsm.state {{ {root}
              idle = rfsm.state {{}}, operational = rfsm.state {{ {state} }},
              rfsm.trans {{ src = 'initial', tgt = 'idle' }},
              rfsm.trans {{ src = 'idle', tgt = 'operational', events = {{ 'e_start' }}, {transition} }},
              rfsm.trans {{ src = 'operational', tgt = 'idle', events = {{ 'e_stop' }} }} }}"
        )
    };
    let (message, labels) =
        said(&model("", "getevents = function() return {} end, idle_hook = function() end,", "", "")).expect("said");
    assert!(message.contains("functions in 1 state and 0 transitions"), "{message}");
    assert!(labels.contains("`root`: getevents, idle_hook — which events come"), "{labels}");
    let (_, labels) = said(&model("", "dbg = function() end, err = function() end,", "", "")).expect("said");
    assert!(labels.contains("`root`: dbg, err"), "{labels}");
    let (message, labels) = said(&model(
        "require 'rfsm.await' require 'rfsm.preview'",
        "",
        "prepare = function() end",
        "likely = function() end",
    ))
    .expect("said");
    assert!(
        message.contains("functions in 1 state and 1 transition, beside those of the plugin `preview`"),
        "{message}"
    );
    assert!(
        labels.contains("`root.operational`: prepare") && labels.contains("`idle` → `operational`: likely"),
        "{labels}"
    );
    assert_eq!(said(&model("require 'rfsm.checkevents'", "", "", "")), None, "it only tells");
    let hooked =
        "local m = {} require('rfsm').preproc[1] = function(fsm) rfsm.post_step_hook_add(fsm, function() end) end";
    let (_, labels) = said(&model(hooked, "", "", "")).expect("said");
    assert!(labels.contains("`root`: post_step_hook"), "{labels}");
}
