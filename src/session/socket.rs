//! The control socket: accepts connections, answers calls, forwards notifications to those who subscribed.
//!
//! Its threads are outside the clock's scheduling: they only put requests into bounded queues and wait, with a limit in
//! real time, for what comes back. A slow or hostile client can fill its own queue and nothing else.

use super::place;
use super::rpc::{self, RpcError};
use crate::limits;
use serde_json::Value as Json;
use std::fs;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::Shutdown;
use std::os::fd::OwnedFd;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;

/// What answers the calls.
pub trait Service: Send + Sync + 'static {
    /// Answers one call of the connection with this number (never 0 or 1); may wait for as long as it promises to.
    ///
    /// # Errors
    /// The error answer to send.
    fn call(&self, line: u32, method: &str, params: &Json) -> Result<Json, RpcError>;
}

/// Sends a notification (method, parameters) to all subscribers; never waits.
pub type Notifier = Arc<dyn Fn(&str, &Json) + Send + Sync>;

/// Lines on their way to the subscribers.
#[derive(Default)]
struct Subscribers {
    list: Mutex<Vec<SyncSender<String>>>,
}

impl Subscribers {
    fn add(&self) -> Receiver<String> {
        let (sender, receiver) = sync_channel(limits::SOCKET_QUEUE);
        self.list.lock().unwrap_or_else(PoisonError::into_inner).push(sender);
        receiver
    }

    /// A subscriber whose queue is full is cut off: it would otherwise hear a story with holes and not know it.
    fn send(&self, line: &str) {
        let mut list = self.list.lock().unwrap_or_else(PoisonError::into_inner);
        list.retain(|s| match s.try_send(line.to_owned()) {
            Ok(()) => true,
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => false,
        });
    }
}

/// Calls that are being answered.
#[derive(Default)]
struct Calls {
    open: Mutex<usize>,
    ended: Condvar,
}

impl Calls {
    fn run<T>(&self, call: impl FnOnce() -> T) -> T {
        *self.open.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        let result = call();
        *self.open.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
        self.ended.notify_all();
        result
    }

    /// Waits until all are answered, at most as long as writing to a client may take.
    fn finish(&self) {
        let open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let _ = self.ended.wait_timeout_while(open, limits::SOCKET_WRITE, |open| *open > 0);
    }
}

/// A listening control socket; dropping it lets the calls under way be answered, closes and removes it.
pub struct ControlSocket {
    path: PathBuf,
    /// The listening socket, to end it.
    listening: UnixStream,
    calls: Arc<Calls>,
    stop: Arc<AtomicBool>,
    subscribers: Arc<Subscribers>,
    accepting: Option<JoinHandle<()>>,
}

/// Why a control socket could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum SocketError {
    /// A deployment of that name runs already.
    #[error("a deployment named `{0}` is already running")]
    Taken(String),
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
        let path = place::socket(name);
        let io = |source| SocketError::Io { path: path.clone(), source };
        place::prepare(&place::directory()).map_err(io)?;
        if path.exists() && place::is_alive(&path) {
            return Err(SocketError::Taken(name.to_owned()));
        }
        let listener = match UnixListener::bind(&path) {
            Ok(listener) => listener,
            // Between the look and the bind somebody else came up: the name is taken all the same.
            Err(e) if e.kind() == io::ErrorKind::AddrInUse => return Err(SocketError::Taken(name.to_owned())),
            Err(e) => return Err(io(e)),
        };
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).map_err(io)?;
        let listening = UnixStream::from(OwnedFd::from(listener.try_clone().map_err(io)?));
        let stop = Arc::new(AtomicBool::new(false));
        let subscribers = Arc::new(Subscribers::default());
        let calls = Arc::new(Calls::default());
        let accepting = {
            let (stop, subscribers, calls) = (stop.clone(), subscribers.clone(), calls.clone());
            std::thread::Builder::new()
                .name("davit-socket".to_owned())
                .spawn(move || accept(&listener, &stop, &subscribers, &calls, &service))
                .map_err(io)?
        };
        Ok(Self { path, listening, calls, stop, subscribers, accepting: Some(accepting) })
    }

    /// Where it listens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Sends a notification to all subscribers; never waits.
    pub fn notify(&self, method: &str, params: &Json) {
        self.subscribers.send(&rpc::notification(method, params));
    }

    /// A function that sends notifications, for other threads.
    pub fn notifier(&self) -> Notifier {
        let subscribers = self.subscribers.clone();
        Arc::new(move |method, params| subscribers.send(&rpc::notification(method, params)))
    }
}

impl Drop for ControlSocket {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        // Wakes the accepting thread, also when the file is gone (its directory was cleaned up, the user logged out): a
        // connection to ourselves would not find it then.
        let _ = self.listening.shutdown(Shutdown::Both);
        let _ = fs::remove_file(&self.path);
        if let Some(thread) = self.accepting.take() {
            let _ = thread.join();
        }
        self.calls.finish();
    }
}

fn accept(
    listener: &UnixListener,
    stop: &Arc<AtomicBool>,
    subscribers: &Arc<Subscribers>,
    calls: &Arc<Calls>,
    service: &Arc<dyn Service>,
) {
    let open = Arc::new(AtomicUsize::new(0));
    // Scripts have the number 1.
    for (number, stream) in (2..).zip(listener.incoming()) {
        if stop.load(Ordering::Acquire) {
            return;
        }
        let Ok(mut stream) = stream else { continue };
        if open.fetch_add(1, Ordering::AcqRel) >= limits::SOCKET_CONNECTIONS {
            open.fetch_sub(1, Ordering::AcqRel);
            let error = RpcError::new(rpc::REFUSED, "too many connections; close one and try again");
            let _ = writeln!(stream, "{}", rpc::answer(&Json::Null, Err(error)));
            continue;
        }
        let (subscribers, service, counter) = (subscribers.clone(), service.clone(), open.clone());
        let calls = calls.clone();
        let serving = std::thread::Builder::new().name("davit-client".to_owned()).spawn(move || {
            let _ = serve(number, stream, &subscribers, &calls, &*service);
            counter.fetch_sub(1, Ordering::AcqRel);
        });
        if serving.is_err() {
            open.fetch_sub(1, Ordering::AcqRel);
        }
    }
}

/// Answers the calls of one connection until it closes.
fn serve(
    number: u32,
    stream: UnixStream,
    subscribers: &Subscribers,
    calls: &Calls,
    service: &dyn Service,
) -> io::Result<()> {
    let writer = Arc::new(Mutex::new(stream.try_clone()?));
    // A client that does not read must not hold a thread for ever.
    stream.set_write_timeout(Some(limits::SOCKET_WRITE))?;
    let mut reader = BufReader::new(stream);
    let mut line = String::new();
    loop {
        line.clear();
        let read = reader.by_ref().take(limits::SOCKET_LINE as u64 + 1).read_line(&mut line);
        let result = match read {
            Ok(0) => return Ok(()),
            Ok(n) if n > limits::SOCKET_LINE => {
                let error = RpcError::new(rpc::INVALID_REQUEST, "the line is too long");
                send(&writer, &rpc::answer(&Json::Null, Err(error)))?;
                return Ok(());
            }
            Ok(_) if line.trim().is_empty() => continue,
            Ok(_) => rpc::parse(&line),
            Err(e) if e.kind() == io::ErrorKind::InvalidData => {
                Err(RpcError::new(rpc::PARSE_ERROR, "the line is not UTF-8"))
            }
            Err(e) => return Err(e),
        };
        match result {
            Ok(call) if call.method == "subscribe" => {
                if let Err(error) = rpc::only(&call.method, &call.params, &[]) {
                    call.id.as_ref().map_or(Ok(()), |id| send(&writer, &rpc::answer(id, Err(error))))?;
                    continue;
                }
                let lines = subscribers.add();
                forward(lines, writer.clone())?;
                if let Some(id) = &call.id {
                    send(&writer, &rpc::answer(id, Ok(Json::Bool(true))))?;
                }
            }
            Ok(call) => calls.run(|| {
                let result = service.call(number, &call.method, &call.params);
                call.id.as_ref().map_or(Ok(()), |id| send(&writer, &rpc::answer(id, result)))
            })?,
            Err(error) => send(&writer, &rpc::answer(&Json::Null, Err(error)))?,
        }
    }
}

fn forward(lines: Receiver<String>, writer: Arc<Mutex<UnixStream>>) -> io::Result<()> {
    std::thread::Builder::new().name("davit-subscriber".to_owned()).spawn(move || {
        while let Ok(line) = lines.recv() {
            if send(&writer, &line).is_err() {
                return;
            }
        }
        // Cut off, or the deployment is gone: the reader sees the end of the stream instead of silence.
        let stream = writer.lock().unwrap_or_else(PoisonError::into_inner);
        let _ = stream.shutdown(Shutdown::Both);
    })?;
    Ok(())
}

fn send(writer: &Mutex<UnixStream>, line: &str) -> io::Result<()> {
    let mut stream = writer.lock().unwrap_or_else(PoisonError::into_inner);
    stream.write_all(line.as_bytes())?;
    stream.write_all(b"\n")
}
