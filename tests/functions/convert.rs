//! Coordinators with functions, written in another form: nothing is lost without a word.

use super::deployed::{CONFIGURATIONS, COORDINATOR, DEPLOYMENT};
use super::support::read;
use davit::diagnostics::Language;
use davit::lang::{LoadOptions, Sources, convert, load_from, print};
use davit::model::finding::Severity;
use davit::model::{Finding, codes};
use std::path::Path;

fn trusted() -> LoadOptions {
    LoadOptions { trusted: true, ..LoadOptions::default() }
}

fn converted(text: &str, to: Language) -> (Option<String>, Vec<Finding>) {
    let done = convert(&Sources::memory([("model.lua", text)]), Path::new("model.lua"), to, &trusted());
    (done.text, done.findings)
}

/// A deployment is written with its coordinators as they are, and what is written loads to the same.
#[test]
fn a_deployment_keeps_its_coordinator_with_all_that_belongs_to_it() {
    let deployment = DEPLOYMENT
        .replace(
            "trusted: true",
            "trusted: { open: [os] }\nhost: [lib/host.lua]\nwith: { gain: 2.0, unread: 1, name: 'a b' }",
        )
        .replace("coordinator: coordinator.lua", "coordinator: charts/coordinator.lua");
    let coordinator = COORDINATOR
        .replace(
            "return rfsm.state {",
            "local part = rfsm.load('../shared/part.lua')\nreturn rfsm.state { part = part,",
        )
        .replace("print('five rounds')", "print(the_host)");
    let from = Sources::memory([
        ("d.yaml", deployment.as_str()),
        ("configurations.lua", &CONFIGURATIONS.replace("create(", "create(unread and ")),
        ("charts/coordinator.lua", &coordinator),
        ("shared/part.lua", "local k = gain\nreturn rfsm.state { doo = function() print(k, name) end }"),
        ("lib/host.lua", "the_host = 'the host'"),
    ]);
    let loaded = load_from(&from, Path::new("d.yaml"), &LoadOptions::default());
    let first = loaded.deployment.unwrap_or_else(|| panic!("{:?}", loaded.findings));
    for language in [Language::Lua, Language::Yaml, Language::Scxml] {
        let files = print::deployment(&first, language);
        let main = &files[0].1;
        assert!(main.contains("trusted: { open: [os] }") && main.contains("host: ["), "{main}");
        assert!(main.contains("gain") && main.contains("a b") && !main.contains("unread"), "{main}");
        let written = files.iter().find(|(name, _)| name.ends_with("coordinator.lua")).expect("kept");
        assert_eq!(written.1, coordinator);
        assert!(files.iter().all(|(name, _)| !name.contains("..") && !name.starts_with('/')), "{files:?}");
        let main = files[0].0.clone();
        let again = load_from(&Sources::memory(files), Path::new(&main), &LoadOptions::default());
        let again = again.deployment.unwrap_or_else(|| panic!("{:?}", again.findings));
        assert_eq!(again.coordinators, first.coordinators);
        let (one, other) = (&first.programs[&first.name], &again.programs[&again.name]);
        assert_eq!((&one.text, one.open, one.host.len()), (&other.text, other.open, other.host.len()));
        assert_eq!(one.files.keys().collect::<Vec<_>>(), other.files.keys().collect::<Vec<_>>());
        assert_eq!(print::kept(&first).len(), 1);
    }
}

#[test]
fn a_pure_coordinator_of_a_trusted_deployment_is_converted() {
    let coordinator = "return state { idle = state {}, operational = state {}, trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'operational', events = { 'e_start' } } }";
    let from = Sources::memory([
        ("d.yaml", DEPLOYMENT),
        ("configurations.lua", CONFIGURATIONS),
        ("coordinator.lua", coordinator),
    ]);
    let deployment = load_from(&from, Path::new("d.yaml"), &LoadOptions::default()).deployment.unwrap();
    let files = print::deployment(&deployment, Language::Yaml);
    assert!(files.iter().any(|(name, _)| name == "coordinator.yaml"), "{files:?}");
    assert!(!files[0].1.contains("trusted"), "{}", files[0].1);
    assert!(print::kept(&deployment).is_empty());
}

#[test]
fn a_file_with_functions_is_refused_and_every_place_named() {
    for to in [Language::Lua, Language::Yaml] {
        let (text, findings) = converted(COORDINATOR, to);
        assert_eq!(text, None);
        let [one] = &findings[..] else { panic!("{findings:?}") };
        assert_eq!((one.code, one.severity), (codes::CONVERT_FUNCTIONS, Severity::Error));
        let labels: Vec<&str> = one.labels.iter().map(|label| label.text.as_str()).collect();
        for place in
            ["`root.idle`: `entry`", "`root.operational`: `doo`", "`starting` → `operational` in `root`: `effect`"]
        {
            assert!(labels.contains(&place), "{place}: {labels:?}");
        }
    }
    // Nothing of a chart is a function, but the root has some.
    let (text, findings) = converted(
        "return rfsm.state { getevents = function() return {} end, a = rfsm.state {}, rfsm.trans { src='initial', tgt='a' } }",
        Language::Yaml,
    );
    assert_eq!(text, None);
    assert_eq!(findings[0].labels[0].text, "`root`: `getevents`");
}

#[test]
fn scxml_is_written_with_a_warning_for_each_place() {
    let (text, findings) = converted(COORDINATOR, Language::Scxml);
    assert!(text.is_some(), "{findings:?}");
    assert_eq!(findings.len(), 4, "{findings:#?}");
    for finding in &findings {
        assert_eq!((finding.code, finding.severity), (codes::CONVERT_LEFT_OUT, Severity::Warning));
        assert!(finding.origin.is_some() && finding.help.is_some());
    }
}

/// A condition is the call of what nobody has defined: not taken, and never taken for none. A `doo` does not complete.
#[test]
fn scxml_says_what_it_cannot_know() {
    let (text, _) = converted(
        "return rfsm.state { a = rfsm.state { doo = function() end }, b = rfsm.state { exit = function() end }, c = rfsm.conn {},
           rfsm.trans { src='initial', tgt='a' }, rfsm.trans { src='a', tgt='b', guard = function() end },
           rfsm.trans { src='a', tgt='c', events = { 'e', function() end } },
           rfsm.trans { src='c', tgt='b', events = { 'e' }, guard = function() end },
           rfsm.trans { src='b', tgt='a', events = { rfsm_timeevent.e_after(function() return 1 end) } } }",
        Language::Scxml,
    );
    let text = text.expect("a text");
    let state = |from: &str, to: &str| text[text.find(from).unwrap()..text.find(to).unwrap()].to_owned();
    let (a, b) = (state("id=\"root.a\"", "id=\"root.b\""), state("id=\"root.b\"", "id=\"root.c\""));
    assert!(!a.contains("<raise") && a.contains("doo: a function"), "{a}");
    assert!(b.contains("<raise") && b.contains("delayexpr=\"seconds_") && !b.contains(" delay="), "{b}");
    assert_eq!(text.matches("<transition event=\"*\" cond=").count(), 2, "the guard of `a`, and its predicate: {text}");
    assert!(text.contains("cond=\"['e'].indexOf(_event.name) &gt;= 0 &amp;&amp; guard_"), "{text}");
    assert!(!text.contains("event=\"*\" target"), "nothing is taken on any event: {text}");
    // It comes back as what it is: not the same.
    let from = Sources::memory([("m.scxml", text.as_str())]);
    let back = davit::lang::load_coordinator(&from, Path::new("m.scxml"), &LoadOptions::default());
    assert!(back.coordinator.is_none());
    assert_eq!(
        back.findings.iter().filter(|f| f.code == codes::SCXML_NO_COUNTERPART).count(),
        5,
        "{:#?}",
        back.findings
    );
}

#[test]
fn fields_of_ones_own_are_left_out_each_with_a_warning() {
    let (text, findings) = converted(
        "return rfsm.state { a = rfsm.state { note = 'hello', helper = function() end, 'loose' }, c = rfsm.conn { why = 1 },
           rfsm.trans { src='initial', tgt='a', colour = 'red' } }",
        Language::Yaml,
    );
    let text = text.unwrap_or_else(|| panic!("{findings:?}"));
    assert!(!text.contains("hello"), "{text}");
    let mut named: Vec<String> = findings
        .iter()
        .filter(|f| f.code == codes::CONVERT_LEFT_OUT && f.severity == Severity::Warning)
        .map(|f| f.message.split('`').nth(1).unwrap_or_default().to_owned())
        .collect();
    named.sort();
    assert_eq!(named, ["[1]", "colour", "helper", "note", "why"]);
    assert_eq!(findings.len(), 5, "{findings:?}");
}

#[test]
fn other_files_are_converted_as_before() {
    let (text, findings) = converted("ConfiguratorConf { c = Configuration { x } }", Language::Yaml);
    assert!(text.is_none() && findings.iter().all(|f| f.code != codes::LUA_HOST_MISSING), "{findings:?}");
    let (text, findings) = converted(CONFIGURATIONS, Language::Yaml);
    assert!(text.is_some(), "{findings:?}");
    for nothing in ["", "local x = {}"] {
        let (_, findings) = converted(nothing, Language::Yaml);
        assert!(matches!(&findings[..], [one] if one.code == codes::TEXT_NOTHING), "{nothing}: {findings:?}");
    }
}

/// A file that is trusted has functions; what is wrong is another thing, and only that is said.
#[test]
fn what_only_a_pure_reading_minds_is_not_said() {
    let loaded = read(
        &[(
            "model.lua",
            "return rfsm.state { type = rfsm.state {}, a = rfsm.state { entry = function() end, note = 1 },
               rfsm.trans { src='initial', tgt='a' } }",
        )],
        &[],
    );
    let codes: Vec<_> = loaded.findings.iter().map(|f| f.code).collect();
    assert_eq!(codes, [codes::CHART_RESERVED], "{:?}", loaded.findings);
}
