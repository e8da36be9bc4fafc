//! The lines of `davit sim`, and what it answers.

use crate::support::*;
use davit::statechart::Sim;

#[test]
fn the_object_of_the_design() {
    let chart = compiled(vec![
        s("unsync", vec![Part::Exit("X")]),
        s("sync", vec![s("harmonizing", vec![]), t("initial", "harmonizing", "")]),
        t("initial", "unsync", ""),
        t("unsync", "sync", "e_qos_ok"),
        t("sync", "unsync", "e_link_lost"),
    ]);
    let mut sim = Sim::new(&chart);
    line(&mut sim, "");
    assert_eq!(
        serde_json::to_string(&line(&mut sim, "e_qos_ok")).unwrap(),
        r#"{"active":["root","root.sync","root.sync.harmonizing"],"mode":"done","queue":["e_done@root.sync.harmonizing"],"actions":["exit root.unsync","raise X","entry root.sync","entry root.sync.harmonizing"],"transition":true,"idle":false}"#
    );
}

#[test]
fn lines_that_say_nothing_known_change_nothing() {
    let chart = compiled(vec![s("a", vec![]), t("initial", "a", "")]);
    let mut sim = Sim::new(&chart);
    for text in ["advance", "advance x", "advance -1", "advance 1 2", "advance nan", "advance inf", "a\u{1}b"] {
        assert!(sim.line(text).is_err(), "{text}");
    }
    assert!(sim.machine().active().is_empty());
    assert_eq!(leaf_after(&mut sim, "run advance"), "root.a", "two words are two events");
}

#[test]
fn a_set_too_large_is_cut_and_said() {
    let chart = compiled(vec![s("a", vec![]), t("initial", "a", "")]);
    let mut sim = Sim::new(&chart);
    let seen = line(&mut sim, &"e ".repeat(davit::limits::CHART_QUEUE + 4));
    let [entered, cut] = &seen.notes[..] else { panic!("{:?}", seen.notes) };
    assert!(entered.starts_with("`e` is lost: this step enters the machine"), "{entered}");
    assert!(cut.starts_with("5 events found no room"), "one place was taken by the event of the first entry: {cut}");
}

#[test]
fn an_event_that_no_transition_lists_is_told_from_one_that_is_not_enabled() {
    let chart = compiled(vec![
        s("a", vec![]),
        s("b", vec![]),
        t("initial", "a", ""),
        t("a", "b", "e_slip"),
        t("b", "a", "e_back"),
    ]);
    let mut sim = Sim::new(&chart);
    line(&mut sim, "run");
    assert_eq!(line(&mut sim, "e_slipd").notes, ["no transition lists `e_slipd`; did you mean `e_slip`?"]);
    assert_eq!(line(&mut sim, "undo x y z w v x").notes, ["no transition lists `undo`, `x`, `y`, `z` and others"]);
    assert!(line(&mut sim, "e_back").notes.is_empty(), "known, and not enabled");
    assert!(line(&mut sim, "e_slip x").notes.is_empty(), "a transition is taken");
}
