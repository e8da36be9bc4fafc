//! The tests that rFSM's authors named (`rfsm.md` §10), where they mean something without functions, written anew; and
//! every statement that was confirmed by running rFSM.

use crate::support::*;
use davit::statechart::Sim;

#[test]
fn initial_entry() {
    let chart = compiled(vec![s("off", vec![]), s("on", vec![]), t("initial", "off", ""), t("off", "on", "e_on")]);
    let mut sim = Sim::new(&chart);
    let seen = line(&mut sim, "run");
    assert_eq!(seen.active, ["root", "root.off"]);
    assert_eq!(serde_json::to_value(&seen).unwrap()["mode"], "done");
    assert!(seen.idle && seen.transition);
}
