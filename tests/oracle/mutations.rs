//! What the oracle must notice: small changes, each made alone in a copy of the sources, in which the oracle then runs.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A change of one place.
struct Mutation {
    name: String,
    file: String,
    old: String,
    new: String,
}

fn mutations() -> Vec<Mutation> {
    let text = include_str!("mutations.txt");
    let one = |block: &str| {
        let (name, rest) = block.split_once("\nfile: ").expect("a file");
        let (file, rest) = rest.split_once("\n-\n").expect("what stands there");
        let (old, rest) = rest.split_once("\n+\n").expect("what stands there then");
        let new = rest.trim_end().strip_suffix('.').expect("an end");
        let new = new.strip_suffix('\n').unwrap_or(new).to_owned();
        Mutation { name: name.to_owned(), file: file.to_owned(), old: old.to_owned(), new }
    };
    text.split("\n## ").skip(1).map(one).collect()
}

fn root() -> PathBuf {
    std::env::var_os("CARGO_MANIFEST_DIR").map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from)
}

impl Mutation {
    fn applied(&self) -> String {
        let text =
            std::fs::read_to_string(root().join(&self.file)).unwrap_or_else(|why| panic!("{}: {why}", self.file));
        let found = text.matches(&self.old).count();
        assert_eq!(found, 1, "`{}`: its place in {} is found {found} times", self.name, self.file);
        text.replacen(&self.old, &self.new, 1)
    }
}

#[test]
fn every_mutation_still_finds_its_place() {
    let all = mutations();
    assert!(all.len() >= 15, "{} mutations", all.len());
    for mutation in &all {
        assert_ne!(mutation.old, mutation.new, "`{}` changes nothing", mutation.name);
        mutation.applied();
    }
}

fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        std::fs::create_dir_all(to).expect("room for a copy");
        for entry in std::fs::read_dir(from).expect("a folder of sources").flatten() {
            copy(&entry.path(), &to.join(entry.file_name()));
        }
        return;
    }
    // What is the same keeps its time, so that only what a mutation touches is built anew.
    let text = std::fs::read(from).expect("a source");
    if std::fs::read(to).ok().as_ref() != Some(&text) {
        std::fs::write(to, text).expect("room for a copy");
    }
}

/// Whether the oracle passes in the copy; none: it does not build.
fn passes(at: &Path) -> Option<bool> {
    let cargo = |more: &[&str]| {
        Command::new(env!("CARGO"))
            .args(["test", "--locked", "--offline", "--test", "oracle"])
            .args(more)
            .current_dir(at)
            .env("DAVIT_ORACLE_CASES", std::env::var("DAVIT_MUTATION_CASES").unwrap_or_else(|_| "5000".to_owned()))
            .env("DAVIT_ORACLE_ENOUGH", "1")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
            .expect("cargo runs")
            .success()
    };
    cargo(&["--no-run"]).then(|| cargo(&["a_running_deployment"]))
}

/// Builds the project once for each: half an hour. `DAVIT_MUTATIONS_AT` says where the copy lies, `DAVIT_MUTATION` which alone to make
/// (a part of its name), `DAVIT_MUTATION_CASES` how many cases are run.
#[test]
#[ignore = "builds the project once for each mutation"]
fn mutations_are_noticed() {
    let at = std::env::var_os("DAVIT_MUTATIONS_AT");
    let at = at.map_or_else(|| Path::new(env!("CARGO_TARGET_TMPDIR")).join("mutations"), PathBuf::from);
    for name in ["Cargo.toml", "Cargo.lock", "rust-toolchain.toml", "src", "benches", "tests/oracle"] {
        let to = at.join(name);
        std::fs::create_dir_all(to.parent().expect("a folder")).expect("room for a copy");
        copy(&root().join(name), &to);
    }
    let mut survived = Vec::new();
    let only = std::env::var("DAVIT_MUTATION").unwrap_or_default();
    for mutation in mutations().into_iter().filter(|mutation| mutation.name.contains(&only)) {
        std::fs::write(at.join(&mutation.file), mutation.applied()).expect("room for a copy");
        let went = passes(&at);
        let told = match went {
            Some(true) => "survived",
            Some(false) => "killed",
            None => "does not build",
        };
        println!("{told:<15} {}", mutation.name);
        if went != Some(false) {
            survived.push(mutation.name);
        }
        copy(&root().join(&mutation.file), &at.join(&mutation.file));
    }
    assert!(survived.is_empty(), "not noticed: {survived:?}");
}
