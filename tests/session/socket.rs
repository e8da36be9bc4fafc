//! The control socket, spoken to as a program in any language would.

use davit::session::client::{Client, ClientError};
use davit::session::rpc::{self, RpcError};
use davit::session::socket::{ControlSocket, Service, SocketError};
use serde_json::{Value as Json, json};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(10);

struct Echo;

impl Service for Echo {
    fn call(&self, _: u32, method: &str, params: &Json) -> Result<Json, RpcError> {
        match method {
            "echo" => Ok(params.clone()),
            "need" => rpc::param::<String>(params, "text").map(Json::String),
            _ => Err(RpcError::new(rpc::METHOD_NOT_FOUND, format!("there is no method `{method}`"))),
        }
    }
}

/// A name of its own for each test: they share one directory.
fn open(test: &str) -> (String, ControlSocket) {
    let name = format!("test_{test}_{}", std::process::id());
    let socket = ControlSocket::open(&name, Arc::new(Echo)).unwrap();
    (name, socket)
}

#[test]
fn calls_are_answered() {
    let (name, _socket) = open("calls");
    let mut client = Client::connect(Some(&name)).unwrap();
    assert_eq!(client.call("echo", &json!({"a": 1}), LIMIT).unwrap(), json!({"a": 1}));
    match client.call("need", &json!({"text": 3}), LIMIT) {
        Err(ClientError::Refused(e)) => assert_eq!(e.code, rpc::INVALID_PARAMS),
        other => panic!("{other:?}"),
    }
    match client.call("nonsense", &Json::Null, LIMIT) {
        Err(ClientError::Refused(e)) => assert_eq!(e.code, rpc::METHOD_NOT_FOUND),
        other => panic!("{other:?}"),
    }
}

#[test]
fn hostile_lines_are_answered_not_fatal() {
    let (_, socket) = open("hostile");
    let mut stream = UnixStream::connect(socket.path()).unwrap();
    let mut lines = BufReader::new(stream.try_clone().unwrap()).lines();
    let mut code = |line: &[u8]| {
        stream.write_all(line).unwrap();
        stream.write_all(b"\n").unwrap();
        let answer: Json = serde_json::from_str(&lines.next().unwrap().unwrap()).unwrap();
        answer["error"]["code"].as_i64()
    };
    assert_eq!(code(b"{"), Some(rpc::PARSE_ERROR));
    assert_eq!(code(b"[]"), Some(rpc::INVALID_REQUEST));
    assert_eq!(code(b"{\"method\":\"echo\",\"id\":1}"), Some(rpc::INVALID_REQUEST));
    assert_eq!(code(b"\xff\xfe"), Some(rpc::PARSE_ERROR));
    assert_eq!(code("[".repeat(100_000).as_bytes()), Some(rpc::PARSE_ERROR));
    assert_eq!(code(b"{\"jsonrpc\":\"2.0\",\"method\":\"echo\",\"id\":1}"), None);
    // An error names the request that it answers; one whose `id` is null is answered too.
    for (line, id) in [
        (&br#"{"jsonrpc":"1.0","method":"echo","id":17}"#[..], json!(17)),
        (br#"{"jsonrpc":"2.0","id":"x"}"#, json!("x")),
        (br#"{"jsonrpc":"2.0","method":"echo","id":null}"#, Json::Null),
    ] {
        stream.write_all(line).unwrap();
        stream.write_all(b"\n").unwrap();
        let answer: Json = serde_json::from_str(&lines.next().unwrap().unwrap()).unwrap();
        assert_eq!(answer["id"], id);
    }
    // A notification gets no answer: the next answer is that of the next call.
    stream.write_all(b"{\"jsonrpc\":\"2.0\",\"method\":\"echo\"}\n").unwrap();
    stream.write_all(b"{\"jsonrpc\":\"2.0\",\"method\":\"echo\",\"id\":7}\n").unwrap();
    let answer: Json = serde_json::from_str(&lines.next().unwrap().unwrap()).unwrap();
    assert_eq!(answer["id"], 7);
}

#[test]
fn subscribers_hear_notifications() {
    let (_, socket) = open("subscribe");
    let mut stream = UnixStream::connect(socket.path()).unwrap();
    let mut lines = BufReader::new(stream.try_clone().unwrap()).lines();
    stream.write_all(b"{\"jsonrpc\":\"2.0\",\"method\":\"subscribe\",\"params\":{\"to\":1},\"id\":0}\n").unwrap();
    assert!(lines.next().unwrap().unwrap().contains("no parameter `to`"));
    stream.write_all(b"{\"jsonrpc\":\"2.0\",\"method\":\"subscribe\",\"id\":1}\n").unwrap();
    assert!(lines.next().unwrap().unwrap().contains("true"));
    socket.notify("event", &json!({"name": "e_x"}));
    let line: Json = serde_json::from_str(&lines.next().unwrap().unwrap()).unwrap();
    assert_eq!(line, json!({"jsonrpc": "2.0", "method": "event", "params": {"name": "e_x"}}));
}

#[test]
fn a_name_is_taken_once_and_free_again() {
    let (name, socket) = open("taken");
    assert!(matches!(ControlSocket::open(&name, Arc::new(Echo)), Err(SocketError::Taken(n)) if n == name));
    let path = socket.path().to_owned();
    assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
    drop(socket);
    assert!(!path.exists());
    let again = ControlSocket::open(&name, Arc::new(Echo)).unwrap();
    drop(again);
    assert!(matches!(Client::connect(Some(&name)), Err(ClientError::Unknown { .. })));
}

#[test]
fn a_socket_left_by_a_killed_process_is_no_obstacle() {
    let (name, socket) = open("stale");
    let path = socket.path().to_owned();
    drop(socket);
    // Bound and dropped without being removed: what a killed process leaves.
    drop(std::os::unix::net::UnixListener::bind(&path).unwrap());
    assert!(path.exists());
    drop(ControlSocket::open(&name, Arc::new(Echo)).unwrap());
}

#[test]
fn a_socket_whose_file_is_gone_closes_all_the_same() {
    let (_, socket) = open("removed");
    std::fs::remove_file(socket.path()).unwrap();
    let (closed, heard) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        drop(socket);
        let _ = closed.send(());
    });
    assert!(heard.recv_timeout(LIMIT).is_ok(), "nothing wakes the thread that accepts");
}
