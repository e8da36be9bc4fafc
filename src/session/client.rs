//! The other end of the control socket, as the command line uses it.

use super::owner;
use super::place::{self, Unreached, Untrusted};
use super::rpc::{self, RpcError};
use crate::limits;
use crate::model::finding::did_you_mean;
use crate::time::{Clock, Time};
use serde_json::{Value as Json, json};
use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::Duration;

/// Why a running deployment could not be asked.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// None runs.
    #[error("no deployment is running")]
    None,
    /// Several run and no name was given.
    #[error("several deployments are running ({}): say which", .0.join(", "))]
    Several(Vec<String>),
    /// None of that name runs.
    #[error("no deployment named `{name}` is running")]
    Unknown {
        /// The name.
        name: String,
        /// What was likely meant.
        help: String,
    },
    /// A process owns the name, but its socket is not there any more.
    #[error("the deployment `{name}` runs, but its socket {} is gone", .path.display())]
    SocketGone {
        /// The name.
        name: String,
        /// Where the socket was.
        path: PathBuf,
    },
    /// The directory of the sockets, the socket, or who listens there is another user's.
    #[error(transparent)]
    Untrusted(#[from] Untrusted),
    /// The connection failed.
    #[error("the running deployment `{name}` does not answer")]
    Io {
        /// The deployment.
        name: String,
        /// Why.
        source: io::Error,
    },
    /// It answered with an error.
    #[error(transparent)]
    Refused(#[from] RpcError),
}

fn nanos(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

fn gone(name: String) -> ClientError {
    let path = place::socket(&name);
    ClientError::SocketGone { name, path }
}

/// A connection to a running deployment.
pub struct Client {
    name: String,
    reader: BufReader<UnixStream>,
    next: u64,
    /// A line whose end has not come.
    begun: Vec<u8>,
    /// The last call, and until when it is made again where there is no place for it.
    call: (String, Time),
    clock: Clock,
}

impl Client {
    /// Connects to the deployment of that name, or to the only one running.
    ///
    /// # Errors
    /// When there is none, or several and no name; or what is there is not the user's own.
    pub fn connect(name: Option<&str>) -> Result<Self, ClientError> {
        place::is_there()?;
        let name = match name {
            Some(name) => name.to_owned(),
            None => {
                let mut running = place::running();
                match running.len() {
                    0 => owner::owned().pop().ok_or(ClientError::None)?,
                    1 => running.remove(0),
                    _ => return Err(ClientError::Several(running)),
                }
            }
        };
        let clock = Clock::real();
        loop {
            match place::reach(&place::socket(&name)) {
                Ok(stream) => {
                    let (reader, call) = (BufReader::new(stream), (String::new(), Time(0)));
                    return Ok(Self { name, reader, next: 1, begun: Vec::new(), call, clock });
                }
                Err(Unreached::Untrusted(why)) => return Err(why.into()),
                Err(Unreached::Io(_)) => {}
            }
            if !owner::is_owned(&name) {
                let running = place::running();
                let help = did_you_mean(&name, "running deployments", running.iter().map(String::as_str));
                return Err(ClientError::Unknown { name, help });
            }
            // It may be about to listen, or about to end.
            if clock.now().0 >= nanos(limits::SOCKET_APPEARS) {
                return Err(gone(name));
            }
            clock.sleep(limits::SOCKET_STEP);
        }
    }

    /// Waits until the deployment's name is free: it is down, and its process is done with its clients. At most for as long
    /// as that may take, and for `limit`.
    pub fn wait_until_free(&self, limit: Duration) {
        let clock = Clock::real();
        let limit = nanos(limit.min(limits::SOCKET_WRITE + limits::TAP_END));
        while owner::is_owned(&self.name) && clock.now().0 < limit {
            clock.sleep(limits::SOCKET_STEP);
        }
    }

    /// The deployment's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Calls a method and waits for its answer, for at most `limit`.
    ///
    /// # Errors
    /// When the deployment refuses, or does not answer in time.
    pub fn call(&mut self, method: &str, params: &Json, limit: Duration) -> Result<Json, ClientError> {
        let asked = self.send(method, params)?;
        self.answer(asked, limit)?.ok_or_else(|| {
            let why = format!("nothing came within {:.1} s", limit.as_secs_f64());
            ClientError::Io { name: self.name.clone(), source: io::Error::new(io::ErrorKind::TimedOut, why) }
        })
    }

    /// Calls a method whose answer is waited for with [`Client::answer`], under the number that this answers.
    ///
    /// # Errors
    /// When the connection is gone.
    pub fn send(&mut self, method: &str, params: &Json) -> Result<u64, ClientError> {
        let id = self.next;
        self.next += 1;
        let line = json!({"jsonrpc": "2.0", "id": id, "method": method, "params": params}).to_string();
        self.call = (format!("{line}\n"), self.clock.now() + limits::SOCKET_SAY);
        self.say()?;
        Ok(id)
    }

    fn say(&mut self) -> Result<(), ClientError> {
        // One that was refused a place may be closed by now; what it was told is still there to be read.
        match self.reader.get_mut().write_all(self.call.0.as_bytes()) {
            Err(source) if source.kind() != io::ErrorKind::BrokenPipe => {
                Err(ClientError::Io { name: self.name.clone(), source })
            }
            _ => Ok(()),
        }
    }

    /// Makes the last call again after a moment: no place was left for it, so it was not heard. Whether there is time for that.
    fn again(&mut self) -> Result<bool, ClientError> {
        if self.clock.now() >= self.call.1 {
            return Ok(false);
        }
        self.clock.sleep(limits::SOCKET_STEP);
        let Ok(stream) = place::reach(&place::socket(&self.name)) else { return Ok(false) };
        (self.reader, self.begun) = (BufReader::new(stream), Vec::new());
        self.say().map(|()| true)
    }

    /// The answer to a call; none: it has not come within `limit`, and may yet.
    ///
    /// # Errors
    /// When the deployment refuses, or the connection is gone.
    pub fn answer(&mut self, id: u64, limit: Duration) -> Result<Option<Json>, ClientError> {
        let name = self.name.clone();
        let io = |source| ClientError::Io { name: name.clone(), source };
        let least = Duration::from_micros(1);
        let deadline = self.clock.now() + limit;
        loop {
            // What else comes meanwhile lengthens nothing. No time at all would be taken for all of it.
            let left = deadline.since(self.clock.now()).max(least);
            self.reader.get_ref().set_read_timeout(Some(left)).map_err(io)?;
            let json = match self.read() {
                Err(late) if matches!(late.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                    return Ok(None);
                }
                read => read.map_err(io)?,
            };
            let refused = json.get("error");
            let own = json.get("id").and_then(Json::as_u64) == Some(id);
            // An error without an `id` is about the connection.
            let about_all = refused.is_some() && json.get("id").is_none_or(Json::is_null);
            if !own && !about_all {
                continue;
            }
            if let Some(error) = refused {
                let error: RpcError =
                    serde_json::from_value(error.clone()).unwrap_or_else(|_| RpcError::new(0, error.to_string()));
                // Whoever has the last places has them for a moment.
                if !own && error.code == rpc::TOO_MANY && self.again()? {
                    if self.clock.now() >= deadline {
                        return Ok(None);
                    }
                    continue;
                }
                return Err(error.into());
            }
            return Ok(Some(json.get("result").cloned().unwrap_or(Json::Null)));
        }
    }

    /// From now on what happens is told: see [`Client::next_entry`].
    ///
    /// # Errors
    /// When the deployment refuses.
    pub fn subscribe(&mut self, limit: Duration) -> Result<(), ClientError> {
        self.call("subscribe", &Json::Null, limit)?;
        let io = |source| ClientError::Io { name: self.name.clone(), source };
        self.reader.get_ref().set_read_timeout(Some(limits::FOLLOW_LOOK)).map_err(io)
    }

    /// The next thing that happens; none: nothing has for [`limits::FOLLOW_LOOK`].
    ///
    /// # Errors
    /// When the deployment does not live any more, or the connection was cut off since too much waited to be read.
    pub fn next_entry(&mut self) -> io::Result<Option<Json>> {
        loop {
            let mut json = match self.read() {
                Err(quiet) if matches!(quiet.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                    return Ok(None);
                }
                read => read?,
            };
            if json.get("method").and_then(Json::as_str) == Some("log") {
                return Ok(Some(json["params"].take()));
            }
        }
    }

    fn read(&mut self) -> io::Result<Json> {
        // What has come of a line stays, also where its end is late.
        self.reader.read_until(b'\n', &mut self.begun)?;
        let line = std::mem::take(&mut self.begun);
        if line.is_empty() {
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "it closed the connection"));
        }
        serde_json::from_slice(&line).map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e))
    }
}
