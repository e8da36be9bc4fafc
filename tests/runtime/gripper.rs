//! The gripper of `examples/own_components`, as `docs/components.md` tells how it is written.

#[path = "../../examples/own_components/gripper.rs"]
mod component;

use davit::Clock;
use davit::app::script::{self, Interrupt, ScriptOptions};
use davit::component::Library;
use davit::lang::LoadOptions;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Arc, Mutex};

fn text(file: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file))
        .unwrap_or_else(|why| panic!("{file}: {why}"))
}

/// What runs is what the chapter shows.
#[test]
fn the_chapter_shows_lines_of_the_example() {
    let chapter = text("docs/components.md");
    let sources = text("examples/own_components/gripper.rs") + &text("examples/own_components.rs");
    let blocks: Vec<&str> =
        chapter.split("```rust\n").skip(1).map(|rest| rest.split("```").next().expect("its end")).collect();
    assert!(blocks.len() > 5);
    for block in blocks {
        assert!(sources.contains(block), "the example has no such lines:\n{block}");
    }
}

/// Each word that a declaration may have stands in the chapter's table, and no other.
#[test]
fn the_chapter_has_each_word_of_a_declaration() {
    let chapter = text("docs/components.md");
    let (_, rest) = chapter.split_once("| word | of |").expect("a table");
    let firsts = rest.lines().skip(2).take_while(|line| line.starts_with('|'));
    let told: BTreeSet<&str> =
        firsts.flat_map(|row| row.split('|').nth(1).unwrap_or_default().split('`').skip(1).step_by(2)).collect();
    let words = text("src/runtime/words.rs");
    let known: BTreeSet<&str> = words
        .split("    pub fn ")
        .skip(1)
        .map(|rest| rest.split(['(', '<']).next().expect("a name"))
        .filter(|name| !["parameter", "injection"].contains(name))
        .collect();
    assert_eq!(told, known);
}

#[test]
fn its_story_goes_to_its_end() {
    let said = Arc::new(Mutex::new(String::new()));
    let heard = said.clone();
    let clock = Clock::simulated();
    let mine = Library::new("mine").with::<component::Gripper>("mine.Gripper");
    let end = script::run(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/own_components/gripper_story.lua"),
        ScriptOptions {
            clock: clock.clone(),
            extensions: davit::builtin().with(mine).into(),
            load: LoadOptions::default(),
            platform: None,
            observer: None,
            interrupt: Interrupt::default(),
            door: None,
            checking: None,
            say: Box::new(move |text| *heard.lock().unwrap() += &format!("{text}\n")),
        },
    );
    clock.shutdown();
    assert!(end.failure.is_none(), "{:?} {}", end.failure, said.lock().unwrap());
    let ended = end.ended.as_ref().expect("it deployed something");
    assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
}
