//! A control socket is its user's own, at both ends. What needs a second user is tried by root alone, and said to be skipped
//! by everybody else.

use crate::demo::Demo;
use crate::foreground::{Foreground, LIMIT, until};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::fs::{PermissionsExt, chown, symlink};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Command, Stdio};

/// A user that owns nothing.
const NOBODY: u32 = 65534;

fn as_nobody(program: &Path) -> Command {
    let mut command = Command::new("setpriv");
    command.args([&format!("--reuid={NOBODY}"), &format!("--regid={NOBODY}"), "--clear-groups"]).arg(program);
    command
}

/// Whether this can be tried here.
fn can_be_another(what: &str) -> bool {
    let davit = Path::new(env!("CARGO_BIN_EXE_davit"));
    let tried = as_nobody(davit).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    let can = davit::session::place::user() == 0 && tried.is_ok_and(|status| status.success());
    if !can {
        println!("skipped: {what} (only root can be another user)");
    }
    can
}

fn mode(path: &Path, mode: u32) {
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
}

fn untrusted(demo: &Demo, why: &str) {
    for args in [&["status"][..], &["shutdown", "demo", "--force"]] {
        let ran = demo.run(args);
        assert_eq!(ran.code, 1, "{args:?}: {}{}", ran.out, ran.err);
        // Lines of a finding are broken at its width.
        let told = ran.err.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ");
        assert!(told.contains("cli::untrusted") && told.contains(why), "{args:?}: {told}");
    }
}

#[test]
fn a_directory_that_is_not_simply_the_users_own_is_not_trusted() {
    let demo = Demo::new();
    let folder = demo.path("davit");
    std::fs::create_dir(demo.path("elsewhere")).unwrap();
    symlink(demo.path("elsewhere"), &folder).unwrap();
    untrusted(&demo, "is a symbolic link");
    let deployed = demo.run(&["deploy", "deployment.yaml", "--detach"]);
    assert!(deployed.code != 0 && deployed.err.contains("symbolic"), "{}{}", deployed.out, deployed.err);
    std::fs::remove_file(&folder).unwrap();
    std::fs::create_dir(&folder).unwrap();
    mode(&folder, 0o777);
    untrusted(&demo, "can be written by other users");
    mode(&folder, 0o700);
    assert!(demo.run(&["status"]).err.contains("cli::not_running"));
    symlink(demo.path("other.sock"), folder.join("demo.sock")).unwrap();
    untrusted_by_name(&demo);
    if can_be_another("another user's directory") {
        chown(&folder, Some(NOBODY), Some(NOBODY)).unwrap();
        untrusted(&demo, "belongs to another user");
    }
}

/// A socket of that name is a link: not followed.
fn untrusted_by_name(demo: &Demo) {
    let ran = demo.run(&["shutdown", "demo"]);
    assert!(ran.code == 1 && ran.err.contains("cli::untrusted"), "{}{}", ran.out, ran.err);
}

#[test]
fn another_users_process_is_no_deployment() {
    if !can_be_another("another user's deployment") {
        return;
    }
    let demo = Demo::new();
    let folder = demo.path("davit");
    std::fs::create_dir(&folder).unwrap();
    mode(&demo.path(""), 0o755);
    chown(&folder, Some(NOBODY), Some(NOBODY)).unwrap();
    let theirs = |args: &[&str]| {
        let mut command = as_nobody(Path::new(env!("CARGO_BIN_EXE_davit")));
        command
            .args(args)
            .current_dir(demo.path(""))
            .env("XDG_RUNTIME_DIR", demo.path(""))
            .env("XDG_STATE_HOME", demo.path("state"));
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command
    };
    let deployed = Foreground::start(&mut theirs(&["deploy", "deployment.yaml"]));
    until("it is up", || theirs(&["status"]).status().unwrap().success().then_some(()));
    // As if it had slipped in: by their names, directory and socket are ours.
    chown(&folder, Some(0), Some(0)).unwrap();
    mode(&folder, 0o755);
    chown(folder.join("demo.sock"), Some(0), Some(0)).unwrap();
    let ran = demo.run(&["status", "demo"]);
    assert_eq!(ran.code, 1, "{}{}", ran.out, ran.err);
    assert!(ran.err.contains("cli::untrusted") && ran.err.contains("listened on"), "{}", ran.err);
    deployed.signal(libc::SIGINT);
    deployed.end();
}

#[test]
fn another_users_process_is_turned_away() {
    if !can_be_another("another user's client") {
        return;
    }
    let demo = Demo::new();
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let deployed = Foreground::start(&mut command);
    demo.until_phase("up");
    let socket = demo.path("davit/demo.sock");
    // Nothing but the socket itself keeps them out.
    mode(&demo.path(""), 0o755);
    mode(&demo.path("davit"), 0o755);
    mode(&socket, 0o666);
    let ask = |mut client: Command| {
        client.args(["--exact", "foreign::a_client_without_checks_of_its_own", "--nocapture"]);
        let told = client.env("DAVIT_TEST_SOCKET", &socket).output().unwrap();
        String::from_utf8_lossy(&told.stdout).into_owned()
    };
    let own = std::env::current_exe().unwrap();
    let theirs = ask(as_nobody(&own));
    assert!(theirs.contains("of its own user") && !theirs.contains("\"phase\""), "{theirs}");
    let ours = ask(Command::new(&own));
    assert!(ours.contains("\"phase\""), "{ours}");
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    deployed.end();
}

/// Not a test of its own: what the one above starts.
#[test]
fn a_client_without_checks_of_its_own() {
    let Some(socket) = std::env::var_os("DAVIT_TEST_SOCKET") else { return };
    let mut stream = UnixStream::connect(socket).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    let _ = stream.write_all(b"{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"status\"}\n");
    let mut told = String::new();
    BufReader::new(stream).read_line(&mut told).unwrap();
    println!("{told}");
}
