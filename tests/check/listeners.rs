//! Events that the values of properties name: whether somebody listens to them, and whether they are names at all.

use crate::support::{Said, Small};

const STATES: &str = "idle = state {}, building = state { entry = 'base' }, up = state {}, leaving = state { entry = 'base.undo' }, stuck = state {},
    trans { src = 'initial', tgt = 'idle' },
    trans { src = 'idle', tgt = 'building', events = { 'e_start' } },
    trans { src = 'building', tgt = 'up', events = { 'base.ok' } },
    trans { src = 'building', tgt = 'leaving', events = { 'base.failed', 'base.broken', 'e_shutdown' } },
    trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown', 'e_seen' } },
    trans { src = 'leaving', tgt = 'idle', events = { 'base.undone' } },
    trans { src = 'leaving', tgt = 'stuck', events = { 'base.undo.failed', 'base.undo.broken' } },
    trans { src = 'stuck', tgt = 'leaving', events = { 'e_shutdown' } },";

fn check(changes: &str, more: &str) -> Said {
    let small = Small::new(&format!("base = Configuration {{ {changes} }}, {more}"), STATES, "");
    let raises = "found: { type: string, default: '', raises: true, tunable: stopped }";
    small.demo.replace("small.yaml", "gain: { type: float", &format!("{raises}\n      gain: {{ type: float"));
    small.check()
}

/// Code, message and help of what is said of the value.
fn told(said: &Said) -> Vec<String> {
    let of = |code| said.of(code).into_iter();
    let all = of("conf::event_unheard").chain(of("conf::bad_value")).chain(of("coord::near_event"));
    let text = |finding: &serde_json::Value, key: &str| finding[key].as_str().unwrap_or_default().to_owned();
    all.map(|f| format!("{}: {}; {}", text(f, "code"), text(f, "message"), text(f, "help"))).collect()
}

#[test]
fn an_event_that_a_property_names_and_nobody_hears_is_told_where_it_is_given() {
    let slip = "conf::event_unheard: nobody listens to `e_sene`, which `a` raises; did you mean `e_seen`?";
    assert_eq!(told(&check("create('a', 'Drive', { properties = { found = 'e_sene' } })", "")), [slip]);
    let set = check("create('a', 'Drive')", "tell = Configuration { property_set('a.found', 'e_sene') },");
    assert_eq!(told(&set), [slip]);
    for fine in [
        "create('a', 'Drive', { properties = { found = 'e_seen' } })",
        "create('a', 'Drive', { properties = { found = '' } })",
    ] {
        let said = check(fine, "");
        assert_eq!((told(&said), said.0["verdict"].as_str()), (Vec::new(), Some("sound")), "{fine}");
    }
}

#[test]
fn what_names_no_event_or_one_of_others_is_refused() {
    let no_name = "conf::bad_value: `a.found` cannot be \"e seen\": `e seen` is not an event name: an event is a non-empty text without blanks; give it a value of type string, the name of an event or \"\"";
    assert_eq!(told(&check("create('a', 'Drive', { properties = { found = 'e seen' } })", "")), [no_name]);
    let forged = told(&check("create('a', 'Drive', { properties = { found = 'base.ok' } })", ""));
    assert_eq!(
        forged,
        [
            "conf::event_unheard: `base.ok` is an answer of the configurator, which nobody else raises; let `a` raise an event of another name, such as `e_seen`"
        ]
    );
}

#[test]
fn only_a_text_can_name_an_event() {
    let small = Small::new("base = Configuration { create('a', 'Drive') }", STATES, "");
    small.demo.replace("small.yaml", "gain: { type: float,", "gain: { type: float, raises: true,");
    let said = small.check();
    let found = said.of("type::bad_type");
    assert_eq!(found[0]["message"], "`gain` is a float, and only a string can be the name of an event", "{:#}", said.0);
}
