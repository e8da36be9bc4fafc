//! Every kind of finding that following the coordinators gives has a way from the start: a script goes it on the running
//! product and sees what the finding says, and `davit sim` steps each coordinator alone along it.

use crate::support::Small;
use davit::check::{FOLLOWED, READ};
use serde_json::Value;
use std::collections::BTreeSet;

/// A deployment in which something of a kind is found.
struct Row {
    code: &'static str,
    /// What its message contains.
    says: &'static str,
    small: Small,
    /// What the script goes on with, where it has come to: it fails where the finding is not true.
    then: &'static str,
    /// What the run tells.
    told: &'static [&'static str],
    /// And what it does not tell.
    never: &'static str,
}

/// `a` of the type `One` and `x` of the type `Two` are there when `odd` is asked for; elsewhere `x` may be a `One`.
fn odd(changes: &str, more: &str) -> Small {
    let configurations = format!(
        "base = Configuration {{ create('a', 'One'), create('b', 'One'), create('x', 'Two'), BASE }},
         x_as_one = Configuration {{ create('x', 'One') }}, odd = Configuration {{ {changes} }}, MORE"
    );
    let (base, more) = more.split_once('|').unwrap_or(("", more));
    let configurations = configurations.replace("BASE", base).replace("MORE", more);
    let entry = if more.contains("above") { "{ 'base', 'first', 'above' }" } else { "'base'" };
    let coordinator = format!(
        "idle = state {{}}, building = state {{ entry = {entry} }}, up = state {{}}, odd = state {{ entry = 'odd' }},
         leaving = state {{ entry = {{ 'odd.undo', 'above.undo', 'first.undo', 'base.undo' }} }},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'building', events = {{ 'e_start' }} }},
         trans {{ src = 'building', tgt = 'up', events = {{ '{}.ok' }} }},
         trans {{ src = 'up', tgt = 'odd', events = {{ 'e_odd' }} }},
         trans {{ src = 'building', tgt = 'leaving', events = {{ 'base.failed', 'base.broken', 'e_shutdown' }} }},
         trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'odd', tgt = 'leaving', events = {{ 'e_shutdown', 'odd.failed' }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ 'base.undone' }} }},",
        if entry.len() > 10 { "above" } else { "base" }
    );
    let coordinator =
        if entry.len() > 10 { coordinator } else { coordinator.replace("'above.undo', 'first.undo', ", "") };
    let small = Small::new(&configurations, &coordinator, "");
    small.demo.replace(
        "small.yaml",
        "types:\n",
        "types:
  One:
    ports:
      p: { direction: out, type: float }
      q: { direction: in, type: float }
      m: { direction: out, type: float, unit: m }
      ty: { direction: in, type: float }
      un: { direction: in, type: float, unit: m }
      buf: { direction: in, type: float }
      only: { direction: in, type: float }
    properties:
      k: { type: float, default: 1.0, max: 100.0 }
      mode: { type: int, default: 0, tunable: stopped }
      alone: { type: float, default: 1.0 }
    operations:
      go: { args: [float], effect: none }
      more: { effect: none }
      weld: { effect: irreversible }
  Two:
    ports:
      p: { direction: in, type: float }
      q: { direction: out, type: float }
      ty: { direction: in, type: int }
      un: { direction: in, type: float, unit: N }
      buf: { direction: in, type: float, buffered: true }
    properties:
      k: { type: float, default: 1.0, max: 10.0 }
    operations:
      go: { effect: none }
  Single: { exclusive: [bus] }
",
    );
    small
}

/// A request that is refused for this reason.
fn reason(code: &'static str, changes: &str, more: &str) -> Row {
    Row { code, says: "", small: odd(changes, more), then: "", told: &["odd.failed"], never: "odd.ok" }
}

fn reasons() -> Vec<Row> {
    vec![
        reason("conf::unknown_component", "property_set('y.k', 2.0)", "y = Configuration { create('y', 'One') },"),
        reason("conf::component_exists", "create('a', 'One')", ""),
        reason("conf::still_connected", "destroy('a')", "connect('a.p', 'b.q')|"),
        reason("conf::already_connected", "connect('a.p', 'b.q', { buffer = 4 })", "connect('a.p', 'b.q')|"),
        reason("conf::not_connected", "disconnect('a.p', 'b.q')", ""),
        reason("conf::data_alone", "connect('b.p', 'b.q')", "connect('a.p', 'b.q')|"),
        reason("conf::not_tunable", "property_set('a.mode', 1)", "post_conf_state = { 'a:running' }|"),
        reason("conf::port_driven", "port_write('b.q', 1.0)", "connect('a.p', 'b.q')|"),
        reason(
            "conf::resource_held",
            "create('s', 'Single'), create('t', 'Single'), post_conf_state = { 's:stopped', 't:stopped' }",
            "",
        ),
        reason("conf::port_unmapped", "replace('a', 'Two')", "connect('a.m', 'b.q')|"),
        reason("conf::port_unlike", "replace('x', 'One', { map = { ty = 'q' } })", ""),
        reason("conf::clash", "property_set('a.k', 2.0), property_set('a.k', 3.0)", ""),
        reason("conf::pre_on_created", "create('y', 'One'), pre_conf_state = { 'y:stopped' }", ""),
        reason("conf::post_on_destroyed", "destroy('b'), post_conf_state = { 'b:stopped' }", ""),
        reason("conf::touches_destroyed", "destroy('b'), property_set('b.k', 2.0)", ""),
        reason("conf::unknown_port", "port_write('x.only', 1.0)", ""),
        reason("conf::unknown_property", "property_set('x.alone', 2.0)", ""),
        reason("conf::unknown_operation", "operation_call('x.more')", ""),
        reason("conf::not_an_out_port", "connect('x.p', 'a.q')", ""),
        reason("conf::not_an_in_port", "connect('a.p', 'x.q')", ""),
        reason("conf::port_types", "connect('a.p', 'x.ty')", ""),
        reason("conf::port_units", "connect('a.m', 'x.un')", ""),
        reason("conf::needs_buffer", "connect('a.p', 'x.buf')", ""),
        reason("conf::bad_value", "property_set('x.k', 20.0)", ""),
        reason("conf::port_not_writable", "port_write('x.buf', 1.0)", ""),
        reason("conf::bad_arguments", "operation_call('x.go', 0.5)", ""),
        reason(
            "stack::group",
            "group = 'g', property_set('a.k', 3.0)",
            "first = Configuration { group = 'g', create('c', 'One') }, above = Configuration { property_set('c.k', 2.0) },",
        ),
        reason("conf::holds_never", "timeout = 0.5, holds = in_state('a', 'running'), property_set('a.k', 2.0)", ""),
        Row {
            then: "raise('e_shutdown') wait_answer('odd.undo.failed', 1)",
            told: &["odd.ok", "odd.undo.failed"],
            never: "odd.undone",
            ..reason("conf::irreversible", "operation_call('a.weld')", "")
        },
        Row {
            then: "assert_running('arm')",
            told: &["odd.ok"],
            never: "odd.failed",
            ..reason("conf::actuator_by_default", "post_conf_state = { '_default:running' }", "create('arm', 'Arm')|")
        },
    ]
}

/// Up and down again, where `up` has what is added to it.
const LIFE: &str =
    "idle = state {}, building = state { entry = 'base' }, up = state {}, leaving = state { entry = 'base.undo' },
    trans { src = 'initial', tgt = 'idle' },
    trans { src = 'idle', tgt = 'building', events = { 'e_start' } },
    trans { src = 'building', tgt = 'up', events = { 'base.ok' } },
    trans { src = 'building', tgt = 'leaving', events = { 'base.failed', 'base.broken', 'e_shutdown' } },
    trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown' } },
    trans { src = 'leaving', tgt = 'idle', events = { 'base.undone' } },";

const BASE: &str = "base = Configuration { create('a', 'Drive') },";

fn row(code: &'static str, says: &'static str, small: Small, then: &'static str, told: &'static [&'static str]) -> Row {
    Row { code, says, small, then, told, never: "nothing of this" }
}

fn coordinators() -> Vec<Row> {
    let life = |more: &str| format!("{LIFE}{more}");
    let without = |line: &str, with: &str| LIFE.replace(line, with);
    let one = format!(
        "{BASE} one = Configuration {{ property_set('a.gain', 2.0) }}, all = Configuration {{ destroy('a') }},"
    );
    let round = |undo: &str| {
        life(&format!(
            "on = state {{ entry = 'one' }}, {undo}
             trans {{ src = 'up', tgt = 'on', events = {{ 'e_go' }} }},
             trans {{ src = 'on', tgt = 'leaving', events = {{ 'e_shutdown' }} }},"
        ))
    };
    let shared = |own: &str, more: &str| {
        format!(
            "idle = state {{}}, up = state {{ entry = '{own}' }}, leaving = state {{ entry = '{own}.undo' }},
             trans {{ src = 'initial', tgt = 'idle' }}, {more}
             trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'leaving', tgt = 'idle', events = {{ '{own}.undone' }} }}, left = state {{}},
             trans {{ src = 'leaving', tgt = 'left', events = {{ '{own}.undo.failed', '{own}.undo.broken' }} }},
             trans {{ src = 'left', tgt = 'leaving', events = {{ 'e_shutdown' }} }},"
        )
    };
    let apart = |own: &str| shared(own, "trans { src = 'idle', tgt = 'up', events = { 'e_start' } },");
    let safe = "base = Configuration { create('arm', 'Arm'), create('a', 'Drive') },
        stop = Configuration { safe = true, property_set('a.gain', 0.0) },";
    let stopped = "stopped = state { entry = 'stop' },
        trans { src = 'building', tgt = 'stopped', events = { 'e_estop' } },
        trans { src = 'stopped', tgt = 'leaving', events = { 'e_shutdown' }, effect = 'stop.undo' },";
    vec![
        row(
            "coord::request_refused",
            "`odd` is refused when it is asked for",
            odd("create('a', 'One')", ""),
            "",
            &["odd.failed"],
        ),
        row("coord::request_refused", "squashed", piled(), "", &["keep.undo.failed"]),
        row(
            "coord::refused_by_other",
            "`one.undo` of `first` is refused because of the frames of `second`",
            Small::several(
                "one = Configuration { create('a', 'Drive') }, two = Configuration { property_set('a.gain', 2.0) },",
                &[
                    ("first", &apart("one")),
                    (
                        "second",
                        &shared(
                            "two",
                            "wait = state {}, trans { src = 'idle', tgt = 'wait', events = { 'e_start' } },
                        trans { src = 'wait', tgt = 'up', events = { 'e_use' } },
                        trans { src = 'wait', tgt = 'idle', events = { 'e_shutdown' } },",
                        ),
                    ),
                ],
                "",
            ),
            "",
            &["one.undo.failed"],
        ),
        row(
            "coord::raced",
            "`soft` of `first` and `hard` of `second` are asked for at once: of `property_set a.gain = 1.5` and `property_set a.gain = 2.0`",
            Small::several(
                "one = Configuration { create('a', 'Drive') }, soft = Configuration { property_set('a.gain', 1.5) },
                 hard = Configuration { property_set('a.gain', 2.0) },",
                &[
                    (
                        "first",
                        &shared(
                            "one",
                            "trans { src = 'idle', tgt = 'up', events = { 'e_start' } }, softly = state { config = 'soft' },
                             trans { src = 'up', tgt = 'softly', events = { 'e_use' } },
                             trans { src = 'softly', tgt = 'leaving', events = { 'e_shutdown' } },",
                        ),
                    ),
                    (
                        "second",
                        "idle = state {}, up = state {}, firmly = state { config = 'hard' },
                         trans { src = 'initial', tgt = 'idle' },
                         trans { src = 'idle', tgt = 'up', events = { 'e_start' } },
                         trans { src = 'up', tgt = 'firmly', events = { 'e_use' } },
                         trans { src = 'up', tgt = 'idle', events = { 'e_shutdown' } },
                         trans { src = 'firmly', tgt = 'idle', events = { 'e_shutdown', 'hard.failed', 'hard.broken' } },",
                    ),
                ],
                "",
            ),
            "wait(0.5) local gain = property('a.gain') assert(gain == 1.5 or gain == 2.0, gain)",
            &["soft.ok", "hard.ok"],
        ),
        row(
            "coord::stack_grows",
            "going round applies `one` again and again",
            Small::new(
                &one,
                &round(
                    "trans { src = 'on', tgt = 'up', events = { 'one.ok' } }, off = state { entry = 'one.undo' },
                trans { src = 'up', tgt = 'off', events = { 'e_off' } },
                trans { src = 'off', tgt = 'leaving', events = { 'e_shutdown' } },",
                ),
                "",
            ),
            "local n = 0 for _, frame in ipairs(stack()) do if frame.configuration == 'one' then n = n + 1 end end assert(n > 2, n)",
            &["one.ok"],
        ),
        row(
            "coord::endless",
            "answers go round for ever",
            Small::new(
                &one,
                &round(
                    "off = state { entry = 'one.undo' }, trans { src = 'on', tgt = 'off', events = { 'one.ok' } },
                    trans { src = 'off', tgt = 'on', events = { 'one.undone' } },
                    trans { src = 'off', tgt = 'leaving', events = { 'e_shutdown' } },",
                ),
                "",
            ),
            "wait_answer('one.ok', 1) wait_answer('one.undone', 1)",
            &["one.ok", "one.undone"],
        ),
        row(
            "coord::lost_unheard",
            "nobody hears `base.lost`",
            Small::new(
                "base = Configuration { create('a', 'Drive'), post_conf_state = { 'a:running' }, holds = in_state('a', 'running') },",
                LIFE,
                "",
            ),
            "assert_state('a', 'faulted')",
            &["base.lost"],
        ),
        row(
            "coord::reverted_unheard",
            "nobody hears `try.reverted`",
            Small::new(
                "base = Configuration { create('a', 'Drive') },
                 try = Configuration { create('b', 'Drive'), confirm = { event = 'e_fine', within = 1.0 } },",
                &life(
                    "trying = state { entry = 'try' }, tried = state {},
                    trans { src = 'up', tgt = 'trying', events = { 'e_try' } },
                    trans { src = 'trying', tgt = 'tried', events = { 'try.ok' } },
                    trans { src = 'trying', tgt = 'trying', events = { 'try.reverted' } },
                    trans { src = 'tried', tgt = 'leaving', events = { 'e_shutdown' }, effect = 'try.undo' },
                    trans { src = 'trying', tgt = 'leaving', events = { 'e_shutdown' }, effect = 'try.undo' },",
                ),
                "",
            ),
            "assert(state('b') == nil)",
            &["try.reverted"],
        ),
        row(
            "coord::stuck",
            "nothing leads on",
            Small::new(BASE, &life("lost = state {}, trans { src = 'up', tgt = 'lost', events = { 'e_lost' } },"), ""),
            "raise('e_shutdown') wait(2) wait_state('lost', 0)",
            &[],
        ),
        row(
            "coord::leftovers",
            "a way down leaves a behind",
            Small::new(BASE, &life("trans { src = 'up', tgt = 'idle', events = { 'e_quit' } },"), ""),
            "wait(2) assert_state('a', 'unconfigured')",
            &[],
        ),
        row(
            "coord::no_way_down",
            "no way leads to `idle`",
            Small::new(
                BASE,
                &life(
                    "here = state {}, there = state {}, trans { src = 'up', tgt = 'here', events = { 'e_trap' } },
                    trans { src = 'here', tgt = 'there', events = { 'e_trap' } },
                    trans { src = 'there', tgt = 'here', events = { 'e_trap' } },",
                ),
                "",
            ),
            "raise('e_shutdown') wait(2) raise('e_trap') wait(2) assert(not table.concat(active(), ' '):find('idle', 1, true))",
            &[],
        ),
        row(
            "coord::no_way_down",
            "only a second `e_shutdown` leads down",
            Small::new(
                BASE,
                &(without("trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown' } },", "")
                    + "parked = state {}, trans { src = 'up', tgt = 'parked', events = { 'e_shutdown' } },
                       trans { src = 'parked', tgt = 'leaving', events = { 'e_shutdown' } },"),
                "",
            ),
            "wait(2) wait_state('parked', 0) raise('e_shutdown') wait_state('idle', 1)",
            &[],
        ),
        row(
            "coord::no_way_down",
            "no way leads down together",
            Small::several(
                "one = Configuration { create('a', 'Drive') }, two = Configuration { create('b', 'Drive') },",
                &[
                    (
                        "first",
                        &(apart("one")
                            + "lost = state { entry = 'e_lost' }, found = state {},
                               trans { src = 'up', tgt = 'lost', events = { 'e_go' } },
                               trans { src = 'lost', tgt = 'found', events = { 'e_go' } },
                               trans { src = 'found', tgt = 'lost', events = { 'e_go' } },"),
                    ),
                    (
                        "second",
                        &(apart("two")
                            + "heard = state {}, trans { src = 'up', tgt = 'heard', events = { 'e_lost' } },
                               trans { src = 'heard', tgt = 'leaving', events = { 'e_shutdown' } },"),
                    ),
                ],
                "emits: [e_lost]\n",
            ),
            "raise('e_shutdown') wait(2) raise('e_go') wait(2)
             assert(not table.concat(active(), ' '):find('first:root.idle', 1, true))",
            &[],
        ),
        Row {
            never: "stop.ok",
            ..row(
                "coord::safety_unheard",
                "`e_estop` does not lead to a `safe` configuration",
                Small::new(safe, &life(stopped), "safety: [e_estop]\n"),
                "wait(2) for _, frame in ipairs(stack()) do assert(frame.configuration ~= 'stop') end",
                &[],
            )
        },
        row(
            "deploy::never_up",
            "the bring-up stops",
            Small::new(
                BASE,
                &(without("tgt = 'up', events = { 'base.ok' }", "tgt = 'lost', events = { 'base.ok' }")
                    + "lost = state {}, trans { src = 'lost', tgt = 'leaving', events = { 'e_shutdown' } },"),
                "",
            ),
            "wait(2) wait_state('lost', 0)",
            &["base.ok"],
        ),
        row(
            "deploy::by_hand",
            "the bring-up waits in `root.building` for `e_base`",
            Small::new(BASE, &without("tgt = 'up', events = { 'base.ok' }", "tgt = 'up', events = { 'e_base' }"), ""),
            "wait(2) wait_state('up', 0)",
            &["base.ok"],
        ),
        row(
            "deploy::never_down",
            "the shutdown stops",
            Small::new(BASE, &without("trans { src = 'leaving', tgt = 'idle', events = { 'base.undone' } },", ""), ""),
            "wait(2) wait_state('leaving', 0)",
            &["base.undone"],
        ),
        row(
            "stack::squashed",
            "squashed together with others",
            Small::new(
                "base = Configuration { create('a', 'Drive') }, one = Configuration { property_set('a.gain', 2.0) },
                 two = Configuration { property_set('a.gain', 3.0) },",
                "idle = state {}, building = state { entry = 'base' }, first = state { entry = 'one' },
                 second = state { entry = 'two' }, up = state {}, leaving = state { entry = 'base.undo' },
                 trans { src = 'initial', tgt = 'idle' },
                 trans { src = 'idle', tgt = 'building', events = { 'e_start' } },
                 trans { src = 'building', tgt = 'first', events = { 'base.ok' } },
                 trans { src = 'first', tgt = 'second', events = { 'one.ok' } },
                 trans { src = 'second', tgt = 'up', events = { 'two.ok' } },
                 trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown' } },
                 trans { src = 'leaving', tgt = 'idle', events = { 'base.undone' } },",
                "limits: { stack: 2 }\n",
            ),
            "wait(2) wait_state('leaving', 0)",
            &["base.undo.failed"],
        ),
        row(
            "deploy::leftovers",
            "the shutdown leaves a behind",
            Small::new(
                BASE,
                &LIFE.replace("tgt = 'leaving', events = { 'e_shutdown' }", "tgt = 'idle', events = { 'e_shutdown' }"),
                "",
            ),
            "wait(2) assert_state('a', 'unconfigured')",
            &[],
        ),
    ]
}

/// Frames that nobody undoes pile up on a round, until one that is undone at last is squashed.
fn piled() -> Small {
    let configurations = format!(
        "{BASE} keep = Configuration {{ property_set('a.mode', 1) }}, one = Configuration {{ property_set('a.gain', 2.0) }},
         two = Configuration {{ property_set('a.gain', 3.0) }}, all = Configuration {{ destroy('a') }},"
    );
    let states = "idle = state {}, building = state { entry = { 'base', 'keep' } }, up = state {},
        first = state { entry = 'one' }, second = state { entry = 'two' },
        undoing = state { entry = 'keep.undo' }, leaving = state { entry = 'all' },
        trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'building', events = { 'e_start' } },
        trans { src = 'building', tgt = 'up', events = { 'keep.ok' } },
        trans { src = 'up', tgt = 'first', events = { 'e_go' } },
        trans { src = 'first', tgt = 'second', events = { 'one.ok' } },
        trans { src = 'second', tgt = 'up', events = { 'two.ok' } },
        trans { src = 'up', tgt = 'undoing', events = { 'e_undo' } },
        trans { src = 'undoing', tgt = 'leaving', events = { 'keep.undone', 'e_shutdown' } },
        trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'leaving', tgt = 'idle', events = { 'all.ok' } },";
    Small::new(&configurations, states, "limits: { stack: 6 }\n")
}

/// Goes the way to the finding by its script, and sees there what the finding says; else what happened.
fn goes(row: &Row) -> Option<String> {
    let said = row.small.demo.run(&["check", "small.yaml", "--json"]).json();
    let all = said["findings"].as_array().unwrap();
    let is = |f: &&Value| {
        let way = !f["trace"].as_array().unwrap().is_empty();
        f["code"] == row.code && way && f["message"].as_str().unwrap().contains(row.says)
    };
    let Some(at) = all.iter().position(|f| is(&f)) else {
        return Some(format!("{} {}: there is none: {:?}", row.code, row.says, messages(all)));
    };
    let number = (at + 1).to_string();
    let made = row.small.demo.run(&["check", "small.yaml", "--trace", &number, "--as", "way.lua"]);
    if !made.err.is_empty() {
        return Some(format!("{} {}: {}{}", row.code, row.says, made.err, way(row, &number)));
    }
    let text = std::fs::read_to_string(row.small.demo.path("way.lua")).unwrap();
    row.small.demo.write("goes.lua", &format!("{text}{}\n", row.then));
    let ran = row.small.demo.run(&["run", "goes.lua", "--clock", "simulated", "--platform", "simulated"]);
    let seen = row.told.iter().all(|told| ran.out.contains(told)) && !ran.out.contains(row.never);
    if ran.err.contains("davit::script") || !seen {
        return Some(format!("{} {}\n{}{text}\n{}\n{}", row.code, row.says, way(row, &number), ran.out, ran.err));
    }
    alone(row, &number, &all[at])
}

/// What was found instead.
fn messages(all: &[Value]) -> Vec<&str> {
    all.iter().flat_map(|f| [f["code"].as_str().unwrap(), f["message"].as_str().unwrap()]).collect()
}

/// The way as it is shown.
fn way(row: &Row, number: &str) -> String {
    row.small.demo.run(&["check", "small.yaml", "--trace", number]).out
}

/// Steps each coordinator alone along the way: it comes to the same state.
fn alone(row: &Row, number: &str, finding: &Value) -> Option<String> {
    for place in finding["trace"].as_array().unwrap().last().unwrap()["states"].as_array().unwrap() {
        let of: Vec<&str> = place["coordinator"].as_str().into_iter().flat_map(|name| ["--of", name]).collect();
        let write = [&["check", "small.yaml", "--trace", number, "--as", "way.events"], &of[..]].concat();
        let made = row.small.demo.run(&write);
        let stepped = [&["sim", "small.yaml", "--events", "way.events", "--json"], &of[..]].concat();
        let stepped = row.small.demo.run(&stepped);
        let text = std::fs::read_to_string(row.small.demo.path("way.events")).unwrap();
        let last: Option<Value> = stepped.out.lines().last().and_then(|line| serde_json::from_str(line).ok());
        let leaf = last.as_ref().and_then(|last| last["active"].as_array()?.last());
        if !made.err.is_empty() || leaf != Some(&place["state"]) {
            let way = way(row, number);
            return Some(format!(
                "{} {} alone\n{way}{}{text}\n{}{}",
                row.code, row.says, made.err, stepped.out, stepped.err
            ));
        }
    }
    None
}

fn all_go(rows: &[Row]) {
    let failed: Vec<String> = rows.iter().filter_map(goes).collect();
    assert!(failed.is_empty(), "{}", failed.join("\n----\n"));
}

#[test]
fn why_requests_are_refused_is_seen_on_the_way() {
    all_go(&reasons());
}

#[test]
fn what_coordinators_come_to_is_seen_on_the_way() {
    all_go(&coordinators());
}

/// Of every code with a way there is one above.
#[test]
fn every_kind_of_finding_is_gone() {
    let gone: BTreeSet<&str> = reasons().iter().chain(&coordinators()).map(|row| row.code).collect();
    let all: BTreeSet<&str> = FOLLOWED.iter().map(|code| code.0).collect();
    assert_eq!(gone, all);
}

/// Codes are listed with a way, or with the reason why there is none.
#[test]
fn every_code_that_check_gives_is_listed() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/src");
    let listed = std::fs::read_to_string(format!("{root}/check/shown.rs")).unwrap();
    let words = |text: &str| -> BTreeSet<String> {
        let text: String =
            text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join(" ");
        text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).map(str::to_owned).collect()
    };
    let codes = std::fs::read_to_string(format!("{root}/model/codes.rs")).unwrap();
    let codes: Vec<&str> =
        codes.lines().filter_map(|line| line.split_once(" = \"")).map(|(name, _)| name.trim()).collect();
    assert!(codes.len() > 150, "{codes:?}");
    let listed = words(&listed);
    for folder in ["check", "plan", "system"] {
        for file in std::fs::read_dir(format!("{root}/{folder}")).unwrap() {
            let path = file.unwrap().path();
            if path.extension().is_none_or(|ending| ending != "rs") || path.ends_with("tests.rs") {
                continue;
            }
            let used = words(&std::fs::read_to_string(&path).unwrap());
            for code in codes.iter().filter(|code| used.contains(**code)) {
                assert!(listed.contains(*code), "{}: {code} is not listed in check/shown.rs", path.display());
            }
        }
    }
    let ways: BTreeSet<&str> = FOLLOWED.iter().map(|code| code.0).collect();
    let both = READ.iter().flat_map(|(_, codes)| *codes).filter(|code| ways.contains(code.0));
    assert_eq!(both.count(), 0);
}

/// What has no way says why, and of several coordinators one is stepped alone.
#[test]
fn what_has_no_way_says_why() {
    let row = coordinators().into_iter().find(|row| row.code == "coord::refused_by_other").unwrap();
    let said = row.small.demo.run(&["check", "small.yaml", "--json"]).json();
    let all = said["findings"].as_array().unwrap();
    let number = |code: &str| (all.iter().position(|f| f["code"] == code).unwrap() + 1).to_string();
    for script in ["way.lua", "way.events"] {
        let shared = number("coord::shared");
        let made = row.small.demo.run(&["check", "small.yaml", "--trace", &shared, "--as", script, "--of", "first"]);
        assert!(
            made.code == 1 && made.err.contains("ask for together: no way leads to it"),
            "{}{}",
            made.code,
            made.err
        );
    }
    let refused = number("coord::refused_by_other");
    for (of, says) in [(&[][..], "several coordinators"), (&["--of", "third"], "no coordinator `third`")] {
        let made =
            row.small.demo.run(&[&["check", "small.yaml", "--trace", &refused, "--as", "way.events"], of].concat());
        assert!(made.code == 2 && made.err.contains(says) && made.err.contains("first, second"), "{}", made.err);
    }
}
