//! All places of a running deployment's control socket are taken by others: an operator gets through all the same.

use crate::demo::Demo;
use crate::foreground::Foreground;
use davit::limits;
use std::os::unix::net::UnixStream;
use std::process::Stdio;

#[test]
fn idle_connections_do_not_lock_the_operator_out() {
    let demo = Demo::new();
    demo.write("deployment.yaml", &format!("{}safety: [e_fast]\n", demo.read("deployment.yaml")));
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let deployed = Foreground::start(&mut command);
    demo.until_phase("up");
    let crowd: Vec<UnixStream> = (0..limits::SOCKET_CONNECTIONS)
        .map(|_| UnixStream::connect(demo.path("davit/demo.sock")).expect("they are let in"))
        .collect();
    let refused = demo.run(&["apply", "rename", "--force"]);
    assert_eq!(refused.code, 1, "{}{}", refused.out, refused.err);
    assert!(refused.err.contains("too many connections"), "{}", refused.err);
    // What is declared as a safety event is heard, another event is not.
    let fast = demo.run(&["event", "e_fast", "--wait", "fast.ok", "--within", "60"]);
    assert_eq!(fast.code, 0, "{}{}", fast.out, fast.err);
    assert!(demo.run(&["event", "e_slow"]).err.contains("too many connections"));
    assert_eq!(demo.run(&["status"]).code, 0);
    assert_eq!(demo.run(&["shutdown", "--force"]).code, 0);
    assert!(deployed.end().code().is_some());
    drop(crowd);
}
