//! The runs of a sweep: each in a process of its own, so that none takes another one with it, a few at a time.

use crate::limits;
use crate::model::codes::{SCRIPT_MISSED, SCRIPT_UNKNOWN_PARAMETER, TEXT_UNKNOWN_PARAMETER};
use crate::model::words::words;
use crate::time::{Clock, RecvError, lock};
use serde_json::Value as Json;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

words! {
    /// How a point ended.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum PointEnd by word {
        /// All figures are within their bounds.
        Ok = "ok",
        /// One is not.
        Missed = "missed",
        /// The script failed otherwise.
        Failed = "failed",
        /// It was not over in time.
        Hung = "hung",
        /// The sweep was ended before it was over, or before it began.
        Stopped = "stopped",
    }
}

/// What came of a point.
#[derive(Debug, Clone)]
pub struct PointRun {
    /// How it ended.
    pub end: PointEnd,
    /// Why, where that says more.
    pub why: Option<String>,
    /// Its figures, as `davit run --json` prints them.
    pub figures: Vec<Json>,
    /// What was found wrong.
    pub findings: Vec<Json>,
}

impl PointRun {
    fn ended(end: PointEnd, why: Option<String>) -> Self {
        Self { end, why, figures: Vec::new(), findings: Vec::new() }
    }

    /// The finding that a parameter is read by nobody, which is so in every point.
    pub fn unknown_parameter(&self) -> Option<&Json> {
        let codes = [SCRIPT_UNKNOWN_PARAMETER, TEXT_UNKNOWN_PARAMETER].map(|code| code.to_string());
        let is = |finding: &&Json| {
            finding["severity"] == "error" && codes.iter().any(|code| finding["code"] == code.as_str())
        };
        self.findings.iter().find(is)
    }
}

/// How the runs are made.
pub struct Sweeping {
    /// What is run, without the parameters of a point.
    pub command: Vec<String>,
    /// How many at a time.
    pub jobs: usize,
    /// How long each may take.
    pub within: Duration,
    /// Nothing more is begun, and what runs is ended.
    pub stop: Arc<AtomicBool>,
}

impl Sweeping {
    /// Runs all points, each with these arguments more; tells of each that ended. In their order: what came of them.
    pub fn all(&self, points: &[Vec<String>], ended: &(dyn Fn(usize, &PointRun) + Sync)) -> Vec<PointRun> {
        let runs: Mutex<Vec<Option<PointRun>>> = Mutex::new(vec![None; points.len()]);
        let next = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..self.jobs.min(points.len()) {
                scope.spawn(|| {
                    loop {
                        let at = next.fetch_add(1, Ordering::Relaxed);
                        if at >= points.len() || self.is_stopped() {
                            return;
                        }
                        let run = self.one(&points[at]);
                        ended(at, &run);
                        lock(&runs)[at] = Some(run);
                    }
                });
            }
        });
        let runs = runs.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        runs.into_iter().map(|run| run.unwrap_or_else(|| PointRun::ended(PointEnd::Stopped, None))).collect()
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn one(&self, more: &[String]) -> PointRun {
        let failed = |why: String| PointRun::ended(PointEnd::Failed, Some(why));
        let program = match std::env::current_exe() {
            Ok(program) => program,
            Err(error) => return failed(format!("this program does not find itself: {error}")),
        };
        let mut command = Command::new(program);
        command.args(&self.command).args(more).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = match command.spawn() {
            Ok(child) => child,
            Err(error) => return failed(format!("it could not be started: {error}")),
        };
        // It ends with this process, however that ends.
        let _parent = child.stdin.take();
        let clock = Clock::real();
        let (told, heard) = clock.channel(1);
        let stdout = child.stdout.take();
        let reader = std::thread::Builder::new().name("davit-point".to_owned()).spawn(move || {
            let _ = told.try_send(read(stdout));
        });
        if let Err(error) = reader {
            end(&mut child);
            return failed(format!("there is no thread left: {error}"));
        }
        let deadline = clock.now() + self.within;
        loop {
            match heard.recv_deadline(deadline.min(clock.now() + limits::SIGNAL_LOOK)) {
                Ok((figures, findings)) => {
                    let status = child.wait().ok().and_then(|status| status.code());
                    return judged(status, figures, findings, self.is_stopped());
                }
                Err(RecvError::Closed) => {
                    end(&mut child);
                    return failed("what it printed could not be read".to_owned());
                }
                Err(RecvError::Timeout) if self.is_stopped() => {
                    end(&mut child);
                    return PointRun::ended(PointEnd::Stopped, None);
                }
                Err(RecvError::Timeout) if clock.now() >= deadline => {
                    end(&mut child);
                    let why = format!("not over in {} s", self.within.as_secs_f64());
                    return PointRun::ended(PointEnd::Hung, Some(why));
                }
                Err(RecvError::Timeout) => {}
            }
        }
    }
}

fn end(child: &mut Child) {
    // It may be over already.
    let _ = child.kill();
    let _ = child.wait();
}

/// What matters of what a run prints: its figures, and the findings that it ends with.
fn read(stdout: Option<impl std::io::Read>) -> (Vec<Json>, Vec<Json>) {
    let (mut figures, mut findings) = (Vec::new(), Vec::new());
    let list = |json: &Json| json.as_array().cloned().unwrap_or_default();
    for line in stdout.into_iter().flat_map(|stdout| BufReader::new(stdout).lines().map_while(Result::ok)) {
        let Ok(told) = serde_json::from_str::<Json>(&line) else { continue };
        if told["what"] == "figures" {
            figures = list(&told["figures"]);
        }
        if told["ok"] == false {
            findings = list(&told["findings"]);
        }
    }
    (figures, findings)
}

fn judged(status: Option<i32>, figures: Vec<Json>, findings: Vec<Json>, stopped: bool) -> PointRun {
    let missed = SCRIPT_MISSED.to_string();
    let said = findings.first().and_then(|finding| finding["message"].as_str()).map(str::to_owned);
    let (end, why) = match status {
        Some(0) => (PointEnd::Ok, None),
        // It was told to end as this command was.
        _ if stopped => (PointEnd::Stopped, None),
        Some(1) if findings.iter().any(|finding| finding["code"] == missed.as_str()) => (PointEnd::Missed, None),
        Some(4) => (PointEnd::Failed, Some(said.unwrap_or_else(|| "it was not shut down in order".to_owned()))),
        Some(status) => (PointEnd::Failed, Some(said.unwrap_or_else(|| format!("exit status {status}")))),
        None => (PointEnd::Failed, Some("it was killed".to_owned())),
    };
    PointRun { end, why, figures, findings }
}
