//! The other end of the control socket, as the command line uses it.

use super::place;
use super::rpc::RpcError;
use crate::model::finding::did_you_mean;
use serde_json::{Value as Json, json};
use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
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

/// A connection to a running deployment.
pub struct Client {
    name: String,
    reader: BufReader<UnixStream>,
    next: u64,
}

impl Client {
    /// Connects to the deployment of that name, or to the only one running.
    ///
    /// # Errors
    /// When there is none, or several and no name.
    pub fn connect(name: Option<&str>) -> Result<Self, ClientError> {
        let name = match name {
            Some(name) => name.to_owned(),
            None => {
                let mut running = place::running();
                match running.len() {
                    0 => return Err(ClientError::None),
                    1 => running.remove(0),
                    _ => return Err(ClientError::Several(running)),
                }
            }
        };
        match UnixStream::connect(place::socket(&name)) {
            Ok(stream) => Ok(Self { name, reader: BufReader::new(stream), next: 1 }),
            Err(_) => {
                let running = place::running();
                let help = did_you_mean(&name, "running deployments", running.iter().map(String::as_str));
                Err(ClientError::Unknown { name, help })
            }
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
        let id = self.next;
        self.next += 1;
        let io = |source| ClientError::Io { name: self.name.clone(), source };
        self.reader.get_ref().set_read_timeout(Some(limit)).map_err(io)?;
        let line = json!({"jsonrpc": "2.0", "id": id, "method": method, "params": params}).to_string();
        self.reader.get_mut().write_all(format!("{line}\n").as_bytes()).map_err(io)?;
        loop {
            let json = self.read().map_err(|source| ClientError::Io { name: self.name.clone(), source })?;
            if json.get("id").and_then(Json::as_u64) != Some(id) {
                continue;
            }
            if let Some(error) = json.get("error") {
                let error: RpcError =
                    serde_json::from_value(error.clone()).unwrap_or_else(|_| RpcError::new(0, error.to_string()));
                return Err(error.into());
            }
            return Ok(json.get("result").cloned().unwrap_or(Json::Null));
        }
    }

    fn read(&mut self) -> io::Result<Json> {
        let mut line = String::new();
        if self.reader.read_line(&mut line)? == 0 {
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "it closed the connection"));
        }
        serde_json::from_str(&line).map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e))
    }
}
