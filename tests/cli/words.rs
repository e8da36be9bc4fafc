//! What texts tell to type is there: every command and flag in help texts, findings, their pages, comments and documents.

use clap::Command;
use std::path::{Path, PathBuf};

/// What a text says to type: the words after `davit`, and where.
struct Typed {
    place: String,
    words: Vec<String>,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn files(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(dir).expect("a folder of the project").filter_map(Result::ok) {
        let path = entry.path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|e| ["rs", "md", "lua", "yaml", "py", "toml"].iter().any(|x| e == *x)) {
            found.push(path);
        }
    }
}

/// The texts of the project that tell people something, each with its name, on which lines that were broken for their
/// width are whole again.
fn texts() -> Vec<(String, String)> {
    let mut paths: Vec<PathBuf> = ["README.md", "ARCHITECTURE.md", "CHANGELOG.md"].map(|f| root().join(f)).to_vec();
    for dir in ["src", "docs", "examples", "configs", "deployments"] {
        files(&root().join(dir), &mut paths);
    }
    let whole = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).expect("texts are UTF-8");
        let rust = path.extension().is_some_and(|e| e == "rs");
        let joined = if rust { rust_text(&text) } else { text };
        (path.strip_prefix(root()).expect("inside").display().to_string(), joined)
    };
    paths.into_iter().map(whole).collect()
}

/// Strings over several lines and paragraphs of comments on one line each, as they are read.
fn rust_text(text: &str) -> String {
    let mut out = String::new();
    let mut comment = false;
    for line in text.lines() {
        let own = line.trim_start();
        let said = ["///", "//!"].iter().find_map(|mark| own.strip_prefix(mark));
        let goes_on = out.ends_with('\\');
        if goes_on {
            out.pop();
            out.push_str(own);
        } else if let (Some(said), true) = (said.filter(|said| !said.trim().is_empty()), comment) {
            out.push_str(said);
        } else {
            // Each is a paragraph of its own.
            out.push_str("\n\n");
            out.push_str(said.unwrap_or(line));
        }
        comment = said.is_some_and(|said| !said.trim().is_empty());
    }
    out
}

/// Everything between backquotes on one line, and lines that show a prompt.
fn quoted(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut fenced = false;
    // A document breaks a quoted text where its line is full.
    let mut paragraph = String::new();
    for line in text.lines() {
        let own = line.trim_start();
        if own.starts_with("```") {
            fenced = !fenced;
            continue;
        }
        if let Some(shown) = own.strip_prefix("$ ").or(own.starts_with("davit ").then_some(own)).filter(|_| fenced) {
            found.push(shown.to_owned());
        }
        if own.is_empty() || fenced || own.starts_with(['|', '-', '*', '#']) {
            found.extend(between(&paragraph));
            paragraph.clear();
        }
        if !fenced {
            paragraph.push_str(own);
            paragraph.push(' ');
        }
    }
    found.extend(between(&paragraph));
    found
}

fn between(paragraph: &str) -> Vec<String> {
    paragraph.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// What of a text is typed: up to a pipe, a redirection or a remark.
fn typed(text: &str) -> Option<Vec<String>> {
    let rest = text.trim().strip_prefix("davit ")?;
    let ends = |word: &&str| !["|", ">", "&&", "2>", "#", "…"].iter().any(|end| word.starts_with(end));
    let words: Vec<String> = rest.split_whitespace().take_while(ends).map(str::to_owned).collect();
    // `davit <command>`, `davit --help`.
    let first = words.first()?;
    (first.starts_with(|c: char| c.is_ascii_lowercase())).then_some(words)
}

/// What is wrong with the words: there is no such command, flag or operand. Flags that help does not show count as none.
fn wrong(cli: &Command, words: &[String]) -> Option<String> {
    let Some(command) = cli.find_subcommand(&words[0]).filter(|c| !c.is_hide_set()) else {
        return Some(format!("there is no command `{}`", words[0]));
    };
    let flags = || command.get_arguments().chain(cli.get_arguments()).filter(|a| !a.is_hide_set());
    let mut operands = 0;
    let mut rest = words[1..].iter();
    while let Some(word) = rest.next() {
        // From here on all are operands, whatever they begin with.
        if word == "--" {
            operands += rest.len();
            break;
        }
        let bare = word.trim_matches(['[', ']', ',', '.', ';', ':', ')']);
        let (name, value) = bare.split_once('=').map_or((bare, None), |(name, value)| (name, Some(value)));
        let flag = match (name.strip_prefix("--"), name.strip_prefix('-')) {
            (Some(long), _) => flags().find(|a| a.get_long() == Some(long)),
            (None, Some(short)) if short.len() == 1 => flags().find(|a| a.get_short() == short.chars().next()),
            _ => {
                operands += 1;
                continue;
            }
        };
        match flag {
            None if ["--help", "-h"].contains(&name) => {}
            None => return Some(format!("`davit {}` has no `{name}`", words[0])),
            Some(flag) if flag.get_action().takes_values() && value.is_none() => _ = rest.next(),
            Some(_) => {}
        }
    }
    let operand = command.get_positionals().next().is_some();
    (operands > 0 && !operand).then(|| format!("`davit {}` takes no operand", words[0]))
}

/// Everything that the texts tell to type.
fn told() -> Vec<Typed> {
    let mut all = Vec::new();
    for (place, text) in texts() {
        for words in quoted(&text).iter().filter_map(|quoted| typed(quoted)) {
            all.push(Typed { place: place.clone(), words });
        }
    }
    all
}

#[test]
fn every_command_and_flag_that_texts_name_is_there() {
    let mut cli = davit::cli::command();
    cli.build();
    let told = told();
    let places = |dir: &str| told.iter().filter(|typed| typed.place.starts_with(dir)).count();
    assert!(places("src/model/codes.rs") > 20 && places("src/") > 60 && places("docs/") > 20 && places("README") > 10);
    let mut found: Vec<String> = told
        .iter()
        .filter_map(|typed| Some(format!("{}: {}: {}", typed.place, typed.words.join(" "), wrong(&cli, &typed.words)?)))
        .collect();
    // A flag by itself belongs to some command (or to a program that is named before it).
    let any = |flag: &str| {
        let commands = cli.get_subcommands().flat_map(Command::get_arguments).chain(cli.get_arguments());
        commands.filter(|a| !a.is_hide_set()).any(|a| a.get_long() == Some(flag))
    };
    for (place, text) in texts() {
        for quoted in quoted(&text) {
            let flag = quoted.split([' ', '=']).next().and_then(|word| word.strip_prefix("--"));
            let named = |flag: &&str| flag.starts_with(|c: char| c.is_ascii_lowercase());
            if let Some(flag) = flag.filter(named).filter(|flag| !any(flag) && !["help", "version"].contains(flag)) {
                found.push(format!("{place}: `{quoted}`: no command has `--{flag}`"));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn what_is_not_there_is_found() {
    let mut cli = davit::cli::command();
    cli.build();
    let why = |text: &str| wrong(&cli, &typed(text).unwrap());
    assert_eq!(why("davit recover --back"), None);
    assert_eq!(why("davit plan FILE ID…"), None);
    assert_eq!(why("davit event e_5dof --wait five_DOF.ok --on arm"), None);
    assert_eq!(why("davit graph picture.yaml --format=dot | dot -Tsvg --no-such"), None);
    assert_eq!(why("davit rehearse FILE"), Some("there is no command `rehearse`".to_owned()));
    assert_eq!(why("davit recover --forward"), Some("`davit recover` has no `--forward`".to_owned()));
    assert_eq!(why("davit drift --wait"), Some("`davit drift` has no `--wait`".to_owned()));
    let broken = "a page \\\n    that says `davit \\\n    recover --back`\n/// or `davit\n/// drift`";
    let commands: Vec<String> =
        quoted(&rust_text(broken)).iter().filter_map(|q| typed(q)).map(|w| w[0].clone()).collect();
    assert_eq!(commands, ["recover", "drift"]);
}

/// The names in backquotes at the beginning of a table's rows.
fn rows(document: &str) -> String {
    let text = std::fs::read_to_string(root().join(document)).expect("a document");
    text.lines().filter(|line| line.starts_with("| `")).filter_map(|line| line.split('|').nth(1)).collect()
}

#[test]
fn the_socket_and_the_scripts_are_documented() {
    let socket = rows("docs/control-socket.md");
    for (method, _) in davit::session::service::METHODS {
        assert!(socket.contains(&format!("`{method}`")), "docs/control-socket.md has no `{method}`");
    }
    let scripts = rows("docs/scripts.md");
    for function in davit::app::script::functions() {
        let called = ["(", "{"].iter().any(|open| scripts.contains(&format!("`{function}{open}")));
        assert!(called, "docs/scripts.md has no `{function}`");
    }
}

/// How many tests a cell names; panics at one that is not there.
fn tests_named(cell: &str) -> usize {
    let mut named = 0;
    for test in cell.split('`').skip(1).step_by(2) {
        let (binary, path) = test.split_once(' ').expect("a test binary and a test");
        let (modules, name) = path.rsplit_once("::").unwrap_or(("", path));
        let module = modules.replace("::", "/");
        let places = match (binary, module.as_str()) {
            ("lib", module) => [format!("src/{module}.rs"), format!("src/{module}/mod.rs")],
            (binary, "") => [format!("tests/{binary}.rs"), format!("tests/{binary}/main.rs")],
            (binary, module) => [format!("tests/{binary}/{module}.rs"), format!("tests/{binary}/{module}/mod.rs")],
        };
        let source: String =
            places.iter().filter_map(|place| std::fs::read_to_string(root().join(place)).ok()).collect();
        let found =
            source.find(&format!("fn {name}(")).and_then(|at| source[..at].rfind("#[test]").map(|test| at - test));
        assert!(found.is_some_and(|distance| distance < 200), "there is no test `{test}` ({places:?})");
        named += 1;
    }
    named
}

/// `docs/promises.md` names, behind each promise, tests that are there; `docs/semantics.md` behind each law.
#[test]
fn each_promise_and_each_law_has_its_tests() {
    let text = std::fs::read_to_string(root().join("docs/promises.md")).expect("the table of promises");
    let mut named = 0;
    for line in text.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| promise")) {
        let tests = tests_named(line.split('|').nth(2).expect("promise, tests"));
        assert!(tests > 0 || line.starts_with("|---"), "no test behind: {line}");
        named += tests;
    }
    assert!(named > 80, "{named}");
    let text = std::fs::read_to_string(root().join("docs/semantics.md")).expect("the semantics");
    let laws = text.lines().skip_while(|line| !line.starts_with("| law |")).skip(2);
    let laws: Vec<&str> = laws.take_while(|line| line.starts_with('|')).collect();
    assert!(laws.len() > 10, "{laws:?}");
    for line in laws {
        assert!(tests_named(line.split('|').nth(3).expect("law, statement, tests")) > 0, "no test behind: {line}");
    }
}
