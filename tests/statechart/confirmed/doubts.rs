//! What rFSM only warns of, or leaves unsaid, and is said here (docs/rfsm.md §2.8 and the list of what it does not check).

use super::doubted;
use crate::support::*;

#[test]
fn each_doubt_is_told_and_a_good_chart_raises_none() {
    let good = || {
        vec![
            s("a", vec![s("x", vec![]), s("y", vec![]), t("initial", "x", ""), t("x", "y", "e"), t("y", "x", "e")]),
            s("b", vec![]),
            t("initial", "a", ""),
            t("a", "b", "f"),
            t("b", "a", "f"),
        ]
    };
    assert!(findings(good()).is_empty(), "{:#?}", findings(good()));
    let with = |more: Vec<Part>| good().into_iter().chain(more).collect::<Vec<_>>();
    let cases = [
        ("chart::no_outgoing", with(vec![s("z", vec![]), t("a", "z", "g")])),
        ("chart::no_outgoing", with(vec![c("k"), t("a", "k", "g")])),
        ("chart::unreachable", with(vec![s("z", vec![]), t("z", "a", "g")])),
        ("chart::order_decides", with(vec![s("z", vec![]), t("a", "z", "f"), t("z", "a", "f")])),
        ("chart::order_decides", with(vec![s("z", vec![]), t("a", "z", ""), t("z", "a", "f")])),
        ("chart::shadowed", with(vec![s("z", vec![]), tx("b", "z", "", 1.0, ""), t("z", "a", "f")])),
        ("chart::never_done", with(vec![tx("b", "a", "e_done@root.nobody", 2.0, "")])),
        ("chart::two_timers", with(vec![t("b", "a", "e_after(1)"), t("b", "a", "e_after(2)")])),
        ("chart::root_exit", with(vec![Part::Exit("bye")])),
        ("chart::root_exit", with(vec![Part::Config("always")])),
    ];
    for (code, parts) in cases {
        doubted(parts, code);
    }
    doubted(vec![s("a", vec![]), t("initial", "a", "e"), t("a", "a", "f")], "chart::entry_waits");
    // Equal priorities that lead to the same are no doubt.
    assert!(findings(with(vec![t("a", "b", "f")])).is_empty());
    assert!(findings(with(vec![t("a", "b", "other")])).is_empty());
}

#[test]
fn find_takes_any_end_of_a_path() {
    let chart = compiled(vec![
        s("up", vec![s("x", vec![]), t("initial", "x", "")]),
        s("down", vec![s("x", vec![]), t("initial", "x", "")]),
        t("initial", "up", ""),
        t("up", "down", "e"),
    ]);
    assert_eq!(chart.fqn(chart.find("up").unwrap()).to_string(), "root.up");
    assert_eq!(chart.find("root.up"), chart.find("up"));
    assert_eq!(chart.fqn(chart.find("down.x").unwrap()).to_string(), "root.down.x");
    assert_eq!(chart.find("x").unwrap_err().to_string(), "`x` is the name of 2 states: root.up.x, root.down.x");
    assert_eq!(
        chart.find("dwon").unwrap_err().to_string(),
        "the coordinator has no state `dwon`; did you mean `down`?"
    );
    assert!(chart.find("initial").is_err(), "a connector is no state");
}
