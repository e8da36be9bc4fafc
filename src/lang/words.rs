//! The words of the monitor language: the same in Lua, where each is a function, and in YAML, where each is a key.

/// A word.
#[derive(Debug, Clone, Copy)]
pub struct Word {
    /// The word.
    pub name: &'static str,
    /// Its arguments, for messages, as Lua writes them.
    pub usage: &'static str,
    /// What it means.
    pub doc: &'static str,
    /// Least number of arguments.
    pub least: usize,
    /// Most arguments.
    pub most: usize,
    /// Whether it takes one list, as long as it may be.
    pub many: bool,
    /// Whether Lua also has it as a method of its first argument.
    pub method: bool,
}

const fn word(name: &'static str, usage: &'static str, doc: &'static str, least: usize, most: usize) -> Word {
    Word { name, usage, doc, least, most, many: false, method: false }
}

const fn many(name: &'static str, usage: &'static str, doc: &'static str) -> Word {
    Word { name, usage, doc, least: 1, most: usize::MAX, many: true, method: false }
}

const fn method(name: &'static str, usage: &'static str, doc: &'static str, count: usize) -> Word {
    Word { name, usage, doc, least: count, most: count, many: false, method: true }
}

/// Words that are true or false.
pub const CONDITIONS: &[Word] = &[
    word("below", "below(\"A.x\", 2.0)", "The left side is less than the right one.", 2, 3),
    word("at_most", "at_most(\"A.x\", 2.0)", "The left side is less than the right one, or equal.", 2, 3),
    word("above", "above(\"A.x\", 2.0)", "The left side is greater than the right one.", 2, 3),
    word("at_least", "at_least(\"A.x\", 2.0)", "The left side is greater than the right one, or equal.", 2, 3),
    word("equals", "equals(\"A.x\", 2.0)", "Both sides are equal.", 2, 3),
    word("differs", "differs(\"A.x\", 2.0)", "The sides are not equal, and both have a number.", 2, 3),
    word("is_true", "is_true(\"A.ready\")", "The bool is true, or the number is not 0.", 1, 1),
    word("in_state", "in_state(\"A\", \"running\")", "The component is in that run state, or is `faulted`.", 2, 2),
    word("faulted", "faulted(\"A\")", "The component is faulted.", 1, 1),
    word("silent", "silent(\"A.x\", 0.1)", "No sample has come for longer than that time (seconds).", 2, 2),
    many("all", "all { above(\"A.x\", 2.0), is_true(\"A.ready\") }", "All of these are true."),
    many("any", "any { above(\"A.x\", 2.0), faulted(\"A\") }", "At least one of these is true."),
    word("no", "no(above(\"A.x\", 2.0))", "It is not true.", 1, 1),
    method(
        "implies",
        "implies(is_true(\"A.ready\"), below(\"A.x\", 2.0))",
        "The first is not true, or the second is.",
        2,
    ),
    word("rise", "rise(above(\"A.x\", 2.0))", "It becomes true at this instant.", 1, 1),
    word("fall", "fall(above(\"A.x\", 2.0))", "It becomes false at this instant.", 1, 1),
    method(
        "once",
        "once(above(\"A.x\", 2.0), { 0, 1.5 })",
        "It was true at some instant of the interval (seconds ago).",
        2,
    ),
    method(
        "historically",
        "historically(above(\"A.x\", 2.0), { 0, 1.5 })",
        "It was true at all instants of the interval (seconds ago).",
        2,
    ),
    method(
        "since",
        "since(above(\"A.x\", 2.0), rise(is_true(\"A.ready\")), { 0, math.huge })",
        "The second was true at some instant of the interval (seconds ago), and the first at all instants after it until now.",
        3,
    ),
    method("for_at_least", "above(\"A.x\", 2.0):for_at_least(0.3)", "It has been true for that time (seconds).", 2),
    method(
        "within_last",
        "above(\"A.x\", 2.0):within_last(0.3)",
        "It was true at some instant of that time (seconds).",
        2,
    ),
];

/// Words that have a number.
pub const SIGNALS: &[Word] = &[
    word("age", "age(\"A.x\")", "Seconds since the newest sample.", 1, 1),
    word("sample_rate", "sample_rate(\"A.x\", 0.5)", "Samples in a second, over that time (1 s if left out).", 1, 2),
    word(
        "activity",
        "activity(\"control\", \"overruns\")",
        "A number of an activity: `cycles`, `overruns`, `latency` or `duration`.",
        2,
        2,
    ),
    many("norm", "norm { \"A.x[0]\", \"A.x[1]\" }", "The Euclidean norm."),
    word("difference", "difference(\"A.x\", \"B.x\")", "The first less the second.", 2, 2),
    many("min", "min { \"A.x\", \"B.x\" }", "The smallest."),
    many("max", "max { \"A.x\", \"B.x\" }", "The greatest."),
    word("abs", "abs(\"A.x\")", "The amount, without its sign.", 1, 1),
];

/// The word of that name.
pub fn find(name: &str) -> Option<&'static Word> {
    CONDITIONS.iter().chain(SIGNALS).find(|word| word.name == name)
}
