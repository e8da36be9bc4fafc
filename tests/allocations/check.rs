//! What `check` asks for memory for: what a state is made of is there already, and most of what leads from one to the next was worked out
//! before.

use crate::{counting, family};
use davit::app;
use davit::check::run;
use davit::lang::LoadOptions;
use davit::libraries;

/// So often at most memory is asked for, for a hundred transitions that are followed.
const FOR_A_HUNDRED: u64 = 250;

/// It is counted on a family in which almost all of the time goes into following: ten modes whose undos may fail.
#[test]
fn following_a_transition_asks_for_memory_about_twice() {
    let folder = tempfile::tempdir().expect("a folder of ours");
    let file = family::write(folder.path(), 1, 10);
    let read = app::read(&file, &LoadOptions::default(), libraries::builtin());
    let read = read.unwrap_or_else(|_| panic!("the family is not read"));
    let (deployment, mut transitions) = (read.deployment, 0);
    let made = counting::made_by(|| transitions = run(deployment, &read.catalogue).explored.transitions as u64);
    assert!(transitions > 20_000, "{transitions} were followed");
    let of_a_hundred = made * 100 / transitions;
    assert!(of_a_hundred <= FOR_A_HUNDRED, "{of_a_hundred} times for a hundred transitions");
}
