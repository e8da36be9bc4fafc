//! What `check` and `graph` say of functions.

use super::support::read;
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
