//! Legal in rFSM and hardly meant: fields with nearly known names, globals that nobody has set.

use super::support::read;
use davit::model::codes;
use davit::model::finding::Severity;

/// What is said of the slips of a model: line, what it is about, the help.
fn slips(text: &str) -> Vec<(u32, String, String)> {
    slips_with(&[("model.lua", text)], &[])
}

fn slips_with(files: &[(&str, &str)], host: &[&str]) -> Vec<(u32, String, String)> {
    let loaded = read(files, host);
    assert!(loaded.coordinator.is_some(), "{:?}", loaded.findings);
    let slips = loaded.findings.iter().filter(|f| f.code == codes::CHART_SLIP);
    slips
        .map(|f| {
            assert_eq!(f.severity, Severity::Warning);
            let line = loaded.sources.locate(f.origin).expect("a place").line;
            (line, f.message.split('`').nth(1).unwrap_or_default().to_owned(), f.help.clone().unwrap_or_default())
        })
        .collect()
}

/// A model with this state and this transition out of it.
fn model(state: &str, transition: &str) -> String {
    format!(
        "return rfsm.state {{\n  off = rfsm.state {{ {state} }},\n  on = rfsm.state {{}},\n  rfsm.trans {{ src='initial', tgt='off' }},
  rfsm.trans {{ src='off', tgt='on', {transition} }},\n}}"
    )
}

#[test]
fn misspelt_keys_are_named_with_what_was_meant() {
    for (state, transition, line, key, meant) in [
        ("", "evnts={'e_on'}", 5, "evnts", "`events`"),
        ("", "event='e_on'", 5, "event", "`events`"),
        ("", "gaurd=function() return false end", 5, "gaurd", "`guard`"),
        ("", "efect='e'", 5, "efect", "`effect`"),
        ("entyr='do_it'", "", 2, "entyr", "`entry`"),
        ("entri=function() end", "", 2, "entri", "`entry`"),
        ("on_exit=function() end", "", 2, "on_exit", "`exit`"),
        ("guard=function() end", "", 2, "guard", "a transition"),
        ("", "entry=function() end", 5, "entry", "a state"),
    ] {
        let said = slips(&model(state, transition));
        let [(at, about, help)] = &said[..] else { panic!("{state}{transition}: {said:?}") };
        assert_eq!((*at, about.as_str()), (line, key));
        assert!(help.contains(meant), "{key}: {help}");
    }
}

#[test]
fn what_is_written_over_several_lines_is_shown_on_its_own() {
    let text = "return rfsm.state {
  off = rfsm.state {
    inner = rfsm.state {},
    entyr = function() end,
  },
  rfsm.trans { src = 'initial', tgt = 'off' },
  rfsm.trans {
    src = 'off', tgt = 'off',
    evnts = { 'e_on' },
  },
  rfsm.trans { src = 'off', tgt = 'off', events = { 'evnts', 'entyr' } },
}";
    let found: Vec<(u32, String)> = slips(text).into_iter().map(|(line, about, _)| (line, about)).collect();
    assert_eq!(found, [(9, "evnts".to_owned()), (4, "entyr".to_owned())]);
}

#[test]
fn a_global_that_nobody_has_set_is_named_where_it_is_a_fields_value() {
    let said = slips(&model("entry=do_it, note=1", "guard = is_it,\n effect = here"));
    let found: Vec<(u32, &str)> = said.iter().map(|(line, about, _)| (*line, about.as_str())).collect();
    assert_eq!(found, [(2, "do_it"), (5, "is_it"), (6, "here")]);
    assert!(said[0].2.contains("\"do_it\""), "{said:?}");
    // Asked for in another way, and set.
    for quiet in ["entry = do_it or function() end", "entry = (do_it), note = 1", "entry = print, note = do_it == nil"]
    {
        assert_eq!(slips(&model(quiet, "")), [], "{quiet}");
    }
    let text = model("entry=do_it", "");
    let files = [("model.lua", text.as_str()), ("host.lua", "function do_it() end")];
    assert_eq!(slips_with(&files, &["host.lua"]), []);
    let files = [("model.lua", "return rfsm.load('sub.lua')"), ("sub.lua", text.as_str())];
    assert_eq!(slips_with(&files, &[]).len(), 1, "in the file that has it");
}

#[test]
fn fields_of_ones_own_stay_quiet() {
    let own = "note='n', name='x', id=7, data={1}, helper=function() end, on=true, emit='e', foo=print, count=0, _x=1, mode='m',
       log=function() end, init=function() end, update=function() end, color='red', desc='d', timeout=3, x=1, y=2";
    assert_eq!(slips(&model(own, own)), []);
    let root = "return rfsm.state { err = print, dbg = false, name='m', getevents=function() return {} end, idle_hook=function() end,
       a = rfsm.state { prepare=function() end }, c = rfsm.conn { note=1 }, rfsm.trans { src='initial', tgt='a', likely=function() end } }";
    assert_eq!(slips(root), []);
    assert_eq!(slips(&format!("require 'rfsm.emem' require 'rfsm.await' require 'rfsm.preview' {root}")), []);
}
