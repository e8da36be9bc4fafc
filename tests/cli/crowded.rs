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
    let come = || UnixStream::connect(demo.path("davit/demo.sock")).expect("they are let in");
    let mut crowd: Vec<UnixStream> = (0..limits::SOCKET_CONNECTIONS).map(|_| come()).collect();
    // Who found a place had that of a connection that was ending still when the crowd came: one more takes it.
    let mut refused = |args: &[&str]| {
        let mut told = demo.run(args);
        for _ in 0..5 {
            if told.err.contains("too many connections") {
                break;
            }
            crowd.push(come());
            told = demo.run(args);
        }
        assert!(told.err.contains("too many connections"), "{}{}", told.out, told.err);
        told.code
    };
    assert_eq!(refused(&["apply", "rename", "--force"]), 1);
    // What is declared as a safety event is heard, another event is not.
    let fast = demo.run(&["event", "e_fast", "--wait", "fast.ok", "--within", "60"]);
    assert_eq!(fast.code, 0, "{}{}", fast.out, fast.err);
    assert_eq!(refused(&["event", "e_slow"]), 1);
    assert_eq!(demo.run(&["status"]).code, 0);
    assert_eq!(demo.run(&["shutdown", "--force"]).code, 4);
    assert!(deployed.end().code().is_some());
    drop(crowd);
}
