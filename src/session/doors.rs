//! Who is let in at the control socket: places, those that are kept, and what is done when there is none.

use super::connection::SocketConnection;
use super::place;
use super::rpc::{self, RpcError};
use super::serving::{ServingShared, serve, too_many};
use crate::time::lock;
use serde_json::Value as Json;
use std::fs::File;
use std::io;
use std::os::unix::net::{UnixListener, UnixStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError, Weak};

/// The connections there are, and whether there may be more.
#[derive(Default)]
pub(super) struct Doors {
    inside: Mutex<InsideDoor>,
    closed: Condvar,
}

#[derive(Default)]
struct InsideDoor {
    closed: bool,
    places: usize,
    /// The processes that have the kept ones.
    kept: Vec<libc::pid_t>,
    connections: Vec<Weak<SocketConnection>>,
}

/// One that is let in, and finds no thread: the system has none left.
pub(super) type Waiting = (Arc<SocketConnection>, DoorPlace);

/// A place, until it is dropped.
pub(super) struct DoorPlace {
    doors: Arc<Doors>,
    /// Whose it is, where it is a kept one.
    kept: Option<libc::pid_t>,
}

impl Drop for DoorPlace {
    fn drop(&mut self) {
        let mut inside = lock(&self.doors.inside);
        match self.kept {
            None => inside.places -= 1,
            Some(process) => {
                let at = inside.kept.iter().position(|other| *other == process);
                at.into_iter().for_each(|at| _ = inside.kept.swap_remove(at));
            }
        }
    }
}

impl Doors {
    /// Nobody else is let in.
    pub fn close(&self) {
        lock(&self.inside).closed = true;
        self.closed.notify_all();
    }

    /// Ends all connections.
    pub fn cut(&self) {
        let connections = std::mem::take(&mut lock(&self.inside).connections);
        connections.iter().filter_map(Weak::upgrade).for_each(|connection| connection.cut());
    }

    fn is_closed(&self) -> bool {
        lock(&self.inside).closed
    }

    /// A place for that process, an ordinary one if there is one left.
    fn place(self: &Arc<Self>, process: libc::pid_t, shared: &ServingShared) -> Option<DoorPlace> {
        let mut inside = lock(&self.inside);
        if inside.places >= shared.bounds.connections {
            drop(inside);
            return self.kept_place(process, shared);
        }
        inside.places += 1;
        Some(DoorPlace { doors: self.clone(), kept: None })
    }

    /// A place of those that are kept.
    fn kept_place(self: &Arc<Self>, process: libc::pid_t, shared: &ServingShared) -> Option<DoorPlace> {
        let mut inside = lock(&self.inside);
        let own = inside.kept.iter().filter(|other| **other == process).count();
        if inside.kept.len() >= shared.bounds.kept || own >= shared.bounds.kept_each {
            return None;
        }
        inside.kept.push(process);
        Some(DoorPlace { doors: self.clone(), kept: Some(process) })
    }

    fn enter(&self, connection: &Arc<SocketConnection>) {
        let mut inside = lock(&self.inside);
        inside.connections.retain(|there| there.strong_count() > 0);
        inside.connections.push(Arc::downgrade(connection));
    }

    /// Begins to answer those who get a kept place and no thread of their own: there is one before there is none left, so that an emergency
    /// stop needs none.
    ///
    /// # Errors
    /// When the operating system has no thread left.
    pub fn keep(shared: &Arc<ServingShared>) -> io::Result<SyncSender<Waiting>> {
        let (waiting, waits) = sync_channel::<Waiting>(shared.bounds.kept);
        let served = shared.clone();
        std::thread::Builder::new().name("davit-kept".to_owned()).spawn(move || {
            for (connection, place) in waits {
                attend(&connection, &served, true);
                drop(place);
            }
        })?;
        Ok(waiting)
    }

    /// Lets clients in until the doors are closed.
    pub fn open(self: &Arc<Self>, listener: &UnixListener, shared: &Arc<ServingShared>, waiting: &SyncSender<Waiting>) {
        // Given up for a moment when there is no other: so who comes then is told, and does not stand in a queue.
        let mut spare = File::open("/dev/null").ok();
        for (number, stream) in (2..).zip(listener.incoming()) {
            if self.is_closed() {
                return;
            }
            match stream {
                Ok(stream) => self.admit(number, stream, shared, waiting),
                Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => {}
                Err(_) => {
                    drop(spare.take());
                    if let Ok((stream, _)) = listener.accept() {
                        refuse(number, stream, shared, too_many());
                    }
                    self.pause(shared);
                    spare = File::open("/dev/null").ok();
                }
            }
        }
    }

    /// Waits a little, or until the doors are closed.
    fn pause(&self, shared: &ServingShared) {
        let inside = lock(&self.inside);
        let still = |inside: &mut InsideDoor| !inside.closed;
        drop(
            self.closed.wait_timeout_while(inside, shared.bounds.pause, still).unwrap_or_else(PoisonError::into_inner),
        );
    }

    fn admit(
        self: &Arc<Self>,
        number: u32,
        stream: UnixStream,
        shared: &Arc<ServingShared>,
        waiting: &SyncSender<Waiting>,
    ) {
        let Some(process) = place::peer(&stream) else {
            let why = "this socket is for the processes of its own user";
            return refuse(number, stream, shared, RpcError::new(rpc::REFUSED, why));
        };
        let Some(place) = self.place(process, shared) else { return refuse(number, stream, shared, too_many()) };
        let Ok(connection) = SocketConnection::new(number, stream, shared.bounds.write).map(Arc::new) else { return };
        self.enter(&connection);
        let may = {
            let inside = lock(&self.inside);
            inside.places + inside.kept.len() <= shared.bounds.threads
        };
        let (serving, own) = (shared.clone(), connection.clone());
        let attended = move || {
            attend(&own, &serving, place.kept.is_some());
            drop(place);
        };
        let thread = || std::thread::Builder::new().name("davit-client".to_owned()).spawn(attended);
        if may && thread().is_ok() {
            return;
        }
        let place = self.kept_place(process, shared);
        if place.is_none_or(|place| waiting.try_send((connection.clone(), place)).is_err()) {
            let _ = connection.send(&rpc::answer(&Json::Null, Err(too_many())));
        }
    }
}

/// Answers one connection to its end.
fn attend(connection: &Arc<SocketConnection>, shared: &ServingShared, kept: bool) {
    // One thread is for all that are kept: what panics in one of them is nothing of the next one's.
    let _ = catch_unwind(AssertUnwindSafe(|| serve(connection, shared, kept)));
    shared.subscribers.remove(connection.number);
    connection.cut();
}

fn refuse(number: u32, stream: UnixStream, shared: &ServingShared, why: RpcError) {
    // A line of a new connection finds room: nobody waits here.
    if let Ok(connection) = SocketConnection::new(number, stream, shared.bounds.write) {
        let _ = connection.send(&rpc::answer(&Json::Null, Err(why)));
    }
}
