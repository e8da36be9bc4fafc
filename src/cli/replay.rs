//! A script that goes the way to a finding of `davit check`.

use crate::check::TraceStep;
use crate::check::replay::Does;
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
        return Err("it stands in the text: no way leads to it".to_owned());
    }
    let mut out = Lines { text: String::new(), now: Duration::ZERO };
    _ = writeln!(out.text, "-- {}: {}", finding.code, finding.message.replace('\n', " "));
    _ = writeln!(out.text, "-- Run it with `davit run FILE --clock simulated --platform simulated`.");
    _ = writeln!(out.text, "deploy({}, {{ replay = true }})", quoted(&file.display().to_string()));
    let half = limits::REPLAY_STEP / 2;
    for step in trace {
        let replay = &step.replay;
        if !replay.arms.is_empty() {
            out.wait_until(replay.at.saturating_sub(half));
        }
        for (step, how, takes) in &replay.arms {
            let (step, how, slow) = (quoted(step), quoted(how.word()), *how == FaultKind::Slow);
            let takes = if slow { format!(", 1, {}", takes.as_secs_f64()) } else { String::new() };
            _ = writeln!(out.text, "fault({step}, {how}{takes})");
        }
        match replay.does {
            Does::Nothing => {}
            Does::Cannot(why) => return Err(format!("no script goes this way: {why}")),
            Does::Raise(event) => {
                out.wait_until(replay.at);
                _ = writeln!(out.text, "raise({})", quoted(event.as_str()));
            }
            Does::Ask(ask) => {
                out.wait_until(replay.at);
                _ = match ask {
                    Ask::Apply(id) => writeln!(out.text, "apply({})", quoted(id.as_str())),
                    Ask::UndoOf(id) => writeln!(out.text, "undo({})", quoted(id.as_str())),
                    other => writeln!(out.text, "-- {other}"),
                };
            }
        }
        let answers = step.answers();
        if !answers.is_empty() {
            out.wait_until(replay.at + half / 2);
        }
        for answer in answers {
            if replay.either.iter().any(|either| either.as_str() == answer) {
                _ = writeln!(
                    out.text,
                    "-- Here `{answer}`, or it is through before it is given up, which leads to the same."
                );
                continue;
            }
            _ = writeln!(out.text, "wait_answer({}, 0)", quoted(answer));
        }
    }
    if let Some(last) = trace.last() {
        out.wait_until(last.replay.at + half / 2);
        if let Some((then, within)) = last.replay.then {
            _ = writeln!(out.text, "wait_answer({}, {})", quoted(then.as_str()), within.as_secs_f64());
            return Ok(out.text);
        }
        for place in &last.states {
            let state = match &place.coordinator {
                Some(name) => format!("{name}:{}", place.state),
                None => place.state.clone(),
            };
            _ = match last.replay.passes {
                false => writeln!(out.text, "wait_state({}, 0)", quoted(&state)),
                true => writeln!(out.text, "-- It has been in {state}, and goes on from there at once."),
            };
        }
    }
    Ok(out.text)
}

struct Lines {
    text: String,
    now: Duration,
}

impl Lines {
    fn wait_until(&mut self, at: Duration) {
        if let Some(left) = at.checked_sub(self.now).filter(|left| !left.is_zero()) {
            _ = writeln!(self.text, "wait({})", left.as_secs_f64());
            self.now = at;
        }
    }
}

/// A Lua string.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n"))
}
