//! SCXML: what is written comes back as a chart of the same behaviour; what other programs write is read as far as it has
//! a meaning here, and every element that has none is named at its place.

use crate::random::chart;
use davit::diagnostics::Language;
use davit::lang::{self, LoadOptions, Sources, print};
use davit::model::codes;
use davit::model::finding::Severity;
use davit::model::statechart::Statechart;
use davit::statechart::{Sim, compile};
use proptest::prelude::*;
use std::cell::Cell;
use std::path::Path;

fn load(text: &str) -> lang::LoadedCoordinator {
    lang::load_coordinator(&Sources::memory([("m.scxml", text)]), Path::new("m.scxml"), &LoadOptions::default())
}

fn read(text: &str) -> Statechart {
    let loaded = load(text);
    loaded.coordinator.unwrap_or_else(|| panic!("{:#?}\n{text}", loaded.findings))
}

/// Code, severity and line:column of each finding.
fn findings(text: &str) -> Vec<String> {
    let loaded = load(text);
    let told = |f: &davit::model::Finding| {
        assert!(f.help.is_some(), "no help: {}", f.message);
        let at = loaded.sources.locate(f.origin).map_or("-".to_owned(), |l| format!("{}:{}", l.line, l.column));
        let weight = if f.severity == Severity::Error { "" } else { "warning " };
        format!("{weight}{} {at} {}", f.code, f.message)
    };
    loaded.findings.iter().map(told).collect()
}

const HEAD: &str = "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" initial=\"a\">\n";

fn document(body: &str) -> String {
    format!("{HEAD}{body}</scxml>\n")
}

/// Both do the same with the same lines; charts that are refused are refused both times.
fn same_after_the_round(bytes: &[u8], script: &[u8]) -> Result<bool, TestCaseError> {
    let model = chart(bytes);
    let (Some(first), _) = compile(&model) else { return Ok(false) };
    let text = print::coordinator(&model, Language::Scxml);
    let loaded = load(&text);
    prop_assert!(loaded.findings.is_empty(), "{:?}\n{text}", loaded.findings);
    let back = loaded.coordinator.unwrap();
    let (second, findings) = compile(&back);
    let Some(second) = second else { panic!("{findings:#?}\n{text}") };
    let (mut one, mut other) = (Sim::new(&first), Sim::new(&second));
    for byte in script {
        let line = match byte % 8 {
            0 => "advance 0.7".to_owned(),
            1 => "run".to_owned(),
            2 => "e1 e3 e_done@root.a".to_owned(),
            n => format!("e{}", n % 5),
        };
        prop_assert_eq!(
            one.line(&line).unwrap(),
            other.line(&line).unwrap(),
            "line `{}` of {:#?}\n{}",
            line,
            model,
            text
        );
    }
    // What was read is written the same again.
    prop_assert_eq!(print::coordinator(&back, Language::Scxml), text);
    Ok(true)
}

#[test]
fn what_is_written_comes_back_with_the_same_behaviour() {
    let (ran, all) = (Cell::new(0), Cell::new(0));
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig {
        cases: crate::random::cases() / 4,
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let bytes = proptest::collection::vec(any::<u8>(), 0..220);
    let script = proptest::collection::vec(any::<u8>(), 1..16);
    let result = runner.run(&(bytes, script), |(bytes, script)| {
        ran.set(ran.get() + usize::from(same_after_the_round(&bytes, &script)?));
        all.set(all.get() + 1);
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
    assert!(ran.get() * 4 > all.get(), "only {} of {} charts: the test has become empty", ran.get(), all.get());
}

#[test]
fn a_foreign_document_runs() {
    let chart = read(
        "<?xml version=\"1.0\"?>
<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" initial=\"off\">
  <!-- a lamp with a timer -->
  <state id=\"off\"><transition event=\"switch\" target=\"on\"/></state>
  <state id=\"on\">
    <onentry><send event=\"lamp.on\" target=\"#_scxml_lamp\"/></onentry>
    <onexit><send event=\"lamp.off\" target=\"#_scxml_lamp\"/></onexit>
    <transition event=\"switch\" target=\"off\"/>
    <transition event=\"done.state.on\" target=\"tired\"/>
    <state id=\"dim\"><transition event=\"more.*\" target=\"bright\"/></state>
    <state id=\"bright\">
      <onentry><send event=\"late\" id=\"t\" delay=\"500ms\"/></onentry>
      <onexit><cancel sendid=\"t\"/></onexit>
      <transition event=\"late\" target=\"spent\"><send event=\"warn\" target=\"#_parent\"/></transition>
    </state>
    <final id=\"spent\"/>
  </state>
  <state id=\"tired\"><transition target=\"off\"/></state>
</scxml>",
    );
    let (chart, _) = compile(&chart);
    let chart = chart.unwrap();
    let mut sim = Sim::new(&chart);
    let mut line = |text: &str| {
        let seen = sim.line(text).unwrap();
        (seen.active.last().unwrap().clone(), seen.actions)
    };
    assert_eq!(line("run").0, "root.off");
    let (at, done) = line("switch");
    assert_eq!(at, "root.on.dim", "the first state written is where it begins");
    assert!(done.contains(&"raise lamp.on".to_owned()), "{done:?}");
    assert_eq!(line("more").0, "root.on.bright");
    assert_eq!(line("advance 0.4").0, "root.on.bright");
    line("advance 0.2");
    let (at, done) = line("");
    assert_eq!(at, "root.on.spent");
    assert!(done.contains(&"raise warn".to_owned()), "{done:?}");
    let (at, done) = line("");
    assert_eq!((at.as_str(), done.contains(&"raise lamp.off".to_owned())), ("root.tired", true));
    assert_eq!(line("").0, "root.off", "without an event it is taken at once");
}

#[test]
fn every_element_without_a_counterpart_is_named_at_its_place() {
    let said = |body: &str| findings(&document(body));
    for (body, at, what) in [
        ("<parallel id=\"a\"/>", "2:1", "parallel"),
        ("<state id=\"a\"><history id=\"h\"/></state>", "2:15", "history"),
        ("<state id=\"a\"/><datamodel><data id=\"x\"/></datamodel>", "2:27", "data"),
        ("<state id=\"a\"/><script>x</script>", "2:16", "script"),
        ("<state id=\"a\"><invoke/></state>", "2:15", "invoke"),
        ("<state id=\"a\"><onentry><assign/></onentry></state>", "2:24", "assign"),
        ("<state id=\"a\"><onentry><raise event=\"e\"/></onentry></state>", "2:24", "raise"),
        ("<state id=\"a\"><onexit><if cond=\"x\"/></onexit></state>", "2:23", "if"),
        ("<state id=\"a\"><onexit><foreach/></onexit></state>", "2:23", "foreach"),
        ("<state id=\"a\"><onexit><send event=\"e\" target=\"#_internal\"/></onexit></state>", "2:23", "send"),
        ("<final id=\"a\"><donedata/></final>", "2:15", "donedata"),
    ] {
        let found = said(body);
        let expected = format!("{} {at} `{what}` has no counterpart here", codes::SCXML_NO_COUNTERPART);
        assert_eq!(found, [expected], "{body}");
    }
    for (body, words) in [
        ("<state id=\"a\"><transition event=\"e\"/></state>", "a transition without a target"),
        ("<state id=\"a\"><transition event=\"e\" cond=\"x\" target=\"a\"/></state>", "a condition on data"),
        ("<state id=\"a\"><transition event=\"e\" target=\"a b\"/></state><state id=\"b\"/>", "entered in parallel"),
        (
            "<state id=\"a\"><transition event=\"e\" type=\"internal\" target=\"b\"/><state id=\"b\"/></state>",
            "an internal transition",
        ),
        ("<state id=\"a\"><onentry><send eventexpr=\"x\"/></onentry></state>", "without a fixed name"),
        ("<state id=\"a\"><onentry><send event=\"x\" delayexpr=\"y\"/></onentry></state>", "a delay that is computed"),
        ("<state id=\"a\"><onentry><send event=\"x\" delay=\"1s\"/></onentry></state>", "no transition of this state"),
        ("<state id=\"a\"><onentry><send event=\"x\" delay=\"soon\"/></onentry></state>", "`soon` is not a time"),
        ("<state id=\"a\"><transition event=\"done.state.a\" target=\"a\"/></state>", "never comes"),
        ("<state id=\"a\"><transition event=\"e\" target=\"aa\"/></state>", "there is no state `aa`"),
        ("<state id=\"a-b\"/><state id=\"a\"/>", "`a-b` is not the name of a state"),
        ("<state id=\"a\"/><state id=\"a\"/>", "two states have the id `a`"),
        ("<state id=\"a\"><transitoin/></state>", "SCXML has no element `transitoin`"),
        ("<state id=\"a\"><initial/><state id=\"b\"/></state>", "`initial` holds no transition"),
    ] {
        let found = said(body);
        assert!(matches!(&found[..], [one] if one.contains(words)), "{body}: {found:?}");
    }
    assert!(findings("<html/>")[0].contains("text::nothing"));
    assert!(findings(&document("")).iter().any(|f| f.contains("no state")));
}

#[test]
fn what_would_be_decided_otherwise_is_a_warning() {
    let inner = document(
        "<state id=\"a\"><transition event=\"e\" target=\"b\"/>\n<state id=\"c\"><transition event=\"e.x\" target=\"d\"/></state><state id=\"d\"/></state><state id=\"b\"/>",
    );
    assert!(
        matches!(&findings(&inner)[..], [one, other] if one.starts_with("warning scxml::prefix 2:15") && other.starts_with("warning scxml::priority 3:15")),
        "{:?}",
        findings(&inner)
    );
    let prefix = document(
        "<state id=\"a\"><transition event=\"e\" target=\"b\"/><transition event=\"e.x\" target=\"a\"/></state><state id=\"b\"/>",
    );
    assert!(
        matches!(&findings(&prefix)[..], [one] if one.starts_with("warning scxml::prefix")),
        "{:?}",
        findings(&prefix)
    );
    let home = document("<state id=\"a\"><onentry><send event=\"e\"/></onentry></state>");
    assert!(
        matches!(&findings(&home)[..], [one] if one.starts_with("warning scxml::sent_home")),
        "{:?}",
        findings(&home)
    );
}

/// Neither is it in a document that this program wrote, and what that says twice it must say alike.
#[test]
fn who_edits_what_was_written_is_heard() {
    let lua = "return state { a = state { config = 'soft' }, b = state {}, trans { src = 'initial', tgt = 'a' },
        trans { src = 'a', tgt = 'b', events = { 'e_go', 'e_after(10)' } }, trans { src = 'b', tgt = 'a', events = { 'e_back' } } }";
    let loaded =
        lang::load_coordinator(&Sources::memory([("c.lua", lua)]), Path::new("c.lua"), &LoadOptions::default());
    let text = print::scxml::coordinator_scxml(&loaded.coordinator.unwrap());
    assert_eq!(findings(&text), Vec::<String>::new(), "{text}");
    for (from, to, told) in [
        ("event=\"e_back\"", "evnt=\"e_back\"", "`transition` has no attribute `evnt`"),
        ("event=\"e_go ", "event=\"e_og ", "`event` says `e_og e_after.10.root.a`, and `davit:event` beside it"),
        ("davit:event=\"e_go ", "davit:event=\"e_og ", "and `davit:event` beside it `e_og e_after(10)`"),
        (
            "delay=\"10s\"",
            "delay=\"20s\"",
            "is sent after `20s`, and the transition that waits for it has `e_after(10)`",
        ),
        ("davit:config=\"soft\"", "config=\"soft\"", "`state` has no attribute `config`"),
        ("version=\"1.0\" datamodel", "verson=\"1.0\" datamodel", "`scxml` has no attribute `verson`"),
    ] {
        assert!(text.contains(from), "{from} {text}");
        let found = findings(&text.replacen(from, to, 1));
        assert!(found.iter().any(|one| one.contains(told)), "{to}: {found:?}");
    }
}

/// What SCXML does not have, or has otherwise, is never passed over.
#[test]
fn what_is_no_word_of_scxml_is_told() {
    let of_a = |inside: &str| document(&format!("<state id=\"a\">{inside}</state><state id=\"b\"/>"));
    let to_b = "<transition event=\"s\" target=\"b\"/>";
    let sent = "<send event=\"s\" id=\"i\" delay=\"1s\"/>";
    let on_exit = "<onexit><cancel sendid=\"i\"/></onexit>";
    for (inside, words) in [
        ("<transition evnt=\"s\" target=\"b\"/>".to_owned(), "`transition` has no attribute `evnt`"),
        ("<transition event=\"s\" type=\"bogus\" target=\"b\"/>".to_owned(), "`bogus` is no type"),
        ("<transition event=\"e_done\" target=\"b\"/>".to_owned(), "`e_done` is no name of an event"),
        ("<transition event=\"e_after(1)\" target=\"b\"/>".to_owned(), "`e_after(1)` is no name of an event"),
        ("hello".to_owned(), "text in `state` means nothing: `hello`"),
        (
            "<onentry><send event=\"s\" target=\"#_parent\" namelist=\"v\"/></onentry>".to_owned(),
            "`namelist` of `send`",
        ),
        ("<onentry><x:do xmlns:x=\"urn:x\"/></onentry>".to_owned(), "`do` is of another language (`urn:x`)"),
        (
            "<i:include xmlns:i=\"http://www.w3.org/2001/XInclude\" href=\"x\"/>".to_owned(),
            "brings in another document",
        ),
        (format!("<onentry>{sent}</onentry>{to_b}"), "comes in SCXML also when this state was left"),
        (format!("<onentry>{sent}<cancel sendid=\"i\"/></onentry>{on_exit}{to_b}"), "taken back while the state"),
        (
            format!(
                "<onentry>{sent}</onentry>{on_exit}{to_b}<state id=\"c\"><onentry><cancel sendid=\"i\"/></onentry></state>"
            ),
            "taken back while the state",
        ),
        (format!("<onentry>{sent}{sent}</onentry>{on_exit}{to_b}"), "`s` is sent later twice"),
        (format!("<onexit>{sent}</onexit>{to_b}"), "`s` is sent later when the state is left"),
        (
            format!("<onentry>{}</onentry>{on_exit}{to_b}", sent.replace("id=", "target=\"#_parent\" id=")),
            "`s` is sent later to the outside",
        ),
    ] {
        let found = findings(&of_a(&inside));
        assert!(matches!(&found[..], [one] if one.contains(words)), "{inside}: {found:?}");
    }
    assert_eq!(findings(&of_a(&format!("<onentry>{sent}</onentry>{on_exit}{to_b}"))), Vec::<String>::new());
    // Notes of editors are nothing that the chart does.
    assert_eq!(findings(&of_a("<q:place xmlns:q=\"urn:q\" q:x=\"1\"/>")), Vec::<String>::new());
    let eventless = document(
        "<state id=\"a\"><transition target=\"b\"/>\n<state id=\"c\"><transition target=\"d\"/></state></state>\
         <state id=\"b\"/><state id=\"d\"/>",
    );
    let found = findings(&eventless);
    assert!(matches!(&found[..], [one] if one.starts_with("warning scxml::priority 3:15")), "{found:?}");
}

/// What SCXML forbids, or says nothing of.
#[test]
fn what_scxml_forbids_is_told() {
    let to = |event: &str| format!("<transition {event} target=\"b\"/>");
    for (body, words) in [
        (
            format!("<state id=\"a\">{}</state><final id=\"b\">{}</final>", to("event=\"e\""), to("event=\"f\"")),
            "`final` has no transitions",
        ),
        (
            format!("<state id=\"a\">{}</state><final id=\"b\"><state id=\"c\"/></final>", to("event=\"e\"")),
            "`state` stands in a `final`",
        ),
        ("<state id=\"a\" initial=\"b\"><state id=\"c\"/></state><state id=\"b\"/>".to_owned(), "2:24 `b` does not stand inside of `a`"),
        ("<state id=\"a\" initial=\"b\"/><state id=\"b\"/>".to_owned(), "2:24 `b` does not stand inside of `a`"),
        (
            format!("<state id=\"a\"><initial>{}</initial><state id=\"c\"/></state><state id=\"b\"/>", to("")),
            "`b` does not stand inside of `a`",
        ),
        ("<state id=\"a\"><transition event=\"e\" taget=\"a\"/></state>".to_owned(), "2:37 `transition` has no attribute `taget`"),
        ("<state ide=\"a\"/>".to_owned(), "2:8 `state` has no attribute `ide`"),
        (
            "<state id=\"a\"><onentry><send event=\"e\" delay=\"2s\" target=\"#_internal\"/></onentry>\
             <transition event=\"e\" target=\"b\"/></state><state id=\"b\"/>"
                .to_owned(),
            "`e` is sent later to `#_internal`",
        ),
        (
            "<state id=\"a\"><onentry><send event=\"e\" delay=\"2s\" id=\"tt\"/></onentry><onexit><cancel sendid=\"ttt\"/></onexit>\
             <transition event=\"e\" target=\"b\"/></state><state id=\"b\"/>"
                .to_owned(),
            "`ttt` takes nothing back: `e` is sent with the id `tt`",
        ),
        (format!("<state id=\"a\">{}</state><state id=\"b\"/>", to("event=\"\"")), "`event` is empty"),
        (
            format!("<state id=\"a\"><initial>{}</initial><state id=\"b\"/></state>", to("event=\"e\"")),
            "the transition in `initial` waits for nothing",
        ),
        (
            format!("<state id=\"a\" initial=\"b\"><initial>{}</initial><state id=\"b\"/></state>", to("")),
            "`state` has `initial` twice",
        ),
        (
            "<state id=\"a\" d:confg=\"slow\" xmlns:d=\"OURS\"/>".replace("OURS", print::scxml::OURS),
            "there is no attribute `davit:confg`",
        ),
        (
            "<state id=\"a\"><d:config xmlns:d=\"OURS\"/></state>".replace("OURS", print::scxml::OURS),
            "there is no element `davit:config`",
        ),
    ] {
        let found = findings(&document(&body));
        assert!(matches!(&found[..], [one] if one.contains(words)), "{body}: {found:?}");
    }
    let found = findings("<scxml version=\"1.0\"><state id=\"a\"/></scxml>");
    assert!(matches!(&found[..], [one] if one.contains("`scxml` does not name SCXML's namespace")), "{found:?}");
    let found = findings(&document("<state id=\"a\"/>").replace("1.0", "2.0"));
    assert!(matches!(&found[..], [one] if one.contains("`version`")), "{found:?}");
}

/// An event that a state sends itself later, and that others wait for, comes from elsewhere as well.
#[test]
fn what_is_sent_later_may_come_before() {
    let body = "<state id=\"a\"><onentry><send event=\"o\" id=\"t\" delay=\"5s\"/></onentry><onexit><cancel sendid=\"t\"/></onexit>
        <transition event=\"o\" target=\"b\"/></state><state id=\"b\">BACK</state>";
    let back = "<transition event=\"o\" target=\"a\"/>";
    let seen = play(&body.replace("BACK", back), &["o", "o"]);
    assert_eq!([&*seen[0].0, &*seen[1].0], ["root.b", "root.a"]);
    // By time alone where nobody else does.
    assert_eq!(play(&body.replace("BACK", ""), &["o"])[0].0, "root.a");
}

/// `root` is the name of the outermost state here, and nobody's in SCXML.
#[test]
fn a_state_may_be_called_root() {
    let inside =
        "<state id=\"root\"><state id=\"b\"><transition event=\"go\" target=\"c\"/></state><state id=\"c\"/></state>";
    let foreign = document(inside).replace(" initial=\"a\"", " initial=\"root\"");
    assert_eq!(findings(&foreign), Vec::<String>::new());
    let chart = read(&foreign);
    let compiled = compile(&chart).0.unwrap();
    let mut sim = Sim::new(&compiled);
    assert_eq!(sim.line("run").unwrap().active.last().unwrap(), "root.root.b");
    assert_eq!(sim.line("go").unwrap().active.last().unwrap(), "root.root.c");
    // What was written of it comes back.
    let written = print::coordinator(&chart, Language::Scxml);
    let again = compile(&read(&written)).0.unwrap();
    let mut sim = Sim::new(&again);
    sim.line("run").unwrap();
    assert_eq!(sim.line("go").unwrap().active.last().unwrap(), "root.root.c");
}

/// Where a foreign document stands after each line, and what was done.
fn play(body: &str, lines: &[&str]) -> Vec<(String, Vec<String>)> {
    let (chart, findings) = compile(&read(&document(body)));
    let chart = chart.unwrap_or_else(|| panic!("{findings:?}"));
    let mut sim = Sim::new(&chart);
    let mut line = |text: &&str| {
        let seen = sim.line(text).unwrap();
        (seen.active.last().unwrap().clone(), seen.actions)
    };
    line(&"run");
    lines.iter().map(|text| (line(text), line(&"run")).0).collect()
}

#[test]
fn any_event_is_refused_because_completion_would_be_one() {
    let found = findings(&document("<state id=\"a\"><transition event=\"*\" target=\"a\"/></state>"));
    assert!(matches!(&found[..], [one] if one.starts_with("scxml::no_counterpart 2:15 `*`")), "{found:?}");
}

/// Document order decides in SCXML; rFSM's sort moves the second and the third of four.
#[test]
fn document_order_decides() {
    for count in 4..12 {
        let more: String = (4..count).map(|n| format!("<transition event=\"e{n}\" target=\"d\"/>")).collect();
        let body = format!(
            "<state id=\"a\"><transition event=\"e0\" target=\"d\"/><transition event=\"e\" target=\"b\"/>{more}<transition event=\"e\" target=\"c\"/><transition event=\"e3\" target=\"d\"/></state><state id=\"b\"/><state id=\"c\"/><state id=\"d\"/>"
        );
        assert_eq!(play(&body, &["e"])[0].0, "root.b", "{count} transitions");
    }
    // Where no two can be meant nothing is added.
    let body: String = (0..6).map(|n| format!("<transition event=\"e{n}\" target=\"a\"/>")).collect();
    let chart = read(&document(&format!("<state id=\"a\">{body}</state>")));
    assert!(chart.root.transitions.iter().all(|transition| transition.pn == 0.0));
}

/// From inside to a state around: SCXML leaves it and enters it again.
#[test]
fn a_transition_to_a_state_around_leaves_it() {
    let body = "<state id=\"a\"><onentry><send event=\"in_a\" target=\"#_parent\"/></onentry><onexit><send event=\"out_a\" target=\"#_parent\"/></onexit>
        <state id=\"b\"><transition event=\"g\" target=\"c\"/></state>
        <state id=\"c\"><transition event=\"e\" target=\"a\"><send event=\"between\" target=\"#_parent\"/></transition></state></state>
        <state id=\"a_again\"/>";
    let seen = play(body, &["g", "e"]);
    assert_eq!(seen[1].0, "root.a.b");
    let raised: Vec<&str> = seen[1].1.iter().filter_map(|action| action.strip_prefix("raise ")).collect();
    assert_eq!(raised, ["out_a", "between", "in_a"]);
}

#[test]
fn a_name_means_all_that_begin_with_it() {
    let body = "<state id=\"a\"><transition event=\"e.*\" target=\"b\"/></state>
        <state id=\"b\"><transition event=\"e.f.g\" target=\"a\"/></state><state id=\"c\"><transition event=\"ef\" target=\"a\"/></state>";
    assert_eq!(play(body, &["e.f.g"])[0].0, "root.b", "a name of the document");
    assert_eq!(play(body, &["e"])[0].0, "root.b");
    assert_eq!(play(body, &["ef"])[0].0, "root.a");
    let found = findings(&document(body));
    assert!(
        matches!(&found[..], [one] if one.starts_with("warning scxml::prefix 2:15") && one.contains("`e.f.g`")),
        "{found:?}"
    );
    let alone = findings(&document("<state id=\"a\"><transition event=\"e.*\" target=\"a\"/></state>"));
    assert!(matches!(&alone[..], [one] if one.starts_with("warning scxml::prefix")), "{alone:?}");
    let many: String =
        (0..200).map(|n| format!("<state id=\"s{n}\"><transition event=\"e.x{n}\" target=\"a\"/></state>")).collect();
    let many = document(&format!("<state id=\"a\"><transition event=\"e\" target=\"a\"/></state>{many}"));
    assert!(findings(&many).iter().any(|f| f.contains("not all names")), "{:?}", findings(&many)[0]);
}

/// What other interpreters read: the order in which transitions are tried, and targets that leave no state around.
#[test]
fn what_is_written_decides_alike_elsewhere() {
    let load = |text: &str| {
        let from = Sources::memory([("m.lua", text)]);
        lang::load_coordinator(&from, Path::new("m.lua"), &LoadOptions::default()).coordinator.expect("a chart")
    };
    let written = |text: &str| print::coordinator(&load(text), Language::Scxml);
    let order = written(
        "return state { a = state {}, b = state {}, c = state {}, trans { src='initial', tgt='a' },
           trans { src='a', tgt='a', events={'e0'} }, trans { src='a', tgt='b', events={'e'} }, trans { src='a', tgt='c', events={'e'} },
           trans { src='a', tgt='a', events={'e3'} }, trans { src='a', tgt='b', events={'e4'}, pn=1 } }",
    );
    let places: Vec<usize> = ["e4", "e0", "\"e\" davit:order=\"2\"", "\"e\" davit:order=\"1\""]
        .iter()
        .map(|text| order.find(text).unwrap_or_else(|| panic!("{text} in {order}")))
        .collect();
    assert!(places[0] < places[1] && places[2] < places[3], "{order}");
    // The state around is not left: SCXML leaves it for itself, and stays in it for what is inside.
    let inside = written(
        "return state { p = state { a = state {}, b = state {}, trans { src='initial', tgt='a' }, trans { src='b', tgt='root.p', events={'e'} },
           trans { src='a', tgt='initial', events={'f'} } }, trans { src='initial', tgt='p' }, trans { src='p', tgt='p', events={'g'} } }",
    );
    assert!(
        inside.contains("event=\"e\" target=\"root.p.initial\"")
            && inside.contains("event=\"f\" target=\"root.p.initial\""),
        "{inside}"
    );
    assert!(inside.contains("<state id=\"root.p.initial\" davit:kind=\"connector\">"), "{inside}");
    assert!(inside.contains("event=\"g\" target=\"root.p\""), "{inside}");
}

#[test]
fn hostile_documents_are_refused() {
    let bomb = "<!DOCTYPE x [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;\">]>\n<scxml>&b;</scxml>";
    assert!(findings(bomb)[0].starts_with("text::syntax"), "{:?}", findings(bomb));
    let deep = document(&"<state id=\"a\">".repeat(100_000));
    let found = findings(&deep);
    assert!(matches!(&found[..], [one] if one.starts_with("text::too_deep")), "{found:?}");
    let quoted =
        document(&format!("<state id=\"a\"><onentry><log expr=\"{}\"/></onentry></state>", "&lt;x>".repeat(1000)));
    assert_eq!(findings(&quoted), [""; 0], "what looks like elements inside a value is none");
    let many = document(&"<q/>".repeat(1_100_000));
    assert!(findings(&many)[0].starts_with("text::too_many_values"), "{}", findings(&many)[0]);
    for broken in ["", "<", "<scxml", "<scxml>", "<scxml></state></scxml>", "\u{0}", "<a b=\"&x;\"/>"] {
        assert!(!findings(broken).is_empty(), "{broken:?}");
    }
    let wide: String =
        (0..20_000).map(|n| format!("<state id=\"s{n}\"><transition event=\"e\" target=\"a\"/></state>")).collect();
    let wide = read(&document(&format!("<state id=\"a\"/>{wide}")));
    assert_eq!(wide.root.children.len(), 20_001);
}

#[test]
fn what_costs_more_than_its_length_is_bounded() {
    let many = |n: usize, one: &dyn Fn(usize) -> String| (0..n).map(one).collect::<Vec<_>>().join(" ");
    let a = |inside: &str| document(&format!("<state id=\"a\" {inside}/>"));
    for document in [
        a(&many(200_000, &|n| format!("x{n}=\"1\""))),
        a(&many(davit::limits::XML_ATTRIBUTES, &|n| format!("y{n}=\"a = b\""))),
        document(
            &(0..davit::limits::XML_NAMESPACES).map(|n| format!("<log xmlns:n{n}=\"u{n}\"/>")).collect::<String>(),
        ),
    ] {
        let told = findings(&document);
        assert!(matches!(&told[..], [one] if one.starts_with("text::too_many_values")), "{told:?}");
    }
    let fits = a(&many(davit::limits::XML_ATTRIBUTES - 1, &|n| format!("y{n}=\"a = b\"")));
    assert!(findings(&fits).iter().all(|told| !told.contains("too_many_values")));
}
