//! What the tests must notice: small changes, all of them in one copy of the project, each behind a switch. The copy is built
//! once and run with each of them; unchanged, it must pass.

use davit::time::Clock;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Duration;

/// A change of one place.
struct Mutation {
    name: String,
    file: String,
    /// The test binary that must notice it, and which of its tests alone.
    by: Noticed,
    before: String,
    old: String,
    after: String,
    new: String,
}

#[derive(Clone, PartialEq, Eq)]
enum Noticed {
    Oracle,
    Check(String),
}

fn mutations() -> Vec<Mutation> {
    let text = include_str!("mutations.txt");
    let one = |block: &str| {
        let (head, rest) = block.split_once("\n-\n").expect("what stands there");
        let (name, keys) = head.split_once("\nfile: ").expect("a file");
        let (file, by) = match keys.split_once("\nby: check ") {
            Some((file, tests)) => (file, Noticed::Check(tests.to_owned())),
            None => (keys, Noticed::Oracle),
        };
        let (old, rest) = rest.split_once("\n+\n").expect("what stands there then");
        let new = rest.trim_end().strip_suffix('.').expect("an end").trim_end().to_owned();
        let (before, old, after) = match old.split_once('«') {
            Some((before, rest)) => {
                let (old, after) = rest.split_once('»').expect("the end of what is changed");
                (before, old, after)
            }
            None => ("", old, ""),
        };
        let [name, file, before, old, after] = [name, file, before, old, after].map(str::to_owned);
        Mutation { name, file, by, before, old, after, new }
    };
    text.split("\n## ").skip(1).map(one).collect()
}

fn root() -> PathBuf {
    std::env::var_os("CARGO_MANIFEST_DIR").map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from)
}

impl Mutation {
    /// The text with the change behind its switch.
    fn switched(&self, number: usize, text: &str) -> String {
        let Self { name, file, before, old, after, new, .. } = self;
        let place = format!("{before}{old}{after}");
        let found = text.matches(&place).count();
        assert_eq!(found, 1, "`{name}`: its place in {file} is found {found} times");
        let switch = format!("{before}{{ if crate::mutation::is({number}) {{ {new} }} else {{ {old} }} }}{after}");
        text.replacen(&place, &switch, 1)
    }
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|why| panic!("{}: {why}", path.display()))
}

#[test]
fn every_mutation_still_finds_its_place() {
    let all = mutations();
    assert!(all.len() >= 26, "{} mutations", all.len());
    for mutation in &all {
        assert_ne!(mutation.old, mutation.new, "`{}` changes nothing", mutation.name);
        mutation.switched(1, &read(&root().join(&mutation.file)));
    }
}

/// Which of them is made is said by the environment; none of them without it.
const SWITCH: &str = "
/// Which change is made.
#[doc(hidden)]
#[allow(missing_docs)]
pub mod mutation {
    static MADE: std::sync::LazyLock<usize> = std::sync::LazyLock::new(|| {
        std::env::var(\"DAVIT_MUTANT\").ok().and_then(|text| text.parse().ok()).unwrap_or(0)
    });

    pub fn is(number: usize) -> bool {
        *MADE == number
    }
}
";

/// The files of a folder, or the one file.
fn files(at: &Path, all: &mut Vec<PathBuf>) {
    if !at.is_dir() {
        return all.push(at.to_owned());
    }
    let mut inside: Vec<PathBuf> =
        std::fs::read_dir(at).expect("a folder").flatten().map(|entry| entry.path()).collect();
    inside.sort();
    inside.iter().for_each(|path| files(path, all));
}

/// The copy, with every change behind its switch. What is the same keeps its time, so that only what changed is built anew.
fn copy(to: &Path) {
    let mut all = Vec::new();
    let kept = [
        "Cargo.toml",
        "Cargo.lock",
        "rust-toolchain.toml",
        "src",
        "benches",
        "examples",
        "tests",
        "deployments",
        "configs",
    ];
    kept.map(|name| root().join(name)).iter().filter(|path| path.exists()).for_each(|path| files(path, &mut all));
    // What is there no more is not in the copy either.
    let mut before = Vec::new();
    kept.map(|name| to.join(name)).iter().filter(|path| path.exists()).for_each(|path| files(path, &mut before));
    for path in before {
        if !root().join(path.strip_prefix(to).expect("below the copy")).exists() {
            std::fs::remove_file(&path).expect("the copy's own");
        }
    }
    for path in all {
        let name = path.strip_prefix(root()).expect("below the root").to_owned();
        let mut text = std::fs::read(&path).expect("a file");
        let changes =
            || mutations().into_iter().zip(1usize..).filter(|(mutation, _)| Path::new(&mutation.file) == name);
        if changes().next().is_some() || name == Path::new("src/lib.rs") {
            let mut source = String::from_utf8(text).expect("a source");
            for (mutation, number) in changes() {
                source = mutation.switched(number, &source);
            }
            if name == Path::new("src/lib.rs") {
                source.push_str(SWITCH);
            }
            text = source.into_bytes();
        }
        let to = to.join(&name);
        if std::fs::read(&to).ok().as_ref() != Some(&text) {
            std::fs::create_dir_all(to.parent().expect("a folder")).expect("room for a copy");
            std::fs::write(&to, text).expect("room for a copy");
        }
    }
}

/// Takes over the dependencies as they were built for these tests: they are the same, and a third of the work. When they were
/// built is kept, since cargo asks which is older. What is built of the project itself is left behind.
fn take_dependencies(to: &Path) {
    let own = std::env::current_exe().expect("a program");
    let from = own.parent().and_then(Path::parent).expect("a folder of what was built");
    let mut all = Vec::new();
    for kind in ["deps", "build", ".fingerprint"] {
        let inside = std::fs::read_dir(from.join(kind)).into_iter().flatten().flatten();
        let foreign = inside.filter(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            let library = name.starts_with("lib") && !name.starts_with("libdavit-");
            if kind == "deps" { library && !name.ends_with(".d") } else { !name.starts_with("davit-") }
        });
        foreign.for_each(|entry| files(&entry.path(), &mut all));
    }
    for path in all {
        let to = to.join(path.strip_prefix(from).expect("inside"));
        if to.exists() {
            continue;
        }
        std::fs::create_dir_all(to.parent().expect("a folder")).expect("room for a copy");
        std::fs::copy(&path, &to).expect("room for a copy");
        let built = std::fs::metadata(&path).and_then(|about| about.modified()).expect("a time");
        let copied = std::fs::File::open(&to).expect("the copy");
        copied.set_modified(built).expect("a time");
    }
}

/// Builds the copy's two test binaries: the oracle, and that of `check`.
fn built(at: &Path) -> [PathBuf; 2] {
    take_dependencies(&at.join("target/debug"));
    let made = Command::new(env!("CARGO"))
        .args([
            "test",
            "--locked",
            "--offline",
            "--test",
            "oracle",
            "--test",
            "check",
            "--no-run",
            "--message-format=json",
        ])
        .current_dir(at)
        .env("CARGO_TARGET_DIR", at.join("target"))
        .env_remove("CARGO_MANIFEST_DIR")
        .output()
        .expect("cargo runs");
    assert!(made.status.success(), "the copy does not build:\n{}", String::from_utf8_lossy(&made.stderr));
    let text = String::from_utf8(made.stdout).expect("text");
    ["oracle", "check"].map(|name| {
        let of = |line: &str| {
            let message: serde_json::Value = serde_json::from_str(line).ok()?;
            let own = message["target"]["name"] == name && message["target"]["kind"][0] == "test";
            message["executable"].as_str().filter(|_| own).map(PathBuf::from)
        };
        text.lines().find_map(of).unwrap_or_else(|| panic!("no test `{name}`"))
    })
}

/// What never ends is noticed, too.
const PATIENCE: Duration = Duration::from_secs(300);

/// Whether the tests pass with that change made.
fn passes(at: &Path, [oracle, check]: &[PathBuf; 2], by: &Noticed, number: usize) -> bool {
    let mut command = match by {
        Noticed::Oracle => Command::new(oracle),
        Noticed::Check(_) => Command::new(check),
    };
    let tests = match by {
        Noticed::Oracle => "a_running_deployment",
        Noticed::Check(tests) => tests,
    };
    let mut running = command
        .arg(tests)
        .current_dir(at)
        .env("CARGO_MANIFEST_DIR", at)
        .env("DAVIT_MUTANT", number.to_string())
        .env("DAVIT_ORACLE_CASES", std::env::var("DAVIT_MUTATION_CASES").unwrap_or_else(|_| "12000".to_owned()))
        .env("DAVIT_ORACLE_ENOUGH", "1")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the tests run");
    let clock = Clock::real();
    let begun = clock.now();
    loop {
        match running.try_wait().expect("the tests run") {
            Some(status) => return status.success(),
            None if clock.now().since(begun) > PATIENCE => {
                let _ = running.kill();
                let _ = running.wait();
                return false;
            }
            None => clock.sleep(Duration::from_millis(20)),
        }
    }
}

/// One build, and a run with each change until it is noticed: a few minutes. `DAVIT_MUTATIONS_AT` says where the copy lies,
/// `DAVIT_MUTATION` which alone to make (a part of its name), `DAVIT_MUTATION_CASES` how many cases the oracle runs.
#[test]
#[ignore = "builds the project once more"]
fn mutations_are_noticed() {
    let at = std::env::var_os("DAVIT_MUTATIONS_AT");
    let at = at.map_or_else(|| Path::new(env!("CARGO_TARGET_TMPDIR")).join("mutations"), PathBuf::from);
    copy(&at);
    let tests = built(&at);
    let only = std::env::var("DAVIT_MUTATION").unwrap_or_default();
    let all: Vec<(Mutation, usize)> =
        mutations().into_iter().zip(1..).filter(|(m, _)| m.name.contains(&only)).collect();
    // What must notice a change passes without it; each of them once, before any change.
    let mut sound: Vec<(&Mutation, usize)> = Vec::new();
    for (mutation, _) in &all {
        if !sound.iter().any(|(known, _)| known.by == mutation.by) {
            sound.push((mutation, 0));
        }
    }
    let failed = survivors(&sound, |passed| !passed, &at, &tests);
    assert!(failed.is_empty(), "what must notice these fails without them: {failed:?}");
    let changed: Vec<(&Mutation, usize)> = all.iter().map(|(mutation, number)| (mutation, *number)).collect();
    let survived = survivors(&changed, |passed| passed, &at, &tests);
    assert!(survived.is_empty(), "not noticed: {survived:?}");
}

/// Runs the tests with each of the changes, as many at a time as the machine has cores; the names of those `wrong` with which they pass or not.
fn survivors(
    changes: &[(&Mutation, usize)],
    wrong: impl Fn(bool) -> bool + Sync,
    at: &Path,
    tests: &[PathBuf; 2],
) -> Vec<String> {
    let (next, names) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let run = || {
        let clock = Clock::real();
        while let Some((mutation, number)) = changes.get(next.fetch_add(1, Relaxed)) {
            let begun = clock.now();
            let passed = passes(at, tests, &mutation.by, *number);
            let told = match (number, passed) {
                (0, true) => "unchanged",
                (0, false) => "fails",
                (_, true) => "survived",
                (_, false) => "noticed",
            };
            println!("{told:<10}{:>6.1} s  {}", clock.now().since(begun).as_secs_f64(), mutation.name);
            if wrong(passed) {
                names.lock().unwrap().push(mutation.name.clone());
            }
        }
    };
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    std::thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(run);
        }
    });
    names.into_inner().unwrap()
}
