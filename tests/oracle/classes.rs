//! What the cases met: each class is counted once a case.

use crate::drive::Note;
use davit::check::{Known, Shown};
use std::collections::BTreeMap;

/// The classes, and of how many cases each was part of.
pub const CLASSES: [&str; 16] = [
    "an undo and a push of which one fails",
    "safe in a batch",
    "e_done",
    "second life",
    "past limits.stack",
    "broken",
    "after broken",
    "cancelled",
    "reverted",
    "operator",
    "set by an operator",
    "three waiting",
    "two at once",
    "interrupted by safe",
    "taken along",
    "known to the end",
];

/// What one case has met.
#[derive(Default)]
pub struct Classes {
    pub met: [bool; CLASSES.len()],
    /// Whether the states that it may be in are to be told after each answer.
    pub tells: bool,
    /// The safe configurations.
    safe: Vec<String>,
    /// Requests raised in one step, by number: whether undo and push are among them.
    mixed: BTreeMap<u64, bool>,
    batch: Vec<(u64, String, String)>,
    under_way: bool,
    life: u8,
}

impl Classes {
    /// Nothing met yet, of a case with these safe configurations.
    pub fn of(safe: Vec<String>) -> Self {
        Self { safe, ..Self::default() }
    }

    fn meets(&mut self, class: &str) {
        let at = CLASSES.iter().position(|name| *name == class).expect("a class");
        self.met[at] = true;
    }

    /// What the same step asked for is all there.
    fn close(&mut self) {
        let batch = std::mem::take(&mut self.batch);
        let is_undo = |ask: &str| ask == "undo" || ask.ends_with(".undo");
        let mixed = batch.iter().any(|(_, ask, _)| is_undo(ask)) && batch.iter().any(|(_, ask, _)| !is_undo(ask));
        self.mixed.extend(batch.iter().map(|(request, ..)| (*request, mixed)));
        if batch.len() > 1 && batch.iter().any(|(_, ask, _)| self.safe.contains(ask)) {
            self.meets("safe in a batch");
        }
        if self.under_way && batch.iter().any(|(_, ask, _)| self.safe.contains(ask)) {
            self.meets("interrupted by safe");
        }
    }

    /// A rest, and what happened since the last one.
    pub fn note(&mut self, notes: &[Note], shown: &Shown, known: Known) {
        for note in notes {
            if let Note::Requested { request, by, ask } = note {
                if self.batch.last().is_some_and(|(_, _, last)| last != by) {
                    self.close();
                }
                self.batch.push((*request, ask.clone(), by.clone()));
                continue;
            }
            self.close();
            match note {
                Note::Answer { request, by, answer, along, .. } => {
                    if *along {
                        self.meets("taken along");
                    }
                    self.answered(*request, by, answer);
                }
                Note::Moved(active) if active.last().is_some_and(|leaf| leaf.contains("done")) => self.meets("e_done"),
                _ => {}
            }
        }
        self.close();
        if known.waiting >= 3 {
            self.meets("three waiting");
        }
        if known.under_way >= 2 {
            self.meets("two at once");
        }
        if shown.frames.iter().any(|(_, _, parts)| *parts > 1) {
            self.meets("past limits.stack");
        }
        self.under_way = known.under_way > 0;
        let down = shown.leaves.iter().all(|leaf| leaf.ends_with(".idle"));
        if self.life == 1 && down && shown.system.is_empty() && shown.open.is_empty() {
            self.life = 2;
        }
        let at = CLASSES.len() - 1;
        self.met[at] = known.world;
    }

    fn answered(&mut self, request: u64, by: &str, answer: &str) {
        let bad = answer.ends_with(".failed") || answer.ends_with(".broken");
        if bad && self.mixed.get(&request).is_some_and(|mixed| *mixed) {
            self.meets("an undo and a push of which one fails");
        }
        if self.met[CLASSES.iter().position(|name| *name == "broken").expect("a class")] {
            self.meets("after broken");
        }
        if answer.ends_with(".broken") {
            self.meets("broken");
        }
        if answer.ends_with(".cancelled") {
            self.meets("cancelled");
        }
        if answer.ends_with(".reverted") {
            self.meets("reverted");
        }
        if by == "operator" {
            self.meets("operator");
            // A member of a component, as no configuration that is written is called.
            let set = |end: &str| answer.strip_suffix(end).is_some_and(|subject| subject.contains('.'));
            if set(".ok") {
                self.meets("set by an operator");
            }
        }
        if answer.ends_with(".ok") {
            if self.life == 2 {
                self.meets("second life");
            }
            self.life = self.life.max(1);
        }
    }
}
