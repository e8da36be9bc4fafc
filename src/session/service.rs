//! The methods of the control socket (`docs/control-socket.md`).

use super::hub::Hub;
use super::log::LoggedAnswer;
use super::members::NoMember;
use super::names::instead;
use super::raising::Acted;
use super::raising::Offered;
use super::rpc::{GOING_DOWN, INVALID_PARAMS, METHOD_NOT_FOUND, REFUSED, RpcError, TIMED_OUT, only, optional, param};
use super::serving::Service;
use super::{Command, NO_FORWARD, NotFromOutside, NotNamed, NotRaised, Session, Unanswered, recovery};
use crate::limits;
use crate::model::finding::did_you_mean;
use crate::model::{Ask, ConfigId, EventName, RequestId};
use serde_json::{Value as Json, json};
use std::sync::Weak;
use std::time::Duration;

/// Answers the calls of a session's control socket. Holds the session weakly: the socket does not keep it alive.
pub struct SessionService {
    session: Weak<Session>,
}

/// The methods with their parameters, for the help of an unknown one and for the documentation's test.
pub const METHODS: &[(&str, &[&str])] = &[
    ("status", &[]),
    ("stack", &[]),
    ("log", &["last"]),
    ("event", &["event", "wait", "wait_for", "within_s"]),
    ("apply", &["configuration", "force", "wait", "within_s"]),
    ("look", &["within_s"]),
    ("get", &["name", "within_s"]),
    ("set", &["name", "value", "force", "wait", "within_s"]),
    ("undo", &["configuration", "to", "force", "wait", "within_s"]),
    ("drift", &["within_s"]),
    ("recover", &["direction", "within_s"]),
    ("commit", &["force", "wait", "within_s"]),
    ("shutdown", &["force", "wait", "within_s"]),
    ("subscribe", &[]),
];

/// There is such a method, and it has all of these parameters.
fn known(method: &str, params: &Json) -> Result<(), RpcError> {
    match METHODS.iter().find(|(name, _)| *name == method) {
        Some((_, parameters)) => only(method, params, parameters),
        None => {
            let near = did_you_mean(method, "methods", METHODS.iter().map(|(name, _)| *name));
            Err(RpcError::helped(METHOD_NOT_FOUND, format!("there is no method `{method}`"), near))
        }
    }
}

impl SessionService {
    /// The service of `session`.
    pub fn new(session: Weak<Session>) -> Self {
        Self { session }
    }
}

/// How long an answer is waited for, in seconds, and what goes through a port.
const WITHIN: f64 = 10.0;
const GET_WITHIN: f64 = 2.0;
const LOOK_WITHIN: f64 = 0.3;
/// It takes what it takes: who asks knows how long that is waited for.
const DOWN_WITHIN: f64 = 1e6;

/// The longest for what ends when who asked is gone.
const WITHIN_MOST: f64 = 1e6;

fn within(params: &Json, usual: f64) -> Result<Duration, RpcError> {
    within_at_most(params, usual, WITHIN_MOST)
}

fn within_at_most(params: &Json, usual: f64, most: f64) -> Result<Duration, RpcError> {
    let seconds: f64 = optional(params, "within_s")?.unwrap_or(usual);
    if seconds.is_finite() && (0.0..=most).contains(&seconds) {
        Ok(Duration::from_secs_f64(seconds))
    } else {
        Err(RpcError::new(INVALID_PARAMS, format!("`within_s` is a number of seconds from 0 to {most}")))
    }
}

fn refused(message: String, help: String) -> RpcError {
    RpcError::helped(REFUSED, message, help)
}

fn view(value: &impl serde::Serialize) -> Json {
    serde_json::to_value(value).expect("views are plain data")
}

/// Whether nobody waits for the answer any more.
type ServiceGone<'a> = &'a dyn Fn() -> bool;

/// Waits outside the clock for what `look` finds, as long as somebody wants to know.
fn wait<T>(
    session: &Session,
    limit: Duration,
    gone: ServiceGone<'_>,
    late: impl FnOnce() -> String,
    look: impl Fn(&Hub) -> Option<T>,
) -> Result<T, RpcError> {
    let found = session.hub().wait_outside(limit, |hub| match look(hub) {
        Some(found) => Some(Some(found)),
        None => gone().then_some(None),
    });
    found.flatten().ok_or_else(|| RpcError::new(TIMED_OUT, late()))
}

impl Service for SessionService {
    fn call(&self, line: u32, method: &str, params: &Json) -> Result<Json, RpcError> {
        self.call_while(line, method, params, &|| false)
    }

    fn must_get_through(&self, method: &str, params: &Json) -> bool {
        match method {
            "shutdown" | "status" => true,
            "event" => self.session.upgrade().is_some_and(|session| {
                let named = params.get("event").and_then(Json::as_str);
                session.deployment().safety.iter().any(|(event, _)| Some(event.as_str()) == named)
            }),
            _ => false,
        }
    }

    fn call_while(&self, line: u32, method: &str, params: &Json, gone: ServiceGone<'_>) -> Result<Json, RpcError> {
        known(method, params)?;
        let session = self.session.upgrade().ok_or_else(|| RpcError::new(GOING_DOWN, "the deployment is down"))?;
        refused_while_stopping(&session, method, params)?;
        match method {
            "status" => Ok(view(&session.status())),
            "stack" => session.status().stack.map(|stack| view(&stack)).ok_or_else(|| unanswered(Unanswered)),
            "log" => Ok(view(&session.hub().log(optional(params, "last")?.unwrap_or(usize::MAX)))),
            "event" => event(&session, params, gone),
            "apply" => {
                let name: String = param(params, "configuration")?;
                let id = configuration(&session, &name)?;
                if session.setting(&name).is_some() {
                    return Err(refused(format!("`{name}` is no configuration"), format!("`davit set {name} VALUE`")));
                }
                let before = session.before(id);
                let mut answer = request(&session, line, Ask::Apply(id), params, gone)?;
                if answer["ok"] == true {
                    answer["notes"] = json!(session.consequences(id, &before));
                }
                Ok(answer)
            }
            "undo" => {
                let ask = match (optional::<String>(params, "configuration")?, optional::<usize>(params, "to")?) {
                    (Some(_), Some(_)) => {
                        return Err(RpcError::new(INVALID_PARAMS, "give `configuration` or `to`, not both"));
                    }
                    (Some(name), None) => Ask::UndoOf(configuration(&session, &name)?),
                    (None, Some(to)) => Ask::UndoTo(to),
                    (None, None) => Ask::Undo,
                };
                request(&session, line, ask, params, gone)
            }
            "look" => Ok(view(&session.look(within_at_most(params, LOOK_WITHIN, limits::READ_WITHIN)?))),
            "get" => {
                let within = within_at_most(params, GET_WITHIN, limits::READ_WITHIN)?;
                session.get(&param::<String>(params, "name")?, within).map(|seen| view(&seen)).map_err(no_member)
            }
            "set" => {
                let (name, value): (String, Json) = (param(params, "name")?, param(params, "value")?);
                within(params, WITHIN)?;
                let request = session.set(line, &name, &value, forced(params)?).map_err(no_member)?;
                answer_to(&session, request, &name, params, gone)
            }
            "drift" => drift(&session, params),
            "recover" => recover(&session, params),
            "commit" => {
                let force = forced(params)?;
                request(&session, line, Ask::Commit { force }, params, gone)
            }
            "shutdown" => {
                let (force, within) = (forced(params)?, within(params, DOWN_WITHIN)?);
                let waits = optional(params, "wait")?.unwrap_or(false);
                session.command(Command::Shutdown { force });
                if !waits {
                    return Ok(json!({ "phase": "shutting_down" }));
                }
                let late = || "it is not down yet".to_owned();
                let ended = wait(&session, within, gone, late, |_| session.ended());
                ended.map(|ended| view(&ended)).map_err(|late| {
                    let still = session.status().stopping.and_then(|stopping| stopping.stands_still());
                    let help = still.unwrap_or_else(|| "it goes on: `davit status` shows what it waits for".to_owned());
                    RpcError { data: json!({ "help": help }), ..late }
                })
            }
            _ => Err(RpcError::new(METHOD_NOT_FOUND, format!("`{method}` is the socket's own"))),
        }
    }
}

/// From the first moment of stopping on nothing changes any more what its stages do: but safety events, the shutdown event
/// and `recover` stay open to the end.
fn refused_while_stopping(session: &Session, method: &str, params: &Json) -> Result<(), RpcError> {
    let what = match method {
        _ if !session.hub().is_stopping() => return Ok(()),
        "apply" | "set" | "undo" | "commit" => format!("`{method}`"),
        "event" => match params.get("event").and_then(Json::as_str) {
            Some(event) if session.deployment().stays_open(event) => return Ok(()),
            Some(event) => format!("`{event}`"),
            None => return Ok(()),
        },
        _ => return Ok(()),
    };
    let deployment = session.deployment();
    let message = format!("`{}` is being stopped: {what} is refused", deployment.name);
    let help = format!(
        "safety events, `{}`, `recover` and `davit shutdown --force` stay open; `davit status` shows what it waits for",
        deployment.shutdown.event
    );
    Err(RpcError::helped(GOING_DOWN, message, help))
}

fn unanswered(why: Unanswered) -> RpcError {
    let help = "something may be under way that holds it up: `davit status` shows what is known";
    RpcError::helped(TIMED_OUT, why.to_string(), help)
}

fn no_member(why: NoMember) -> RpcError {
    refused(why.message, why.help)
}

/// One of the deployment, or what an operator has set.
fn configuration(session: &Session, name: &str) -> Result<ConfigId, RpcError> {
    let known = session.configurations();
    known.iter().find(|id| id.as_str() == name).copied().or_else(|| session.setting(name)).ok_or_else(|| {
        refused(
            format!("there is no configuration `{name}`"),
            did_you_mean(name, "configurations", known.iter().map(ConfigId::as_str)),
        )
    })
}

fn event(session: &Session, params: &Json, gone: ServiceGone<'_>) -> Result<Json, RpcError> {
    let name: String = param(params, "event")?;
    let wait_for: Option<String> = optional(params, "wait_for")?;
    let waits: bool = optional(params, "wait")?.unwrap_or(false);
    let within = within(params, WITHIN)?;
    let mut answer = json!({ "accepted": true });
    let event = session.named(&name).map_err(|why| match why {
        NotNamed::NotFromOutside(why) => not_from_outside(why),
        other => refused(other.to_string(), session.near_event(&name)),
    })?;
    if !session.events().contains(&event) {
        let near = session.near_event(&name);
        answer["note"] = json!(format!("no transition lists `{name}`, only functions may see it; {near}"));
    }
    if let Some(why) = wait_for.as_ref().and_then(|name| session.never_heard(name)) {
        return Err(refused(why, "wait for an answer that may come, or for an event".to_owned()));
    }
    let since = session.hub().heard();
    if let Some(wait_for) = wait_for {
        let Offered { ticket, acted } = session.offer_watched(event, "operator").map_err(not_raised)?;
        // What no transition hears leads to nothing that could be waited for, but for what functions see, and what it confirms.
        let alone = acted.is_none() && !session.sees_all_events() && !session.confirms(event);
        let late = format!("`{wait_for}` was not heard in time");
        let mut ends = instead(&wait_for);
        ends.push(wait_for);
        let unheard = |hub: &Hub| (alone && hub.was_heard(ticket) == Some(false)).then_some(None);
        let either = |hub: &Hub| hub.first_heard(&ends, since).map(Some).or_else(|| unheard(hub));
        let heard = wait(session, within, gone, || late, either);
        session.hub().forget(ticket);
        match heard? {
            Some(heard) => answer["heard"] = json!(heard),
            None => not_taken(session, event, &mut answer),
        }
    } else if waits {
        let Offered { ticket, acted } = session.offer_watched(event, "operator").map_err(not_raised)?;
        if let Some(Acted { requests, before }) = acted {
            session.hub().forget(ticket);
            let all = |hub: &Hub| requests.iter().map(|request| hub.answer(*request)).collect::<Option<Vec<_>>>();
            let late = || format!("what `{name}` does by itself was not over in time");
            let answers: Vec<LoggedAnswer> = wait(session, within, gone, late, all)?;
            answer["taken"] = json!(true);
            if before {
                answer["before"] = json!(true);
            }
            answer["acted"] = json!(answers.iter().map(|answered| &answered.answer).collect::<Vec<_>>());
            return Ok(answer);
        }
        let late = || format!("`{name}` was not taken up in time; it may be yet");
        let taken = wait(session, within, gone, late, |hub| hub.was_heard(ticket));
        session.hub().forget(ticket);
        // What confirms a configuration need not move a coordinator.
        let taken = taken? || session.confirms(event);
        match taken {
            true => answer["taken"] = json!(true),
            false => not_taken(session, event, &mut answer),
        }
    } else {
        session.offer(event, "operator").map_err(not_raised)?;
    }
    Ok(answer)
}

/// Nobody has heard it: one of safety tells who thinks that it has stopped something what it does not hold.
fn not_taken(session: &Session, event: EventName, answer: &mut Json) {
    answer["taken"] = json!(false);
    if let Some(note) = session.applied_over_safe(event) {
        answer["note"] = json!(note);
    }
}

fn not_from_outside(why: NotFromOutside) -> RpcError {
    let data = json!({ "help": why.help, "code": NotFromOutside::CODE });
    RpcError { data, ..RpcError::new(REFUSED, why.to_string()) }
}

fn not_raised(why: NotRaised) -> RpcError {
    match why {
        NotRaised::NotFromOutside(why) => not_from_outside(why),
        NotRaised::Stopping => {
            RpcError { code: GOING_DOWN, ..refused(why.to_string(), "deploy it again when it is down".to_owned()) }
        }
        NotRaised::Refused(why) => {
            refused(why.to_string(), "events come faster than it reacts: wait, and send it again".to_owned())
        }
    }
}

fn drift(session: &Session, params: &Json) -> Result<Json, RpcError> {
    let drift = session.drift(within_at_most(params, WITHIN, limits::READ_WITHIN)?);
    let help = "something may be under way, or a component keeps it busy: `davit status` shows it";
    let late = || RpcError::helped(TIMED_OUT, "the platform could not be read in time", help);
    drift.map(|differences| view(&differences)).ok_or_else(late)
}

fn recover(session: &Session, params: &Json) -> Result<Json, RpcError> {
    let word: String = param(params, "direction")?;
    let Some(how) = recovery(&word) else {
        return Err(if word == "forward" {
            refused(NO_FORWARD.to_owned(), "go `back`, or `accept` what is there".to_owned())
        } else {
            RpcError::new(INVALID_PARAMS, "`direction` is `back` or `accept`")
        });
    };
    let within = within_at_most(params, WITHIN, limits::RECOVER_WITHIN)?;
    let recovered = session.recover(how, "operator", within);
    recovered.map(|recovered| view(&recovered)).ok_or_else(|| {
        let message = "the recovery was not over in time; it goes on";
        RpcError::helped(TIMED_OUT, message, "`davit status` and `davit log` show how it ends")
    })
}

fn forced(params: &Json) -> Result<bool, RpcError> {
    Ok(optional(params, "force")?.unwrap_or(false))
}

fn request(session: &Session, line: u32, ask: Ask, params: &Json, gone: ServiceGone<'_>) -> Result<Json, RpcError> {
    within(params, WITHIN)?;
    let request = session.request_on(line, ask, "operator", forced(params)?);
    answer_to(session, request, &ask.to_string(), params, gone)
}

/// The answer to a request, if it is waited for.
fn answer_to(
    session: &Session,
    request: RequestId,
    what: &str,
    params: &Json,
    gone: ServiceGone<'_>,
) -> Result<Json, RpcError> {
    let waits: bool = optional(params, "wait")?.unwrap_or(false);
    let within = within(params, WITHIN)?;
    if !waits {
        return Ok(json!({ "request": request }));
    }
    let late = || format!("`{what}` was not answered in time; it may be carried out yet");
    let answer: LoggedAnswer = wait(session, within, gone, late, |hub| hub.answer(request))?;
    Ok(view(&answer))
}
