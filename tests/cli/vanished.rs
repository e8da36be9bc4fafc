//! The file of a control socket is removed while its deployment runs: the name stays taken, and what is wrong is said.

use crate::demo::Demo;
use crate::foreground::Foreground;
use std::process::Stdio;

#[test]
fn a_deployment_whose_socket_is_gone_keeps_its_name_and_hears_signals() {
    for whole in [false, true] {
        let demo = Demo::new();
        let mut command = demo.command(&["deploy", "deployment.yaml"]);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let deployed = Foreground::start(&mut command);
        demo.until_phase("up");
        let socket = demo.path("davit/demo.sock");
        match whole {
            true => std::fs::remove_dir_all(demo.path("davit")).unwrap(),
            false => std::fs::remove_file(&socket).unwrap(),
        }
        for args in [&["shutdown"][..], &["shutdown", "demo", "--force"], &["status"]] {
            let asked = demo.run(args);
            assert_eq!(asked.code, 1, "{args:?}: {}{}", asked.out, asked.err);
            assert!(asked.err.contains("cli::socket_gone") && asked.err.contains("Ctrl-C"), "{args:?}: {}", asked.err);
        }
        let second = demo.run(&["deploy", "deployment.yaml", "--detach"]);
        assert_eq!(second.code, 1, "{}{}", second.out, second.err);
        assert!(second.err.contains("cli::name_taken"), "{}", second.err);
        // What somebody put in its place is not its own to remove.
        std::fs::create_dir_all(demo.path("davit")).unwrap();
        std::fs::write(&socket, "another's").unwrap();
        deployed.signal(libc::SIGINT);
        assert_eq!(deployed.end().code(), Some(0));
        assert_eq!(demo.read("davit/demo.sock"), "another's");
        std::fs::remove_file(&socket).unwrap();
        assert!(demo.run(&["status"]).err.contains("cli::not_running"));
        assert_eq!(demo.run(&["deploy", "deployment.yaml", "--detach"]).code, 0, "and the name is free");
        assert_eq!(demo.run(&["shutdown"]).code, 0);
    }
}

#[test]
fn the_socket_of_a_killed_process_is_removed_only_by_who_deploys_that_name_anew() {
    let demo = Demo::new();
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let deployed = Foreground::start(&mut command);
    demo.until_phase("up");
    deployed.signal(libc::SIGKILL);
    let _ = deployed.end();
    let socket = demo.path("davit/demo.sock");
    assert!(demo.run(&["stack"]).err.contains("cli::not_running"));
    assert_eq!(demo.run(&["status"]).code, 4, "it died");
    assert!(socket.exists(), "nobody removes what may be just born");
    assert_eq!(demo.run(&["deploy", "deployment.yaml", "--detach"]).code, 0);
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    assert!(!socket.exists());
}

#[test]
fn of_many_that_start_at_once_one_has_the_name() {
    let demo = Demo::new();
    for round in 0..3 {
        let starts: Vec<_> = (0..5)
            .map(|_| {
                let mut command = demo.command(&["deploy", "deployment.yaml", "--detach"]);
                std::thread::spawn(move || command.output().expect("the program starts"))
            })
            .collect();
        // Whoever looks meanwhile takes nothing away.
        let looks = (0..10).map(|_| demo.command(&["status"])).map(|mut command| command.output().expect("it starts"));
        assert_eq!(looks.count(), 10);
        let mut codes: Vec<i32> = Vec::new();
        for start in starts {
            let ended = start.join().expect("it ends");
            let err = String::from_utf8_lossy(&ended.stderr).into_owned();
            let code = ended.status.code().expect("it ends by itself");
            assert!(code == 0 || err.contains("cli::name_taken"), "{code}: {err}");
            codes.push(code);
        }
        codes.sort_unstable();
        assert_eq!(codes, [0, 1, 1, 1, 1], "round {round}");
        assert_eq!(demo.run(&["status"]).code, 0);
        assert_eq!(demo.run(&["shutdown"]).code, 0);
    }
}
