//! What a coordinator's functions print, and how many of their events found no room: kept until a step tells it.

use crate::limits;
use crate::model::finding::count;
use crate::statechart::{FunctionOutput, Printer};
use std::cell::{Cell, RefCell};

/// What was printed, bounded.
#[derive(Debug, Default)]
pub struct Voice {
    lines: RefCell<Vec<FunctionOutput>>,
    lost: Cell<usize>,
    /// Events that found no room: since that was last told, and before.
    no_room: Cell<u64>,
    no_room_before: Cell<u64>,
}

impl Voice {
    /// Says a line.
    pub fn say(&self, by: Printer, text: &str) {
        let mut lines = self.lines.borrow_mut();
        if lines.len() >= limits::SAID_LINES {
            self.lost.set(self.lost.get() + 1);
            return;
        }
        let text = if text.chars().count() > limits::SAID_LENGTH {
            text.chars().take(limits::SAID_LENGTH).chain(" …".chars()).collect()
        } else {
            text.to_owned()
        };
        lines.push(FunctionOutput { by, text });
    }

    /// Counts events that found no room; how many there were is told once a step.
    pub fn no_room(&self, events: u64) {
        self.no_room.set(self.no_room.get() + events);
    }

    /// How many events found no room, ever.
    pub fn lost_events(&self) -> u64 {
        self.no_room.get() + self.no_room_before.get()
    }

    /// Moves all of it to the end of `out`.
    pub fn drain(&self, out: &mut Vec<FunctionOutput>) {
        out.append(&mut self.lines.borrow_mut());
        let events = self.no_room.replace(0);
        if events > 0 {
            self.no_room_before.set(self.no_room_before.get() + events);
            let (events, most) = (count(grouped(events), "event"), grouped(limits::CHART_QUEUE as u64));
            let text = format!("{events} found no room: at most {most} wait for a step");
            out.push(FunctionOutput { by: Printer::Err, text });
        }
        let lost = self.lost.replace(0);
        if lost > 0 {
            out.push(FunctionOutput {
                by: Printer::Warn,
                text: format!("{} left out: too much was printed at once", count(lost, "more line")),
            });
        }
    }
}

/// A number as people read it: `18,976`.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}
