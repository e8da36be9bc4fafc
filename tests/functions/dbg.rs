//! What a model's own `dbg` printer is told: rFSM's tags in its order (docs/rfsm.md §8).

use super::support::Model;
use davit::time::Clock;

/// `TAG first-names…` of every call, line by line of the script.
fn told(model: &Model, lines: &[&str]) -> Vec<Vec<String>> {
    let mut sim = model.sim_on(Some(Clock::simulated()));
    lines.iter().map(|line| sim.line(line).expect("a line").notes).collect()
}

const MODEL: &str = "return rfsm.state {
    dbg = function(tag, ...) print(tag .. ' ' .. table.concat({ ... }, ' ')) end,
    a = rfsm.state { entry = function(fsm) rfsm.send_events(fsm, 'x', 7) end, a1 = rfsm.state {}, rfsm.trans { src='initial', tgt='a1' } },
    c = rfsm.conn {},
    b = rfsm.state { b1 = rfsm.state { doo = function() rfsm.yield(true) end }, rfsm.trans { src='initial', tgt='b1' } },
    rfsm.trans { src='initial', tgt='a' },
    rfsm.trans { src='a', tgt='c', events={'e'}, guard = function() end },
    rfsm.trans { src='c', tgt='b' } }";

#[test]
fn a_models_own_dbg_hears_of_all_in_order() {
    let seen = told(&Model::new(MODEL), &["", "e", "none", "", "run"]);
    assert_eq!(
        seen[0],
        [
            "STATE_ENTER root",
            "EXEC_PATH root.initial -> root.a.initial -> root.a.a1",
            "TRANS_EXIT up to root.initial lca: root",
            "EFFECT T={ src='root.initial', tgt='root.a.initial', events='{}' }",
            "TRANS_ENTER lca: root down to root.a.initial",
            "RAISED x, 7",
            "STATE_ENTER root.a",
            "TRANS_EXIT up to root.a.initial lca: root.a",
            "EFFECT T={ src='root.a.initial', tgt='root.a.a1', events='{}' }",
            "TRANS_ENTER lca: root.a down to root.a.a1",
            "RAISED e_done@root.a.a1",
            "STATE_ENTER root.a.a1",
        ]
    );
    assert_eq!(
        seen[1],
        [
            "TRANSITION looking for transitions for x, 7, e_done@root.a.a1, e",
            "CHECKING depth: 0 root",
            "CHECKING depth: 1 root.a",
            "EXEC_PATH root.a -> root.c -> root.b.initial -> root.b.b1",
            "TRANS_EXIT up to root.a lca: root",
            "STATE_EXIT root.a.a1",
            "STATE_EXIT root.a",
            "EFFECT T={ src='root.a', tgt='root.c', events='e' }",
            "TRANS_ENTER lca: root down to root.c",
            "TRANS_EXIT up to root.c lca: root",
            "EFFECT T={ src='root.c', tgt='root.b.initial', events='{}' }",
            "TRANS_ENTER lca: root down to root.b.initial",
            "STATE_ENTER root.b",
            "TRANS_EXIT up to root.b.initial lca: root.b",
            "EFFECT T={ src='root.b.initial', tgt='root.b.b1', events='{}' }",
            "TRANS_ENTER lca: root.b down to root.b.b1",
            "STATE_ENTER root.b.b1",
        ]
    );
    assert_eq!(
        seen[2],
        [
            "TRANSITION looking for transitions for none",
            "CHECKING depth: 0 root",
            "CHECKING depth: 1 root.b",
            "CHECKING depth: 2 root.b.b1",
            "TRANSITION none is enabled",
            "DOO begins: root.b.b1",
            "no transition lists `none`",
        ]
    );
    assert_eq!(seen[3], ["DOO is through: root.b.b1", "RAISED e_done@root.b.b1"]);
    assert_eq!(seen[4].last().map(String::as_str), Some("HIBERNATING nothing to do"), "{:?}", seen[4]);
}

#[test]
fn a_chart_without_guards_tells_the_same_of_a_straight_way() {
    let text = "return rfsm.state { dbg = function(tag, ...) print(tag .. ' ' .. table.concat({ ... }, ' ')) end,
        a = rfsm.state { exit = function() print('exit runs') end }, b = rfsm.state { entry = function() print('entry runs') end },
        rfsm.trans { src='initial', tgt='a' }, rfsm.trans { src='a', tgt='b', events={'e'} } }";
    let seen = told(&Model::new(text), &["run", "e"]);
    assert_eq!(
        seen[1],
        [
            "TRANSITION looking for transitions for e",
            "CHECKING depth: 0 root",
            "CHECKING depth: 1 root.a",
            "EXEC_PATH root.a -> root.b",
            "TRANS_EXIT up to root.a lca: root",
            "exit runs",
            "STATE_EXIT root.a",
            "EFFECT T={ src='root.a', tgt='root.b', events='e' }",
            "TRANS_ENTER lca: root down to root.b",
            "entry runs",
            "RAISED e_done@root.b",
            "STATE_ENTER root.b",
        ]
    );
}

#[test]
fn tags_can_be_chosen_and_a_dbg_that_fails_is_told() {
    let model = |dbg: &str| {
        Model::new(&format!(
            "return rfsm.state {{ dbg = {dbg}, a = rfsm.state {{ entry = function() end }}, rfsm.trans {{ src='initial', tgt='a' }} }}"
        ))
    };
    let chosen = model("rfsmpp.gen_dbgcolor('name', { STATE_ENTER = true }, false)");
    assert_eq!(told(&chosen, &[""])[0], ["name: STATE_ENTER root", "name: STATE_ENTER root.a"]);
    for silent in ["false", "nil", "function() end"] {
        assert!(told(&model(silent), &["run"])[0].is_empty(), "{silent}");
    }
    let seen = told(&model("function(tag) if tag == 'EFFECT' then error('no', 0) end end"), &["run"]);
    assert_eq!(seen[0], ["error: DBG error executing dbg: no"]);
    // What it sends is an event like any other, and it may not step the machine.
    let steps = "local machine return rfsm.state { entry = function(fsm) machine = fsm end,
        dbg = function(tag) if tag == 'EFFECT' then rfsm.run(machine) end end,
        a = rfsm.state {}, rfsm.trans { src='initial', tgt='a' } }";
    let seen = told(&Model::new(steps), &["run"]);
    assert!(seen[0][0].starts_with("error: DBG") && seen[0][0].contains("stepped by Davit"), "{seen:?}");
}

#[test]
fn a_machine_of_the_models_own_may_be_given_a_dbg_later() {
    super::lab::run(
        "local m = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'} } })
         rfsm.run(m)
         local tags = {}
         m.dbg = function(tag, name) tags[#tags + 1] = tag end
         rfsm.send_events(m, 'e') rfsm.run(m)
         eq(tags, { 'RAISED', 'TRANSITION', 'CHECKING', 'CHECKING', 'EXEC_PATH', 'TRANS_EXIT', 'STATE_EXIT', 'EFFECT', 'TRANS_ENTER',
           'RAISED', 'STATE_ENTER', 'TRANSITION', 'CHECKING', 'CHECKING', 'TRANSITION', 'HIBERNATING' })",
    );
}

#[test]
fn a_chart_whose_only_function_is_its_dbg_tells_it() {
    let text = "return rfsm.state { dbg = function(tag, name) if tag == 'STATE_ENTER' then print(name) end end,
        a = rfsm.state {}, b = rfsm.state {},
        rfsm.trans { src='initial', tgt='a' }, rfsm.trans { src='a', tgt='b', events={'e'} } }";
    assert_eq!(told(&Model::new(text), &["run", "e"]), [vec!["root", "root.a"], vec!["root.b"]]);
    for silent in ["dbg = false,", "", "err = function() end,"] {
        assert!(
            Model::new(&format!(
                "return rfsm.state {{ {silent} a = rfsm.state {{}}, rfsm.trans {{ src='initial', tgt='a' }} }}"
            ))
            .is_pure()
        );
    }
}

#[test]
fn a_dbg_that_a_function_gives_and_takes_away_hears_of_the_steps_between() {
    let text = "return rfsm.state {
        a = rfsm.state { entry = function(fsm) fsm.dbg = function(tag, name) if tag == 'STATE_ENTER' then print(name) end end end },
        b = rfsm.state { entry = function(fsm) fsm.dbg = false end }, c = rfsm.state {},
        rfsm.trans { src='initial', tgt='a' }, rfsm.trans { src='a', tgt='b', events={'e'} }, rfsm.trans { src='b', tgt='c', events={'e'} } }";
    let seen = told(&Model::new(text), &["run", "f", "e", "e"]);
    assert!(seen[0].is_empty() && seen[3].is_empty(), "{seen:?}");
    let text = text.replace("fsm.dbg = false", "");
    let seen = told(&Model::new(&text), &["run", "e", "e"]);
    assert_eq!(seen[1..], [vec!["root.b"], vec!["root.c"]]);
}
