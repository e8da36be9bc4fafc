//! What is asked of a configurator and what it answers (design §6).

use crate::model::codes;
use crate::model::{Ask, ComponentName, ConfigId, EventName, Finding, Findings, RequestId, Step, Verdict};
use crate::platform::Cause;
use crate::stack::Requester;
use crate::time::Time;
use smallvec::SmallVec;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// The way out of *broken*, as it is told wherever something is.
pub const WAY_OUT: &str = "`davit undo ID` of the configuration that broke it goes back, and so does `davit recover --back`; \
                           `davit recover --accept` takes what is there as the state; `davit drift` shows what differs";

/// One request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request {
    /// Its number, given by who asks.
    pub id: RequestId,
    /// What is asked.
    pub ask: Ask,
    /// Who asks.
    pub requester: Requester,
    /// Whether a state of the coordinator that is being entered asks (its frame is never squashed while it is in force).
    pub scoped: bool,
    /// Comes back with the answer; means nothing to the configurator.
    pub tag: (u64, u64),
}

/// Requests that belong together (raised in one step of a coordinator): an undo and a push among them are executed as
/// one transaction, by their net difference.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Batch {
    /// The requests, in the order they were raised.
    pub requests: SmallVec<[Request; 2]>,
}

impl Batch {
    /// A batch of one.
    pub fn one(request: Request) -> Self {
        Self { requests: SmallVec::from_iter([request]) }
    }
}

impl FromIterator<Request> for Batch {
    fn from_iter<I: IntoIterator<Item = Request>>(requests: I) -> Self {
        Self { requests: requests.into_iter().collect() }
    }
}

/// The queue of requests is full; each request of the batch was answered *failed*.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the configurator's queue is full")]
pub struct Full;

/// The answer to a request. Every request gets exactly one; a later [`Verdict::Reverted`] (or an undo verdict in its
/// place, when the frame could not be popped) about a configuration whose confirmation did not come is a notice and
/// carries the number of the request that had pushed it.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Which request.
    pub request: Request,
    /// How it ended.
    pub verdict: Verdict,
    /// When.
    pub at: Time,
    /// How long after the configurator took it up.
    pub took: Duration,
    /// Why, where it is not simply a success; also what a success could not do (a safe configuration's failed steps).
    pub reason: Option<Arc<Reason>>,
}

impl Answer {
    /// The status event that tells it.
    pub fn event(&self) -> EventName {
        self.verdict.event(self.request.ask)
    }

    /// The reason in findings; empty for a success.
    pub fn findings(&self) -> Findings {
        self.reason.as_ref().map(|reason| reason.findings()).unwrap_or_default()
    }
}

/// Why a request did not simply succeed.
#[derive(Debug, Clone, PartialEq)]
pub enum Reason {
    /// No configuration of that name.
    Unknown(ConfigId),
    /// The queue was full.
    Full,
    /// There is no plan: every violation. Nothing was done.
    Refused(Findings),
    /// A step failed.
    Step {
        /// The step.
        step: Step,
        /// Why.
        cause: Cause,
    },
    /// The configuration's own time was over before it was applied.
    Timeout(Duration),
    /// Stopped for a `safe` configuration.
    Interrupted(ConfigId),
    /// Overtaken by its own undo while it was queued.
    Overtaken,
    /// The system is neither as before nor as asked for.
    Broken(Arc<Residual>),
    /// Nothing is done while the system is broken.
    StillBroken(Arc<Residual>),
    /// A request of the same batch failed, and they are one transaction.
    Together(Arc<Reason>),
    /// The confirming event did not come within that time.
    NotConfirmed(EventName, Duration),
    /// The configurator itself failed.
    Panic(String),
    /// No frame to undo.
    NothingToUndo,
    /// Everything is being taken down.
    TakenDown,
    /// The configurator has ended.
    Ended,
}

/// What is left of an application that is neither done nor undone.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    /// What it began with.
    pub cause: Reason,
    /// The steps from the system as it should be to the system as it is: the exact difference.
    pub difference: Vec<Step>,
    /// Steps of which nobody knows whether they happened.
    pub unsettled: Vec<Step>,
    /// Steps that were done and that nothing undoes.
    pub irreversible: Vec<Step>,
    /// Components that are faulted and should not be. The difference takes them for unconfigured: a fault is nothing a
    /// step can bring about.
    pub faulted: Vec<ComponentName>,
    /// Components whose call has not returned.
    pub quarantined: Vec<ComponentName>,
    /// Whether the difference was read from the platform; if not, the platform did not answer and it is what the
    /// configurator believes.
    pub observed: bool,
}

impl Residual {
    /// Whether nothing observable is left.
    pub fn is_empty(&self) -> bool {
        self.difference.is_empty()
            && self.unsettled.is_empty()
            && self.irreversible.is_empty()
            && self.faulted.is_empty()
            && self.quarantined.is_empty()
    }
}

fn list(steps: &[Step]) -> String {
    let shown: Vec<String> = steps.iter().take(12).map(|step| format!("`{step}`")).collect();
    let more = if steps.len() > 12 { format!(" and {} more", steps.len() - 12) } else { String::new() };
    format!("{}{more}", shown.join(", "))
}

impl Reason {
    /// As findings, each with its code and help.
    pub fn findings(&self) -> Findings {
        match self {
            Self::Refused(findings) => findings.clone(),
            Self::Broken(residual) => {
                let mut all = vec![residual.finding(codes::BROKEN)];
                all.extend(residual.cause.findings());
                all
            }
            Self::StillBroken(residual) => vec![residual.finding(codes::STILL_BROKEN)],
            Self::Together(reason) => reason.findings(),
            _ => vec![self.single()],
        }
    }

    fn single(&self) -> Finding {
        match self {
            Self::Unknown(id) => Finding::error(codes::UNKNOWN_REQUEST, self.to_string())
                .help(format!("add a configuration `{id}` to the deployment, or ask for one it has")),
            Self::Full => Finding::error(codes::QUEUE_FULL, self.to_string())
                .help("wait for the answers to earlier requests before asking for more"),
            Self::Step { cause: Cause::Timeout, .. } => Finding::error(codes::STEP_TIMEOUT, self.to_string())
                .help("look at what the component does there, or raise `limits.step_timeout_s`"),
            Self::Step { .. } => Finding::error(codes::STEP_FAILED, self.to_string())
                .help("the component's own message says why; mend that and ask again"),
            Self::Timeout(_) => Finding::error(codes::CONFIGURATION_TIMEOUT, self.to_string())
                .help("raise the configuration's `timeout`, or find the step that takes so long with `davit log`"),
            Self::Interrupted(_) => Finding::error(codes::INTERRUPTED, self.to_string())
                .help("ask again when the safe configuration is no longer needed"),
            Self::Overtaken => Finding::info(codes::OVERTAKEN, self.to_string()),
            Self::NotConfirmed(..) => Finding::error(codes::NOT_CONFIRMED, self.to_string())
                .help("find out why the event did not come, or give it more time with `within`"),
            Self::NothingToUndo => {
                Finding::error(codes::NOTHING_TO_UNDO, self.to_string()).help("`davit stack` shows the frames in force")
            }
            Self::TakenDown | Self::Ended => {
                Finding::error(codes::ENDED, self.to_string()).help("deploy again before asking for configurations")
            }
            Self::Panic(_) => Finding::error(codes::CONFIGURATOR_PANIC, self.to_string())
                .help("this is a defect of the configurator itself; compare model and platform with `davit drift`"),
            Self::Refused(_) | Self::Broken(_) | Self::StillBroken(_) | Self::Together(_) => {
                Finding::error(codes::STEP_FAILED, self.to_string())
            }
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(id) => write!(f, "there is no configuration `{id}` in this deployment"),
            Self::Full => f.write_str("the configurator's queue is full"),
            Self::Refused(findings) => {
                for (i, finding) in findings.iter().filter(|finding| finding.is_error()).enumerate() {
                    write!(f, "{}{}", if i == 0 { "" } else { "; " }, finding.message)?;
                }
                Ok(())
            }
            Self::Step { step, cause } => write!(f, "`{step}`: {cause}"),
            Self::Timeout(limit) => write!(f, "not applied within {} s", limit.as_secs_f64()),
            Self::Interrupted(by) => write!(f, "interrupted by the safe configuration `{by}`"),
            Self::Overtaken => f.write_str("overtaken by its own undo before it began"),
            Self::Broken(residual) => write!(f, "{residual}"),
            Self::StillBroken(residual) => write!(f, "the system is broken since an earlier request: {residual}"),
            Self::Together(reason) => write!(f, "another request of the same step failed: {reason}"),
            Self::NotConfirmed(event, within) => {
                write!(f, "the confirming event `{event}` did not come within {} s", within.as_secs_f64())
            }
            Self::Panic(text) => write!(f, "the configurator itself failed: {text}"),
            Self::NothingToUndo => f.write_str("there is no frame to undo"),
            Self::TakenDown => f.write_str("the system is being taken down"),
            Self::Ended => f.write_str("the configurator has ended"),
        }
    }
}

impl Residual {
    fn finding(&self, code: crate::model::Code) -> Finding {
        Finding::error(code, self.to_string()).help(WAY_OUT)
    }
}

impl fmt::Display for Residual {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.cause)?;
        if !self.difference.is_empty() {
            let seen = if self.observed { "what remains" } else { "what remains, as far as is known" };
            write!(f, "; {seen}: {}", list(&self.difference))?;
        }
        if !self.unsettled.is_empty() {
            write!(f, "; nobody knows whether it happened: {}", list(&self.unsettled))?;
        }
        if !self.irreversible.is_empty() {
            write!(f, "; cannot be undone: {}", list(&self.irreversible))?;
        }
        for (what, components) in [("faulted", &self.faulted), ("in quarantine", &self.quarantined)] {
            if !components.is_empty() {
                let names: Vec<&str> = components.iter().map(ComponentName::as_str).collect();
                write!(f, "; {what}: {}", names.join(", "))?;
            }
        }
        Ok(())
    }
}
