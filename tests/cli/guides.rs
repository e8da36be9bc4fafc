//! The guides say what is so: their blocks are run, as they stand.
//!
//! What becomes of a block stands in a comment before it:
//!
//! * `script: runs`, `script: fails`, `script: sweep` with options of the command line: a script, which ends well, or with 1; what stands in a
//!   block `console` behind it is printed.
//! * `check: FILE`: a file of examples/pair but for its comments, which is accepted so, and with which the story there ends well.
//! * `part of: FILE`: lines of a file of examples/pair.
//! * `file: FILE`: a file of this project, whole.
//! * `story: FILE`: all that a script of this project prints in simulated time.
//! * `types`: what a deployment may have under `types`.
//! * `console: FILE`: what commands print while that file of examples/pair is deployed, but for times.

use crate::demo::{Demo, at_home};
use crate::hierarchy::{DeployedCell, cell, example, timeless};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// A block of code.
struct Block {
    /// What stands in the comment before it.
    mark: Option<String>,
    /// What it is written in.
    language: String,
    text: String,
}

fn blocks(guide: &str) -> Vec<Block> {
    let text = std::fs::read_to_string(format!("{ROOT}/docs/{guide}.md")).expect("the guide");
    let (mut blocks, mut mark, mut lines) = (Vec::new(), None, text.lines());
    while let Some(line) = lines.next() {
        let bare = line.trim_start();
        let indent = line.len() - bare.len();
        if let Some(language) = bare.strip_prefix("```") {
            let inside = lines.by_ref().take_while(|line| line.trim_start() != "```");
            let text = inside.map(|line| format!("{}\n", line.get(indent..).unwrap_or_default())).collect();
            blocks.push(Block { mark: mark.take(), language: language.to_owned(), text });
        } else {
            mark = bare.strip_prefix("<!-- ").and_then(|rest| rest.strip_suffix(" -->")).map(str::to_owned);
        }
    }
    blocks
}

/// Runs what is marked; what it printed.
fn done(mark: &str, text: &str) -> String {
    let (what, of) = mark.split_once(": ").unwrap_or((mark, ""));
    match what {
        "script" => scripted(of, text),
        "check" => {
            let said = |text: &str| -> Vec<String> {
                let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
                lines.map(str::to_owned).collect()
            };
            assert_eq!(said(text), said(&example(of)), "{of}");
            let demo = cell();
            demo.write(of, text);
            demo.write("story.lua", &example("story.lua"));
            for command in [&["check", of][..], &["run", "story.lua", "--clock", "simulated"]] {
                let ran = demo.run(command);
                assert_eq!(ran.code, 0, "{command:?}: {}{}", ran.out, ran.err);
                assert!(!ran.err.contains('⚠'), "{}", ran.err);
            }
            String::new()
        }
        "part of" => {
            let file = example(of);
            let mut lines = file.lines().map(str::trim);
            for line in text.lines().map(str::trim) {
                assert!(lines.any(|own| own == line), "`{line}` does not stand in {of}, or not there");
            }
            String::new()
        }
        "file" => {
            let file = std::fs::read_to_string(format!("{ROOT}/{of}")).expect("the file");
            assert_eq!(text, file, "{of}");
            String::new()
        }
        "story" => {
            let ran = at_home(&["run", of, "--clock", "simulated"]);
            let (command, printed) = text.split_once('\n').expect("a command, and what it prints");
            assert_eq!(command, format!("$ davit run {of} --clock simulated"));
            assert_eq!((ran.code, ran.out.as_str()), (0, printed), "{}", ran.err);
            String::new()
        }
        "types" => {
            let demo = Demo::new();
            let rest = "davit: 1\nname: typed\nplatform: simulated\nconfigurations: []\ncoordinator: on.lua\n\
                        deploy: { event: e_start, up: on, within_s: 5 }\nshutdown: { event: e_shutdown, down: idle, within_s: 5 }\n";
            let on = "return state { idle = state {}, on = state {}, trans { src = 'initial', tgt = 'idle' },
                trans { src = 'idle', tgt = 'on', events = { 'e_start' } }, trans { src = 'on', tgt = 'idle', events = { 'e_shutdown' } } }";
            demo.write("on.lua", on);
            demo.write("typed.yaml", &format!("{rest}{text}"));
            let ran = demo.run(&["check", "typed.yaml"]);
            assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
            String::new()
        }
        "console" => {
            let deployed = DeployedCell::of(cell(), of);
            for shown in text.split("$ davit ").skip(1) {
                let (command, printed) = shown.split_once('\n').expect("a command, and what it prints");
                let args: Vec<&str> = command.split_whitespace().collect();
                assert_eq!(deployed.shows(&args), timeless(printed.trim_end()), "davit {command}");
            }
            String::new()
        }
        _ => panic!("nobody knows what to do with a block that is marked `{mark}`"),
    }
}

fn scripted(mark: &str, text: &str) -> String {
    let demo = Demo::new();
    demo.write("story.lua", &text.replace("../deployments", &format!("{ROOT}/deployments")));
    let mut words = mark.split_whitespace();
    let first = words.next();
    let more: Vec<&str> = words.collect();
    let command: &[&str] = match first {
        Some("sweep") => &["sweep", "story.lua"],
        _ => &["run", "story.lua", "--clock", "simulated"],
    };
    let ran = demo.run(&[command, &more].concat());
    assert_eq!(ran.code, i32::from(first != Some("runs")), "{text}: {}{}", ran.out, ran.err);
    ran.out + &ran.err
}

/// All blocks of a guide; how many there are.
fn executed(guide: &str, may_be_unmarked: bool) -> usize {
    let (mut printed, mut all) = (None, 0);
    for Block { mark, language, text } in blocks(guide) {
        match (mark, printed.take()) {
            (Some(mark), _) => {
                printed = Some(done(&mark, &text));
                all += 1;
            }
            (None, Some(printed)) if language == "console" => {
                for line in text.lines().filter(|line| !line.starts_with("$ ") && !line.contains('…')) {
                    let line = line.trim_end();
                    assert!(printed.contains(line), "not printed: {line}\n{printed}");
                }
            }
            _ => assert!(may_be_unmarked, "nobody knows whether this is so:\n{text}"),
        }
    }
    all
}

#[test]
fn the_blocks_on_scripts() {
    assert!(executed("scripts", true) > 4);
}

#[test]
fn the_blocks_on_coordinators() {
    assert!(executed("coordinators", true) > 1);
}

#[test]
fn the_blocks_on_composition() {
    assert!(executed("composition", false) > 4);
}

#[test]
fn the_blocks_on_the_youbots() {
    assert!(executed("youbot", false) > 0);
}
