//! What a script waits for: states, answers, events.

use super::{SharedHost, clock, deadline, error, interrupt, session};
use crate::model::finding::{did_you_mean, meant};
use crate::model::{EventName, RequestId};
use crate::session::{Hub, Session};
use std::collections::BTreeSet;

/// Waits until `look` finds something; tells what was there instead when the time is over.
fn wait_until<T>(
    host: &SharedHost,
    seconds: f64,
    look: impl Fn(&Session) -> Option<T>,
    what: impl Fn(&Hub) -> String,
) -> mlua::Result<T> {
    let (session, clock, deadline) = (session(host)?, clock(host), deadline(host, seconds)?);
    let interrupt = interrupt(host);
    loop {
        interrupt.check()?;
        if let Some(found) = look(&session) {
            return Ok(found);
        }
        if clock.now() >= deadline {
            return Err(error(what(session.hub())));
        }
        session.hub().changed.wait(deadline);
    }
}

/// Waits until what was asked for is done; fails with the reasons where it is not.
pub(super) fn wait_done(host: &SharedHost, request: RequestId, seconds: f64) -> mlua::Result<()> {
    let answer = wait_until(
        host,
        seconds,
        |s| s.hub().answer(request),
        |hub| format!("no answer came in {seconds} s: {}", hub.whereabouts()),
    )?;
    if answer.ok {
        return Ok(());
    }
    let reasons: String = answer.reasons.iter().map(|reason| format!("\n  {reason}")).collect();
    Err(error(format!("{}{reasons}", answer.answer)))
}

pub(super) fn wait_state(host: &SharedHost, state: &str, seconds: f64) -> mlua::Result<()> {
    let deployed = session(host)?;
    if !deployed.knows_state(state) {
        let names = deployed.coordinators();
        if let Some((of, _)) = state.split_once(':')
            && names.iter().all(|name| name.as_str() != of)
        {
            let help = did_you_mean(of, "coordinators", names.iter().map(|name| name.as_str()));
            return Err(error(format!("there is no coordinator `{of}` that could be in `{state}`: {help}")));
        }
        let meant = state.split_once(['.', '/']).map(|(of, own)| format!("{of}:{own}"));
        if let Some(meant) = meant.filter(|meant| deployed.knows_state(meant)) {
            return Err(error(format!("no coordinator has a state `{state}`: did you mean `{meant}`?")));
        }
        let states = deployed.states();
        let own = state.rsplit(['.', ':']).next().unwrap_or(state);
        let help = did_you_mean(own, "states", states.iter().map(String::as_str));
        return Err(error(format!("the coordinator has no state `{state}`: {help}")));
    }
    wait_until(
        host,
        seconds,
        |s| s.in_state(state).then_some(()),
        |hub| format!("not in `{state}` after {seconds} s: {}", hub.whereabouts()),
    )
}

pub(super) fn wait_answer(host: &SharedHost, event: &str, seconds: f64) -> mlua::Result<()> {
    if let Some(why) = session(host)?.never_heard(event) {
        return Err(error(why));
    }
    let meant = meant_event(&*session(host)?, event);
    let (mark, taken) = (host.borrow().mark, host.borrow().taken.clone());
    let number = wait_until(
        host,
        seconds,
        |s| s.hub().heard_but(event, mark, &taken),
        |hub| {
            let waiting = hub.outstanding();
            let waiting =
                if waiting.is_empty() { String::new() } else { format!("; still waiting for {}", waiting.join(", ")) };
            let failed: String = hub.failures_since(mark).iter().map(|why| format!("\n  {why}")).collect();
            format!("`{event}` was not heard in {seconds} s{waiting}{meant}{failed}")
        },
    )?;
    host.borrow_mut().taken.push(number);
    Ok(())
}

/// Which event that is heard or emitted may be meant by one that is neither: a component may raise it all the same.
fn meant_event(session: &Session, event: &str) -> String {
    let deployment = session.deployment();
    let known: BTreeSet<EventName> =
        session.events().into_iter().chain(deployment.emits.iter().map(|(event, _)| *event)).collect();
    // What is answered so, and only did not come, is meant.
    if known.iter().any(|known| known.as_str() == event) || deployment.looks_like_answer(event) {
        return String::new();
    }
    let meant = meant(event, known.iter().map(|known| known.as_str()));
    if meant.is_empty() { String::new() } else { format!(" (did you mean `{}`?)", meant.join("` or `")) }
}
