//! What is written and is no key: words with a meaning of their own that stand where a name could.

use super::Languages;

/// Such a word.
#[derive(Debug)]
pub struct OwnWord {
    /// The word.
    pub name: &'static str,
    /// The kind of file whose page tells of it.
    pub file: &'static str,
    /// Where it stands, and with what.
    pub form: &'static str,
    /// What it means.
    pub doc: &'static str,
    /// A line with it, as Lua has it where it can be written in Lua.
    pub example: &'static str,
    /// In which languages it can be written.
    pub language: Languages,
}

const fn word(
    name: &'static str,
    file: &'static str,
    form: &'static str,
    doc: &'static str,
    example: &'static str,
) -> OwnWord {
    OwnWord { name, file, form, doc, example, language: Languages::All }
}

/// All of them.
pub static OWN_WORDS: &[OwnWord] = &[
    OwnWord {
        language: Languages::Yaml,
        ..word(
            "self",
            "deployment",
            "the component in the ports of `settled_by`",
            "The component itself whose operation is called: a type does not know what its components are called.",
            "settled_by: { above: [self.height, 0.3] }",
        )
    },
    word(
        "_default",
        "configurations",
        "the component in an entry of `pre_conf_state` or `post_conf_state`",
        "Every component of the file that the list does not name. It stands once in a list; who produces data is stopped before who \
         consumes it, and started after.",
        "post_conf_state = { '_default:running' }",
    ),
    word(
        "initial",
        "coordinator",
        "the `src` of a transition",
        "The state that is entered first: a transition from `initial` is taken when the state around it is entered.",
        "src = \"initial\", tgt = \"idle\"",
    ),
    word(
        "e_after",
        "coordinator",
        "an event of a transition, `e_after(SECONDS)`",
        "The time event: so many seconds after what the transition leaves was entered.",
        "events = { \"e_after(0.5)\" }",
    ),
    word(
        "e_at",
        "coordinator",
        "an event of a transition, `e_at(SECONDS)`",
        "The time event: so many seconds after the coordinator began.",
        "events = { \"e_at(20)\" }",
    ),
    word(
        "e_done",
        "coordinator",
        "an event of a transition",
        "Raised by a state without states in it once it is complete: what it does while it is active (`doo`) has ended, or there is none.",
        "events = { \"e_done\" }",
    ),
    word(
        "condition",
        "monitors",
        "a word of the monitors' language with its arguments",
        "What is true or false at every instant: of a monitor (`when`), of a configuration (`holds`), of an operation (`settled_by`). \
         `davit explain --keys` lists the words; `above`, `in_state` and `all` are some.",
        "above(\"A.x\", 2.0)",
    ),
    word(
        "signal",
        "monitors",
        "a number, a port, a part of one, or a word with its arguments",
        "What is a number at every instant, and is compared in a condition: `\"A.x\"`, `\"A.x[0]\"`, `age(\"A.x\")`.",
        "above(age(\"A.x\"), 0.1)",
    ),
];
