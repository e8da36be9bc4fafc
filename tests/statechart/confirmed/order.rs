//! The order of a node's outgoing transitions (docs/rfsm.md §4.3).

use crate::support::*;
use davit::statechart::Sim;

/// Leaves `t1`…`tn`, all reached from `a` on `e` with these priorities; answers in which order they are tried.
fn order(priorities: &[Option<f64>]) -> Vec<usize> {
    let names: Vec<String> = (1..=priorities.len()).map(|i| format!("t{i}")).collect();
    let mut tried = Vec::new();
    // Taking away the winner's event each time would change the list; so each target has an own event as well, and
    // the order is read off the compiled list.
    let mut parts = vec![s("a", vec![]), t("initial", "a", "")];
    for (name, pn) in names.iter().zip(priorities) {
        parts.push(s(name, vec![]));
        parts.push(tx("a", name, "e", pn.unwrap_or(0.0), ""));
    }
    let chart = compiled(parts);
    let a = chart.find("a").unwrap();
    for edge in chart.outgoing(a) {
        let target = chart.name(chart.ends(edge).1).to_string();
        tried.push(target[1..].parse().unwrap());
    }
    let mut sim = Sim::new(&chart);
    line(&mut sim, "run");
    assert_eq!(leaf_after(&mut sim, "e"), format!("root.t{}", tried[0]), "the first of the list is taken");
    tried
}

#[test]
fn equal_priorities_are_not_in_written_order() {
    assert_eq!(order(&[None; 4]), [1, 3, 2, 4]);
    assert_eq!(order(&[None; 5]), [1, 4, 3, 2, 5]);
    assert_eq!(order(&[None; 7]), [1, 5, 6, 4, 2, 3, 7]);
    assert_eq!(order(&[None; 12]), [1, 8, 7, 9, 10, 11, 6, 4, 5, 2, 3, 12]);
    let some = Some;
    assert_eq!(
        order(&[some(0.0), some(5.0), some(0.0), some(5.0), None, some(-1.0), some(5.0), some(0.0)]),
        [4, 2, 7, 5, 1, 8, 3, 6]
    );
    assert_eq!(order(&[some(-1.0), some(-1.0), some(2.0)]), [3, 2, 1]);
}

/// The sort of a real Lua, over random lists of up to 100.
#[test]
fn the_order_is_what_lua_makes_of_it() {
    let lua = mlua::Lua::new();
    let sort: mlua::Function = lua
        .load(
            "local pn = ...; local list = {}; for i = 1, #pn do list[i] = { i = i, pn = pn[i] } end
             table.sort(list, function(a, b) return a.pn > b.pn end)
             local out = {}; for i, t in ipairs(list) do out[i] = t.i end; return out",
        )
        .into_function()
        .unwrap();
    let mut seed = 1_u64;
    let mut next = |below: u64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) % below
    };
    for _ in 0..300 {
        let length = 2 + next(98);
        let kinds = 1 + next(6);
        let pn: Vec<f64> = (0..length).map(|_| next(kinds) as f64).collect();
        let lua: Vec<usize> = sort.call(pn.clone()).unwrap();
        let ours = order(&pn.into_iter().map(Some).collect::<Vec<_>>());
        assert_eq!(ours, lua);
    }
}

#[test]
fn at_equal_priority_the_outer_scope_wins() {
    let chart = compiled(vec![
        s("a", vec![s("x", vec![]), s("inner", vec![]), t("initial", "x", ""), t("x", "inner", "e")]),
        s("outer", vec![]),
        t("initial", "a", ""),
        t(".a.x", "outer", "e"),
    ]);
    let mut sim = Sim::new(&chart);
    line(&mut sim, "run");
    assert_eq!(leaf_after(&mut sim, "e"), "root.outer");
}
