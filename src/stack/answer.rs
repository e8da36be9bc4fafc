//! What comes of requests: verdicts with their reasons, and what is left where something is broken.

use super::Frame;
use super::request::Request;
use crate::model::codes;
use crate::model::finding::count;
use crate::model::{Cause, ComponentName, ConfigId, EventName, Finding, Findings, Step, Verdict};
use crate::system::{System, UnknownType, step};
use crate::time::Time;
use std::collections::BTreeSet;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// The way out of *broken*, as it is told wherever something is.
pub const WAY_OUT: &str = "`davit undo ID` takes back what is left of that configuration (with `--force` where a coordinator \
                           asked for it), `davit recover --back` all that is but for what is safe; \
                           `davit recover --accept` takes what is there as the state; `davit drift` shows what differs";

/// The answer to a request. Every request gets exactly one; a later `Verdict::Reverted` (or an undo verdict in its
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
    /// Whoever asked has no room for another answer: it waits for too many, or does not come to hear them.
    Unheard,
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
    /// It was applied, and what it stands for did not become true in time.
    DoesNotStand(ConfigId),
    /// What it stands for was true and is no longer so.
    StandsNoMore(ConfigId),
    /// A later look at the platform shows it otherwise.
    SeenOtherwise(Vec<Step>),
    /// Safe configurations were taken back, and something is not as before them.
    LeftByEmergency(Vec<Step>),
    /// Stopped for a `safe` configuration.
    Interrupted(ConfigId),
    /// Overtaken by its own undo while it was queued.
    Overtaken,
    /// Given up: its undo came while it was being carried out.
    GivenUp,
    /// A `safe` configuration was asked for while it waited.
    SafeCame(ConfigId),
    /// It is safe, in force in part, and not taken back by who recovers.
    StaysSafe(ConfigId),
    /// It would move something while a `safe` configuration is in force: which, where one is that keeps it still.
    Moves(Step, Option<ConfigId>),
    /// What is left of a frame is not taken back by who recovers: that would move something which a `safe` configuration keeps still.
    KeptStill {
        /// Whose frame.
        frame: ConfigId,
        /// What would move.
        step: Step,
        /// What keeps it still.
        safe: ConfigId,
    },
    /// An operator would write what a `safe` configuration in force has written.
    OverwritesSafe(Step, ConfigId),
    /// An operator's would take the place of a `safe` configuration in force.
    TakesSafePlace(ConfigId),
    /// Something would move that nobody asked to move.
    MovesUnasked(Step),
    /// What it needs is being worked on.
    Busy,
    /// A coordinator's frames are in force, and force was not asked for.
    NeedsForce(ConfigId),
    /// An operator asked for what the deployment's `operator:` does not list, and not with force.
    NotListed(ConfigId),
    /// The system is neither as before nor as asked for.
    Broken(Arc<Residual>),
    /// Nothing is done while the system is broken.
    StillBroken(Arc<Residual>),
    /// The confirming event did not come within that time.
    NotConfirmed(EventName, Duration),
    /// The configurator itself failed.
    Panic(String),
    /// The platform shows a component that nothing here can have made.
    UnknownType(UnknownType),
    /// No frame to undo.
    NothingToUndo,
    /// No frame of an operator to undo; coordinators have some.
    NoneByHand,
    /// No frame above so many.
    NothingAbove(usize),
    /// It was to be undone, and had no frame.
    NotInForce(ConfigId),
    /// What an undo without a name has undone.
    Undid(Vec<ConfigId>),
    /// It was undone, and these frames with it, which stood in its way.
    TookAlong(Vec<TakenAlong>),
    /// Everything is being taken down.
    TakenDown,
    /// The configurator has ended.
    Ended,
}

/// A frame that was undone with another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TakenAlong {
    /// Its configuration.
    pub configuration: ConfigId,
    /// A coordinator had let go of it, and its undo had failed; else an operator's.
    pub left: bool,
}

impl TakenAlong {
    /// What is told of that frame.
    pub fn of(frame: &Frame) -> Self {
        Self { configuration: frame.configuration, left: frame.left }
    }
}

/// What is left of an application that is neither done nor undone.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    /// What it began with.
    pub cause: Reason,
    /// What else went wrong, where everything was tried (a safe configuration).
    pub also: Vec<Reason>,
    /// What was done and not taken back: the steps of the partial frame. The model has them.
    pub left: Vec<Step>,
    /// The step back that was withheld, with all behind it: it moves, and nobody asked for that.
    pub withheld: Option<Step>,
    /// The steps from the system as the model has it to the system as it is.
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
    /// Nothing but its cause.
    pub fn of(cause: Reason) -> Self {
        Self {
            cause,
            also: Vec::new(),
            left: Vec::new(),
            withheld: None,
            difference: Vec::new(),
            unsettled: Vec::new(),
            irreversible: Vec::new(),
            faulted: Vec::new(),
            quarantined: Vec::new(),
            observed: true,
        }
    }

    /// Whether everything is known and as the model has it: then nothing is left but a partial frame, if that.
    pub fn is_settled(&self) -> bool {
        self.observed && self.difference.is_empty() && self.unsettled.is_empty() && self.faulted.is_empty()
    }

    /// What of it is left for as long as nothing but its partial frame is: what has been settled, mended or brought back
    /// since is not, nor what something else has overwritten.
    pub fn of_partial(&self, system: &System) -> Self {
        let overwritten = |step: &Step| {
            step::absolute(step).is_some() && step::inverse(step, None, system).steps() != std::slice::from_ref(step)
        };
        Self {
            left: self.left.iter().filter(|step| !overwritten(step)).cloned().collect(),
            withheld: self.withheld.clone(),
            irreversible: self.irreversible.clone(),
            ..Self::of(self.cause.clone())
        }
    }

    /// Whether nothing at all is left.
    pub fn is_empty(&self) -> bool {
        self.is_settled() && self.left.is_empty() && self.irreversible.is_empty()
    }

    /// The components of which not all is known, or that are not as the model has them.
    pub fn components(&self) -> impl Iterator<Item = ComponentName> + '_ {
        let steps = self.difference.iter().chain(&self.unsettled);
        let of = |step: &Step| match step {
            Step::Connect { from, to, .. } | Step::Disconnect { from, to } => [from.component, to.component],
            other => [other.component(); 2],
        };
        steps.flat_map(of).chain(self.faulted.iter().copied())
    }
}

impl Residual {
    /// Components that differ in nothing but a connection to one of these `own`, or to another one that differs.
    pub fn guests(&self, own: &[ComponentName]) -> BTreeSet<ComponentName> {
        let connects = |step: &Step| matches!(step, Step::Connect { .. } | Step::Disconnect { .. });
        let others = self.difference.iter().chain(&self.unsettled).filter(|step| !connects(step));
        let others: Vec<ComponentName> = others.map(Step::component).chain(self.faulted.iter().copied()).collect();
        self.components().filter(|component| !own.contains(component) && !others.contains(component)).collect()
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
                all.extend(std::iter::once(&residual.cause).chain(&residual.also).flat_map(Self::findings));
                all
            }
            Self::StillBroken(residual) => vec![residual.finding(codes::STILL_BROKEN)],
            _ => vec![self.single()],
        }
    }

    /// As it is told, a line each. What is broken is told with its cause, which is a finding of its own beside it; and what made one broken
    /// may have made another one so that counted on it.
    pub fn told(&self) -> Vec<String> {
        let all: Vec<String> = self.findings().into_iter().map(|finding| finding.message).collect();
        let is_part = |one: &String| {
            all.iter().any(|whole| whole.strip_prefix(one.as_str()).is_some_and(|rest| rest.starts_with("; ")))
        };
        let mut told: Vec<String> = Vec::new();
        for one in all.iter().filter(|one| !is_part(one)) {
            if !told.contains(one) {
                told.push(one.clone());
            }
        }
        told
    }

    fn single(&self) -> Finding {
        match self {
            Self::Unknown(id) => Finding::error(codes::UNKNOWN_REQUEST, self.to_string())
                .help(format!("add a configuration `{id}` to the deployment, or ask for one it has")),
            Self::Full => Finding::error(codes::QUEUE_FULL, self.to_string())
                .help("wait for the answers to earlier requests before asking for more"),
            Self::Unheard => Finding::error(codes::ANSWERS_FULL, self.to_string())
                .help("wait for the answers to earlier requests before asking for more"),
            Self::Step { cause: Cause::Timeout, .. } => Finding::error(codes::STEP_TIMEOUT, self.to_string())
                .help("look at what the component does there, or raise `limits.step_timeout_s`"),
            Self::Step { .. } => Finding::error(codes::STEP_FAILED, self.to_string())
                .help("the component's own message says why; mend that and ask again"),
            Self::Timeout(_) => Finding::error(codes::CONFIGURATION_TIMEOUT, self.to_string())
                .help("raise the configuration's `timeout`, or find the step that takes so long with `davit log`"),
            Self::DoesNotStand(_) => Finding::error(codes::DOES_NOT_STAND, self.to_string())
                .help("see what its `holds` looks at, or give it more time with `timeout`"),
            Self::StandsNoMore(_) => Finding::error(codes::STANDS_NO_MORE, self.to_string())
                .help("see what its `holds` looks at; it is in force still, and watched again once it is applied anew"),
            Self::SeenOtherwise(_) => Finding::error(codes::SEEN_OTHERWISE, self.to_string())
                .help("`davit drift` shows what differs, `davit recover --back` mends it, `--accept` takes it as it is"),
            Self::LeftByEmergency(_) => Finding::error(codes::LEFT_BY_EMERGENCY, self.to_string())
                .help("`davit recover --back` brings it to where it was, `--accept` takes it as it is"),
            Self::Interrupted(_) => Finding::error(codes::INTERRUPTED, self.to_string())
                .help("ask again when the safe configuration is no longer needed"),
            Self::Overtaken => Finding::info(codes::OVERTAKEN, self.to_string()),
            Self::GivenUp => Finding::info(codes::GIVEN_UP, self.to_string()),
            Self::SafeCame(_) => Finding::error(codes::INTERRUPTED, self.to_string())
                .help("ask again when the safe configuration is no longer needed"),
            Self::StaysSafe(_) => Finding::error(codes::STILL_BROKEN, self.to_string()).help(WAY_OUT),
            Self::Moves(..) | Self::KeptStill { .. } => Finding::error(codes::MOVES_WHILE_SAFE, self.to_string()).help(
                "let the coordinator ask for it in a later step, when it is meant to move again; an operator says `--force`",
            ),
            Self::OverwritesSafe(_, safe) | Self::TakesSafePlace(safe) => {
                Finding::error(codes::OVERWRITES_SAFE, self.to_string()).help(format!(
                    "`{safe}` is let go of by its own undo, as its coordinator does it (`davit undo {safe}`, with `--force` where a \
                     coordinator asked for it); `--force` does it all the same"
                ))
            }
            Self::MovesUnasked(_) => Finding::error(codes::MOVES_UNASKED, self.to_string()).help(
                "undo it when it may move, or write `on_failure = \"rollback\"` where it always may",
            ),
            Self::Busy => Finding::error(codes::BUSY, self.to_string()).help("ask again when `davit status` shows nothing outstanding"),
            Self::NeedsForce(_) => Finding::error(codes::NEEDS_FORCE, self.to_string())
                .help("undo only your own, or say `--force` if the coordinator's is meant"),
            Self::NotListed(_) => Finding::error(codes::NOT_LISTED, self.to_string())
                .help("`davit check` follows what comes of what is listed, applied at any time"),
            Self::NotConfirmed(..) => Finding::error(codes::NOT_CONFIRMED, self.to_string())
                .help("find out why the event did not come, or give it more time with `within`"),
            Self::NothingToUndo | Self::NoneByHand | Self::NothingAbove(_) => {
                Finding::error(codes::NOTHING_TO_UNDO, self.to_string()).help("`davit stack` shows the frames in force")
            }
            Self::NotInForce(_) => Finding::info(codes::NOTHING_TO_UNDO, self.to_string()),
            Self::Undid(_) => Finding::info(codes::STACK_UNDONE, self.to_string()),
            Self::TookAlong(_) => Finding::info(codes::STACK_TAKEN_ALONG, self.to_string()),
            Self::TakenDown | Self::Ended => {
                Finding::error(codes::ENDED, self.to_string()).help("deploy again before asking for configurations")
            }
            Self::Panic(_) => Finding::error(codes::CONFIGURATOR_PANIC, self.to_string())
                .help("this is a defect of the configurator itself; compare model and platform with `davit drift`"),
            Self::UnknownType(_) => Finding::error(codes::UNKNOWN_TYPE, self.to_string())
                .help("whoever made it on the platform removes it; it is left as it is"),
            Self::Refused(_) | Self::Broken(_) | Self::StillBroken(_) => {
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
            Self::Unheard => f.write_str("the coordinator has no room for another answer"),
            Self::Refused(findings) => {
                for (i, finding) in findings.iter().filter(|finding| finding.is_error()).enumerate() {
                    write!(f, "{}{}", if i == 0 { "" } else { "; " }, finding.message)?;
                }
                Ok(())
            }
            Self::Step { step, cause } => write!(f, "`{step}`: {cause}"),
            Self::Timeout(limit) => write!(f, "not applied within {} s", limit.as_secs_f64()),
            Self::DoesNotStand(id) => write!(f, "applied, but what `{id}` stands for did not become true in time"),
            Self::StandsNoMore(id) => write!(f, "what `{id}` stands for is no longer so"),
            Self::SeenOtherwise(steps) => write!(f, "the platform shows otherwise: {}", list(steps)),
            Self::LeftByEmergency(steps) => write!(f, "the emergency is over, and it is not as before it: {}", list(steps)),
            Self::Interrupted(by) => write!(f, "interrupted by the safe configuration `{by}`"),
            Self::Overtaken => f.write_str("overtaken by its own undo before it began"),
            Self::GivenUp => f.write_str("given up: its undo was asked for"),
            Self::SafeCame(by) => write!(f, "the safe configuration `{by}` was asked for while it waited"),
            Self::StaysSafe(id) => write!(
                f,
                "`{id}` is safe and stays in force as far as it came: `davit apply {id}` applies it anew, `davit undo {id}` lets it go \
                 (with `--force` where a coordinator asked for it)"
            ),
            Self::Moves(step, None) => write!(f, "`{step}` moves, and a safe configuration is in force"),
            Self::Moves(step, Some(safe)) => {
                write!(f, "`{step}` moves, and the safe configuration `{safe}` is in force")
            }
            Self::KeptStill { frame, step, safe } => write!(
                f,
                "`{step}` moves, and the safe configuration `{safe}` is in force: `davit undo {safe}` lets it go (with `--force` where a \
                 coordinator asked for it), and `davit recover --back` goes on then; `davit undo {frame} --force` moves it all the same"
            ),
            Self::OverwritesSafe(step, safe) => {
                write!(f, "`{step}` changes what the safe configuration `{safe}`, which is in force, has written")
            }
            Self::TakesSafePlace(safe) => {
                write!(f, "it would take the place of the safe configuration `{safe}`, which is in force")
            }
            Self::MovesUnasked(step) => write!(f, "`{step}` moves, and nobody asked for that"),
            Self::Busy => f.write_str("requests are under way that it would meddle with"),
            Self::NeedsForce(id) => {
                write!(f, "`{id}` is a frame of a coordinator: `--force` undoes it all the same (in a script `{{force = true}}`)")
            }
            Self::NotListed(id) => {
                let (file, own) = match id.as_str().rsplit_once('/') {
                    Some((path, own)) => (format!("`operator:` in the file of `{path}`"), own),
                    None => ("the deployment's `operator:`".to_owned(), id.as_str()),
                };
                write!(
                    f,
                    "{file} does not list `{own}`: add it there, or say `--force` (in a script `{{force = true}}`)"
                )
            }
            Self::Broken(residual) => write!(f, "{residual}"),
            Self::StillBroken(residual) => write!(f, "what it names is broken since an earlier request: {residual}"),
            Self::NotConfirmed(event, within) => {
                write!(f, "the confirming event `{event}` did not come within {} s", within.as_secs_f64())
            }
            Self::Panic(text) => write!(f, "the configurator itself failed: {text}"),
            Self::UnknownType(unknown) => write!(f, "what the platform shows was not taken in: {unknown}"),
            Self::NothingToUndo => f.write_str("there is no frame to undo"),
            Self::NoneByHand => f.write_str(
                "nothing that was applied by hand is in force: a coordinator's frame is undone by its name, with `--force` (in a script \
                 `{force = true}`)",
            ),
            Self::NothingAbove(left) => write!(f, "there is nothing to undo: no more is in force than {}", count(left, "frame")),
            Self::NotInForce(id) => write!(f, "`{id}` was not in force: there was nothing to undo"),
            Self::Undid(all) => {
                let names: Vec<String> = all.iter().map(|id| format!("`{id}`")).collect();
                write!(f, "{} {} undone", names.join(", "), if all.len() == 1 { "is" } else { "are" })
            }
            Self::TookAlong(frames) => {
                let of = |left: bool, whose: &str| {
                    let ids = frames.iter().filter(|frame| frame.left == left);
                    let ids: Vec<String> = ids.map(|frame| format!("`{}`", frame.configuration)).collect();
                    let (was, it) = if ids.len() > 1 { ("were", "they") } else { ("was", "it") };
                    let told = format!("{}{whose} {was} undone with it, since {it} stood in its way", ids.join(", "));
                    (!ids.is_empty()).then_some(told)
                };
                let told = [of(false, " of an operator"), of(true, ", whose undo had failed before,")];
                f.write_str(&told.into_iter().flatten().collect::<Vec<_>>().join("; "))
            }
            Self::TakenDown => f.write_str("the system is being taken down"),
            Self::Ended => f.write_str("the configurator has ended"),
        }
    }
}

fn unasked(step: &Step) -> String {
    format!("not done unasked, since it moves: `{step}`")
}

impl Residual {
    /// What it began with, and what keeps it from going back.
    pub fn why(&self) -> String {
        let withheld = self.withheld.as_ref().map(|step| format!("; {}", unasked(step)));
        format!("{}{}", self.cause, withheld.unwrap_or_default())
    }

    fn finding(&self, code: crate::model::Code) -> Finding {
        Finding::error(code, self.to_string()).help(WAY_OUT)
    }
}

impl fmt::Display for Residual {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.cause)?;
        if !self.left.is_empty() {
            write!(f, "; done and not taken back: {}", list(&self.left))?;
        }
        if let Some(step) = &self.withheld {
            write!(f, "; {}", unasked(step))?;
        }
        if !self.difference.is_empty() {
            let seen = if self.observed { "what differs" } else { "what differs, as far as is known" };
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
