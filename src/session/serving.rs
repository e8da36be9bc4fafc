//! What is done with the lines of a connection: who answers them, and within which bounds.

use super::connection::{Lines, SaidTo, SocketConnection};
use super::rpc::{self, RpcError};
use super::subscribers::Subscribers;
use crate::limits;
use crate::time::lock;
use serde_json::Value as Json;
use std::io;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// What answers the calls.
pub trait Service: Send + Sync + 'static {
    /// Answers one call of the connection with this number (never 0 or 1); may wait for as long as it promises to.
    ///
    /// # Errors
    /// The error answer to send.
    fn call(&self, line: u32, method: &str, params: &Json) -> Result<Json, RpcError>;

    /// The same, and may give up waiting when `gone` says that nobody waits for the answer any more.
    ///
    /// # Errors
    /// The error answer to send.
    fn call_while(&self, line: u32, method: &str, params: &Json, gone: &dyn Fn() -> bool) -> Result<Json, RpcError> {
        let _ = gone;
        self.call(line, method, params)
    }

    /// Whether such a call is answered when all places but the kept ones are taken.
    fn must_get_through(&self, method: &str, params: &Json) -> bool {
        let _ = (method, params);
        false
    }
}

/// Bounds of a control socket; see those of the same names in [`limits`].
#[derive(Debug, Clone)]
pub struct Bounds {
    /// [`limits::SOCKET_CONNECTIONS`]
    pub connections: usize,
    /// [`limits::SOCKET_KEPT`]
    pub kept: usize,
    /// [`limits::SOCKET_KEPT_EACH`]
    pub kept_each: usize,
    /// How many connections have a thread of their own; what must get through on another one is answered by a thread that there is
    /// from the beginning, one call after the other.
    pub threads: usize,
    /// [`limits::SOCKET_SAY`]
    pub say: Duration,
    /// [`limits::SOCKET_IDLE`]
    pub idle: Duration,
    /// [`limits::SOCKET_WRITE`]
    pub write: Duration,
    /// [`limits::SOCKET_PAUSE`]
    pub pause: Duration,
    /// [`limits::SOCKET_QUEUE`]
    pub queue: usize,
}

impl Default for Bounds {
    fn default() -> Self {
        Self {
            connections: limits::SOCKET_CONNECTIONS,
            kept: limits::SOCKET_KEPT,
            kept_each: limits::SOCKET_KEPT_EACH,
            threads: limits::SOCKET_CONNECTIONS + limits::SOCKET_KEPT,
            say: limits::SOCKET_SAY,
            idle: limits::SOCKET_IDLE,
            write: limits::SOCKET_WRITE,
            pause: limits::SOCKET_PAUSE,
            queue: limits::SOCKET_QUEUE,
        }
    }
}

/// Calls that are being answered.
#[derive(Default)]
pub(super) struct ServedCalls {
    open: Mutex<usize>,
    ended: Condvar,
}

impl ServedCalls {
    pub fn run<T>(&self, call: impl FnOnce() -> T) -> T {
        /// Also a call that panics is over.
        struct Open<'c>(&'c ServedCalls);
        impl Drop for Open<'_> {
            fn drop(&mut self) {
                *lock(&self.0.open) -= 1;
                self.0.ended.notify_all();
            }
        }
        *lock(&self.open) += 1;
        let _open = Open(self);
        call()
    }

    /// Waits until all are answered, at most as long as writing to a client may take.
    pub fn finish(&self) {
        let open = lock(&self.open);
        drop(
            self.ended
                .wait_timeout_while(open, limits::SOCKET_WRITE, |open| *open > 0)
                .unwrap_or_else(PoisonError::into_inner),
        );
    }
}

/// What the connections of one socket share.
pub(super) struct ServingShared {
    pub bounds: Bounds,
    pub subscribers: Arc<Subscribers>,
    pub calls: ServedCalls,
    pub service: Arc<dyn Service>,
}

/// The answer to one that finds all places taken.
pub(super) fn too_many() -> RpcError {
    let help = "close one and try again; `davit status`, `davit shutdown` and safety events are answered all the same";
    RpcError::helped(rpc::TOO_MANY, "too many connections", help)
}

/// Answers the calls of one connection until it closes. `kept`: it has one of the places kept for what must get through.
pub(super) fn serve(connection: &Arc<SocketConnection>, shared: &ServingShared, kept: bool) -> io::Result<()> {
    let mut lines = Lines::of(connection);
    let mut subscribed = false;
    let bounds = &shared.bounds;
    let refuse = |id: &Json, error: RpcError| connection.send(&rpc::answer(id, Err(error)));
    loop {
        let limit = if kept { bounds.say } else { bounds.idle };
        let call = match lines.next((!subscribed).then_some(limit))? {
            SaidTo::End => return Ok(()),
            SaidTo::Nothing if kept => return refuse(&Json::Null, too_many()),
            SaidTo::Nothing => {
                let why = format!("closed: nothing was said for {} s", bounds.idle.as_secs_f64());
                return refuse(&Json::Null, RpcError::new(rpc::REFUSED, why));
            }
            SaidTo::TooLong => {
                return refuse(&Json::Null, RpcError::new(rpc::INVALID_REQUEST, "the line is too long"));
            }
            SaidTo::NotText => Err((Json::Null, RpcError::new(rpc::PARSE_ERROR, "the line is not UTF-8"))),
            SaidTo::Line(line) if line.trim().is_empty() && !kept => continue,
            SaidTo::Line(line) => rpc::parse(&line),
        };
        let call = match call {
            Ok(call) => call,
            // One line is all that is heard on a kept place: who says nothing again and again must not keep it.
            Err((id, error)) if kept => return refuse(&id, error),
            Err((id, error)) => {
                refuse(&id, error)?;
                continue;
            }
        };
        let answer = |result: Result<Json, RpcError>| match &call.id {
            Some(id) => connection.send(&rpc::answer(id, result)),
            None => Ok(()),
        };
        if kept && !shared.service.must_get_through(&call.method, &call.params) {
            return answer(Err(too_many()));
        }
        if call.method == "subscribe" {
            answer(match rpc::only(&call.method, &call.params, &[]) {
                Err(error) => Err(error),
                Ok(()) => match shared.subscribers.add(connection)? {
                    true => {
                        subscribed = true;
                        Ok(Json::Bool(true))
                    }
                    false => Err(RpcError::new(rpc::REFUSED, "this connection has subscribed already")),
                },
            })?;
            continue;
        }
        shared.calls.run(|| {
            let gone = || connection.is_gone();
            answer(shared.service.call_while(connection.number, &call.method, &call.params, &gone))
        })?;
        // Such a place is for one word: who asks again and again must not keep it.
        if kept {
            return Ok(());
        }
    }
}
