//! Who is let in at the control socket when many want to: places, deadlines, subscribers that do not read.

use davit::session::client::{Client, ClientError};
use davit::session::log::{Happening, LogEntry};
use davit::session::owner;
use davit::session::rpc::{self, RpcError};
use davit::session::socket::{Bounds, ControlSocket, Service, SocketError};
use davit::time::Clock;
use serde_json::{Value as Json, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(60);

/// `wait` waits until nobody wants to know any more; `shutdown` must get through.
#[derive(Default)]
struct Waits {
    given_up: AtomicUsize,
}

impl Service for Waits {
    fn call(&self, _: u32, method: &str, _: &Json) -> Result<Json, RpcError> {
        Ok(json!(method))
    }

    fn call_while(&self, line: u32, method: &str, params: &Json, gone: &dyn Fn() -> bool) -> Result<Json, RpcError> {
        if method == "wait" {
            until("the client is gone", || gone().then_some(()));
            self.given_up.fetch_add(1, Ordering::SeqCst);
        }
        self.call(line, method, params)
    }

    fn must_get_through(&self, method: &str, _: &Json) -> bool {
        method == "shutdown"
    }
}

fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let clock = Clock::real();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(clock.now().as_secs_f64() < LIMIT.as_secs_f64(), "{what}: not in {} s", LIMIT.as_secs());
        clock.sleep(Duration::from_millis(5));
    }
}

fn open(test: &str, bounds: Bounds) -> (String, ControlSocket, Arc<Waits>) {
    let name = format!("test_{test}_{}", std::process::id());
    let service = Arc::new(Waits::default());
    let socket = ControlSocket::open_within(&name, service.clone(), bounds).unwrap();
    (name, socket, service)
}

fn refused(answer: Result<Json, ClientError>) -> RpcError {
    match answer {
        Err(ClientError::Refused(error)) => error,
        other => panic!("{other:?}"),
    }
}

fn say(stream: &mut UnixStream, method: &str) {
    stream.write_all(format!("{{\"jsonrpc\":\"2.0\",\"method\":\"{method}\",\"id\":1}}\n").as_bytes()).unwrap();
}

/// What comes until it is closed.
fn rest(stream: &mut UnixStream) -> String {
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    let mut text = Vec::new();
    let mut chunk = [0; 1 << 16];
    loop {
        match stream.read(&mut chunk) {
            Ok(0) => return String::from_utf8_lossy(&text).into_owned(),
            Ok(n) => text.extend_from_slice(&chunk[..n]),
            Err(e) if e.kind() == std::io::ErrorKind::ConnectionReset => {
                return String::from_utf8_lossy(&text).into_owned();
            }
            Err(e) => panic!("it is not closed: {e}"),
        }
    }
}

#[test]
fn idle_connections_lock_nobody_out() {
    let (name, socket, _) = open("places", Bounds { say: LIMIT, kept_each: 4, ..Bounds::default() });
    let connect = || UnixStream::connect(socket.path()).unwrap();
    let mut idle: Vec<UnixStream> = (0..Bounds::default().connections).map(|_| connect()).collect();
    // Each of them has its place.
    for stream in &mut idle {
        say(stream, "hello");
        let mut line = String::new();
        BufReader::new(stream).read_line(&mut line).unwrap();
        assert!(line.contains("hello"), "{line}");
    }
    let mut client = Client::connect(Some(&name)).unwrap();
    assert_eq!(client.call("shutdown", &Json::Null, LIMIT).unwrap(), json!("shutdown"));
    assert!(client.call("shutdown", &Json::Null, LIMIT).is_err(), "a kept place is for one call");
    let error = refused(Client::connect(Some(&name)).unwrap().call("stack", &Json::Null, LIMIT));
    assert_eq!((error.code, error.message.as_str()), (rpc::TOO_MANY, "too many connections"));
    // Also the kept places have an end; who finds none is told so, and does not hang.
    let kept: Vec<UnixStream> = (0..Bounds::default().kept).map(|_| connect()).collect();
    assert!(rest(&mut connect()).contains("too many connections"), "it is refused at once");
    drop((kept, client));
    until("a kept place is free again", || {
        Client::connect(Some(&name)).unwrap().call("shutdown", &Json::Null, LIMIT).ok()
    });
    drop(idle);
    until("places are free again", || Client::connect(Some(&name)).unwrap().call("stack", &Json::Null, LIMIT).ok());
}

/// One line is all that is heard on a kept place, one process has one of them, and who finds none tries again for a moment.
#[test]
fn who_keeps_coming_keeps_nobody_out() {
    let (name, socket, _) = open("again", Bounds { connections: 1, say: LIMIT, ..Bounds::default() });
    let connect = || UnixStream::connect(socket.path()).unwrap();
    let hello = |stream: &mut UnixStream| {
        say(stream, "hello");
        let mut line = String::new();
        BufReader::new(stream).read_line(&mut line).unwrap();
        assert!(line.contains("hello"), "{line}");
    };
    let mut idle = connect();
    hello(&mut idle);
    for line in ["\n", "x\n", "{}\n"] {
        let mut stream = connect();
        stream.write_all(line.as_bytes()).unwrap();
        assert!(!rest(&mut stream).is_empty(), "it is told why");
        drop(stream);
        // The place is free when its connection has ended.
        until("the place is free again", || {
            Client::connect(Some(&name)).unwrap().call("shutdown", &Json::Null, LIMIT).ok()
        });
    }
    let silent = until("a kept place", || {
        let silent = connect();
        silent.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
        BufReader::new(&silent).read_line(&mut String::new()).is_err().then_some(silent)
    });
    assert!(rest(&mut connect()).contains("too many connections"), "one process has one of the four");
    drop((silent, idle, socket));

    let short = Bounds { connections: 1, say: Duration::from_millis(200), ..Bounds::default() };
    let (name, socket, _) = open("again_later", short);
    let connect = || UnixStream::connect(socket.path()).unwrap();
    let mut idle = connect();
    hello(&mut idle);
    let _silent = connect();
    let answer = Client::connect(Some(&name)).unwrap().call("shutdown", &Json::Null, LIMIT);
    assert_eq!(answer.unwrap(), "shutdown", "who finds none tries again");
}

/// Where the system has no thread left, what must get through does: one after the other.
#[test]
fn without_a_thread_of_its_own_what_must_get_through_does() {
    let (name, socket, _) = open("threads", Bounds { threads: 0, ..Bounds::default() });
    for _ in 0..3 {
        let mut operator = Client::connect(Some(&name)).unwrap();
        assert_eq!(operator.call("shutdown", &Json::Null, LIMIT).unwrap(), "shutdown");
        let mut other = Client::connect(Some(&name)).unwrap();
        assert_eq!(refused(other.call("stack", &Json::Null, LIMIT)).code, rpc::TOO_MANY);
    }
    drop(socket);
}

#[test]
fn places_are_given_away_when_nothing_is_said() {
    let short = Duration::from_millis(50);
    let bounds = Bounds { connections: 1, idle: short, say: short, ..Bounds::default() };
    let (name, socket, _) = open("idle", bounds);
    let connect = || UnixStream::connect(socket.path()).unwrap();
    let mut idle = connect();
    assert!(rest(&mut idle).contains("nothing was said"));
    // One that says a line without an end, bit by bit, says nothing either.
    let mut slow = connect();
    until("it is closed", || slow.write_all(b" ").err());
    // One that subscribed is silent by nature.
    let mut subscribed = until("a place", || {
        let mut stream = connect();
        say(&mut stream, "subscribe");
        let mut line = String::new();
        BufReader::new(stream.try_clone().unwrap()).read_line(&mut line).ok()?;
        line.contains("true").then_some(stream)
    });
    // All places are taken now; a kept one does not wait for long.
    assert!(rest(&mut connect()).contains("too many connections"));
    socket.notify("log", &json!({ "at": 1 }));
    let mut line = String::new();
    BufReader::new(subscribed.try_clone().unwrap()).read_line(&mut line).unwrap();
    assert!(line.contains("\"at\":1"), "{line}");
    say(&mut subscribed, "subscribe");
    line.clear();
    BufReader::new(subscribed.try_clone().unwrap()).read_line(&mut line).unwrap();
    assert!(line.contains("subscribed already"), "{line}");
    // A leaked one goes with its client, though nothing is sent to it.
    drop(subscribed);
    until("its place is free", || Client::connect(Some(&name)).unwrap().call("stack", &Json::Null, LIMIT).ok());
}

#[test]
fn a_wait_that_nobody_waits_for_ends() {
    let (name, socket, service) = open("gone", Bounds { connections: 1, ..Bounds::default() });
    let mut waits = UnixStream::connect(socket.path()).unwrap();
    say(&mut waits, "wait");
    // One that will say no more, but reads, is not gone.
    waits.shutdown(std::net::Shutdown::Write).unwrap();
    assert_eq!(refused(Client::connect(Some(&name)).unwrap().call("stack", &Json::Null, LIMIT)).code, rpc::TOO_MANY);
    assert_eq!(service.given_up.load(Ordering::SeqCst), 0);
    drop(waits);
    until("its place is free", || Client::connect(Some(&name)).unwrap().call("stack", &Json::Null, LIMIT).ok());
    assert_eq!(service.given_up.load(Ordering::SeqCst), 1);
}

#[test]
fn a_subscriber_that_does_not_read_is_cut_off_and_the_others_hear_all() {
    let (_, socket, _) = open("deaf", Bounds { queue: 64, ..Bounds::default() });
    // In simulated time who sends waits for those who read.
    let clock = Clock::simulated();
    let hears = socket.observer(&clock).unwrap();
    let subscribe = || {
        let mut stream = UnixStream::connect(socket.path()).unwrap();
        say(&mut stream, "subscribe");
        let mut line = String::new();
        let mut reader = BufReader::new(stream.try_clone().unwrap());
        reader.read_line(&mut line).unwrap();
        assert!(line.contains("true"));
        (stream, reader)
    };
    let (mut deaf, _unread) = subscribe();
    let (_stream, reader) = subscribe();
    let reads = std::thread::spawn(move || {
        let told = reader.lines().map_while(Result::ok);
        told.map(|line| serde_json::from_str::<Json>(&line).unwrap()["params"]["note"].clone()).collect::<Vec<Json>>()
    });
    // More than the system keeps for who does not read, and than waits for it here.
    let text = "x".repeat(1000);
    for number in 0..3_000 {
        let note = format!("{number} {text}");
        hears.hear(&Arc::new(LogEntry { at: 0.0, what: Happening::Forced { note } }));
        hears.keep_pace();
    }
    let missing = rest(&mut deaf);
    assert!(!missing.contains("2999 x"), "it was cut off");
    drop(socket);
    let heard = reads.join().unwrap();
    assert_eq!(heard.len(), 3_000);
    assert!(heard.iter().enumerate().all(|(i, note)| note.as_str().unwrap().starts_with(&format!("{i} "))));
}

#[test]
fn a_name_has_one_owner_whatever_becomes_of_the_file() {
    let (name, socket, _) = open("owner", Bounds::default());
    assert!(owner::is_owned(&name) && owner::owned().contains(&name));
    std::fs::remove_file(socket.path()).unwrap();
    let second = ControlSocket::open(&name, Arc::new(Waits::default()));
    assert!(matches!(second, Err(SocketError::Taken(taken)) if taken == name));
    assert!(matches!(Client::connect(Some(&name)), Err(ClientError::SocketGone { .. })), "said, after a moment");
    // Another's file in its place stays.
    std::fs::write(socket.path(), "another's").unwrap();
    let path = socket.path().to_owned();
    socket.leave()();
    drop(socket);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "another's");
    assert!(!owner::is_owned(&name));
    std::fs::remove_file(&path).unwrap();
    // A long name has one too.
    let long = format!("{}_{}", "long".repeat(12), std::process::id());
    let held = owner::Owner::of(&long).unwrap().expect("nobody has it");
    assert!(owner::is_owned(&long) && owner::Owner::of(&long).unwrap().is_none());
    drop(held);
    assert!(!owner::is_owned(&long));
}

#[test]
fn a_socket_that_nobody_listens_on_is_left_alone() {
    let (name, socket, _) = open("newborn", Bounds::default());
    let newborn = socket.path().with_file_name(format!("{name}_newborn.sock"));
    // Bound by somebody who is about to listen, or left of one who was killed: both look the same.
    drop(std::os::unix::net::UnixListener::bind(&newborn).unwrap());
    assert!(davit::session::place::running().contains(&name));
    assert!(Client::connect(Some(&format!("{name}_newborn"))).is_err());
    assert!(newborn.exists());
    std::fs::remove_file(&newborn).unwrap();
}
