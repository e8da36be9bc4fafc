//! `davit sim` at a terminal, without the terminal: lines in, text out.
//!
//! What was typed is kept, and `undo` begins anew and types all of it again but the end: so it serves charts with
//! functions as well, whose state nobody can copy.

use crate::limits;
use crate::statechart::{EventId, Hook, Sim};
use crate::time::Time;
use std::fmt::Write as _;

/// Words that are no events.
pub const COMMANDS: &[&str] = &["run", "advance", "undo", "reset", "history", "help", "quit"];

const HELP: &str = "\
EVENT …          queue these events as one set and do one step; an empty line only does a step
run              run until nothing is left to do
advance SECONDS  move the clock and do one step
undo [N]         take back the last line, or the last N
reset            begin anew
history          what was typed, numbered
help             this
quit             leave (or Ctrl-D)
";

/// What a line came to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SimReply {
    /// What is to be shown, with a line break at its end unless it is empty.
    pub text: String,
    /// It was the last line.
    pub quit: bool,
}

/// A run that can be taken back.
pub struct SimSession<'c, F, M> {
    sim: Sim<'c, F>,
    /// A machine at its beginning.
    make: M,
    /// Lines that did something.
    typed: Vec<String>,
}

impl<'c, F: Hook, M: Fn() -> Result<Sim<'c, F>, String>> SimSession<'c, F, M> {
    /// A run at its beginning.
    ///
    /// # Errors
    /// Why `make` could make no machine.
    pub fn new(make: M) -> Result<Self, String> {
        Ok(Self { sim: make()?, make, typed: Vec::new() })
    }

    /// Does what a line says.
    pub fn line(&mut self, line: &str) -> SimReply {
        let words: Vec<&str> = line.split_whitespace().collect();
        let say = |text: String| SimReply { text, quit: false };
        match words[..] {
            ["quit" | "exit"] => SimReply { text: String::new(), quit: true },
            ["help" | "?"] => say(HELP.to_owned()),
            ["history"] => {
                let mut text = String::new();
                for (number, line) in self.typed.iter().enumerate() {
                    let shown = if line.trim().is_empty() { "(a step)" } else { line.trim() };
                    let _ = writeln!(text, "{:4}  {shown}", number + 1);
                }
                say(text)
            }
            ["reset"] => say(self.back_to(0)),
            ["undo"] => say(self.undo(1)),
            ["undo", number] => match number.parse() {
                Ok(number) => say(self.undo(number)),
                Err(_) => say(format!("`undo {number}` is not understood: it is written `undo` or `undo NUMBER`\n")),
            },
            _ if self.typed.len() >= limits::SIM_LINES => {
                say(format!("{} lines are as many as can be taken back: `reset` begins anew\n", limits::SIM_LINES))
            }
            _ => match self.sim.line(line) {
                Ok(seen) => {
                    self.typed.push(line.to_owned());
                    say(format!("{seen}\n"))
                }
                Err(error) => say(format!("{error}\n")),
            },
        }
    }

    fn undo(&mut self, lines: usize) -> String {
        if self.typed.is_empty() {
            return "there is nothing to undo\n".to_owned();
        }
        self.back_to(self.typed.len().saturating_sub(lines))
    }

    /// Begins anew and does the first `lines` lines again.
    fn back_to(&mut self, lines: usize) -> String {
        let mut sim = match (self.make)() {
            Ok(sim) => sim,
            Err(why) => return format!("{why}\n"),
        };
        self.typed.truncate(lines);
        let mut last = None;
        for line in &self.typed {
            last = sim.line(line).ok();
        }
        self.sim = sim;
        match last.and_then(|seen| seen.active.last().cloned()) {
            Some(leaf) => format!("back in {leaf}\n"),
            None => "back at the beginning\n".to_owned(),
        }
    }

    /// Where it stands: the active states with their time, what waits inside, and which events would take a transition now.
    pub fn state(&self) -> String {
        let machine = self.sim.machine();
        let chart = self.sim.chart();
        let mut text = match machine.leaf() {
            Some(leaf) => chart.fqn(leaf).to_string(),
            None => "not entered".to_owned(),
        };
        let _ = write!(text, "  at {} s", seconds(self.sim.now()));
        if let Some(due) = machine.next_deadline(chart) {
            let _ = write!(text, ", next time event after {} s", seconds(Time(due.as_nanos().saturating_sub(1))));
        }
        text.push('\n');
        let waiting: Vec<String> = machine.queue().events().iter().map(|e| chart.event_text(*e)).collect();
        if !waiting.is_empty() {
            let _ = writeln!(text, "queue: {}", waiting.join(" "));
        }
        let enabled = self.enabled();
        if !enabled.is_empty() {
            let _ = writeln!(text, "enabled: {}", enabled.join(" "));
        }
        text
    }

    /// Events that would take a transition now, each alone. Where functions decide, those that may.
    pub fn enabled(&self) -> Vec<String> {
        let (machine, chart) = (self.sim.machine(), self.sim.chart());
        let mut events: Vec<EventId> = Vec::new();
        for state in machine.active() {
            for edge in chart.outgoing(*state) {
                events.extend_from_slice(chart.triggers(edge).unwrap_or_default());
            }
        }
        if chart.is_pure() {
            events.retain(|event| machine.would_take(chart, *event));
        }
        let mut names: Vec<String> = events.into_iter().map(|event| chart.event_text(event)).collect();
        names.sort();
        names.dedup();
        names
    }

    /// How the word that ends at the end of `line` may go on: where it begins, and the words. Enabled events come first.
    pub fn complete(&self, line: &str) -> (usize, Vec<String>) {
        let start = line.rfind(char::is_whitespace).map_or(0, |at| at + 1);
        let begun = &line[start..];
        let first = line[..start].trim().is_empty();
        let mut words: Vec<String> = self.enabled();
        let known =
            self.sim.chart().events().iter().map(ToString::to_string).collect::<std::collections::BTreeSet<_>>();
        words.extend(known);
        if first {
            words.extend(COMMANDS.iter().map(ToString::to_string));
        }
        let mut seen = std::collections::BTreeSet::new();
        words.retain(|word| word.starts_with(begun) && seen.insert(word.clone()));
        (start, words)
    }
}

fn seconds(time: Time) -> String {
    let text = format!("{:.9}", time.as_secs_f64());
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lang::{self, LoadOptions, Sources};
    use crate::statechart::{Chart, Nobody, compile};
    use std::path::Path;

    fn lamp() -> Chart {
        let text = "return state {
          off = state {}, on = state { entry = \"e_light\" },
          trans { src = \"initial\", tgt = \"off\" },
          trans { src = \"off\", tgt = \"on\", events = { \"e_switch\" } },
          trans { src = \"on\", tgt = \"off\", events = { \"e_switch\", \"e_after(2)\" } },
        }";
        let from = Sources::memory([("lamp.lua", text)]);
        let loaded = lang::load_coordinator(&from, Path::new("lamp.lua"), &LoadOptions::default());
        compile(&loaded.coordinator.unwrap()).0.unwrap()
    }

    #[test]
    fn lines_are_done_shown_and_taken_back() {
        let chart = lamp();
        let make = || Ok::<Sim<'_, Nobody>, String>(Sim::new(&chart));
        let mut session = SimSession::new(make).unwrap();
        assert_eq!(session.state(), "not entered  at 0 s\nqueue: e_init_fsm\n");
        assert!(session.line("run").text.contains("= root.off"));
        assert_eq!(session.enabled(), ["e_switch"]);
        let reply = session.line("e_switch");
        assert!(reply.text.contains("raise e_light") && !reply.quit, "{}", reply.text);
        assert!(session.state().starts_with("root.on  at 0 s, next time event after 2 s\nqueue: e_done@root.on\n"));
        session.line("advance 1.5");
        session.line("run");
        assert_eq!(session.line("history").text, "   1  run\n   2  e_switch\n   3  advance 1.5\n   4  run\n");
        assert_eq!(session.line("undo 2").text, "back in root.on\n");
        assert!(session.state().contains("at 0 s"), "the clock goes back as well");
        assert_eq!(session.line("undo").text, "back in root.off\n");
        assert!(session.line("advance soon").text.contains("not understood"));
        assert!(session.line("undo soon").text.contains("not understood"));
        assert_eq!(session.line("reset").text, "back at the beginning\n");
        assert_eq!(session.line("undo").text, "there is nothing to undo\n");
        assert!(session.line("help").text.contains("advance SECONDS"));
        assert!(session.line("quit").quit);
    }

    #[test]
    fn words_are_completed() {
        let chart = lamp();
        let make = || Ok::<Sim<'_, Nobody>, String>(Sim::new(&chart));
        let mut session = SimSession::new(make).unwrap();
        session.line("run");
        assert_eq!(session.complete("e_s"), (0, vec!["e_switch".to_owned()]));
        assert_eq!(session.complete("e_switch e_a"), (9, vec!["e_after(2)@root.on".to_owned()]));
        assert_eq!(session.complete("un"), (0, vec!["undo".to_owned()]));
        assert_eq!(session.complete("e_switch un"), (9, vec![]));
        assert_eq!(session.complete("").1[0], "e_switch", "what is enabled comes first");
    }
}
