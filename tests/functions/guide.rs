//! The example of `docs/from-rfsm.md`: both models answer every order of events alike.

use super::support::{Model, read};
use davit::statechart::{Sim, compile};

const EVENTS: [&str; 5] = ["e_grasp", "e_contact", "e_slipped", "e_released", "e_reset"];

/// The block of Lua after a mark.
fn block(mark: &str) -> String {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/from-rfsm.md")).expect("the guide");
    let after = text.split(&format!("<!-- {mark} -->\n```lua\n")).nth(1).expect("the mark");
    after.split("```").next().expect("an end").to_owned()
}

/// The state inside the root, and how often the hand was closed.
fn seen(active: &[String], closed: usize) -> (String, usize) {
    let own = active.get(1).cloned().unwrap_or_default();
    (own.trim_start_matches("root.").to_owned(), closed)
}

#[test]
fn the_rich_and_the_pure_coordinator_answer_alike() {
    let rich = Model::new(&block("rich"));
    let pure = read(&[("model.lua", &block("pure"))], &[]);
    assert!(pure.program.is_none(), "it is pure");
    let (pure, findings) = compile(&pure.coordinator.expect("a chart"));
    let pure = pure.unwrap_or_else(|| panic!("{findings:?}"));
    // All orders of four events: as numbers to base five.
    for order in 0..5_usize.pow(4) {
        let events: Vec<&str> = (0..4).map(|digit| EVENTS[order / 5_usize.pow(digit) % 5]).collect();
        let (mut a, mut b) = (rich.sim(), Sim::new(&pure));
        let (mut closed_a, mut closed_b) = (0, 0);
        for line in ["run"].iter().chain(events.iter().flat_map(|event| [event, &"run"])) {
            let (x, y) = (a.line(line).unwrap(), b.line(line).unwrap());
            closed_a += x.notes.iter().filter(|n| *n == "close the hand").count();
            closed_b += y.actions.iter().filter(|n| *n == "raise close_hand").count();
            assert_eq!(seen(&x.active, closed_a), seen(&y.active, closed_b), "after {line} of {events:?}");
        }
    }
}
