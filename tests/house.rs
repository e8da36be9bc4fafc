//! The rules of the house, read from the sources: which room may use which (`ARCHITECTURE.md`), how long a file may be,
//! which words may not stand in it, where time may be read, where one more change has to be known (`house/changes.rs`), and that
//! every finding code is used and explained.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

#[path = "house/changes.rs"]
mod changes;
#[path = "house/types.rs"]
mod types;

/// A file past this is a sign that a second idea lives in it.
const LINES: usize = 500;

/// The same for tests, which may be long lists of cases.
const TEST_LINES: usize = 1000;

/// Files outside `time` that may read the clock, each with the reason.
const CLOCK_READERS: &[(&str, &str)] =
    &[("src/lang/lua/sandbox.rs", "a budget against hostile files: library calls can only be timed")];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn files_under(dir: &Path, endings: &[&str], found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(dir) else { return };
    let mut paths: Vec<PathBuf> = entries.map(|e| e.expect("a readable directory").path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            if path.file_name().is_some_and(|n| n != "target" && n != ".git") {
                files_under(&path, endings, found);
            }
        } else if path.extension().is_some_and(|e| endings.iter().any(|x| e == *x)) {
            found.push(path);
        }
    }
}

/// Every Rust source under `dir` of the project, with its path relative to the project and its text.
fn sources(dir: &str) -> Vec<(String, String)> {
    let mut paths = Vec::new();
    files_under(&root().join(dir), &["rs"], &mut paths);
    paths
        .into_iter()
        .map(|path| {
            let text = std::fs::read_to_string(&path).expect("sources are UTF-8");
            let name = path.strip_prefix(root()).expect("inside the project").to_string_lossy().into_owned();
            (name, text)
        })
        .collect()
}

/// The import table: room → rooms it may use.
fn table(text: &str) -> BTreeMap<String, BTreeSet<String>> {
    let section = text.split("## Import table").nth(1).expect("ARCHITECTURE.md has a section `Import table`");
    let mut table = BTreeMap::new();
    let mut above: Vec<String> = Vec::new();
    for line in section.lines().map(str::trim).skip_while(|l| !l.starts_with('|')).take_while(|l| l.starts_with('|')) {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let ([room, uses], true) = (<[&str; 2]>::try_from(cells).expect("two columns"), line.contains('`')) else {
            continue;
        };
        let room = room.trim_matches('`').to_owned();
        let named: BTreeSet<String> =
            uses.split('`').skip(1).step_by(2).map(|name| name.trim_end_matches('/').to_owned()).collect();
        let allowed = if uses.starts_with("all above") {
            above.iter().filter(|r| !named.contains(*r)).cloned().collect()
        } else {
            named
        };
        for used in &allowed {
            assert!(above.contains(used), "ARCHITECTURE.md: `{room}` may use `{used}`, which does not stand above it");
        }
        table.insert(room.clone(), allowed);
        above.push(room);
    }
    assert!(table.len() > 10, "the import table of ARCHITECTURE.md was not understood");
    table
}

/// The text without comments and with string contents blanked, line by line.
fn code_lines(text: &str) -> Vec<String> {
    let mut lines = Vec::new();
    let mut in_raw: Option<String> = None;
    for line in text.lines() {
        let mut out = String::new();
        let mut rest = line;
        loop {
            if let Some(end) = &in_raw {
                let Some(at) = rest.find(end.as_str()) else { break };
                rest = &rest[at + end.len()..];
                in_raw = None;
                continue;
            }
            let Some(c) = rest.chars().next() else { break };
            if rest.starts_with("//") {
                break;
            }
            if let Some(after) = rest.strip_prefix('r') {
                let hashes = after.chars().take_while(|c| *c == '#').count();
                let word = out.chars().last().is_some_and(|c| c.is_alphanumeric() || c == '_');
                if !word && after[hashes..].starts_with('"') {
                    in_raw = Some(format!("\"{}", "#".repeat(hashes)));
                    rest = &after[hashes + 1..];
                    continue;
                }
            }
            if c == '"' {
                let mut escaped = false;
                let end = rest[1..].find(|c| {
                    let ends = c == '"' && !escaped;
                    escaped = c == '\\' && !escaped;
                    ends
                });
                out.push_str("\"\"");
                match end {
                    Some(end) => rest = &rest[end + 2..],
                    None => {
                        // A string over several lines: its end is looked for as that of a raw one.
                        in_raw = Some("\"".to_owned());
                        rest = "";
                    }
                }
                continue;
            }
            if rest.starts_with("'\"'") {
                out.push_str("' '");
                rest = &rest[3..];
                continue;
            }
            if rest.starts_with("'\\") {
                let end = rest[2..].char_indices().skip(1).find(|(_, c)| *c == '\'').map_or(rest.len(), |(i, _)| i + 3);
                out.push_str("' '");
                rest = &rest[end.min(rest.len())..];
                continue;
            }
            out.push(c);
            rest = &rest[c.len_utf8()..];
        }
        lines.push(out);
    }
    lines
}

/// The rooms a source names after `prefix` (`crate::` or `davit::`), with the line of each: `crate::a::b` and
/// `crate::{a::b, c}`.
fn rooms_named(text: &str, prefix: &str) -> Vec<(usize, String)> {
    paths_named(text, prefix).into_iter().map(|(line, room, _)| (line, room)).collect()
}

/// The same with whether something in it is named, and not only itself.
fn paths_named(text: &str, prefix: &str) -> Vec<(usize, String, bool)> {
    let code = code_lines(text).join("\n");
    let one = |line: usize, path: &str| {
        let path = path.trim_start();
        let name: String = path.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        let more = path[name.len()..].trim_start().starts_with("::");
        (line, name, more)
    };
    let mut found = Vec::new();
    let mut from = 0;
    while let Some(at) = code[from..].find(prefix).map(|i| i + from) {
        from = at + prefix.len();
        if code[..at].chars().last().is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '$') {
            continue;
        }
        let line = code[..at].matches('\n').count() + 1;
        let rest = code[from..].trim_start();
        let Some(group) = rest.strip_prefix('{') else {
            found.push(one(line, rest));
            continue;
        };
        let mut depth = 0usize;
        let mut begin = 0;
        for (at, c) in group.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => {
                    found.push(one(line, &group[begin..at]));
                    break;
                }
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    found.push(one(line, &group[begin..at]));
                    begin = at + 1;
                }
                _ => {}
            }
        }
    }
    found.retain(|(_, room, _)| !room.is_empty());
    found
}

fn room_of(file: &str) -> String {
    let inside = file.strip_prefix("src/").expect("a file under src");
    inside.split('/').next().expect("a name").trim_end_matches(".rs").to_owned()
}

#[test]
fn imports_follow_the_table() {
    let architecture = std::fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md is there");
    let table = table(&architecture);
    let mut wrong = Vec::new();
    for (file, text) in sources("src") {
        let room = room_of(&file);
        if room == "lib" || room == "main" {
            continue;
        }
        let Some(allowed) = table.get(&room) else {
            wrong.push(format!("{file}: the room `{room}` is not in the import table of ARCHITECTURE.md"));
            continue;
        };
        for (line, used) in rooms_named(&text, "crate::") {
            if used != room && !allowed.contains(&used) {
                let why = if table.contains_key(&used) {
                    format!(
                        "`{room}` may use only {allowed:?}: imports point downwards, so that every room can be read, \
                         tested and replaced without the rooms that stand on it"
                    )
                } else {
                    "no room of that name is in the table: name things by the room they live in".to_owned()
                };
                wrong.push(format!("{file}:{line}: uses `crate::{used}`; {why}"));
            }
        }
        // `super` must not climb out of the room either.
        let depth = file.matches('/').count() - usize::from(file.ends_with("/mod.rs"));
        let climb = "super::".repeat(depth + 1);
        for (i, line) in code_lines(&text).iter().enumerate() {
            if line.contains(&climb) {
                wrong.push(format!("{file}:{}: `{climb}` leaves the room; write `crate::ROOM::…`", i + 1));
            }
        }
    }
    assert!(wrong.is_empty(), "imports that are not in the table of ARCHITECTURE.md:\n{}", wrong.join("\n"));
}

/// Which file of a room needs which other one, by what they name after `super::`. What its `mod.rs` hands on is the file's
/// that has it; what it has itself makes a circle with whoever needs that, unless it `has` the room's one type.
fn needs(room: &str, has: bool) -> BTreeMap<String, BTreeSet<String>> {
    let prefix = format!("src/{room}/");
    let files: Vec<(String, String)> = (sources("src").into_iter())
        .filter_map(|(file, text)| Some((file.strip_prefix(&prefix)?.strip_suffix(".rs")?.to_owned(), text)))
        .filter(|(file, _)| !file.contains('/'))
        .collect();
    let is_left_out = |file: &str| has && file == "mod";
    let names: BTreeSet<&String> = files.iter().map(|(file, _)| file).collect();
    let contents = files.iter().find(|(file, _)| file == "mod").map(|(_, text)| code_lines(text).join("\n"));
    let contents = contents.expect("a room has a table of contents");
    let hands_on = |name: &String| {
        let exports = contents.split(';').map(str::trim_start).filter_map(|line| line.strip_prefix("pub use "));
        let mut words = exports.map(|line| line.split(|c: char| !c.is_alphanumeric() && c != '_'));
        words.find_map(|mut words| {
            let from = words.next().map(str::to_owned);
            words.any(|word| word == name).then_some(from).flatten()
        })
    };
    let of = |text: &str| rooms_named(text, "super::").into_iter().map(|(_, name)| name).collect::<BTreeSet<String>>();
    let meant = |name: String| match (names.contains(&name), hands_on(&name)) {
        (true, _) => Some(name),
        (false, Some(from)) => names.contains(&from).then_some(from),
        // A module of the tests names the one around it.
        (false, None) => contents.contains(&format!(" {name}")).then(|| "mod".to_owned()),
    };
    let of = |file: &String, text: &String| -> BTreeSet<String> {
        let needs = of(text).into_iter().filter_map(meant).filter(|name| name != file);
        // The table of contents needs everything in it.
        if file == "mod" {
            names.iter().filter(|name| **name != "mod").map(|name| (*name).clone()).collect()
        } else {
            needs.collect()
        }
    };
    let mut needs: BTreeMap<String, BTreeSet<String>> = files
        .iter()
        .filter(|(file, _)| !is_left_out(file))
        .map(|(file, text)| (file.clone(), of(file, text)))
        .collect();
    needs.values_mut().for_each(|needs| needs.retain(|name| !is_left_out(name)));
    needs
}

#[test]
fn no_files_go_round_in_a_circle() {
    let free = ["check", "configurator", "diagnostics", "functions", "monitor"];
    let rooms = free.map(|room| (room, false)).into_iter().chain([("stack", true), ("transaction", true)]);
    for (room, has) in rooms {
        let mut needs = needs(room, has);
        assert!(
            needs.len() > 4 && needs.values().any(|needs| !needs.is_empty()),
            "`{room}` was not understood: {needs:?}"
        );
        // What needs nothing that is left is no part of a circle.
        while let Some(done) = needs.iter().find(|(_, needs)| needs.is_empty()).map(|(file, _)| file.clone()) {
            needs.remove(&done);
            needs.values_mut().for_each(|needs| _ = needs.remove(&done));
        }
        assert!(needs.is_empty(), "files of `{room}` need each other in a circle: {needs:#?}");
    }
}

/// The names that `src/lib.rs` offers, each with its place (`davit::Session`).
fn public_names() -> BTreeSet<String> {
    let text = std::fs::read_to_string(root().join("src/lib.rs")).expect("lib.rs is there");
    let mut names = BTreeSet::new();
    let (mut module, mut hidden, mut used) = (String::new(), false, String::new());
    for line in code_lines(&text) {
        // What is hidden, and the rooms, are nobody's to use.
        match line.trim_end() {
            "#[doc(hidden)]" | "    #[doc(hidden)]" | "mod rooms {" | "#[cfg(feature = \"\")]" => hidden = true,
            "}" => (module, hidden) = (String::new(), false),
            "    }" => hidden = false,
            line => {
                if let Some(name) = line.strip_prefix("pub mod ").and_then(|line| line.strip_suffix(" {")) {
                    module = format!("{name}::");
                }
            }
        }
        if !used.is_empty() || line.trim_start().starts_with("pub use ") {
            used += line.trim_start().trim_start_matches("pub use ");
            used.push(' ');
        }
        let Some(whole) = used.trim_end().strip_suffix(';') else { continue };
        let list = whole.split_once('{').map_or(whole, |(_, list)| list.trim_end_matches('}'));
        let last = |name: &str| name.rsplit([' ', ':']).next().unwrap_or_default().to_owned();
        let listed = list.split(',').map(|name| last(name.trim())).filter(|name| !name.is_empty() && name != "*");
        names.extend(listed.filter(|_| !hidden).map(|name| format!("davit::{module}{name}")));
        if module.is_empty() {
            hidden = false;
        }
        used.clear();
    }
    names
}

/// What this crate offers changes on purpose only. Written anew with `DAVIT_WRITE_NAMES=1`.
#[test]
fn the_public_names_are_those_that_are_listed() {
    let path = root().join("tests/golden/public_names.txt");
    let names = public_names();
    assert!(names.len() > 40 && names.contains("davit::main"), "lib.rs was not understood: {names:?}");
    let text: String = names.iter().map(|name| format!("{name}\n")).collect();
    if std::env::var_os("DAVIT_WRITE_NAMES").is_some() {
        std::fs::write(&path, &text).expect("the list can be written");
    }
    let listed = std::fs::read_to_string(&path).expect("the list is there");
    let listed: BTreeSet<String> = listed.lines().map(str::to_owned).collect();
    let (more, less): (Vec<_>, Vec<_>) = (names.difference(&listed).collect(), listed.difference(&names).collect());
    assert!(
        more.is_empty() && less.is_empty(),
        "offered and not listed: {more:?}; listed and not offered: {less:?}. Whoever uses Davit sees that: say it in \
         CHANGELOG.md, and list it with DAVIT_WRITE_NAMES=1"
    );
}

/// Programs and examples use what everybody may use: rooms are open to tests and measurements alone.
#[test]
fn examples_name_no_rooms() {
    let is_room = |name: &str| ["", ".rs"].iter().any(|end| root().join(format!("src/{name}{end}")).exists());
    let mut texts: Vec<(String, String)> = sources("examples");
    texts.extend(sources("tests").into_iter().filter(|(file, _)| file == "tests/own_program.rs"));
    texts.extend(sources("src").into_iter().filter(|(file, _)| file == "src/main.rs"));
    assert!(texts.len() > 4, "the examples are somewhere else");
    // And those in the documentation.
    for (file, text) in sources("src") {
        let mut inside = false;
        let mut example = String::new();
        for line in text.lines().map(str::trim_start) {
            let Some(said) = line.strip_prefix("///").or_else(|| line.strip_prefix("//!")) else { continue };
            inside ^= said.trim_start().starts_with("```");
            if inside {
                example = example + said.trim_start().trim_start_matches("# ") + "\n";
            }
        }
        texts.push((format!("{file} (examples)"), example));
    }
    let offered = public_names();
    let mut wrong = Vec::new();
    for (file, text) in texts {
        for (line, name, more) in paths_named(&text, "davit::") {
            let whole = offered.contains(&format!("davit::{name}")) && !more;
            if is_room(&name) && !whole {
                wrong.push(format!("{file}:{line}: `davit::{name}`"));
            }
        }
    }
    assert!(wrong.is_empty(), "rooms are private, use what `src/lib.rs` offers:\n{}", wrong.join("\n"));
}

#[test]
fn files_hold_one_idea() {
    let long: Vec<String> = sources("src")
        .into_iter()
        .chain(sources("tests"))
        .filter(|(file, text)| text.lines().count() > if file.starts_with("tests/") { TEST_LINES } else { LINES })
        // A list of pages is one idea however long it gets.
        .filter(|(file, _)| file != "src/model/codes.rs")
        .map(|(file, text)| format!("{file}: {} lines", text.lines().count()))
        .collect();
    assert!(long.is_empty(), "files past {LINES} lines; a second idea lives there, split it:\n{}", long.join("\n"));
}

#[test]
fn nothing_is_left_undone_and_no_machine_is_named() {
    // Put together here, so that this file does not contain them.
    let words = [
        ["to", "do!("],
        ["unimple", "mented!("],
        ["db", "g!("],
        ["/wo", "rk/"],
        ["/tm", "p/"],
        ["/ho", "me/"],
        ["/ro", "ot/"],
    ]
    .map(|parts| parts.concat());
    let mut paths = Vec::new();
    for dir in ["src", "tests", "examples", "benches", "configs", "deployments", "docs", "fuzz"] {
        files_under(&root().join(dir), &["rs", "lua", "yaml", "yml", "md", "toml", "py", "sh", "json"], &mut paths);
    }
    for name in ["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "Cargo.toml", "clippy.toml"] {
        paths.push(root().join(name));
    }
    let mut wrong = Vec::new();
    for path in paths {
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        for (i, line) in text.lines().enumerate() {
            for word in &words {
                if line.contains(word.as_str()) {
                    wrong.push(format!("{}:{}: `{word}`", path.strip_prefix(root()).unwrap().display(), i + 1));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "unfinished code, or paths that exist on one machine only:\n{}", wrong.join("\n"));
}

/// Texts whose sections are numbered.
const NUMBERED: [&str; 2] = ["docs/rfsm.md", "manual of Lua"];

/// What the code refers to for its meaning is in the repository: a section of `docs/semantics.md`, or another page of `docs`.
#[test]
fn what_is_referred_to_is_there() {
    let pages = std::fs::read_to_string(root().join("docs/semantics.md")).expect("the semantics");
    let sections: Vec<&str> = pages.lines().filter_map(|line| line.strip_prefix("## ")).collect();
    let mut referred = 0;
    for (file, text) in sources("src").into_iter().chain(sources("tests")) {
        if file.ends_with("house.rs") {
            continue;
        }
        let elsewhere =
            text.lines().find(|line| line.contains('\u{a7}') && !NUMBERED.iter().any(|text| line.contains(text)));
        assert!(elsewhere.is_none(), "{file} refers to a text that is not here: {elsewhere:?}");
        for (at, _) in text.match_indices("(semantics:") {
            let inside =
                &text[at..at + text[at..].find(')').unwrap_or_else(|| panic!("{file}: a parenthesis is open"))];
            for section in inside.split('*').skip(1).step_by(2) {
                assert!(sections.contains(&section), "{file}: docs/semantics.md has no section `{section}`");
                referred += 1;
            }
        }
        for (at, _) in text.match_indices("docs/") {
            let path: String = text[at..]
                .chars()
                .take_while(|c| c.is_ascii_alphanumeric() || matches!(c, '/' | '-' | '_' | '.'))
                .collect();
            if let Some(end) = path.find(".md") {
                let path = &path[..end + 3];
                assert!(path.contains('{') || root().join(path).exists(), "{file}: there is no {path}");
            }
        }
    }
    assert!(referred > 40, "{referred}");
}

#[test]
fn time_is_read_in_one_room() {
    let mut wrong = Vec::new();
    for (file, text) in sources("src") {
        if room_of(&file) == "time" || CLOCK_READERS.iter().any(|(reader, _)| file == *reader) {
            continue;
        }
        for (i, line) in code_lines(&text).iter().enumerate() {
            for word in ["Instant::now", "SystemTime::now", "thread::sleep", "UNIX_EPOCH.elapsed"] {
                if line.contains(word) {
                    wrong.push(format!("{file}:{}: `{word}`", i + 1));
                }
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "time comes from the clock of `time`, which can be simulated; else a scenario is no ordinary test:\n{}",
        wrong.join("\n")
    );
}

/// Files that may write to a stream: all else of the program hands its words to one of them.
const WRITERS: &[&str] = &["src/cli/output.rs", "src/cli/detach.rs", "src/cli/printed.rs", "src/cli/progress.rs"];

#[test]
fn nothing_is_written_and_nothing_observes_in_a_thread_that_acts() {
    let mut wrong = Vec::new();
    for (file, text) in sources("src") {
        for (i, line) in code_lines(&text).iter().enumerate() {
            let streams = ["println!", "print!", "io::stdout()", "io::stderr()"];
            let writes = !WRITERS.contains(&file.as_str()) && streams.iter().any(|word| line.contains(word));
            // `attach` hangs an observer on a tap; `observe` is for tests and measurements.
            if writes || line.contains("hub().observe(") || line.contains("hub.observe(") {
                wrong.push(format!("{file}:{}: `{}`", i + 1, line.trim()));
            }
        }
    }
    assert!(wrong.is_empty(), "whoever acts waits for a reader here, see `session/tap.rs`:\n{}", wrong.join("\n"));
}

#[test]
fn every_code_is_used_and_explained() {
    let text = std::fs::read_to_string(root().join("src/model/codes.rs")).expect("codes.rs is there");
    let list = text.split("\ncodes! {").nth(1).and_then(|t| t.split("\n}\n").next()).expect("the list of codes");
    let names: Vec<&str> = list
        .lines()
        .filter_map(|line| line.trim().split_once(" = \""))
        .map(|(name, _)| name)
        .filter(|name| {
            !name.is_empty() && name.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_')
        })
        .collect();
    assert_eq!(names.len(), davit::model::codes::PAGES.len(), "codes.rs was not understood");
    let code: String = sources("src")
        .into_iter()
        .filter(|(file, _)| file != "src/model/codes.rs")
        .map(|(_, text)| code_lines(&text).join("\n"))
        .collect();
    let words: BTreeSet<&str> = code.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
    let unused: Vec<&&str> = names.iter().filter(|name| !words.contains(**name)).collect();
    assert!(unused.is_empty(), "codes that nothing reports; remove them, or report them: {unused:?}");
    for page in davit::model::codes::PAGES {
        assert!(page.text.len() > 60, "{} has no real page", page.code);
        assert!(
            !page.title.is_empty() && !page.title.ends_with('.'),
            "{}: the title is one line without a stop",
            page.code
        );
    }
}

#[test]
fn the_reader_of_imports_reads() {
    let text = "use crate::{model::{A, b::C}, system, plan::x};\n// crate::lang\nlet s = \"crate::cli\";\nfn f() { \
                crate::stack::go() }\nlet q = '\"'; crate::draw::x();\nlet r = r#\"crate::app\"#; crate::time::y();";
    let rooms: Vec<(usize, String)> = rooms_named(text, "crate::");
    let names: Vec<&str> = rooms.iter().map(|(_, r)| r.as_str()).collect();
    assert_eq!(names, ["model", "system", "plan", "stack", "draw", "time"]);
    assert_eq!(rooms[3].0, 4);
}
