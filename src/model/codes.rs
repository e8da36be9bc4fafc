//! Every code a finding or an operational error may carry, in one list, with the page `davit explain CODE` prints.
//!
//! A code is never reused for another meaning. Each page says what happened, why it is refused, and what to do.

/// A stable code, `area::name`; printed as `davit::area::name`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Code(pub &'static str);

impl std::fmt::Display for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0)
    }
}

impl std::fmt::Debug for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0)
    }
}

impl serde::Serialize for Code {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0)
    }
}

/// A code with its page.
#[derive(Debug, Clone, Copy)]
pub struct Page {
    /// The code.
    pub code: Code,
    /// One line.
    pub title: &'static str,
    /// What happened, why it is refused, what to do.
    pub text: &'static str,
}

macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident = $code:literal, $title:literal, $text:literal;)*) => {
        $(
            #[doc = $title]
            pub const $name: Code = Code($code);
        )*

        /// All pages, in the order of the list.
        pub const PAGES: &[Page] = &[$(Page { code: $name, title: $title, text: $text }),*];
    };
}

codes! {
    // ---- text and files (lang) -------------------------------------------------------------------------------------
    // ---- deployment and types --------------------------------------------------------------------------------------
    // ---- configurations and plans ----------------------------------------------------------------------------------
    // ---- stack -----------------------------------------------------------------------------------------------------
    // ---- coordinators (statecharts) --------------------------------------------------------------------------------
    CHART_NO_INITIAL = "chart::no_initial",
        "The chart does not say where it begins",
        "A statechart is entered at the connector `initial` of its root, and this one has none. It is made where a transition with `src = \"initial\"` is written in the root. Write one to the state in which the coordinator begins.";
    CHART_INITIAL_STATE = "chart::initial_is_a_state",
        "A state is called `initial`",
        "`initial` is the name of the connector at which a composite state is entered. A state of that name cannot play this part: rFSM reports it, and the composite cannot be entered as meant. Give the state another name and write a transition from `initial` to it.";
    CHART_TOO_DEEP = "chart::too_deep",
        "States are nested too deeply",
        "Statecharts nest a handful of levels; a depth beyond the limit is taken for a mistake or an attack, since compiling and stepping go through the levels one by one. Flatten the chart, or split it into subsystems.";
    CHART_TWO_NODES = "chart::two_nodes",
        "Two states or connectors of one name in the same state",
        "Within a state every child has its own name, or references to it would be ambiguous. Rename one of them.";
    CHART_RESERVED = "chart::reserved_name",
        "A state has a name that rFSM uses itself",
        "rFSM keeps its own fields beside the children of a state (`type`, `new`, `rfsm`; in the root also `err`, `warn`, `info`, `dbg`, `getevents`, `idle_hook`). A child of that name is overwritten or breaks the model there, so it is refused here. Choose another name.";
    CHART_DOO_IN_COMPOSITE = "chart::doo_in_composite",
        "A composite state has an activity",
        "Only leaves run an activity (`doo`). rFSM reports this as an error and then never runs it. Move the activity into a state inside.";
    CHART_BAD_PRIORITY = "chart::bad_priority",
        "A priority number is not finite",
        "Transitions of one state are tried by falling priority number `pn`. Infinity and not-a-number have no place in that order. Write a finite number.";
    CHART_MISSING_END = "chart::missing_end",
        "A transition has no source or no target",
        "Every transition names the node it starts from (`src`) and the one it leads to (`tgt`). Write the missing one.";
    CHART_INTERNAL = "chart::internal_transition",
        "A transition is marked internal",
        "rFSM rejects `tgt = \"internal\"`: it has no transitions that leave no state. Let the transition end in a state, or put a state beside the one meant and move the reaction there.";
    CHART_UNKNOWN_STATE = "chart::unknown_state",
        "A transition names a state that does not exist",
        "A name without a dot is looked up in the state in whose table the transition is written; `.a.b` is a path from there; `a.b` and `root.a.b` are paths from the root. Nothing of that name was found. Correct the spelling or write the whole path.";
    CHART_FROM_ROOT = "chart::from_root",
        "A transition starts at the root",
        "The root is never left, and rFSM fails when such a transition is taken. Put the states into one state inside the root and start the transition there.";
    CHART_TARGET_WITHOUT_INITIAL = "chart::target_without_initial",
        "A transition ends at a composite state without initial connector",
        "Entering a state that has states in it means entering one of them, and this one does not say which. Write a transition from `initial` inside it, or name one of the states inside as the target.";
    CHART_CONNECTOR_CIRCLE = "chart::connector_circle",
        "Connectors lead round in a circle",
        "A path through connectors is searched to its end before anything happens. A circle of them that no guard holds has no end; rFSM overflows its stack. Break the circle, or put a state into it.";
    CHART_LONG_CHAIN = "chart::long_chain",
        "Too many connectors one after the other",
        "A path through connectors is taken in one step, and the search for it is bounded. Shorten the chain of connectors, or put states into it.";
    CHART_NO_OUTGOING = "chart::no_outgoing",
        "No transition leads out",
        "rFSM warns of every node without outgoing transitions. A connector without one is a dead end: no path through it is ever taken. A state that nothing leads out of, neither from itself nor from a state around or inside it, is never left once entered. Write the transition that is missing, or ignore this for an intended final state.";
    CHART_UNREACHABLE = "chart::unreachable",
        "A state is never entered",
        "No sequence of events leads here from the initial connector of the root. Most often a transition to it is missing or names another state. Write the transition or take the state out.";
    CHART_ORDER_DECIDES = "chart::order_decides",
        "The order of writing decides between two transitions",
        "Two transitions of one node have the same priority number and can be triggered by the same event. Which one is taken follows from rFSM's unstable sort: with up to three transitions mostly the first written, with more not even that. Give them different `pn`.";
    CHART_SHADOWED = "chart::shadowed",
        "A transition is never taken",
        "A transition that any event triggers is tried before it and always succeeds. Give this one a higher `pn`, or let the other one list its events.";
    CHART_NOT_ENTERED = "chart::entry_waits",
        "The chart cannot be entered by itself",
        "All paths from the initial connector of the root list events. The chart is entered in its first step, with the events that happen to wait then; without the right one entering fails. Take the events off one path.";
    CHART_ENDLESS = "chart::endless",
        "States complete in a circle",
        "A state without activity completes as soon as it is entered, and its completion event alone triggers the next transition. Here this leads round in a circle: the chart never comes to rest, rFSM's `run` would never return, and a coordinator would stop after its bound. Let one transition of the circle wait for another event.";
    CHART_TIMER_AT_CONNECTOR = "chart::timer_at_connector",
        "A time event at a connector",
        "A time event counts from the entry of the state its transition starts at. Connectors are passed, not entered, so it is never raised. Start the transition at a state.";
    CHART_TWO_TIMERS = "chart::two_timers",
        "Two time events at one state",
        "rFSM's time events know one time a state: of several, only the one written last is ever raised. Put the shorter time into a state inside, or a longer one into a state around.";
    CHART_NEVER_DONE = "chart::never_done",
        "A completion event that never comes",
        "`e_done` is raised for leaves alone, under the leaf's full name (`e_done@root.a.b`). States with states in them, connectors and names that are no state never complete. Wait for the leaf instead, or raise an event of your own.";
    CHART_ROOT_EXIT = "chart::root_exit",
        "The root is never left",
        "Exit actions of the root never run, and a configuration in force while the root is active is never undone by the coordinator. Put them into a state inside.";
    CHART_RUNAWAY = "chart::runaway",
        "The coordinator does not come to rest",
        "After an event a coordinator takes transitions until nothing is left to do. This one went on past the bound, and what it was doing was stopped there; it goes on with the next event. Completion events or time events lead round in a circle: look at the states named and let one transition wait for another event.";
    // ---- run time: platform, configurator, session -----------------------------------------------------------------
    // ---- youbot and standard libraries -----------------------------------------------------------------------------
    // ---- command line ----------------------------------------------------------------------------------------------
    CLI_UNKNOWN_CODE = "cli::unknown_code", "there is no finding with this code",
        "`davit explain` was asked about a code that no finding carries. Codes are printed with every finding, as \
         `davit::area::name`; the leading `davit::` may be left out. `davit explain` without a code lists all of them.";
    CLI_NOT_RUNNING = "cli::not_running", "there is no such running deployment",
        "The command talks to a running deployment through its control socket, and none of that name (or none at all) \
         answers. Start one with `davit deploy FILE`. Sockets are looked for in $XDG_RUNTIME_DIR/davit: a deployment \
         started by another user, or with another value of that variable, is not seen.";
    CLI_SEVERAL_RUNNING = "cli::several_running", "several deployments are running",
        "The command was given no name and more than one deployment is running, so it is not known which is meant. \
         Give the name: `davit status NAME`, `davit event E --on NAME`.";
    CLI_NO_ANSWER = "cli::no_answer", "the running deployment does not answer",
        "The control socket is there and something listens on it, but no answer came in time, or the connection was \
         closed. The deployment may just have ended: `davit status` tells. If it is stuck, `davit shutdown --force` \
         takes it down without its coordinator.";
    CLI_REFUSED = "cli::refused", "the running deployment refused",
        "The running deployment understood the request and said no; the message is its own. An unknown event or \
         configuration is refused at once; a wait that ran out is told as such, and the request itself may still be \
         answered: `davit log` shows it.";
}

/// The page of `code`, written with or without the leading `davit::`.
pub fn page(code: &str) -> Option<&'static Page> {
    let code = code.strip_prefix("davit::").unwrap_or(code);
    PAGES.iter().find(|page| page.code.0 == code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_unique_and_explained() {
        for (i, page) in PAGES.iter().enumerate() {
            assert!(PAGES[i + 1..].iter().all(|other| other.code != page.code), "{} stands twice", page.code);
            assert!(page.code.0.split("::").count() == 2, "{} is not area::name", page.code);
            assert!(page.text.len() > 60, "{} has no real page", page.code);
        }
    }
}
