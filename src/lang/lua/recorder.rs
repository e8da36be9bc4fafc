//! What constructors record while a Lua file runs.

use crate::functions::{place_of, text_of};
use crate::lang::params::Params;
use crate::lang::tokens::tokens;
use crate::lang::tree::{Cx, Kind, Node, Reading};
use crate::limits;
use crate::model::{Code, Finding, Origin, codes};
use rustc_hash::{FxHashMap, FxHashSet};
use std::cell::RefCell;
use std::rc::Rc;

/// The recorder as the constructors hold it.
pub type SharedRecorder = Rc<RefCell<Recorder>>;

/// One thing a constructor made.
pub struct Recorded {
    /// The constructor.
    pub verb: &'static str,
    /// Where it was called.
    pub origin: Origin,
    /// What it was given.
    pub node: Option<Node>,
    /// In how many places it stands.
    pub uses: u32,
}

/// A table that a statechart constructor was given.
#[derive(Clone, Copy)]
pub struct Classed {
    /// `state`, `trans` or `conn`.
    pub class: &'static str,
    /// Where.
    pub origin: Origin,
    /// The how-manieth: what was made earlier was written earlier.
    pub sequence: u32,
}

/// Which budget is used up, and on which line.
#[derive(Debug, Clone)]
pub struct Exhausted {
    pub code: Code,
    pub message: String,
    pub line: u32,
}

/// A name whose value is asked for, see [`Recorder::read_here`].
pub struct ReadName {
    pub path: String,
    pub called: bool,
}

/// The state of one run.
#[derive(Default)]
pub struct Recorder {
    pub cx: Cx,
    pub reading: Reading,
    pub params: Params,
    pub made: Vec<Recorded>,
    pub classed: FxHashMap<usize, Classed>,
    /// Nodes recorded so far, against [`limits::TEXT_NODES`].
    pub nodes: usize,
    /// Instructions so far, and what counts like them.
    pub instructions: u64,
    /// Set once; from then on every instruction of the file fails.
    pub exhausted: Option<Exhausted>,
    /// Whether keys stand twice in a table.
    pub has_lost: bool,
    /// Names of which it was said already that they are undefined.
    pub undefined: FxHashSet<String>,
    /// Whether the text is being parsed, not run.
    pub parsing: bool,
    /// Where files that it loads are; none: it may not load any.
    pub loads: Option<super::Loads>,
    /// Files that are being run, each loaded by the one before it.
    pub loading: Vec<String>,
    /// Calls so far on the current line, by constructor.
    line: u32,
    on_line: Vec<(&'static str, u32)>,
}

impl Recorder {
    /// One for a file.
    pub fn new(cx: Cx, reading: Reading, params: Params, loads: Option<super::Loads>) -> Self {
        Self { cx, reading, params, loads, ..Self::default() }
    }

    /// The place of a call of `word` on a line.
    pub fn call_at(&mut self, line: u32, word: &'static str) -> Origin {
        if line != self.line {
            self.line = line;
            self.on_line.clear();
        }
        let nth = match self.on_line.iter_mut().find(|(w, _)| *w == word) {
            Some((_, count)) => {
                *count += 1;
                *count
            }
            None => {
                self.on_line.push((word, 0));
                0
            }
        };
        self.cx.sources.call(self.reading.file, line, nth, word)
    }

    /// The place of a word on a line.
    pub fn word_at(&mut self, line: u32, word: &str) -> Origin {
        let line = self.cx.sources.exact_line(self.reading.file, line);
        self.cx.sources.within(line, word)
    }

    /// The place of a name on a line where its value is asked for.
    pub fn read_at(&mut self, line: u32, name: &str) -> Origin {
        self.cx.sources.read(self.reading.file, line, name)
    }

    /// How a name stands on a line where its value is asked for: with the names behind it (`base.odom`), and whether it is called.
    pub fn read_here(&self, line: u32, name: &str) -> ReadName {
        let file = self.cx.sources.file(self.reading.file);
        let tokens = tokens(&file.text[file.line(line)]);
        let Some(mut at) = tokens.iter().position(|token| token.text == name) else {
            return ReadName { path: name.to_owned(), called: false };
        };
        let mut path = name.to_owned();
        let is_word = |text: &str| text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
        while let [dot, member, ..] = &tokens[at + 1..]
            && dot.text == "."
            && is_word(member.text)
        {
            path = format!("{path}.{}", member.text);
            at += 2;
        }
        let called = tokens.get(at + 1).is_some_and(|next| ["(", "{", "\""].contains(&next.text));
        ReadName { path, called }
    }

    /// Records what a constructor made; answers its number.
    pub fn record(&mut self, verb: &'static str, origin: Origin, node: Node) -> usize {
        self.made.push(Recorded { verb, origin, node: Some(node), uses: 0 });
        self.made.len() - 1
    }

    /// What was recorded under a number, for one of its places.
    pub fn take(&mut self, index: usize) -> Node {
        self.take_or_copy(index, false)
    }

    fn take_or_copy(&mut self, index: usize, copy: bool) -> Node {
        let made = &mut self.made[index];
        let copy = copy || made.uses > 1;
        let mut node = if copy { made.node.clone() } else { made.node.take() }
            .unwrap_or_else(|| Node::new(Kind::Poison, made.origin));
        if let Kind::Made("Configuration", named, items) = &mut node.kind {
            // The only named part that constructors make: a condition.
            for entry in named.iter_mut().filter(|entry| entry.key == "holds") {
                self.fill(&mut entry.value, copy, 0);
            }
            for item in items {
                if let Kind::Handle(handle) = item.kind {
                    *item = self.take_or_copy(handle as usize, copy);
                }
            }
        }
        node
    }

    /// Whether what the file makes is lost, and no news: to names that are not defined, or where a key stands again.
    pub fn has_lost(&self) -> bool {
        self.has_lost || self.has_undefined()
    }

    /// Whether the file uses names that are not defined.
    pub fn has_undefined(&self) -> bool {
        self.undefined.iter().any(|name| !name.starts_with('\0'))
    }

    /// Counts nodes; answers whether there are too many.
    pub fn count(&mut self, nodes: usize, line: u32) -> bool {
        self.nodes += nodes;
        if self.nodes > limits::TEXT_NODES && self.exhausted.is_none() {
            self.exhausted = Some(Exhausted {
                code: codes::TEXT_TOO_MANY_NODES,
                message: format!("the file makes more than {} values", limits::TEXT_NODES),
                line,
            });
        }
        self.exhausted.is_some()
    }

    /// The finding of a budget.
    pub fn report_exhausted(&mut self, exhausted: &Exhausted) {
        let at = self.cx.sources.exact_line(self.reading.file, exhausted.line);
        let help = "a configuration file only lists what is to be changed: look for a loop that does not end or makes too much";
        self.cx.report(
            Finding::error(exhausted.code, exhausted.message.clone())
                .at(at)
                .labelled("here when it was used up")
                .help(help),
        );
    }

    /// The finding of an error that ended the run.
    pub fn report_error(&mut self, error: &mlua::Error) {
        if let Some(exhausted) = self.exhausted.take() {
            self.report_exhausted(&exhausted);
            return;
        }
        let full = text_of(error);
        let (line, message) = super::sandbox::split_line(&full);
        let line = line.or_else(|| Some(place_of(error, super::sandbox::is_file)?.1));
        let at = match line {
            Some(line) => self.cx.sources.exact_line(self.reading.file, line),
            None => self.reading.whole,
        };
        let memory = full.contains("not enough memory");
        if memory {
            let mb = limits::LUA_BYTES / 1024 / 1024;
            let finding = Finding::error(codes::LUA_MEMORY, format!("the file needs more than {mb} MB in Lua"));
            self.cx.report(
                finding.at(at).help("a configuration file only lists what is to be changed: look for what grows"),
            );
        } else if self.parsing {
            if message.contains("overflow") || message.contains("levels") || message.contains("error in error handling")
            {
                let finding = Finding::error(codes::TEXT_TOO_DEEP, format!("nested too deeply: {message}")).at(at);
                self.cx.refuse(
                    finding.help("nothing that Davit reads needs so many levels: a bracket is probably not closed"),
                );
            } else {
                let finding = super::syntax::not_lua(&mut self.cx.sources, self.reading.file, line, &message);
                self.cx.refuse(finding);
            }
        } else {
            // A name that is not defined makes other errors in its wake; the finding about it says enough.
            if self.has_undefined() && message.contains("light userdata") {
                return;
            }
            let finding = Finding::error(codes::LUA_ERROR, format!("the file fails: {message}")).at(at);
            // `above("A.x" > limit)`: both sides are there at once, and one is only the name of a signal.
            let help = match message.contains("attempt to compare") {
                true => {
                    "in Lua that is true or false at once; a signal is compared by words that take it and the bound: \
                     `above(\"A.x\", 2.0)`, `below(…)`, `at_most(…)` or `at_least(…)`"
                }
                false => "the message is Lua's own; the file must run to its end once, without errors",
            };
            self.cx.report(finding.help(help));
        }
    }
}
