//! A script that goes the way to a finding of `davit check`.

use crate::check::{Again, Does, Happened, TraceStep, why_no_way};
use crate::limits;
use crate::model::{Ask, FaultKind, Finding};
use std::fmt::Write as _;
use std::path::Path;
use std::time::Duration;

/// The script, for a deployment in `file`.
///
/// # Errors
/// Why no script goes this way.
pub fn script(file: &Path, finding: &Finding, trace: &[TraceStep]) -> Result<String, String> {
    if trace.is_empty() {
        return Err(why_no_way(finding.code).to_owned());
    }
    let mut out = ScriptLines { text: String::new(), now: Duration::ZERO, within: "" };
    _ = writeln!(out.text, "-- {}: {}", finding.code, finding.message.replace('\n', " "));
    _ = writeln!(out.text, "-- Run it with `davit run FILE --clock simulated --platform simulated`.");
    _ = writeln!(out.text, "deploy({}, {{ replay = true }})", quoted(&file.display().to_string()));
    for step in trace {
        out.step(step)?;
    }
    if let Some(last) = trace.last() {
        out.wait_until(last.replay.at + HALF / 2);
        if let Some((then, within)) = last.replay.then {
            out.line(format!("wait_answer({}, {})", quoted(then.as_str()), within.as_secs_f64()));
            return Ok(out.text);
        }
        for place in &last.states {
            let state = match &place.coordinator {
                Some(name) => format!("{name}:{}", place.state),
                None => place.state.clone(),
            };
            out.line(match last.replay.passes {
                false => format!("wait_state({}, 0)", quoted(&state)),
                true => format!("-- It has been in {state}, and goes on from there at once."),
            });
        }
    }
    Ok(out.text)
}

/// The lines by which `davit sim` steps a coordinator alone along a way; none is named where there is only one.
///
/// # Errors
/// Why there are none.
pub fn events(finding: &Finding, trace: &[TraceStep], coordinator: Option<&str>) -> Result<String, String> {
    if trace.is_empty() {
        return Err(why_no_way(finding.code).to_owned());
    }
    let mut alone = Alone { text: "run\n".to_owned(), now: Duration::ZERO, coordinator, timed: false };
    alone.timed = trace.iter().any(|step| alone.is_own_time(step));
    trace.iter().for_each(|step| alone.step(step));
    Ok(alone.text)
}

/// A coordinator alone.
struct Alone<'c> {
    text: String,
    now: Duration,
    coordinator: Option<&'c str>,
    /// Time passes for it on the way.
    timed: bool,
}

impl Alone<'_> {
    fn is_own_time(&self, step: &TraceStep) -> bool {
        let own = matches!(step.what, Happened::Time { .. })
            && step.hears.iter().any(|hears| hears.coordinator.as_deref() == self.coordinator);
        let again = step.replay.again.as_ref();
        own || again.is_some_and(|again| again.steps.iter().any(|step| self.is_own_time(step)))
    }

    fn step(&mut self, step: &TraceStep) {
        if let Some(again) = &step.replay.again {
            // The rounds after the second one are like it, later.
            let rounds: Vec<&[TraceStep]> = again.steps.chunks(again.round.max(1)).collect();
            let mut later = Duration::ZERO;
            for number in 0..again.times {
                let Some(round) = rounds.get(number.min(rounds.len() - 1)) else { return };
                if number >= rounds.len() && rounds.len() > 1 {
                    later += rounds[1][0].replay.at.saturating_sub(rounds[0][0].replay.at);
                }
                for step in *round {
                    let at = step.replay.at + later;
                    self.one(step, at);
                }
            }
            return;
        }
        self.one(step, step.replay.at);
    }

    fn one(&mut self, step: &TraceStep, at: Duration) {
        let own = step.hears.iter().filter(|hears| hears.coordinator.as_deref() == self.coordinator);
        let events: Vec<&str> = own.map(|hears| hears.event.as_str()).collect();
        if events.is_empty() {
            return;
        }
        if let Some(passes) = at.checked_sub(self.now).filter(|passes| self.timed && !passes.is_zero()) {
            // A time event comes when more than its time has passed.
            let more = Duration::from_nanos(u64::from(matches!(step.what, Happened::Time { .. })));
            _ = writeln!(self.text, "advance {}", (passes + more).as_secs_f64());
            self.now = at;
        }
        for event in events {
            match step.what {
                Happened::Time { .. } => self.text.push_str("run\n"),
                _ => _ = writeln!(self.text, "{event}\nrun"),
            }
        }
    }
}

/// What is armed for a move is so long before it.
const HALF: Duration = Duration::from_micros(limits::REPLAY_STEP.as_micros() as u64 / 2);

struct ScriptLines {
    text: String,
    now: Duration,
    within: &'static str,
}

impl ScriptLines {
    fn line(&mut self, line: impl std::fmt::Display) {
        _ = writeln!(self.text, "{}{line}", self.within);
    }

    fn wait_until(&mut self, at: Duration) {
        if let Some(left) = at.checked_sub(self.now).filter(|left| !left.is_zero()) {
            self.line(format!("wait({})", left.as_secs_f64()));
            self.now = at;
        }
    }

    /// One move.
    fn step(&mut self, step: &TraceStep) -> Result<(), String> {
        let replay = &step.replay;
        if let Some(again) = &replay.again {
            return self.again(again);
        }
        if !replay.arms.is_empty() {
            self.wait_until(replay.at.saturating_sub(HALF));
        }
        for (step, how, takes) in &replay.arms {
            let (step, how, slow) = (quoted(step), quoted(how.word()), *how == FaultKind::Slow);
            let takes = if slow { format!(", 1, {}", takes.as_secs_f64()) } else { String::new() };
            self.line(format!("fault({step}, {how}{takes})"));
        }
        match replay.does {
            Does::Nothing => {}
            Does::Cannot(why) => return Err(format!("no script goes this way: {why}")),
            Does::Raise(event) => {
                self.wait_until(replay.at);
                self.line(format!("raise({})", quoted(event.as_str())));
            }
            Does::RaiseTo(event) => {
                self.wait_until(replay.at);
                let to = replay.others.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(", ");
                let to = if to.is_empty() { "{}".to_owned() } else { format!("{{ {to} }}") };
                self.line(format!("raise({}, {{ to = {to} }})", quoted(event.as_str())));
            }
            Does::Ask(ask) => {
                self.wait_until(replay.at);
                self.line(match ask {
                    Ask::Apply(id) => match id.sets() {
                        Some((member, value)) => format!("set({}, {value})", quoted(member)),
                        None => format!("apply({})", quoted(id.as_str())),
                    },
                    Ask::UndoOf(_) => format!("undo({})", quoted(ask.subject())),
                    other => format!("-- {other}"),
                });
            }
            Does::Fail(component, told) => {
                self.wait_until(replay.at);
                self.line(format!("fail({})", quoted(component.as_str())));
                self.told(replay.at, told.as_str());
            }
            Does::Hear(told) => self.told(replay.at, told.as_str()),
            Does::OthersDown => {
                self.wait_until(replay.at);
                for other in &replay.others {
                    self.line(format!("wait_state({}, 0)", quoted(other)));
                }
            }
        }
        for answer in step.answers() {
            if replay.either.iter().any(|either| either.as_str() == answer) {
                self.wait_until(replay.at + HALF / 2);
                self.line(format!(
                    "-- Here `{answer}`, or it is through before it is given up, which leads to the same."
                ));
                continue;
            }
            self.told(replay.at, answer);
        }
        Ok(())
    }

    /// This is told at that time.
    fn told(&mut self, at: Duration, event: &str) {
        self.wait_until(at + HALF / 2);
        self.line(format!("wait_answer({}, 0)", quoted(event)));
    }

    /// A cycle, again and again: the rounds between the first and the last one are all like the second.
    fn again(&mut self, again: &Again) -> Result<(), String> {
        let last = again.steps.len() / again.round.max(1);
        for (number, steps) in again.steps.chunks(again.round.max(1)).enumerate() {
            let times = again.times.saturating_sub(2);
            let repeated = number == 1 && last == limits::REPLAY_ROUNDS && times > 1;
            if repeated {
                self.line(format!("for _ = 1, {times} do"));
                self.within = "  ";
            }
            for step in steps {
                self.step(step)?;
            }
            if repeated {
                self.within = "";
                self.line("end");
            }
        }
        Ok(())
    }
}

/// A Lua string.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n"))
}
