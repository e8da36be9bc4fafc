//! The paper's two listings, as files, unchanged.

use crate::helpers::{clean, codes, load, shown};
use davit::lang::{self, LoadOptions, Sources};
use davit::model::{ChangeKind, Target, Value, Wanted};
use std::path::Path;

const LISTING_1: &str = include_str!("../paper/listing_1_sample_configuration.lua");
const LISTING_2: &str = include_str!("../paper/listing_2_youbot_sample.lua");

fn options() -> LoadOptions {
    LoadOptions { set: vec![("arg1".into(), "1".into()), ("arg2".into(), "two".into())], ..LoadOptions::default() }
}

#[test]
fn listing_1_sample_configuration() {
    let files = Sources::memory([("sample.lua", LISTING_1)]);
    let loaded = lang::load_configurations(&files, Path::new("sample.lua"), &options());
    assert!(loaded.findings.is_empty(), "{}", shown(&loaded.findings, &loaded.sources));
    let [c] = &loaded.configurations[..] else { panic!("one configuration") };
    assert_eq!(c.id.as_str(), "sample", "a configuration alone takes the file's name");
    let pre: Vec<String> = c.pre.iter().map(|e| format!("{}:{}", e.target, e.state)).collect();
    assert_eq!(pre, ["compA:running", "compB:stopped", "_default:stopped"]);
    assert_eq!(c.post.iter().map(|e| (e.target, e.state)).collect::<Vec<_>>(), [(Target::Default, Wanted::Running)]);
    let [a, b, g] = &c.changes[..] else { panic!("three changes") };
    assert!(matches!(&a.kind, ChangeKind::PropertySet { property, value }
        if property.to_string() == "compA.prop1" && *value == Value::floats(&[2.3, 3.4, 5.34])));
    assert!(matches!(&b.kind, ChangeKind::PortWrite { port, value: Value::Float(33.4) }
        if port.to_string() == "compB.portX"));
    assert!(matches!(&g.kind, ChangeKind::OperationCall { call, undo: None }
        if call.operation.to_string() == "compG.op1" && call.args == [Value::Int(1), Value::str("two")]));
    let second = loaded.sources.locate(c.pre.iter().nth(1).unwrap().origin).unwrap();
    assert_eq!((second.line, second.column), (2, 41));
}

#[test]
fn listing_1_without_its_arguments_says_what_is_undefined_and_where() {
    let files = Sources::memory([("sample.lua", LISTING_1)]);
    let loaded = lang::load_configurations(&files, Path::new("sample.lua"), &LoadOptions::default());
    let json = davit::diagnostics::to_json(&loaded.findings, &loaded.sources);
    let found: Vec<_> = json
        .as_array()
        .unwrap()
        .iter()
        .map(|f| (f["message"].as_str().unwrap(), f["line"].as_u64(), f["column"].as_u64()))
        .collect();
    assert_eq!(found, [("`arg1` is not defined", Some(9), Some(33)), ("`arg2` is not defined", Some(9), Some(39))]);
    assert!(!loaded.unreadable, "judged, not unreadable");
}

#[test]
fn listing_2_youbot_sample() {
    let files = Sources::memory([("youbot.lua", LISTING_2)]);
    let loaded = lang::load_configurations(&files, Path::new("youbot.lua"), &LoadOptions::default());
    assert!(loaded.findings.is_empty(), "{}", shown(&loaded.findings, &loaded.sources));
    let ids: Vec<_> = loaded.configurations.iter().map(|c| c.id.as_str()).collect();
    assert_eq!(ids, ["disable_copying", "enable_copying", "eight_DOF", "five_DOF"], "in written order");
    let ChangeKind::PropertySet { value, .. } = &loaded.configurations[3].changes[0].kind else { panic!() };
    assert_eq!(*value, Value::Array(vec![Value::Int(0), Value::Int(0), Value::Int(0)]));
}

#[test]
fn the_example_deployment_is_clean() {
    let loaded = load(&[], &LoadOptions::default());
    clean(&loaded);
    let deployment = loaded.deployment.unwrap();
    assert_eq!(deployment.configurations.len(), 1);
    assert_eq!(deployment.coordinators[0].chart.root.children.len(), 3);
    assert_eq!(deployment.limits.stack, 32);
}

#[test]
fn parameters_come_from_with_and_set() {
    let text = "ConfiguratorConf { up = Configuration { property_set(\"A.k\", gains.slow), } }";
    let deployment = format!("{}with: {{ gains: {{ slow: 0.5 }} }}\n", crate::helpers::DEPLOYMENT);
    let files = [("d.yaml", deployment.as_str()), ("c.lua", text)];
    let value = |options: &LoadOptions| {
        let loaded = load(&files, options);
        clean(&loaded);
        match &loaded.deployment.unwrap().configurations[0].changes[0].kind {
            ChangeKind::PropertySet { value, .. } => value.clone(),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(value(&LoadOptions::default()), Value::Float(0.5));
    assert_eq!(
        value(&LoadOptions { set: vec![("gains.slow".into(), "0.75".into())], ..LoadOptions::default() }),
        Value::Float(0.75)
    );
    let typo = load(&files, &LoadOptions { set: vec![("gain.slow".into(), "0.75".into())], ..LoadOptions::default() });
    assert_eq!(codes(&typo), ["text::unknown_parameter 1:1"]);
    assert!(typo.findings[0].help.as_ref().unwrap().contains("`gains`"));
}
