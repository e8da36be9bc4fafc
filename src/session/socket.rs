//! The control socket: listens, answers calls, forwards notifications to those who subscribed.
//!
//! Its threads are outside the clock's scheduling: they only put requests into bounded queues and wait, with a limit in
//! real time, for what comes back. A slow or hostile client can fill its own queue and nothing else. [`owner`](super::owner)
//! says whose name it is, [`doors`](super::doors) who is let in, [`serving`](super::serving) what is done with what they say.

use super::doors::Doors;
use super::owner::Owner;
use super::place::{self, KnownName};
use super::room::{self, DescriptorRoom};
use super::serving::{ServedCalls, ServingShared};
use super::subscribers::{Subscribers, ToSubscribers};
use super::tap::LogSink;
use crate::limits;
use crate::time::{Clock, lock};
use std::fs;
use std::io;
use std::net::Shutdown;
use std::os::fd::OwnedFd;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

pub use super::serving::{Bounds, Service};

/// A listening control socket; dropping it lets the calls under way be answered, closes and removes it.
pub struct ControlSocket {
    path: PathBuf,
    /// The file it made.
    file: KnownName,
    /// The listening socket, to end it.
    listening: UnixStream,
    doors: Arc<Doors>,
    shared: Arc<ServingShared>,
    observer: Mutex<Option<ToSubscribers>>,
    accepting: Option<JoinHandle<()>>,
    /// Held longest.
    _owner: Owner,
}

/// Why a control socket could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum SocketError {
    /// A deployment of that name runs already.
    #[error("a deployment named `{0}` is already running")]
    Taken(String),
    /// The process may have so many descriptors open, and with those that are open already not one connection would fit in.
    #[error("{open} of {limit} descriptors are open, and {} more are needed to be commanded", room::LEAST)]
    Descriptors {
        /// That are open.
        open: usize,
        /// That may be.
        limit: usize,
    },
    /// The operating system refused.
    #[error("cannot listen on {path}")]
    Io {
        /// The socket.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl ControlSocket {
    /// Listens as the deployment `name`, and lets `service` answer.
    ///
    /// # Errors
    /// When the name is taken by a running deployment, or the socket cannot be made.
    pub fn open(name: &str, service: Arc<dyn Service>) -> Result<Self, SocketError> {
        Self::open_within(name, service, Bounds::default())
    }

    /// The same with other bounds.
    ///
    /// # Errors
    /// When the name is taken by a running deployment, or the socket cannot be made.
    pub fn open_within(name: &str, service: Arc<dyn Service>, bounds: Bounds) -> Result<Self, SocketError> {
        let path = place::socket(name);
        let io = |source| SocketError::Io { path: path.clone(), source };
        let taken = || SocketError::Taken(name.to_owned());
        let room = DescriptorRoom::now();
        if let Some(DescriptorRoom { open, limit }) = room.filter(|room| room.connections(bounds.kept) == 0) {
            return Err(SocketError::Descriptors { open, limit });
        }
        place::prepare(&place::directory()).map_err(io)?;
        let owner = Owner::of(name).map_err(io)?.ok_or_else(taken)?;
        // Only who owns the name gets here: what lies there is left of a process that is gone, unless it answers (to who
        // cannot see its lock: they share a directory and no network).
        if place::is_alive(&path) {
            return Err(taken());
        }
        match fs::remove_file(&path) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(io(e)),
            _ => {}
        }
        let listener = UnixListener::bind(&path).map_err(io)?;
        let file = KnownName::at(&path).map_err(io)?;
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).map_err(io)?;
        let listening = UnixStream::from(OwnedFd::from(listener.try_clone().map_err(io)?));
        let subscribers = Arc::new(Subscribers::new(bounds.queue));
        let connections = room.map_or(bounds.connections, |room| bounds.connections.min(room.connections(bounds.kept)));
        let bounds = Bounds { connections, ..bounds };
        let shared = Arc::new(ServingShared { bounds, subscribers, calls: ServedCalls::default(), service });
        let doors = Arc::new(Doors::default());
        let kept = Doors::keep(&shared).map_err(io)?;
        let accepting = {
            let (doors, shared) = (doors.clone(), shared.clone());
            std::thread::Builder::new()
                .name("davit-socket".to_owned())
                .spawn(move || doors.open(&listener, &shared, &kept))
                .map_err(io)?
        };
        Ok(Self {
            path,
            file,
            listening,
            doors,
            shared,
            observer: Mutex::default(),
            accepting: Some(accepting),
            _owner: owner,
        })
    }

    /// Where it listens.
    #[cfg(any(test, feature = "internals"))]
    pub fn path(&self) -> &std::path::Path {
        &self.path
    }

    /// Sends a notification to all subscribers; never waits.
    #[cfg(any(test, feature = "internals"))]
    pub fn notify(&self, method: &str, params: &serde_json::Value) {
        self.shared.subscribers.send(&super::rpc::notification(method, params));
    }

    /// What to give to a session on `clock`, so that the subscribers hear all that happens.
    ///
    /// # Errors
    /// When the operating system has no thread left.
    pub fn observer(&self, clock: &Clock) -> io::Result<Arc<dyn LogSink>> {
        let observer = self.shared.subscribers.observer(clock)?;
        *lock(&self.observer) = Some(observer.clone());
        Ok(Arc::new(observer))
    }

    /// A function that takes the socket's file away, for a process that ends at once.
    pub fn leave(&self) -> impl FnOnce() + Send + use<> {
        let (path, file) = (self.path.clone(), self.file);
        move || file.remove(&path)
    }
}

impl Drop for ControlSocket {
    fn drop(&mut self) {
        self.doors.close();
        // Wakes the accepting thread, also when the file is gone (its directory was cleaned up, the user logged out): a
        // connection to ourselves would not find it then.
        let _ = self.listening.shutdown(Shutdown::Both);
        self.file.remove(&self.path);
        if let Some(thread) = self.accepting.take() {
            let _ = thread.join();
        }
        self.shared.calls.finish();
        if let Some(observer) = lock(&self.observer).take() {
            observer.finish(limits::TAP_END);
        }
        self.shared.subscribers.finish(limits::TAP_END);
        self.doors.cut();
    }
}
