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
    TEXT_NO_FILE = "text::no_file", "there is no such file",
        "A file that was asked for, or that a deployment names, does not exist. Files named in a deployment are looked \
         for from the folder of the deployment file. Correct the path; near names in that folder are suggested.";
    TEXT_UNREADABLE = "text::unreadable", "a file cannot be read",
        "The file exists, but it is a folder, or the system refuses to let it be read. Check its permissions and that \
         the path names a text file.";
    TEXT_TOO_LARGE = "text::too_large", "a file is too large",
        "Files are refused by their size before they are read, so that a wrong path (a log, a disk image) cannot fill \
         the memory. Check that it is the right file; a generated deployment can be split into several files.";
    TEXT_NOT_UTF8 = "text::not_utf8", "a text is not UTF-8",
        "All texts are read as UTF-8, and this one holds bytes that belong to no character. It may be saved in another \
         encoding, or be no text at all. Save it as UTF-8.";
    TEXT_UNKNOWN_LANGUAGE = "text::unknown_language", "the name of a file does not tell its language",
        "The ending of a file says how it is read: `.lua` as Lua, `.yaml` or `.yml` as YAML; a deployment is always \
         YAML. Rename the file, or name the right one.";
    TEXT_SYNTAX = "text::syntax", "a text does not parse",
        "The text is not Lua, or not YAML, at the place shown; the message is the parser's own. The mistake often stands \
         just before that place: a bracket or a quote left open, a missing comma, a tab in YAML's indentation.";
    TEXT_TOO_DEEP = "text::too_deep", "a text is nested too deeply",
        "Tables inside tables are read up to a fixed depth, far beyond what any configuration or coordinator needs, so \
         that no text can exhaust the stack of the program. A bracket is probably not closed, or a table contains \
         itself.";
    TEXT_TOO_MANY_NODES = "text::too_many_values", "a text unfolds to too many values",
        "Aliases in YAML and loops in Lua can make millions of values out of a few lines. Their number is bounded, so \
         that no text can exhaust the memory. Write less of them, or split the file.";
    TEXT_SEVERAL_DOCUMENTS = "text::several_documents", "a YAML file holds several documents",
        "A line `---` begins a new YAML document. Davit reads one document a file and does not guess which one is \
         meant. Put the others into files of their own.";
    TEXT_TAG = "text::tag", "a YAML tag means nothing here",
        "Tags such as `!include` or `!!binary` ask the reader for something that Davit does not do. Remove the tag; the \
         type of a value follows from the place where it stands.";
    TEXT_DUPLICATE_KEY = "text::duplicate_key", "a key stands twice",
        "The same key stands twice in one table, or the same file twice in one list. Which of the two was meant cannot \
         be known, and silently taking the last one hides mistakes. Keep one of them.";
    TEXT_UNKNOWN_KEY = "text::unknown_key", "a key is not known",
        "A table has a key that means nothing at this place. It is refused rather than ignored, since it is nearly \
         always misspelt or stands one level too high or too low. The nearest known key is suggested.";
    TEXT_MISSING_KEY = "text::missing_key", "a required key is missing",
        "A table lacks a key that it cannot do without. The help shows a line to add. Required keys of a deployment are \
         davit, name, platform, libraries or types, configurations, coordinator, deploy, shutdown.";
    TEXT_WRONG_TYPE = "text::wrong_type", "a value is of the wrong kind",
        "A value is, say, a number where a text is wanted, or a table where a list is wanted. In YAML, a text that looks \
         like a number or a truth value needs quotes; in Lua, a list has no holes and does not mix with named values.";
    TEXT_BAD_NAME = "text::bad_name", "a name is not formed as it must be",
        "Names consist of letters, digits and `_` and do not start with a digit; a member is written `Component.member`, \
         a subsystem's component `left/Dynamics`. Names appear in events, sockets and logs, where other characters have \
         a meaning of their own. Change the name, everywhere it is used.";
    TEXT_BAD_VALUE = "text::bad_value", "a value is not one of those allowed",
        "The place takes one of a few words, or a number in a range, and this is another. The help names the nearest \
         word or the form that is wanted.";
    TEXT_BAD_TIME = "text::bad_time", "a time is not a sensible number of its unit",
        "Times are written as plain numbers; the unit belongs to the key: `timeout` and `within` are in seconds, keys \
         ending in `_s` in seconds, in `_ms` in milliseconds. A time is more than zero and at most a day: anything else \
         is taken for a mistake in the unit. Write `timeout: 0.5`, not `500ms`.";
    TEXT_NOT_FINITE = "text::not_finite", "a number is NaN or infinite",
        "Values that are not finite numbers are refused wherever they enter: no limit, comparison or controller treats \
         them sensibly. Look at the calculation that led to it, such as a division by zero.";
    TEXT_BAD_PARAMETER = "text::bad_parameter", "a parameter on the command line cannot be read",
        "Parameters are given as `--set name=value` or `--set table.key=value`. The name is a name of Lua, the value is \
         read as YAML: `--set gain=0.5`, `--set mode=fast`, `--set weights=[1.0, 2.0]`.";
    TEXT_UNKNOWN_PARAMETER = "text::unknown_parameter", "nothing reads a parameter",
        "A parameter was given, under `with:` or by `--set`, that no Lua file of the deployment reads. It is most likely \
         misspelt, and the value meant for it would silently stay the old one. Correct the name, or remove it.";
    TEXT_NOTHING = "text::nothing", "a file does not contain what it is named for",
        "A file listed under `configurations` makes no configuration, or one under `coordinator` returns no state. \
         A file of configurations calls `ConfiguratorConf { name = Configuration { … } }`, a coordinator's file ends \
         with `return state { … }`. Perhaps the two files are exchanged.";
    LUA_BYTECODE = "lua::bytecode", "a file is compiled Lua",
        "Only Lua texts are read. Compiled Lua can break out of every sandbox, and it has no lines to point at. Give the \
         source file.";
    LUA_ERROR = "lua::error", "a Lua file fails while it runs",
        "A Lua file is run once, from its beginning to its end, and this one raised an error on the way; the message is \
         Lua's own. What had been made before is not used, since a file counts as a whole or not at all.";
    LUA_UNDEFINED = "lua::undefined", "a name is not defined",
        "A Lua file uses a name that nothing defines. In plain Lua it would be nil and the mistake would show much later, \
         or never. Correct the spelling (the nearest name is suggested), define it in the file, or give it as a \
         parameter: `with:` in the deployment, `--set name=value` on the command line.";
    LUA_CLOSED = "lua::closed", "a part of Lua is closed here",
        "Lua files describe a system and are read by every command, so they may not touch files, processes, the network \
         or the clock, load other code, or call functions that no budget can stop (patterns). Write the data down, or \
         give it as a parameter.";
    LUA_INSTRUCTIONS = "lua::instructions", "a Lua file runs too long",
        "A Lua file may take a fixed number of instructions and a fixed time, far more than any list of changes needs. \
         This one took more: most likely a loop that does not end. Protected calls and coroutines do not lift the \
         bound.";
    LUA_MEMORY = "lua::memory", "a Lua file needs too much memory",
        "A Lua file may hold a fixed number of bytes. This one grew past it: look for a table or a text that grows in a \
         loop.";
    LUA_ARGUMENTS = "lua::arguments", "a constructor was called with other arguments than it takes",
        "The words of the language take fixed arguments: `create(component, type, { … })`, `destroy(component)`, \
         `connect(from, to, policy)`, `disconnect(from, to)`, `property_set(property, value)`, `port_write(port, \
         value)`, `operation_call(operation, …):undo(operation, …)`; `Configuration`, `ConfiguratorConf`, `state`, \
         `trans` and `conn` take one table.";
    LUA_UNUSED = "lua::unused", "a change stands in no configuration",
        "A Lua file makes a change that no configuration holds, so it would silently never happen. Put it inside the \
         braces of a `Configuration`, or remove it.";
    LUA_BAD_RETURN = "lua::bad_return", "a Lua file returns something unexpected",
        "A coordinator's file returns the state made by `state { … }`. A file of configurations returns nothing, or what \
         `ConfiguratorConf` made. Anything else has no meaning here.";
    LUA_PRINT = "lua::print", "a Lua file prints",
        "A Lua file called `print`. Files are read by every command and may not write into its output, so what was \
         printed is shown as a note. Remove the call when it is no longer needed.";
    // ---- deployment and types --------------------------------------------------------------------------------------
    DEPLOY_MONITORS_LATER = "deploy::monitors_later", "monitors are not read yet",
        "The deployment names files of monitors. This version does not evaluate them, so nothing will raise their \
         events. Until then a component can watch its ports and raise events through an event port.";
    TYPE_BAD_TYPE = "type::bad_type", "this is not a type of values",
        "Types are `bool`, `int`, `float`, `string`, for ports also `event`, arrays `\"float[3]\"` and `\"float[]\"` (in \
         quotes, since YAML has brackets of its own), and records `{x: float, y: float}`. Anything else cannot be \
         checked, so it is refused.";
    TYPE_BAD_DEFAULT = "type::bad_default", "a property's default or limits contradict its type",
        "The default of a property must be of its type and lie within `min` and `max`, and `min` may not exceed `max`: \
         a component could otherwise never be created without breaking its own rules. Correct the declaration.";
    // ---- configurations and plans ----------------------------------------------------------------------------------
    CONF_KEYED_ENTRIES = "conf::keyed_entries", "two keyed entries in a state list have no order",
        "A state list is applied in its order, but the named entries of a Lua table have none: with two or more keys, \
         chance would decide which component changes first. Write them as a list: `{ 'compA:running', \
         '_default:stopped' }`. One key alone is fine, and comes after the entries.";
    CONF_DEFAULT_TWICE = "conf::default_twice", "`_default` stands twice in a state list",
        "`_default` stands for every component that the list does not name, so it can be brought to one state only. \
         Keep one of the entries, or name the components.";
    CONF_BAD_STATE = "conf::bad_state", "this is not a run state that can be demanded",
        "Run states are `unconfigured`, `stopped` and `running`; the names of RTT, ROS 2 and microblx are understood as \
         well. `faulted` cannot be demanded: components get there by themselves. An entry of a state list is written \
         `component:state`.";
    CONF_UNKNOWN_CHANGE = "conf::unknown_change", "there is no such change",
        "The changes are create, destroy, connect, disconnect, property_set, port_write and operation_call, one a list \
         entry. Everything else a configuration does is said by its state lists.";
    CONF_UNNAMED = "conf::unnamed", "a configuration has no name",
        "A configuration is asked for by its name, and this one has none that could be used: it is not held by \
         `ConfiguratorConf`, or another one of the same name took its place in the table (Lua keeps the last). One \
         configuration alone in its file takes the file's name.";
    CONF_DUPLICATE = "conf::duplicate", "two configurations have the same name",
        "A request names one configuration, so names are unique in a deployment, over all its files. Rename one of \
         them, and the requests for it.";
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
    CHART_FUNCTION = "chart::function", "a coordinator contains a function",
        "Guards, actions and activities written as Lua functions need `trusted: true` and come in a later version; what \
         they do could not be verified. A pure coordinator raises names of events where rFSM has functions: the work is \
         done by components, conditions are watched by monitors, switches are made by configurations.";
    CHART_UNNAMED = "chart::unnamed", "a state has no name",
        "A state inside a state is written `name = state { … }`: transitions refer to it by that name. Without one it \
         could never be entered.";
    CHART_RESERVED_NAME = "chart::reserved_name", "a state has a name that means something else",
        "The words entry, exit, doo, config, doc, type, new and rfsm have a meaning in a state's table, so a state of \
         that name could not be told from it, or breaks references in rFSM. Choose another name.";
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
