//! Live progress of a deployment: a line for every answer, and on a terminal a line below that tells what is under way.

use super::log::{count, duration};
use super::output::{Output, Style};
use crate::session::{Happening, Observer, Phase};
use crate::time::Time;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// How a deployment's story is told.
#[derive(Clone)]
pub struct Progress {
    out: Output,
    bar: ProgressBar,
    quiet: Arc<AtomicBool>,
    json: bool,
}

impl Progress {
    /// Tells it on stdout: as one JSON object a line if `json`, else as text.
    pub fn new(out: Output, json: bool) -> Self {
        let bar = if std::io::stdout().is_terminal() && !json {
            ProgressBar::with_draw_target(None, ProgressDrawTarget::stdout())
        } else {
            ProgressBar::hidden()
        };
        bar.set_style(ProgressStyle::with_template("{spinner} {msg}").expect("a valid template"));
        Self { out, bar, quiet: Arc::new(AtomicBool::new(false)), json }
    }

    /// What to give to the session.
    pub fn observer(&self) -> Observer {
        let this = self.clone();
        Arc::new(move |at, what| this.tell(at, what))
    }

    /// A line of the story.
    pub fn line(&self, line: impl std::fmt::Display) {
        if self.quiet.load(Ordering::Relaxed) || self.json {
            return;
        }
        let out = self.out;
        self.bar.suspend(|| out.line(line));
    }

    /// From now on nothing is told but by [`Progress::line`].
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }

    /// From now on nothing is told at all (whoever listened is gone).
    pub fn silence(&self) {
        self.finish();
        self.quiet.store(true, Ordering::Relaxed);
    }

    fn tell(&self, at: Time, what: &Happening) {
        if self.quiet.load(Ordering::Relaxed) {
            return;
        }
        if self.json {
            self.out.json_line(&crate::session::log::Entry { at: at.as_secs_f64(), what: what.clone() });
            return;
        }
        let out = &self.out;
        let time = out.paint(Style::Dim, format!("{:>9.3} s", at.as_secs_f64()));
        match what {
            // A recovery is answered where it was asked: no answer ends its bar.
            Happening::Requested { request: None, ask, by } => self.line(format!("{time}  {ask} (asked by {by})")),
            Happening::Requested { ask, by, .. } => {
                self.bar.reset();
                self.bar.set_message(format!("{ask} (asked by {by})"));
                self.bar.enable_steady_tick(std::time::Duration::from_millis(100));
            }
            Happening::Answered(answer) => {
                self.bar.disable_steady_tick();
                self.bar.finish_and_clear();
                let (mark, style) = if answer.ok { ("ok", Style::Good) } else { ("no", Style::Bad) };
                self.line(format!(
                    "{time}  {}  {:<28} {:>9}  {:>9}",
                    out.paint(style, mark),
                    answer.answer,
                    count(answer.steps.len(), "step"),
                    duration(answer.took_us),
                ));
                for reason in &answer.reasons {
                    self.line(format!("                 {reason}"));
                }
            }
            Happening::State { active } => {
                let leaf = active.last().map_or("(inactive)", String::as_str);
                self.line(format!("{time}  {}  {}", out.paint(Style::Dim, "in"), out.paint(Style::Name, leaf)));
            }
            Happening::Emitted { event } => self.line(format!("{time}  {}  {event}", out.paint(Style::Dim, "!!"))),
            Happening::Fault { component, reason } => {
                self.line(format!("{time}  {}  {component}: {reason}", out.paint(Style::Bad, "fault")));
            }
            Happening::Returned { component } => self.line(format!("{time}  {component} returned and was cleaned up")),
            Happening::Lost { event, reasons } => {
                self.line(format!("{time}  {}  {event}", out.paint(Style::Bad, "lost")));
                reasons.iter().for_each(|reason| self.line(format!("                 {reason}")));
            }
            Happening::Recovered { .. } => self.line(format!("{time}  {}", out.paint(Style::Good, "recovered"))),
            Happening::Forced { note } => self.line(format!("{time}  {}  {note}", out.paint(Style::Care, "forced"))),
            Happening::Dropped { events } => {
                let word = out.paint(Style::Care, "dropped");
                self.line(format!("{time}  {word}  {events} events: the coordinator does not keep up"));
            }
            Happening::Slow { coordinator, seconds } => {
                let word = out.paint(Style::Care, "slow");
                self.line(format!(
                    "{time}  {word}  coordinator `{coordinator}` has been in a function for {seconds:.1} s"
                ));
            }
            Happening::Phase { phase: Phase::Broken } => {
                self.line(format!("{time}  {}", out.paint(Style::Bad, "broken")));
            }
            Happening::Said { by, text } if *by != "dbg" => {
                let style = if *by == "info" { Style::Dim } else { Style::Care };
                self.line(format!("{time}  {}  {text}", out.paint(style, by)));
            }
            Happening::Said { .. } | Happening::Phase { .. } | Happening::Event { .. } | Happening::Stale { .. } => {}
        }
    }
}
