//! Live progress of a deployment: a line for every answer, and on a terminal a line below that tells what is under way.
//!
//! All of it is written in a thread of its own behind a [tap](crate::session::tap): a terminal that was stopped (Ctrl-S), or a
//! pipe that nobody reads, keeps nobody waiting who acts.

use super::detach;
use super::log::duration;
use super::output::{Output, Style};
use crate::limits;
use crate::model::finding::count;
use crate::session::log::LogEntry;
use crate::session::tap::{LogSink, News, Tap};
use crate::session::{Happening, Phase};
use crate::time::Clock;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::sync::Arc;

/// How a deployment's story is told. Clones tell the same one.
#[derive(Clone)]
pub struct ProgressView {
    tap: Tap<ToldLine>,
    json: bool,
    simulated: bool,
}

/// What is told.
enum ToldLine {
    /// Something happened.
    Entry(Arc<LogEntry>),
    /// A line of the command's own.
    Line(String),
    /// The same for programs.
    Json(String),
    /// No line below any more that tells what is under way.
    Finish,
    /// It is up, and whoever listened to the process in the background goes.
    UpInBackground,
}

impl From<Arc<LogEntry>> for ToldLine {
    fn from(entry: Arc<LogEntry>) -> Self {
        Self::Entry(entry)
    }
}

impl ProgressView {
    /// Tells it on stdout: as one JSON object a line if `json`, else as text. Of a deployment on `clock`.
    ///
    /// # Errors
    /// When the operating system has no thread left.
    pub fn new(out: Output, json: bool, clock: &Clock) -> std::io::Result<Self> {
        let mut screen = Screen::new(out, json);
        let tap = Tap::new("davit-output", limits::TAP, clock, move |news| screen.show(news))?;
        Ok(Self { tap, json, simulated: clock.is_simulated() })
    }

    /// What to give to the session.
    pub fn observer(&self) -> Arc<dyn LogSink> {
        Arc::new(self.tap.clone())
    }

    /// The same for who wants to hear only what somebody has to decide.
    pub fn quiet_observer(&self) -> Arc<dyn LogSink> {
        Arc::new(Quiet(self.tap.clone()))
    }

    /// A line of the command's own, for people. Never waits.
    pub fn line(&self, line: impl std::fmt::Display) {
        if !self.json {
            self.tap.put_own(ToldLine::Line(line.to_string()));
        }
    }

    /// A line of a script. In simulated time the script waits for the reader.
    pub fn say(&self, line: impl std::fmt::Display) {
        if !self.json {
            self.tap.put(ToldLine::Line(line.to_string()));
            self.tap.keep_pace();
        }
    }

    /// The same for programs.
    pub fn say_json(&self, object: &serde_json::Value) {
        self.tap.put(ToldLine::Json(object.to_string()));
        self.tap.keep_pace();
    }

    /// What the command itself has to say, for programs. Never waits.
    pub fn json_line(&self, object: &serde_json::Value) {
        if self.json {
            self.tap.put_own(ToldLine::Json(object.to_string()));
        }
    }

    /// From now on nothing is told but by [`ProgressView::line`], [`ProgressView::json_line`] and what happens.
    pub fn finish(&self) {
        self.tap.put_own(ToldLine::Finish);
    }

    /// It is up, and from now on nothing is told at all.
    pub fn up_in_background(&self) {
        self.tap.put_own(ToldLine::UpInBackground);
    }

    /// The end: waits until all is written, as long as somebody reads. Answers how many lines were not.
    pub fn end(&self) -> u64 {
        self.tap.finish(if self.simulated { limits::TAP_PATIENCE } else { limits::TAP_END })
    }
}

/// Passes on what is noted, and nothing else: it may be that people are waited for.
struct Quiet(Tap<ToldLine>);

impl LogSink for Quiet {
    fn hear(&self, entry: &Arc<LogEntry>) {
        if matches!(entry.what, Happening::Noted { .. }) {
            self.0.hear(entry);
        }
    }
}

/// Who raises events and is no component.
const COMMANDERS: [&str; 4] = ["deployment", "operator", "script", "configurator"];

/// The end of the tap that writes.
struct Screen {
    out: Output,
    bar: ProgressBar,
    quiet: bool,
    json: bool,
    /// When what was told last happened.
    at: f64,
    /// It is being stopped: all that components report is told; before, what is of safety.
    stopping: bool,
    /// What they reported, and when that was told last: one that goes on reporting is told now and then.
    reported: BTreeMap<String, f64>,
}

impl Screen {
    fn new(out: Output, json: bool) -> Self {
        let bar = if std::io::stdout().is_terminal() && !json {
            ProgressBar::with_draw_target(None, ProgressDrawTarget::stdout())
        } else {
            ProgressBar::hidden()
        };
        bar.set_style(ProgressStyle::with_template("{spinner} {wide_msg}").expect("a valid template"));
        Self { out, bar, quiet: false, json, at: 0.0, stopping: false, reported: BTreeMap::new() }
    }

    fn line(&self, line: impl std::fmt::Display) {
        let out = self.out;
        self.bar.suspend(|| out.line(line));
    }

    fn show(&mut self, news: News<ToldLine>) {
        if self.quiet {
            return;
        }
        match news {
            News::One(ToldLine::Entry(entry)) => {
                self.at = entry.at;
                self.tell(&entry);
            }
            News::One(ToldLine::Line(line)) => self.line(line),
            News::One(ToldLine::Json(line)) => self.out.line(line),
            News::One(ToldLine::Finish) => self.bar.finish_and_clear(),
            News::One(ToldLine::UpInBackground) => {
                self.bar.finish_and_clear();
                self.quiet = true;
                detach::tell_up(self.out);
            }
            News::Missed(entries) if self.json => {
                self.out.json_line(&json!({ "at": self.at, "what": "missed", "entries": entries }));
            }
            News::Missed(entries) => {
                let word = self.out.paint(Style::Care, "missed");
                let lines = count(entries, "line");
                self.line(format!("             {word}  {lines} not shown: more came than was read"));
            }
        }
    }

    fn tell(&mut self, entry: &LogEntry) {
        if self.json {
            self.out.json_line(entry);
            return;
        }
        let out = &self.out;
        let time = out.paint(Style::Dim, format!("{:>9.3} s", entry.at));
        match &entry.what {
            // A recovery is answered where it was asked: no answer ends its bar.
            Happening::Requested { request: None, ask, by } => self.line(format!("{time}  {ask} (asked by {by})")),
            Happening::Requested { ask, by, .. } => {
                self.bar.reset();
                self.bar.set_message(format!("{ask} (asked by {by})"));
                // It takes a thread, which there may not be: not where nobody sees it.
                if !self.bar.is_hidden() {
                    self.bar.enable_steady_tick(std::time::Duration::from_millis(100));
                }
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
            Happening::Injected { component, fault } => {
                self.line(format!("{time}  {}  {component}: {fault}", out.paint(Style::Care, "inject")));
            }
            Happening::Returned { component } => self.line(format!("{time}  {component} returned and was cleaned up")),
            Happening::Lost { event, reasons } => {
                self.line(format!("{time}  {}  {event}", out.paint(Style::Bad, "lost")));
                reasons.iter().for_each(|reason| self.line(format!("                 {reason}")));
            }
            Happening::Recovered { .. } => self.line(format!("{time}  {}", out.paint(Style::Good, "recovered"))),
            Happening::Stopping { why: None, .. } => {}
            Happening::Stopping { stage, why: Some(why) } => {
                let word = out.paint(Style::Care, "stopping");
                self.line(format!("{time}  {word}  {}: {why}", stage.words()));
            }
            Happening::Forced { note } => self.line(format!("{time}  {}  {note}", out.paint(Style::Care, "forced"))),
            Happening::Noted { note } => self.line(format!("{time}  {}  {note}", out.paint(Style::Care, "note"))),
            Happening::Dropped { events } => {
                let word = out.paint(Style::Care, "dropped");
                self.line(format!("{time}  {word}  {}: the coordinator does not keep up", count(events, "event")));
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
            Happening::Printed { text } => self.line(format!("{time}  {}  {text}", out.paint(Style::Dim, ".."))),
            Happening::Phase { phase } => self.stopping |= *phase == Phase::ShuttingDown,
            Happening::Event { event, from, safety }
                if *safety || self.stopping && !COMMANDERS.contains(&from.as_str()) =>
            {
                let before = self.reported.insert(event.clone(), entry.at);
                if before.is_some_and(|before| entry.at < before + limits::REPORTED_AGAIN.as_secs_f64()) {
                    self.reported.insert(event.clone(), before.unwrap_or(entry.at));
                } else {
                    self.line(format!("{time}  {}  {event} from {from}", out.paint(Style::Care, "..")));
                }
            }
            Happening::Said { .. } | Happening::Event { .. } | Happening::Stale { .. } => {}
        }
    }
}
