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

super::words::sent_as_shown!(Code);

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
    TEXT_NO_DEPLOYMENT = "text::no_deployment", "a file is no deployment",
        "A deployment is a file in YAML with `davit: 1`; it names the files of its coordinator, its configurations and its monitors. The file given \
         is one of those. Give the deployment instead.";
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
         that no text can exhaust the memory; so are the attributes of one XML element and the namespaces of a document. Write \
         less of them, or split the file.";
    TEXT_SEVERAL_DOCUMENTS = "text::several_documents", "a YAML file holds several documents",
        "A line `---` begins a new YAML document. Davit reads one document a file and does not guess which one is \
         meant. Put the others into files of their own.";
    TEXT_TAG = "text::tag", "a YAML tag means nothing here",
        "Tags such as `!include` or `!!binary` ask the reader for something that Davit does not do. Remove the tag; the \
         type of a value follows from the place where it stands.";
    TEXT_DUPLICATE_KEY = "text::duplicate_key", "a key stands twice",
        "The same key stands twice in one table, or the same file twice in one list. Which of the two was meant cannot \
         be known, and silently taking the last one, as Lua itself does, hides mistakes. Keep one of them.";
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
    TEXT_BAD_PARAMETER = "text::bad_parameter", "a parameter has no value, or cannot be read from the command line",
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
    LUA_HOST_MISSING = "lua::host_missing", "a model expects something from its host",
        "A coordinator with functions uses a global name that neither it nor Davit defines. rFSM models often expect such \
         names (`rtt`, `yarp`, a table of the application) from the program they were written for. Define them in a Lua \
         file and name it under `host:` in the deployment, or with `--host`.";
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
    LUA_LOGIC = "lua::logic", "Lua's own `and`, `or` or `not` stands between conditions of monitors",
        "Lua gives `and`, `or` and `not` the same meaning for every value: of two conditions, `p and q` is q, `p or q` is p, \
         and `not p` is false. Write `all { p, q }`, `any { p, q }` and `no(p)`.";
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
    TYPE_BAD_TYPE = "type::bad_type", "this is not a type of values",
        "Types are `bool`, `int`, `float`, `string`, for ports also `event`, arrays `\"float[3]\"` and `\"float[]\"` (in \
         quotes, since YAML has brackets of its own), and records `{x: float, y: float}`; a property that names an event (`raises: true`) is a `string`. Anything else cannot be \
         checked, so it is refused.";
    TYPE_BAD_DEFAULT = "type::bad_default", "a property's default or limits contradict its type",
        "The default of a property must be of its type and lie within `min` and `max`, and `min` may not exceed `max`: \
         a component could otherwise never be created without breaking its own rules. Correct the declaration.";
    COMPOSE_NOT_EXPORTED = "compose::not_exported", "something of a subsystem is touched that it does not export",
        "A deployment touches of its subsystems what they export, and nothing else: so a subsystem can be changed inside \
         without anybody outside noticing. The message says which line to add to `exports` in the subsystem's file, or under \
         which name it is exported already. Write it as if the subsystem were a component: `connect(\"left.tool_pose\", …)`.";
    COMPOSE_NOT_OWN = "compose::not_own", "a deployment acts on a component of its subsystem",
        "What is in a subsystem is made, started, stopped and removed by that subsystem's own configurations. A parent does \
         not create or destroy it, names it in no list of states, and asks for none of its configurations. Raise an event that the \
         subsystem accepts instead (`left/e_start`), and wait for what it emits.";
    COMPOSE_NAME_TAKEN = "compose::name_taken", "a name is that of a subsystem",
        "What is in a subsystem has its name before its own: `left/Dynamics`. A coordinator cannot have the name of a subsystem, \
         and no configuration one that begins with it. Give one of them another name.";
    COMPOSE_PARAMETER = "compose::parameter", "a parameter of a deployment is missing, unknown, or has a value that it does not allow",
        "Under `parameters` a deployment says what it can be given: by the deployment that it is a subsystem of, or by \
         `--set NAME=VALUE` (`--set left.NAME=VALUE` for that of a subsystem). One without a default must be given; a value is of the \
         parameter's type and within its limits.";
    COMPOSE_UNKNOWN = "compose::unknown", "composition names something that is not there",
        "An export names a member of a component that no configuration of its file creates, `leaving` or `exports.from` name an event \
         that is not among those that the deployment emits or accepts, `activities` of a subsystem name an activity that is not there, or \
         a coordinator raises or waits for an event of a subsystem that this neither accepts nor emits. Correct the name.";
    COMPOSE_DIFFERS = "compose::differs", "a subsystem does not fit the deployment",
        "One platform counts for all of a deployment, and a type has one meaning in it: where two files say otherwise, nobody could tell \
         what runs. Write the same in both.";
    COMPOSE_CIRCLE = "compose::circle", "a deployment is a part of itself",
        "A subsystem's file names, directly or by others, the file that names it. Nothing could ever be built of that. Take one of \
         them out.";
    COMPOSE_WORD = "compose::word", "an event has a name that is told by itself",
        "`up`, `down`, `failed` and `stranded` are told to a parent of each of its subsystems without anybody raising them \
         (`left/up`), and so is what ends in `.ignored`. Answers (`park.ok`) come to who asked, and what is called like a configuration asks for it. A deployment \
         cannot emit or accept an event called so. Give it another name.";
    COMPOSE_NOT_DOWN_AT_FIRST = "compose::not_down_at_first", "a subsystem is not down before it is begun",
        "A deployment is down when all its coordinators are, those of its subsystems too. A subsystem that does not begin in the state that its file \
         names in `shutdown: { down }` is not down before it is begun, or ended: a parent that comes to where it is down without either is stopped \
         without its coordinator. Let the subsystem begin in that state, or let its parent end it on every way down, also where it was not begun.";
    COMPOSE_UNBEGUN = "compose::unbegun", "nobody begins a subsystem",
        "A subsystem is begun by the event that its file names in `deploy: { event }`, raised by a coordinator of its parent with the subsystem's \
         name before it (`left/e_start`). No coordinator raises that of this one: it is never there, what it exports neither, and nothing of \
         its file ever runs. Raise the event in the bring-up and wait for `left/up`, or leave the subsystem out.";
    COMPOSE_SAFETY = "compose::safety", "a safety event does not reach a subsystem with actuators",
        "A safety event is given at once to every subsystem, to any depth, that declares one of the same name under `safety`. This \
         one has actuators and none of that name, so it would move on through an emergency. Declare it there, and let it lead to a safe \
         configuration. Where the outer file has no `safety` at all, each subsystem is stopped by an event of its own: list the event there \
         as well, so that one stops all of them.";
    COMPOSE_PROMISE = "compose::promise", "what a subsystem exports is touched while it need not be there",
        "What a subsystem exports is there from *up* on, or from the event that `exports: { from }` names, until it has left: it says so \
         (`leaving: { says }`) and waits until its parent lets go (`until`). The parent asks for what touches it only between these, and holds \
         no frame of it any more when it lets go. The way shows what comes first.";
    COMPOSE_EXCLUSIVE = "compose::exclusive", "two subsystems may hold the same thing at once",
        "Components of two subsystems, or one of a subsystem and one of the parent, may come to hold a thing of one name (`exclusive` of their types), and \
         both may be there at once: the second one would be refused it when it runs. What a subsystem may hold is judged from the event that begins it until \
         `left/down` was heard, with every value that its file and its parent give. Give them different values, by a parameter, or begin one when the other is down.";
    COMPOSE_UNLEFT = "compose::unleft", "a subsystem takes away what it exports without being let go",
        "A subsystem with `leaving` destroys nothing that it exports before it has heard the event under `until`, so that nothing of its \
         parent is cut off; nor does it replace any or make it anew, and it passes on nothing of a subsystem of its own that does not promise it. \
         Wait for that event before the configurations that take exported components away. One without `leaving` may take them away whenever \
         it is not *up*. A parent that ends a subsystem with `leaving` raises `until`, without which that never goes down, and raises it when \
         the subsystem waits for it: what comes before is lost.";
    COMPOSE_EXPORT_DRIVEN = "compose::export_driven", "an exported in-port is driven inside",
        "An in-port that is exported is one that the parent drives: inside nothing is connected to it, and no configuration writes it. Export \
         an out-port, or remove the inner connection.";
    DEPLOY_UNKNOWN_STATE = "deploy::unknown_state", "the deployment names a state that the coordinator does not have",
        "`deploy.up`, `deploy.failed` and `shutdown.down` name states of the coordinator, by their own name \
         (`operational`), their full name (`root.operational`) or any end of it that only one state has. Without the \
         state, nobody could tell when the system is up or down. Correct the name, or add the state.";
    DEPLOY_EVENT_UNHEARD = "deploy::event_unheard", "no transition waits for the event that starts or ends the deployment",
        "`deploy.event` starts the bring-up and `shutdown.event` the shutdown. The coordinator has no transition on the \
         event, so nothing would ever happen. Correct the event's name in the deployment or in the coordinator.";
    DEPLOY_ONE_EVENT = "deploy::one_event", "one event starts and ends the deployment",
        "`deploy.event` and `shutdown.event` are the same. Raised while the bring-up is under way, or once more while it is being \
         stopped, it would mean both, and nobody could tell which. Give the deployment an event for each.";
    DEPLOY_NEVER_UP = "deploy::never_up", "the bring-up does not reach the state that means up, or not in time",
        "The coordinator was driven with the deploy event and every request answered `ok` at once, and came to rest somewhere \
         else than in `deploy.up`, or only after `deploy.within_s`, for it waits for times (`e_after`) that last longer. A bring-up \
         that fails when everything goes well cannot work: look at the trace for the place where it stops, and at the event it \
         waits for there. Events of components were tried where nothing else could go on. A state listed under `deploy.failed` ends \
         the bring-up as failed: no way up may come to it.";
    DEPLOY_BY_HAND = "deploy::by_hand", "the bring-up or the shutdown waits for an event that nothing in the deployment raises",
        "Driven with the event that begins or ends it and every request answered `ok`, the coordinator goes on only by an event from outside that no \
         component, monitor, reaction or coordinator raises. Mostly its name is misspelt, or an answer (`ID.ok`) was meant: then `davit deploy` waits \
         `deploy.within_s` and gives up, and `davit shutdown` takes it down without its coordinator after `shutdown.within_s`. Where people decide at \
         that place on the way up, it is up there: name that state in `deploy.up`. On the way down let a time lead on as well.";
    DEPLOY_NEVER_DOWN = "deploy::never_down", "the shutdown does not reach the state that means down, or not in time",
        "From the state that means up, the coordinator was driven with the shutdown event and every request answered \
         `ok` at once, and did not reach `shutdown.down`, or only after `shutdown.within_s`. It would have to be stopped without its \
         coordinator. Look at the trace for the place where it stops. An ordinary event from outside leads nowhere then where the \
         deployment declares `safety`: it is refused while it is being stopped. What components and monitors report is not.";
    DEPLOY_LEFTOVERS = "deploy::leftovers", "the shutdown leaves components behind",
        "The coordinator reaches the state that means down, but components that the bring-up created are still there. \
         They would be taken away without the order that the coordinator knows (exit status 4). Let the coordinator undo what it \
         applied, or apply a configuration that destroys what is left; the finding names it.";
    DEPLOY_UNKNOWN_CONFIGURATION = "deploy::unknown_configuration", "the deployment names a configuration that there is not",
        "`operator` lists what an operator may do while the deployment is up: configurations by their names, properties and \
         in-ports as `Component.member`. `shutdown.rest` lists the configurations that bring the system to rest when it is \
         taken down by force (the third stage of stopping, docs/operating.md). A name that no configuration has would be missed when it is needed. Correct it, or remove it.";
    DEPLOY_NO_JOURNAL = "deploy::no_journal", "there is no journal whose durability could be set",
        "`durability` is to say how safely a journal is kept, and no journal is written yet: whatever the key said, a crash \
         would lose the same. A promise that is not kept is worse than none, so the key is refused. Leave it out.";
    DEPLOY_UNKNOWN_LIBRARY = "deploy::unknown_library", "there is no such component library",
        "`libraries` names the component libraries that this program was built with. A library of your own is linked into \
         a program of your own: `davit::main(libraries)`. `davit types` lists what this program has.";
    TYPE_UNKNOWN_TYPE = "type::unknown_type", "a component type refers to a type that there is not",
        "`start_after` and `stop_before` name other component types, whose components start before and stop after those of \
         this one. A name that no type has would silently order nothing. Correct it, or leave it out.";
    TYPE_CIRCLE = "type::circle", "the order of types leads round in a circle",
        "`start_after` and `stop_before` say which types come first inside a feedback loop, where the data flow does not. Each of these \
         waits for another one of them, so no order fits, and the name would decide. Leave one of the names out.";
    TYPE_EXCLUSIVE = "type::exclusive", "a property that cannot stand in the name of what a component has for itself",
        "What a component holds for itself must not become something else while it holds it: a property in braces is one of the type, of type string, int \
         or bool, and `tunable: unconfigured`. Mark the property so, or name the thing without it. Nor may an operator choose it without force (`operator:`): any value \
         may be that of another component.";
    TYPE_NO_EVENT = "type::no_event", "a component type says that its components raise what none can",
        "`raises:` lists events of components. Answers to requests (`park.ok`), requests, what is told of subsystems by itself, and events of the \
         statechart itself are raised by nobody but Davit. Leave it out, or give the event another name.";
    TYPE_WITHOUT_CODE = "type::without_code", "a component of a type that is only declared, on a platform that needs its code",
        "Types under `types:` say which ports, properties and operations a component has, not what it does. The simulated \
         platform runs them all the same; the embedded platform needs the code, which comes with a library. Use \
         `platform: simulated`, or a type of one of the libraries; your own code goes into a library of your own program.";
    TYPE_DIFFERS = "type::differs", "a declared type is another than the library's or the platform's type of that name",
        "The deployment declares a type under `types:` that one of its libraries has as well. The library's is what runs and what \
         configurations are judged by; the declaration is held against it. It is an error where something that the declaration allows \
         would fail (a member, an argument or a value that the library does not take), else a warning. Write what the library has, or \
         leave the declaration out. A platform of a program's own is asked for its types when a deployment begins: where plans could \
         fail on it, nothing is begun.";
    TYPE_UNKNOWN_OPERATION = "type::unknown_operation", "the undo of an operation is not an operation that fits",
        "An operation's `effect: { undo: NAME }` names another operation of the same type, which takes the same arguments \
         or none. Otherwise a configuration that calls it could not be undone when it matters. Correct the name or the \
         arguments, or declare the effect as `none` or `irreversible`.";
    TYPE_SETTLED_ELSEWHERE = "type::settled_elsewhere", "the condition that settles an operation is not about its own component",
        "`settled_by` is a condition that is true once the operation was done, so that a call of which no answer came can be \
         settled by looking. It is written of the component itself, under the name `self`: `equals: [self.mode, 6]`. Ports \
         are those of the type; other components and activities are not known to a type.";
    DEPLOY_UNKNOWN_PLATFORM = "deploy::unknown_platform", "there is no such platform",
        "The key `platform` names where the components live, and this program has no platform of that name. `embedded` \
         runs components of the libraries in this process; `simulated` runs any declared type without components.";
    // ---- configurations and plans ----------------------------------------------------------------------------------
    CONF_KEYED_ENTRIES = "conf::keyed_entries", "a keyed entry in a state list has no place in its order",
        "A state list is applied in its order, but the named entries of a Lua table have none: with two or more keys, \
         chance would decide which component changes first. Write them as a list: `{ 'compA:running', \
         '_default:stopped' }`. One key alone is fine; beside entries it is `_default`, which comes after them.";
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
    CONF_RESERVED = "conf::reserved_name", "a configuration has a name that means something else",
        "A coordinator asks for a configuration by its name. `undo` there asks for undoing what was applied last, and `e_done` is the \
         event of a state whose activity is over: a configuration of such a name could not be asked for. Choose another name.";
    CONF_DUPLICATE = "conf::duplicate", "two configurations have the same name",
        "A request names one configuration, so names are unique in a deployment, over all its files. Rename one of \
         them, and the requests for it.";
    CONF_HOLDS_UNSEEN = "conf::holds_unseen", "the platform does not show what a configuration stands for",
        "The components of the simulated platform have no code: their run states can be seen, values at their ports cannot. So \
         what the configuration stands for counts as true there while none of the components that it looks at is faulted, and \
         `davit status` shows the frame as not observed. On a platform whose components run it is evaluated; until then \
         nobody has seen that it ever becomes true.";
    CONF_HOLDS_NEVER = "conf::holds_never", "a configuration is applied where what it stands for cannot be true",
        "With `holds` a configuration says what must be true once it has been applied. Run states are known beforehand: on the \
         way shown the condition is false after its last step, whatever its ports carry, and nobody else can make it true \
         before its time is over. So the request can only end *failed*, and is taken back. Let the configuration bring the \
         components there itself (`post_conf_state`), ask for it where they are there already, or correct the condition.";
    CONF_CONFIRM_CONTRADICTED = "conf::confirm_contradicted", "`confirm` stands beside `safe` or `on_failure = \"hold\"`",
        "`confirm` says that the configuration is undone when an event does not come in time. A safe configuration stays in \
         force until somebody undoes it, and `on_failure = \"hold\"` says that nothing is undone unasked: both at once \
         cannot be kept. Keep one. A coordinator can wait for the event itself, with `e_after(s)`, and undo.";
    CONF_ON_FAILURE_SAFE = "conf::on_failure_safe", "`on_failure` stands beside `safe`",
        "Of a safe configuration every step is tried, past failures, and none is taken back: that is what makes it safe to \
         ask for at any time. `on_failure` says something else of failures. Leave it out.";
    CONF_SAFE_MOVES = "conf::safe_moves", "a safe configuration takes back something that moves",
        "A safe configuration has a `group`, so that it takes the place of whatever is in force of that: the frame of that one is undone, and \
         something of it moves when it is taken back. In an emergency that moves which is to be stopped. Give the safe one a \
         group of its own: it is in force over the other one then, and that moves where somebody asks for its undo. What a run state leads to is not \
         looked at.";
    CONF_ALONE_IN_GROUP = "conf::alone_in_group", "a configuration is alone in its group, and another one is called nearly so",
        "Configurations of one `group` are alternatives: applying one replaces the frame of the one that is in force. This group has \
         only one configuration, which replaces nothing, and another group has nearly the same name: one of both is misspelt, as it \
         seems. Correct it, or leave the group out.";
    CONF_UNASKED = "conf::unasked", "nobody asks for a configuration",
        "No state and no transition of a coordinator asks for this configuration, it is not safe, brings nothing to rest (`shutdown: { rest }`), \
         and `operator:` does not list it. It can only be applied by force (`davit apply --force`), of which `check` knows nothing. Ask for it, \
         list it where people apply it, or delete it; a name that is misspelt elsewhere is told by a finding of its own.";
    UNKNOWN_COMPONENT = "conf::unknown_component", "there is no such component",
        "The configuration names a component that does not exist where it is applied: it was never created, was destroyed, or its name is misspelt. Nothing can be done to it. Create it earlier (or in the same configuration), or correct the name.";
    UNKNOWN_TYPE = "conf::unknown_type", "there is no such component type",
        "A component is to be created of a type that neither the deployment declares nor one of its libraries brings. Add the library under `libraries:`, declare the type under `types:`, or correct the name; `davit types` lists what there is.";
    UNKNOWN_PORT = "conf::unknown_port", "the component has no such port",
        "A connection or a port_write names a port that the component's type does not have. Ports are declared by the type; `davit types TYPE` lists them. Correct the name or the type.";
    UNKNOWN_PROPERTY = "conf::unknown_property", "the component has no such property",
        "A property_set, or a value in a create, names a property that the component's type does not have. `davit types TYPE` lists the properties of a type with their units and limits. Correct the name or the type.";
    UNKNOWN_OPERATION = "conf::unknown_operation", "the component has no such operation",
        "An operation_call, or the call that undoes it, names an operation that the component's type does not have. `davit types TYPE` lists the operations of a type. Correct the name or the type.";
    UNKNOWN_ACTIVITY = "conf::unknown_activity", "there is no such activity",
        "A component is to be created in an activity that the deployment does not have. An activity is a thread that updates components; it is declared under `activities:` in the deployment. Declare it there or correct the name.";
    COMPONENT_EXISTS = "conf::component_exists", "there is a component of that name already",
        "A create is an act: it is refused when a component of that name exists already, because taking the present one for the wanted one would hide a mistake. Destroy the old one in the same configuration (the derived order destroys first), or choose another name.";
    STILL_CONNECTED = "conf::still_connected", "a component that has connections cannot be destroyed",
        "Destroying a component would silently cut its connections, and an undo would have to guess them. Add a disconnect for each connection that the finding names to the same configuration; the derived order makes them first.";
    NOT_UNCONFIGURED = "conf::not_unconfigured", "only an unconfigured or faulted component can be destroyed",
        "A component is destroyed from the run state unconfigured (or faulted). A configuration's destroy takes the legal path down by itself, so this is met only where single steps are executed: stop and clean up the component first.";
    ILLEGAL_TRANSITION = "conf::illegal_transition", "the run state does not allow this move",
        "Run states change along unconfigured, stopped, running, one step at a time, and from faulted only by cleanup. The component is in a state from which the move does not exist; most likely it changed by itself (a fault) since the plan was made. Look at its state and plan anew.";
    RESOURCE_HELD = "conf::resource_held", "a component needs for itself what another one holds",
        "A type may name things that a component of it needs for itself (`exclusive: [\"ethercat:{ifname}\"]`, with the value of a property inside): a bus, a \
         serial line, a network interface. A component holds them from *configured* on, until it is *unconfigured* again, one at a time. Two components \
         that come to the same name cannot both be configured: give one of them another value of the property, or bring the one that holds it \
         to unconfigured first.";
    FAULTED_DEMANDED = "conf::faulted_demanded", "the state `faulted` cannot be demanded",
        "Faulted is a state that a component falls into by itself; nobody can bring it there, so no list may demand it. Demand unconfigured, stopped or running.";
    NOT_AN_OUT_PORT = "conf::not_an_out_port", "a connection begins at an out-port",
        "Data flows from the first port of a connection to the second, and the first one is declared as an in-port. Most likely the two ends are exchanged: write connect(from_out_port, to_in_port).";
    NOT_AN_IN_PORT = "conf::not_an_in_port", "only an in-port can be connected to or written",
        "A connection ends at an in-port, and port_write writes in-ports; this port is declared as an out-port, whose samples come from its component alone. Exchange the two ends of the connection, or write the in-port at the other end.";
    PORT_TYPES = "conf::port_types", "the two ports carry different types",
        "Ports are connected only when their types are equal; an int port does not feed a float port, because a connection converts nothing. Connect a port of the same type, or put a converting component in between.";
    PORT_UNITS = "conf::port_units", "the two ports carry different units",
        "Both ports state a unit and the units differ, so the numbers would be taken for something else. Connect a port of the same unit, put a converting component in between, or leave the unit of one side out where it truly does not matter.";
    ALREADY_CONNECTED = "conf::already_connected", "the two ports are connected already",
        "A connect is an act: a pair of ports that is connected already is refused, also with another policy. To change the policy, write the disconnect and the connect into the same configuration; the derived order disconnects first.";
    NOT_CONNECTED = "conf::not_connected", "the two ports are not connected",
        "A disconnect is an act: it is refused when the two ports are not connected where it is applied. Remove the disconnect, correct the ports, or apply the configuration that connects them first.";
    DATA_ALONE = "conf::data_alone", "a data connection must be the only one of its in-port",
        "A `data` connection carries the latest value, so an in-port that had a second source would jump between the two. Disconnect the present source in the same configuration, or use buffered connections, of which an in-port may have many.";
    NEEDS_BUFFER = "conf::needs_buffer", "this in-port takes only buffered connections",
        "The in-port's type declares `buffered: true`: its component reads it as a queue, and a `data` connection would drop samples. Give the connection a policy, { buffer = 64 }.";
    BUFFER_SIZE = "conf::buffer_size", "a buffer holds at least one sample",
        "The policy asks for a FIFO without room for any sample, which would lose them all. Give the number of samples it must hold, at least 1.";
    NOT_TUNABLE = "conf::not_tunable", "the property cannot be set in this run state",
        "The property's type says in which run states it may be set (`tunable:`), and during the changes of this configuration the component is in another one. Bring it into a permitted state with pre_conf_state, and back with post_conf_state.";
    BAD_VALUE = "conf::bad_value", "the value is not one of this slot",
        "The value is not of the declared type, lies outside the declared limits, or is not a finite number. An int is accepted where a float is wanted, never the reverse; min and max are allowed values and hold for every number in the value. Correct the value or the type.";
    PORT_DRIVEN = "conf::port_driven", "a connected in-port cannot be written",
        "port_write goes to in-ports that nothing drives; this one is connected, and the next sample would replace the written value at once. Disconnect it in the same configuration (the derived order disconnects first), or set the source instead.";
    PORT_NOT_WRITABLE = "conf::port_not_writable", "buffered ports and event ports cannot be written",
        "A written value is the latest value of its port. A buffered port and an event port are queues and have none, so an undo could not take the sample back. Connect a component that sends it, or use an operation or a property.";
    BAD_ARGUMENTS = "conf::bad_arguments", "the operation takes other arguments",
        "The call's arguments differ from the operation's declaration in number or in type. `davit types TYPE` shows the operation with the types of its arguments. Correct the call; the same rule holds for the call that undoes it.";
    PORT_UNLIKE = "conf::port_unlike", "a port cannot become that one where its component is replaced",
        "The `map` of a replace says what a port of the old component is called on the new one, so that its connections go on there. The two are of different direction, type or unit: no connection of the one could be one of the other. Correct the map, or connect the new component by hand: disconnect, destroy, create and connect.";
    PORT_UNMAPPED = "conf::port_unmapped", "a connected port has no counterpart on the component that replaces its own",
        "A replace carries the connections of the old component over to the new one. This port is connected where the configuration is applied, and the type of the new component has no port of that name. Say in `map` what it is called there, or disconnect it in the same configuration if the connection is to end.";
    MISSING_PROPERTY = "conf::missing_property", "a property without a default is not given",
        "The type declares this property without a default, so a component cannot be created without a value for it. Give the value in the create itself; a property_set beside it comes too late, for the component would exist without one in between.";
    CLASH = "conf::clash", "two changes of one configuration do not commute",
        "The changes of a configuration are a set: no order is promised among them. These two touch the same thing and would leave different systems in different orders; so do a call and the one that takes it back. Keep one of them, or write two configurations and apply them one after the other.";
    CHANGE_TWICE = "conf::change_twice", "one change stands twice in a configuration",
        "The changes of a configuration are a set: what stands in it twice, word for word, is done once. An operation that is to be called twice is called by two configurations, one after the other. Of everything else remove one.";
    DEFAULT_TWICE = "conf::default_twice", "`_default` stands twice in one list",
        "`_default` stands for every component that the same list does not name; twice in one list it would demand two states of all of them. Keep one, and name the components that are to be in another state.";
    PRE_ON_CREATED = "conf::pre_on_created", "a component that is created here cannot be in the pre-state list",
        "The pre-state list is applied before the changes, when this component does not exist yet. Put the entry into post_conf_state, or create the component in an earlier configuration.";
    POST_ON_DESTROYED = "conf::post_on_destroyed", "a component that is destroyed here cannot be in the post-state list",
        "The post-state list is applied after the changes, when this component does not exist any more. Remove the entry; destroy stops and cleans up the component by itself.";
    TOUCHES_DESTROYED = "conf::touches_destroyed", "a change to a component that this configuration destroys",
        "In one order the change would be lost, in the other it would meet no component. Remove the change or the destroy, or write two configurations. Only disconnects and the pre-state list concern a component that is being destroyed.";
    IRREVERSIBLE = "conf::irreversible", "a step of this configuration cannot be undone",
        "Once this step is done, neither a failure of a later step nor an undo can take it back: its frame becomes a floor of the stack. If that is meant, say so with `irreversible = true`; else name the call that undoes it, operation_call(...):undo(...), or declare the operation's `effect:`.";
    ACTUATOR_BY_DEFAULT = "conf::actuator_by_default", "an actuator is started or stopped only through `_default`",
        "The component's type is declared `actuator: true`: starting or stopping it moves something. Here that happens only because `_default` covers it, which is easily overlooked. Name the component in the list if it is meant.";
    // ---- SCXML -------------------------------------------------------------------------------------------------------
    SCXML_NO_COUNTERPART = "scxml::no_counterpart", "something of SCXML has no counterpart here",
        "A coordinator holds no data, runs no code, and is in one state at a time. What of an SCXML document needs more (parallel regions, history, a data model, conditions, scripts, invocations, events that the chart raises to itself, transitions without a target) is refused, each at its place, with what to do instead.";
    SCXML_PRIORITY = "scxml::priority", "SCXML would take another transition",
        "Two active states, one inside the other, wait for the same event. In SCXML the inner one wins, in rFSM's semantics (and here) the outer one. Give the two transitions different events, or change the chart so that only one of them can be meant.";
    SCXML_PREFIX = "scxml::prefix", "SCXML compares only the beginning of an event's name",
        "In SCXML `e` also means `e.x` and `e.y`, and so does `e.*`; here names are compared whole. The names of the document that begin so are added; others, that come from outside only, are not meant. List every event that is meant.";
    SCXML_SENT_HOME = "scxml::sent_home", "an event would come back to the chart in SCXML",
        "A `<send>` without a target puts the event into the chart's own queue. Here a name that is raised leaves the coordinator: it is a request, or an event for others. Write a target if that is meant; else go to the state in question.";
    SCXML_OUTLIVES = "scxml::outlives", "a delayed event would come in SCXML also when its state was left",
        "In SCXML a `<send>` with a delay comes when its time is over, whatever state the chart is in by then, unless a `<cancel>` takes it back. Here it is a time event of the state that sends it on its entry, and ends with that. Take it back on exit of that state (`<onexit><cancel sendid=\"…\"/></onexit>`), which means the same in both.";
    // ---- stack -----------------------------------------------------------------------------------------------------
    STACK_EMPTY = "stack::empty", "there is nothing to undo",
        "The stack holds no frame that could be popped: nothing was applied, or all of it was undone already, or it was committed. `davit stack` shows the frames.";
    STACK_FLOOR = "stack::floor", "undo does not pass this frame",
        "The frame contains a step that cannot be undone, or the state was committed after it: it is a floor, and neither it nor a frame below it can be popped that is of the same file and shares a component with it. Apply a configuration that leads to the wanted state instead.";
    STACK_SHARED = "stack::shared", "a frame above shares something with this one",
        "A frame below the top can be popped only when nothing above it wrote what it wrote or needs it to be as it is. What a parent set, wrote or called in a subsystem keeps nothing of that from being undone, only what it has connected. The finding names the frame above and the thing they share. Undo the frame above first, or undo down to this one (`davit undo --to N`).";
    STACK_UNDONE = "stack::undone", "what an undo without a name has undone",
        "An undo without a name takes back the newest frame of whoever asks for it. This is the configuration that it was of; the next undo takes back the one below it.";
    STACK_TAKEN_ALONG = "stack::taken_along", "what stood in its way was undone with it",
        "While a deployment is led down, what its coordinator undoes takes along the frames of operators that stand in its way, and its own of states that were left and that were not undone then (something safe came, or that failed): newest first, in one transaction, both or none. Not what an operator has made `safe`, nor what would move when it is undone: then the coordinator's undo is refused, and says so.";
    STACK_GROUP = "stack::group", "the group's present frame cannot be replaced",
        "Configurations of one group are alternatives: applying one pops the frame of the other first. That frame cannot be popped, for the reason given, so the new configuration is refused and nothing has changed. Undo what stands in the way first.";
    STACK_FOREIGN = "stack::foreign", "the frame belongs to another coordinator",
        "Each coordinator of a deployment undoes its own frames only, whatever the order. Popping the top, or replacing the frame of a group, would here have undone what another coordinator asked for and relies on. Let that coordinator undo it (send it an event), or undo it as an operator.";
    STACK_FULL = "stack::full", "the stack is full and nothing of it can be squashed",
        "Each coordinator, and operators in each subsystem, may have `limits.stack` frames; past that the oldest are squashed into one, but frames of states that are active are never squashed, and here no two others lie side by side. Undo or commit something, or raise `limits: { stack: … }` in the deployment.";
    STACK_SQUASHED = "stack::squashed", "the frame was squashed together with others",
        "The stack is bounded for each coordinator, and for operators in each subsystem: the oldest frames were squashed into one, which can be undone as one only. Undo down to it, or raise `limits: { stack: … }` in the deployment so that more frames stay single.";
    STACK_HELD = "stack::held", "a coordinator's frame is in force",
        "`davit commit` makes the operator's own frames permanent. While a coordinator has a frame in force this is refused: its undo may write over what was made permanent, or need what the operator changed. Commit when the coordinator has undone it, or say `davit commit --force`: the operator's frames are given up and the coordinator's stay, to be undone as far as that goes.";
    STACK_NO_FRAME = "stack::no_frame", "there is no such frame",
        "The frame that is to be undone is not on the stack (any more): it was undone, replaced by another of its group, or never pushed. `davit stack` shows the frames.";
    STACK_DRIFTED = "stack::drifted", "the system is not as the frame left it",
        "An inverse of this frame meets a false precondition: the system changed by itself since the frame was pushed (a component failed, or somebody else changed it). `davit status` shows the components as they are, `davit drift` whether they differ from what is known of them. Mend the component and ask again, or apply a configuration that leads to the wanted state.";
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
        "A state has a name that means something else",
        "The words `entry`, `exit`, `doo`, `config` and `doc` are keys of a state's table, and rFSM keeps its own fields beside the children of a state (`type`, `new`, `rfsm`; in the root also `err`, `warn`, `info`, `dbg`, `getevents`, `idle_hook`). A child of that name is overwritten or breaks the model there, so it is refused here. Choose another name.";
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
        "A path through connectors is searched to its end before anything happens. A circle of them that neither a guard nor an event holds has no end; rFSM overflows its stack, and here it is refused. A circle that events hold is a warning: when all that open it come in one step, no transition is taken (rFSM overflows its stack). A deployment gives the coordinator one event a step. Break the circle, or put a state into it.";
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
        "Guards, actions and activities written as Lua functions run only in a coordinator that the deployment trusts \
         (`trusted: true`), because what they do cannot be verified. A pure coordinator raises names of events where rFSM \
         has functions: the work is done by components, conditions are watched by monitors, switches are made by \
         configurations.";
    FUNCTIONS_NOT_OPENED = "functions::not_opened", "a coordinator's functions cannot be run",
        "A coordinator with functions is run twice: when it is read, and where its functions are to be called. The second \
         time it failed, or it made another chart than the one that was checked. What a coordinator's file makes must not \
         depend on the time, on chance or on files that change.";
    CHART_UNNAMED = "chart::unnamed", "a state has no name",
        "A state inside a state is written `name = state { … }`: transitions refer to it by that name. Without one it \
         could never be entered.";
    COORD_UNKNOWN_REQUEST = "coord::unknown_request", "the coordinator asks for a configuration that there is not",
        "A name that a coordinator raises is a request when it is a configuration's name, `NAME.undo` or `undo`; else it \
         must be listed under `emits` in the deployment. This one is neither, so nobody would hear it. Correct the name, \
         add the configuration, or list the event under `emits`.";
    COORD_UNKNOWN_ANSWER = "coord::unknown_answer", "a transition waits for an answer that no configurator gives",
        "Answers are named after the request: `ID.ok`, `ID.failed`, `ID.broken`, `ID.cancelled`, `ID.reverted`, \
         `ID.undone`, `ID.undo.failed`, `ID.undo.broken`. This event has such a form, but there is no such configuration \
         or no such answer, so the transition would wait for ever. Correct the name.";
    COORD_ANSWER_NEVER_COMES = "coord::answer_never_comes", "a transition waits for an answer to a request that is never made",
        "Answers go to whoever asked. The coordinator waits for the answer to a request that it makes nowhere, so the \
         transition can never be taken. Raise the request where it is wanted, or remove the event.";
    COORD_NEVER_EMITTED = "coord::never_emitted", "an event that the deployment emits is raised nowhere",
        "`emits` lists the events that leave the deployment. The coordinator raises this one nowhere, so whoever waits for \
         it outside waits in vain. Raise it in the coordinator, or remove it from the list.";
    COORD_NEAR_EVENT = "coord::near_event", "an event is nearly, but not quite, one that there is",
        "Events are plain names, and components and operators may raise any, so an unknown one is no error by itself. This \
         one differs by a letter or two from an event that the deployment raises or accepts, or that a component raises by what its type says (`raises`), \
         and is probably a slip. Correct it, give it a name that cannot be mistaken, or list it under `accepts`: an operator raises it.";
    COORD_FAILURE_UNHANDLED = "coord::failure_unhandled", "nobody hears that a request failed",
        "Every request can fail. The coordinator asks for a configuration in a state where no transition waits for \
         `ID.failed` (or `ID.broken`), so after a failure it stays where it is as if nothing had happened. Add a transition \
         to a state that knows what to do: try again, go back, or stop. The same holds for `ID.reverted` of a configuration that \
         must be confirmed (`confirm`). `ID.cancelled` comes when the request was taken back by its own undo, or still waited \
         when a `safe` configuration came: where one may come, hear it like `ID.failed`.";
    CHART_SLIP = "chart::slip", "a field of a trusted coordinator means nothing, and was hardly meant so",
        "A coordinator that is trusted is read as rFSM reads it: fields of your own are legal everywhere, and a global that \
         nobody has set is nil. So `evnts = {…}`, `gaurd = function …` and `entry = do_it` are no errors, but the transition is \
         taken on any event, without a condition, and nothing is done on entry. Correct the name; a field of your own that only \
         looks like one of rFSM's can be called otherwise, or begin with `_`.";
    CONVERT_FUNCTIONS = "convert::functions", "functions cannot be written in another language",
        "A function of a coordinator is a piece of Lua. In YAML there is no word for it, and its text cannot be taken out of \
         its file, which may define what it uses anywhere. A deployment is converted all the same: such a coordinator stays \
         the file that it is, beside those that it loads. To write it in another language make it pure (docs/from-rfsm.md).";
    CONVERT_SUBSYSTEMS = "convert::subsystems", "a deployment with subsystems is not converted as one",
        "What is written in the file of a subsystem belongs to that file: put together with what names it, it would be another deployment. \
         Convert the files one by one.";
    CONVERT_LEFT_OUT = "convert::left_out", "something cannot be written in the language asked for",
        "A field of your own has no place in a pure coordinator, and a function has none in SCXML, where a comment or a \
         condition that is not defined stands for it. What is written says less than what was read.";
    COORD_NOT_PURE = "coord::not_pure", "the coordinator has functions",
        "A coordinator of states, transitions and names of events can be verified in full. Functions can do anything, so \
         what `check` says about requests, failures and shutdown holds only as far as no function is involved. Names of \
         events in place of functions make a coordinator pure.";
    COORD_REQUEST_REFUSED = "coord::request_refused", "a request is refused in a state in which the coordinator makes it",
        "`check` follows the coordinator through every order of events and answers. On the way shown, it asks for a \
         configuration that does not fit the system as it is then: a component is there already or not there, a port is \
         driven, a property cannot be set in this run state. The request would be answered `failed`. Make the request \
         where it fits, or write the configuration so that it fits both states: demands (run states, values) are fulfilled \
         when already so, acts (create, destroy, connect, disconnect) are not. What moves and is interrupted by something \
         safe is not taken back unasked, and stands in the way of what lies below it: ask for its undo by its name before \
         theirs, on every way down; where nothing of it is left, that is answered as done.";
    COORD_ENDLESS = "coord::endless", "answers go round for ever",
        "On the way shown the coordinator gets to a circle of states that only answers lead round: each answer makes it ask \
         for something whose answer makes it ask again. No step fails and no time passes on the way round, so it works \
         without end as fast as the configurator answers. Let it wait somewhere on the way round: for an event, or for a \
         time (`e_after(1.0)`).";
    COORD_SAFETY_UNHEARD = "coord::safety_unheard", "a safety event does not lead to a safe configuration",
        "`safety` lists events that must lead to a `safe` configuration wherever an actuator exists. On the way shown there \
         is a component of a type with `actuator: true`, no safe configuration is in force or asked for, and the event \
         either is not heard, or what it leads to asks for no safe configuration before another event comes. After something \
         ended *broken* nothing is known of the system, and the same is demanded as a warning. Add a transition on the event \
         to a state that asks for a safe configuration on its entry; a transition from the outermost state in which actuators \
         exist serves for all states inside. Where no coordinator waits for the event at all, that is a warning even without an \
         actuator: it is probably a slip.";
    COORD_SAFE_LEFT = "coord::safe_left", "an emergency is taken back without anybody having said so",
        "A state takes a `safe` configuration back when it is left (it is its `config`, or its `exit` undoes it), and a transition leaves it by what \
         comes by itself: an answer of that configuration, a time, a fault, or whatever comes next, also in several steps of which nobody asked for any; and \
         what is entered asks for nothing safe. When a part of an \
         emergency stop fails (`stop.broken`), that undoes the part that was done: brakes open again, and nobody asked. Let an event of people lead on \
         (`e_reset`). What should be shown or told of how it ended is a transition between two states inside of the one that has the \
         configuration: that stays in force. The same where a coordinator raises what ends an emergency of a subsystem, or of another coordinator, \
         since an answer, a time or a report of a subsystem came: the event of safety may have come just before. Let it hear that event where it \
         waits, and go to a state from which an event of people leads on.";
    DEPLOY_NO_REST = "deploy::no_rest", "something moves, and nothing is named that brings it to rest by force",
        "When a deployment is taken down by force (the third stage of stopping, docs/operating.md), its safe configurations are applied and then \
         everything is removed: what stands only by its drives falls. `shutdown: { rest: [park] }` names configurations that bring it to rest before \
         that, in their order. Name them, or see that it may stop where it is; this is only a note.";
    DEPLOY_NO_PLATFORM = "deploy::no_platform", "the platform cannot be made",
        "The platform that the deployment names said that it cannot be had now: a device that is not there, a middleware that does \
         not answer. The message has its own words. Nothing was brought up.";
    DEPLOY_PART = "deploy::part", "the deployment is a part of something larger",
        "The file exports an in-port that its component's type declares `required: true`: a parent is to drive it, and nothing in the file does. \
         Such a file is a subsystem of another one. It is checked, planned, drawn and simulated by itself (`davit check` notes what it is), but \
         not deployed where components run: without what its parent connects it cannot do what it is there for. Deploy a file that has it among its \
         `subsystems`, or, to have it alone, connect or write the port in the file itself and export it no more.";
    DEPLOY_PLATFORM_OPTION = "deploy::platform_option", "an option of the platform is wrong",
        "`platform: { NAME: { … } }` gives the platform options. Which ones there are, of which type, and which must be given, is \
         what the program says that brings the platform. The built-in platforms have none.";
    DEPLOY_PORT_REQUIRED = "deploy::port_required", "nothing drives an in-port that its component needs",
        "The component's type declares the in-port `required: true`: without samples the component cannot do what it is there for. Nothing \
         that may be in force while the deployment is up connects or writes it: no configuration that a coordinator asks for, none that an \
         operator may apply (`operator:`, `safe`), and no operator may set it. One that nobody may ask for drives nothing, and neither does \
         one that is undone before it is up, or applied when it goes down; one that is in force in some mode only does. Connect it to an \
         out-port, or write it, or ask for what does.";
    DEPLOY_PORT_UNDRIVEN = "deploy::port_undriven", "nothing drives some in-ports",
        "Nothing that may be in force while the deployment is up connects or writes these in-ports: no configuration that a coordinator \
         asks for, none that an operator may apply (`operator:`, `safe`), and no operator may set them. One that nobody may ask for drives \
         nothing, and neither does one that is undone before it is up, or applied when it goes down. Their components see them as never \
         written. That is often meant (an input that this system does not use), and now and then a connection that was forgotten or \
         misspelt. A type that cannot do without says `required: true` of its port: then it is a warning.";
    DEPLOY_UNWATCHED = "deploy::unwatched", "part of what commands an actuator may die unnoticed",
        "A component whose activity hangs, or that was stopped by hand, sends nothing any more; whoever receives its data goes on with \
         the last value. Where there is an actuator this is told of components that a configuration starts: those whose data reach it, over as \
         many connections as it takes, those that a `holds` reads (it stays true with the last value), and those that run the monitors. A \
         component counts as watched where a monitor whose event a transition hears reads one of its ports, whoever receives its data has an \
         out-port of events, or a transition hears `COMPONENT.faulted` (which comes of a panic, not of a component that is stopped or \
         hangs). Watch what it sends: a monitor with `when = silent(\"COMPONENT.port\", 0.05)`. What sends nothing is not asked for.";
    DEPLOY_SAFETY_ANSWER = "deploy::safety_answer", "an answer of the configurator is listed as a safety event",
        "`safety` lists events from outside that must lead to a `safe` configuration: what a component, a monitor or an operator \
         raises. An answer (`ID.ok`, `ID.failed`, …) comes only to who asked for something. Hear it with a transition of the \
         coordinator, and list the events that mean danger.";
    DEPLOY_OPERATOR_NAME = "deploy::operator_name", "a coordinator is called `operator`",
        "Frames, answers and the log are told by who asked for them, and `operator` is who asks by hand, from a script or through \
         the control socket. A coordinator of that name could not be told from an operator. Give it (or, where it has no name of \
         its own, the deployment) another name.";
    COORD_LOST_UNHEARD = "coord::lost_unheard", "nobody hears that what a configuration stands for is lost",
        "A configuration says with `holds` what it stands for. When that becomes false while a frame of it is in force, the \
         coordinator hears `ID.lost`, in whatever state it is. On the way shown it is in a state in which no transition hears \
         it, so it would go on as if nothing had happened. Add a transition on `ID.lost` to a state around all in which the \
         configuration may be in force.";
    COORD_REVERTED_UNHEARD = "coord::reverted_unheard", "nobody hears that a configuration was taken back unconfirmed",
        "A configuration with `confirm` is taken back when its event does not come in time, and the coordinator hears \
         `ID.reverted`, in whatever state it is: it is no answer to a state. On the way shown it is in a state in which no \
         transition hears it, so it would go on as if the configuration were in force. Add a transition on `ID.reverted` to a \
         state around all in which the configuration may wait for its confirmation, or wait for the event before going on.";
    COORD_NEVER_ENTERED = "coord::never_entered", "a state is never entered, whatever comes",
        "Transitions lead to the state, and in all that was followed none of them is taken: where they begin, what they wait for never comes. Most \
         often an answer stands there in the place of an event (`fast.ok` leads to the state that asks for `fast`), or a transition that is tried before \
         it takes the same event. It is a warning where all was followed and only answers to what nobody asks for elsewhere lead there; else a note: a state may be there for what does \
         not come in this deployment.";
    COORD_STUCK = "coord::stuck", "the coordinator can get to where nothing leads on",
        "On the way shown, the coordinator reaches a state in which no answer is awaited and no event leads anywhere, \
         neither from inside nor from outside. Only a stop without its coordinator gets the system out. Where the state waits for answers, \
         they belong to requests that were not made on this way: ask on the entry of the state, so that it is asked for on \
         every way there. Else add a transition, at least on the shutdown event.";
    COORD_NO_WAY_DOWN = "coord::no_way_down", "the state that means down cannot be reached from here",
        "`check` followed every order of events from the state shown, and none leads to `shutdown.down`, even if every \
         request succeeds from there on. It would have to be stopped without its coordinator (exit status 4). Add the transitions that lead down from there. The event that begins the shutdown \
         is raised once: where nobody hears it in some state, or where a state on the way down waits for it again, what is \
         there is taken down without the coordinator. Hear it in a state around all of those, or let an answer or a time lead \
         on. What a component or a monitor reports leads on only where it is sure to come then: not where it may have come \
         before, and not where it tells that something has failed. A bring-up that ends in a state listed under `deploy.failed` is \
         stopped there.";
    COORD_LEFTOVERS = "coord::leftovers", "a way down leaves components behind",
        "On the way shown the coordinator reaches the state that means down with components still there. They \
         would be taken away without the order that the coordinator knows. Let every way down undo or destroy what was \
         applied on the way up.";
    COORD_SHARED = "coord::shared", "two coordinators touch the same component",
        "The configurations of one coordinator touch a component that those of another touch, or one that an operator may apply \
         touches what both touch. At run time one of them may be \
         refused something because of the other's frames (nothing is broken by that: it is refused and named), and of two that write the same \
         property or port the later one holds. The \
         coordinators are followed together; what comes of it is told by findings of its own, and this is a note. Where they \
         were not followed to the end, it is a warning. Give each coordinator components of its own, or let one coordinator \
         ask the other by an event.";
    COORD_RACED = "coord::raced", "two coordinators write the same at once, with different values",
        "One event has two coordinators ask for configurations that write the same property or port, with different values. Neither is \
         refused, for a value that is written bars nobody, and both are applied one after the other: which of them is the later one, and \
         holds, depends on which coordinator is quicker. Let one of them ask for it and tell the other by an event (`emits`), or let one wait for \
         what the other one tells.";
    COORD_REFUSED_BY_OTHER = "coord::refused_by_other", "one coordinator is refused something because of another's frames",
        "Coordinators side by side were followed together, and one of them is refused something because frames of those named \
         are in the way: they share a component or a group with it, and without them it would not be refused. Nothing is \
         broken by that, the request is answered as failed; but whether it happens depends on which of them was first. The \
         trace shows a shortest way. Give each coordinator components of its own, or let one ask the other by an event. Where it \
         is an operator's frame, the operator undoes it first, or `operator:` does not list it.";
    COORD_STACK_GROWS = "coord::stack_grows", "going round makes the stack grow",
        "The coordinator can go round a circle of states that applies a configuration each time and never undoes it, \
         though elsewhere it undoes that configuration by name. Each round leaves a frame; past the limit the oldest are \
         squashed together and can no longer be undone one by one. Undo it on the way round, scope it to a state \
         (`config = …`), or give it a group. Where its undo failed on that way, lead from there to a state that asks for its \
         undo once more.";
    // ---- run time: platform, configurator, session -----------------------------------------------------------------
    UNKNOWN_REQUEST = "run::unknown_configuration", "a request names no configuration",
        "A request was raised whose name is not a configuration of the running deployment. It was answered `ID.failed` and \
         nothing was done. Correct the name in the coordinator or in the command, or add the configuration to the deployment.";
    QUEUE_FULL = "run::queue_full", "the configurator's queue is full",
        "More requests are waiting than the configurator's bounded queue holds. The request was answered *failed* instead of \
         being dropped silently. A coordinator should wait for an answer before it asks for more.";
    ANSWERS_FULL = "run::answers_full", "the coordinator has no room for another answer",
        "Room for an answer is taken when a coordinator asks. This one has asked for so much without hearing the answers that there \
         is none left, so the request was answered *failed* at once and nothing was done. A coordinator should wait for an answer \
         before it asks for more.";
    NOT_FROM_OUTSIDE = "run::not_from_outside", "an event that nobody outside may raise",
        "Answers of the configurator, such as `engage.ok`, and the events of the statechart itself, such as `e_done@root.a`, tell a \
         coordinator what has happened. If a command, a client of the control socket, a script or an embedding program raised one, the \
         coordinator would be told what has not. Ask for what is meant (`davit apply engage`): the answer goes to whoever asks. What \
         components and monitors raise, `COMPONENT.faulted` among it, is no such event.";
    STEP_FAILED = "run::step_failed", "a step failed",
        "The platform answered that a step did not happen: it was refused, or the component's own code failed or panicked. \
         What the request had done before was undone, unless the answer is *broken*. Mend what the message names and ask again.";
    STEP_TIMEOUT = "run::step_timeout", "a step did not answer in time",
        "A component did not answer before the step's deadline. What really happened was read back from the platform, and the \
         request was undone. A component whose call never returns is kept in quarantine: no plan may use it until it returns. \
         Find out what the component waits for, or raise `limits.step_timeout_s`.";
    CONFIGURATION_TIMEOUT = "run::timeout", "a configuration was not applied within its time",
        "The configuration has a `timeout`, and it was over before all steps were done. What had been done was undone. Raise the \
         timeout, or see in the log which step takes so long.";
    BROKEN = "run::broken", "the system is neither as before nor as asked for",
        "An application failed and was not undone completely: a step failed while undoing, taking it back would move something \
         nobody asked to move, something irreversible had been done, an outcome could not be settled, or the configuration says \
         `on_failure = \"hold\"`. What was done and not taken back is a frame marked *partial*; `davit undo ID` takes it back as far \
         as that goes. What is not known, or differs from the model, stays claimed until it is recovered: `davit drift` shows it, \
         `davit recover --back` undoes it, `davit recover --accept` takes it as it is.";
    STILL_BROKEN = "run::still_broken", "what the request names is broken since an earlier request",
        "An earlier request left components of which not all is known, or that are not as the model has them. Plans are made from \
         what is known, so a request that names one of them is refused; everything else goes on. `ID.undo` of the configuration \
         that broke repairs them, straight to where it leads, and so do `davit recover --back`, `davit recover --accept` and a shutdown.";
    DOES_NOT_STAND = "run::does_not_stand", "what a configuration stands for did not become true",
        "A configuration says with `holds` what it stands for. All its steps were done, and within its `timeout` (else within \
         `limits.step_timeout_s`) the condition did not become true on what was written after the last of them. So it failed, \
         and was taken back like after a failed step. A port that is written only when its value changes may have nothing to \
         show then: let it be written periodically, or look at something else.";
    STANDS_NO_MORE = "run::stands_no_more", "what a configuration stands for is no longer so",
        "The condition under `holds` was true when the configuration was applied, and became false while it is in force, by \
         itself, by a fault or by a later configuration. Nothing is undone; the coordinator hears `ID.lost`, once until the \
         configuration is applied anew, and `davit status` marks it.";
    SEEN_OTHERWISE = "run::seen_otherwise", "the platform is not as the model has it",
        "Now and then the configurator looks whether components are as its steps have left them. These are not: a step was \
         reported done and was not, or somebody else changed them. They are broken: a request that names one of them is \
         refused, and the coordinator hears `ID.lost` of the newest configuration that wrote what differs. `davit drift` shows \
         the difference, `davit recover --back` mends it, `davit recover --accept` takes the system as it is.";
    LEFT_BY_EMERGENCY = "run::left_by_emergency", "an emergency is over, and something is not as before it",
        "Safe configurations were applied, something failed, was late or was interrupted meanwhile, and all of them were taken \
         back. What is in force now was in force before, and the system is not as it was then: what one of them, or what it \
         interrupted, had done was taken for somebody else's. Where nothing moves by that it is put right at once; else it is \
         broken until somebody recovers it. `davit drift` shows the difference.";
    INTERRUPTED = "run::interrupted", "a safe configuration went first",
        "A configuration marked `safe` was requested while this request was being carried out. No further step of it was issued, \
         the safe configuration was applied, and what it did not touch was rolled back. Ask again when it is safe to.";
    OVERTAKEN = "run::overtaken", "a queued request was overtaken by its own undo",
        "`ID` was still waiting when `ID.undo` of the same requester came: both cancel each other and nothing is done at all. \
         The first is answered `ID.cancelled`, the second `ID.undone`.";
    GIVEN_UP = "run::given_up", "a request was given up by its own undo",
        "`ID.undo` came from the same requester while `ID` was being carried out: no further step of it was begun, calls that \
         were out were told to end, and what had been done was taken back, also what moves. It was answered `ID.cancelled`.";
    MOVES_WHILE_SAFE = "run::moves_while_safe", "something would move while a safe configuration is in force",
        "While a frame of a `safe` configuration is in force nothing moves, except by a request that the coordinator raises in \
         a later step: an undo raised in the same step as the safe configuration is refused when a step of it moves, and so \
         is an operator's request without `--force`. Nothing was done.";
    OVERWRITES_SAFE = "run::overwrites_safe", "an operator would overwrite what something safe has written",
        "While a frame of a `safe` configuration is in force, what it has written, and its place in its group, is changed by an operator \
         only with `--force`, also what `operator:` lists: whoever looks at it takes it for held. What a coordinator asks for in a later step \
         goes. Nothing was done.";
    MOVES_UNASKED = "run::moves_unasked", "something would move that nobody asked to move",
        "A confirmation did not come in time, and taking the configuration back would move hardware. Nobody asked for that: the \
         frame stays, the answer is `ID.undo.failed`. `on_failure = \"rollback\"` in the configuration lets it move.";
    BUSY = "run::busy", "what the request needs is being worked on",
        "Undoing down to a number of frames, committing, recovering and undoing the frame of somebody else need that nothing \
         is under way or waiting that concerns the same components. Nothing was done. Ask again when it is quiet.";
    NEEDS_FORCE = "run::needs_force", "an operator's request concerns a coordinator's frame",
        "An operator undoes the operator's own frames, and commits while no frame of a coordinator is in force. What belongs to a \
         coordinator is taken back by that coordinator, which else would not know of it. With `--force` it is done all the same.";
    NOT_LISTED = "run::not_listed", "an operator applies what the deployment does not list",
        "While a deployment is up, an operator (a terminal, the control socket, a script) may apply what its `operator:` lists, \
         and what is `safe`: `davit check` looked at what comes of these at any time. Anything else is answered `ID.failed` and \
         nothing is done. Add the configuration to `operator:` and check the deployment, or say `--force` (`{force = true}` in \
         a script, `\"force\": true` on the socket).";
    NOT_CONFIRMED = "run::not_confirmed", "a confirmation did not come",
        "The configuration says `confirm`: after it was applied an event had to come within a time, and it did not. Its frame was \
         popped and `ID.reverted` raised. Find out why the event did not come, or give it more time.";
    CONFIGURATOR_PANIC = "run::configurator_panic", "the configurator itself failed",
        "A defect of the configurator was caught: the request was answered *broken*, and the configurator was started anew with \
         its picture of the system read back from the platform. Please report it with the log; compare with `davit drift`.";
    NOTHING_TO_UNDO = "run::nothing_to_undo", "there is no frame to undo",
        "An undo was asked for while no configuration is in force (or not as many as were to be undone), so there was nothing to \
         take back and nothing was done. `davit stack` shows the frames in force.";
    ENDED = "run::ended", "the system is being taken down",
        "The request came while everything was being taken down, or after the configurator had ended. It was answered instead of \
         being dropped, and nothing was done. Deploy again before asking for configurations.";
    QUARANTINED = "run::quarantined", "a component is in quarantine",
        "An earlier call of this component never returned, so nobody knows what it is doing. No plan may use it until the call \
         returns and the platform has cleaned it up. Restart the component or the platform it runs on, or leave it out.";
    // ---- youbot and standard libraries -----------------------------------------------------------------------------
    // ---- command line ----------------------------------------------------------------------------------------------
    CLI_BAD_SET = "cli::bad_set", "`--set` gives no parameter a value",
        "Parameters of the files are given as `--set NAME=VALUE`; the name may have dots, `--set gains.k=2.5`. They \
         override what the deployment says under `with:`. Without an equals sign there is nothing to give.";
    CLI_OVERWRITES = "cli::overwrites", "files are there that would be written over",
        "The names of what is written into a folder are the program's own, and a file of one of them is there with another text. \
         It may be another deployment's, or somebody's own: nothing was written. Name another folder, or say `--force`.";
    CLI_UNWRITABLE = "cli::unwritable", "the output cannot be written",
        "`-o FILE` names a file that cannot be created or written: the directory is missing, it is a directory itself, or \
         permission is denied. Nothing was written. Name another file, or leave `-o` out to print to the terminal. Or what \
         a command prints could not be written where its output goes, as to a full disk: part of it is missing. A \
         deployment lives on all the same; its command says so when it ends. A reader that goes away (`| head`) is no error.";
    CLI_NOT_EMPTY = "cli::not_empty", "the folder is not empty",
        "`davit new FOLDER` begins a deployment in a folder of its own. There is something in this one, which may be yours: nothing was written. \
         Name a folder that is not there yet, or an empty one.";
    CLI_UNKNOWN_MONITOR = "cli::unknown_monitor", "there is no such monitor",
        "The file has monitors, but none of the name that was given. Correct the name, or leave the option out to run all \
         of them.";
    CLI_UNKNOWN_TYPE = "cli::unknown_type", "there is no such component type",
        "`davit types` was asked for a type that neither the libraries of this program nor the deployment has. `davit types` \
         without a name lists all of them; types of a deployment are listed with `davit types FILE`.";
    CLI_UNKNOWN_CONFIGURATION = "cli::unknown_configuration", "the deployment has no such configuration",
        "`davit plan FILE ID…` plans configurations of the deployment, one after the other. There is none of this name in \
         the files that the deployment lists under `configurations`. Correct the name; without names, the bring-up is planned.";
    CLI_EVENTS_UNREADABLE = "cli::events_unreadable", "the file of events cannot be read",
        "`davit sim --events FILE` reads lines of events from a file, or from standard input as `-`. The file is missing, is \
         a directory, is no text, or has no end that is in sight: a line has at most 1 MiB, and all of them 64 MiB. Name another \
         one; each line is a set of events, `run`, or `advance SECONDS`.";
    CLI_MEMORY_UNKNOWN = "cli::memory_unknown", "it is not known how much memory is taken up",
        "`davit check --budget 2GB` bounds the memory of the process, and asks the operating system how much that is \
         (`/proc/self/status`). Here it does not tell. Bound the number of transitions (`--budget 2M`) or \
         of states (`--budget 500Kstates`) instead.";
    CLI_WHICH_COORDINATOR = "cli::which_coordinator", "it is not said which coordinator is meant",
        "The deployment has several coordinators (`coordinators:`), and the command works on one. Give its name with `--of NAME`.";
    CLI_NO_FINDING = "cli::no_finding", "there is no finding of that number",
        "`davit check FILE --trace N` shows the way to the N-th finding, counted from 1 in the order in which `davit check FILE` lists errors, \
         warnings and notes.";
    CLI_UNKNOWN_SUBSYSTEM = "cli::unknown_subsystem", "there is no subsystem of that path",
        "`--in PATH` looks into one subsystem of a deployment. The path is made of the names under `subsystems:`, from the deployment \
         that is shown: `left`, or `cell/left` of one in a subsystem; a deployment without `subsystems:` has none. `davit status` and \
         `davit graph FILE` show them all.";
    CLI_WHICH_WAY = "cli::which_way", "it is not said how to recover",
        "`davit recover` leads a broken deployment out, and there are two ways: `--back` undoes what remains, to the system \
         before the interrupted application; `--accept` takes what is there as the state and gives the stack up. Which is \
         right is for a person to decide. Say one of them; `davit drift` shows what differs.";
    CLI_FORMAT_OF_COORDINATORS = "cli::format_of_coordinators", "the format is one of coordinators only",
        "PlantUML, SCXML and rFSM's JSON have a form for statecharts and none for components or plans. Ask for `--what coordinator`, or for a picture.";
    CLI_CONTRADICTS = "cli::contradicts", "two options do not go together",
        "An option was given that says nothing beside what else was asked for: `--live` marks active states, which only a picture of \
         coordinators has; `--pace` is about simulated time, and real time goes by as it does. Leave one of the two out.";
    CLI_UNKNOWN_CODE = "cli::unknown_code", "there is no finding with this code",
        "`davit explain` was asked about a code that no finding carries. Codes are printed with every finding, as \
         `davit::area::name`; the leading `davit::` may be left out. `davit explain` without a code lists all of them.";
    CLI_NAME_TAKEN = "cli::name_taken", "a deployment of that name is already running",
        "Every running deployment has a control socket of its own name, and one of this name answers already. Take the \
         other one down (`davit shutdown NAME`), or give this one another `name` in its file.";
    CLI_SYSTEM = "cli::system", "the operating system refused",
        "Something the command needs from the operating system (a socket, a thread, a signal, a process) was refused; \
         the message is the system's own. Usually a directory that cannot be written, or a limit on threads or open \
         files.";
    SCRIPT_SYNTAX = "script::syntax", "the script does not parse",
        "The script given to `davit run` is not a Lua 5.4 program; the message says in which line Lua gave up. Mend it \
         there; nothing was deployed.";
    SCRIPT_FAILED = "script::failed", "the script failed",
        "A function of the script raised an error: an assertion that does not hold, a wait whose time is over, a name \
         that does not exist, a deployment that did not come up. The deployment was taken down before the command \
         ended. The functions a script may call are described in docs/scripts.md.";
    SCRIPT_MISSED = "script::missed", "a figure of the script is out of its bounds",
        "The script ran to its end, and something that it measured (`expect{ name = …, value = …, max = … }`) is more or less \
         than it may be, or not a number. Each is told with its line, what it is and what was expected; the table at the end has \
         all figures, and `where it failed` says what was in force when the first one was missed. Record more (`sample{ … }`, \
         `davit run SCRIPT --samples DIR`), look at the series, and mend the system or the bound.";
    SCRIPT_UNKNOWN_PARAMETER = "script::unknown_parameter", "nothing reads the parameter",
        "`--set NAME=VALUE` gives a parameter to the script, which reads it with `param(\"NAME\", DEFAULT)`, or to the deployments that it \
         loads, whose Lua files read it by its name. Neither does here: it is misspelt, or the script reads it only after its \
         `deploy`. Write it as the script does, or read it before.";
    CLI_NOT_RUNNING = "cli::not_running", "there is no such running deployment",
        "The command talks to a running deployment through its control socket, and none of that name (or none at all) \
         answers. Start one with `davit deploy FILE`. Sockets are looked for in $XDG_RUNTIME_DIR/davit: a deployment \
         started by another user, or with another value of that variable, is not seen. One that ended left its log: `davit log \
         NAME`; of one that died without being shut down `davit status NAME` tells when, and how far it was.";
    CLI_NOTHING_KEPT = "cli::nothing_kept", "nothing is kept of such a deployment",
        "What `davit list --forget NAME` throws away is what is kept of a deployment that does not run any more: its log, how it \
         ended, that it died, or a damaged record. There is none of that name, or it runs: `davit shutdown NAME` takes it down first.";
    CLI_SEVERAL_RUNNING = "cli::several_running", "several deployments are running",
        "The command was given no name and more than one deployment is running, so it is not known which is meant. \
         Give the name: `davit status NAME`, `davit event E --on NAME`.";
    CLI_NO_ANSWER = "cli::no_answer", "the running deployment does not answer",
        "The control socket is there and something listens on it, but no answer came within what `--within` allows and one \
         second more, or the connection was closed. The deployment may just have ended: `davit status` tells. If it is stuck, `davit shutdown --force` \
         takes it down without its coordinator.";
    CLI_SOCKET_GONE = "cli::socket_gone", "the socket of a running deployment is gone",
        "A process owns the deployment's name, but the file of its control socket is not there any more: somebody removed it, \
         or the directory was cleaned up (a logout does that to XDG_RUNTIME_DIR). It runs on, and no second deployment of \
         that name can start. It can be reached by signals only: Ctrl-C in its terminal, or SIGINT to its process (`pgrep -af \
         davit` shows the number), shuts it down in order.";
    CLI_UNTRUSTED = "cli::untrusted", "a control socket is not the user's own",
        "A command talks to a deployment only where the directory of the control sockets, the socket and the process that listens \
         on it all belong to the user, others may not write to the directory, and neither is a symbolic link: who else put \
         something there could answer in the deployment's name. A deployment turns away the processes of other users in the \
         same way. Set XDG_RUNTIME_DIR to a directory of your own, for the deployment and for the commands.";
    CLI_REFUSED = "cli::refused", "the running deployment refused",
        "The running deployment understood the request and said no; the message is its own. An unknown event or \
         configuration is refused at once; a wait that ran out is told as such, and the request itself may still be \
         answered: `davit log` shows it.";
    // ---- monitors --------------------------------------------------------------------------------------------------
    MONITOR_UNNAMED = "monitor::unnamed", "a monitor has no name",
        "Monitors are switched on and off, shown and recorded by their names. Write each as `name = monitor { … }` inside \
         `Monitors { … }`.";
    MONITOR_DUPLICATE = "monitor::duplicate", "two monitors have one name",
        "Monitors are switched on and off by their names, so a deployment has one of each, in whichever of its files. \
         Give one of them another name.";
    MONITOR_UNKNOWN_WORD = "monitor::unknown_word", "a word that is no condition or no signal",
        "Conditions and signals are made with a fixed list of words, the same in Lua and in YAML; the chapter on \
         monitors has the table. A signal (a port, its age, a norm) has a number and becomes a condition when it is \
         compared with another.";
    MONITOR_ARGUMENTS = "monitor::arguments", "a word of the monitor language has other arguments",
        "Each word takes a fixed number of arguments, or one list. The help shows one that is right; in YAML the same \
         word is the key and the list its arguments.";
    MONITOR_BAD_INTERVAL = "monitor::bad_interval", "an interval of time is none",
        "The interval of `once`, `historically` and `since` has two ends in seconds, which say how long ago: the newer \
         one first, neither in the future; the older one may be infinite (`math.huge`, in YAML `.inf`).";
    MONITOR_BAD_HYSTERESIS = "monitor::bad_hysteresis", "a hysteresis that cannot be",
        "A hysteresis says how far a signal must go back before an ordered comparison that was true ends; it is 0 or \
         more. `equals` and `differs` have no side to which it could reach.";
    MONITOR_AGE = "monitor::age", "an age is used in another way than compared with a time",
        "The age of a sample grows all the time, between samples too. It is therefore compared with a number of seconds \
         directly, which becomes true at an instant that is known beforehand; norms, differences and a hysteresis of \
         ages have no such instant.";
    MONITOR_TOO_DEEP = "monitor::too_deep", "conditions are nested too deeply",
        "Conditions within conditions are read up to a fixed depth, beyond what can be understood, so that both \
         languages can express each of them. `all` and `any` take as many conditions as are wanted, side by side.";
    MONITOR_COMPARED = "monitor::compared", "a signal is compared with Lua's own operators",
        "`age(\"A.x\") > 0.1` is calculated by Lua when the file is read, once, and cannot be recorded as a condition. The \
         words `below`, `at_most`, `above`, `at_least`, `equals` and `differs` can.";
    MONITOR_NOT_A_NUMBER = "monitor::not_a_number", "a signal is neither a number nor a bool",
        "Conditions compare numbers; a bool counts as 0 or 1. What the port carries is something else: name the field or \
         the element that is meant (`Arm.state.qd[0]`, counted from 0).";
    MONITOR_NO_SUCH_PART = "monitor::no_such_part", "what a port carries has no such field or element",
        "The value of the port is looked into by fields (`.name`) and elements (`[0]`, counted from 0), as its type says; \
         `davit types` shows it. Correct the name or the index.";
    MONITOR_EVENT_TAKEN = "monitor::event_taken", "a monitor raises what only Davit itself may raise",
        "Answers of the configurator, such as `engage.ok`, and the events of the statechart itself, such as \
         `e_done@root.a`, tell the coordinator what has happened. If a monitor raised one, the coordinator would be told \
         what has not. Give the monitor's event another name.";
    MONITOR_NOTHING_REPEATED = "monitor::nothing_repeated", "a monitor repeats an event that it does not have",
        "`repeat_every` raises `event` again and again while the condition stays true. Without `event` there is nothing to \
         repeat; `cleared` is raised once.";
    MONITOR_NOT_RUN = "monitor::not_run", "the monitors of a deployment never run",
        "A deployment's monitors are a component of it, of the type `davit.Monitors`: they watch while it runs, in the \
         rounds of its activity. No configuration creates one, so nothing is watched. Create it where the other \
         components are created, as in `create(\"Monitors\", \"davit.Monitors\", { activity = \"safety\" })`, in an \
         activity whose period is short enough for what is to be noticed. On the simulated platform no component does \
         anything, so there no monitor is evaluated either.";
    MONITOR_UNHEARD = "monitor::unheard", "nobody listens to an event of a monitor",
        "No transition of the coordinator waits for the event and no configuration is confirmed by it, so the monitor \
         watches in vain. The name may be misspelt in one of the two places.";
    CONF_EVENT_UNHEARD = "conf::event_unheard", "nobody listens to an event that a value names",
        "The property is one whose value is the name of an event that the component raises (`raises: true` in its type). No transition of the \
         coordinator waits for this one and no configuration is confirmed by it, or it is of a name that only Davit itself tells things by. It may be misspelt in one of the two places; where nothing is to be raised \
         leave the value out, or give \"\".";
    // ---- the simulated platform ------------------------------------------------------------------------------------
    SIMULATED_UNKNOWN_STEP = "simulated::unknown_step", "a reaction or a fault of the simulated platform names no step",
        "`simulated: { reactions: [...] }` says what components raise by themselves after a step was done, `faults: [...]` \
         which steps go wrong. The step is written as `davit plan` prints it, or with its beginning: `start radio`, `property_set radio.channel`, \
         `operation_call arm.home`, or a verb alone for all of its steps. Here the first word is no step's, or what follows \
         is no component or member, or stands in no step's text: the reaction or fault would never come.";
    SIMULATED_UNHEARD = "simulated::unheard", "nobody listens to what a simulated component raises",
        "A simulated component raises an event that no transition of a coordinator waits for, and no configuration is \
         confirmed by it. It is probably misspelt; if not, it can be left out.";
    SIMULATED_NOT_USED = "simulated::not_used", "`simulated` or `faults` is said of another platform",
        "`faults` are injected where the simulated platform runs the deployment, and nowhere else. What `simulated` says stands for the behaviour of components that the simulated platform does not run. On another \
         platform the components behave by themselves, and it is not used.";
    // ---- recorded samples ------------------------------------------------------------------------------------------
    SAMPLES_UNREADABLE = "samples::unreadable", "a file of samples cannot be read",
        "The file does not exist, may not be read, or is no text in UTF-8. Samples are comma-separated values: a first \
         line with `time` and the names of ports, then one line for each time.";
    SAMPLES_EMPTY = "samples::empty", "a file of samples holds no samples",
        "There is no first line with the names of the columns, or no line after it. A recording that was cut off, or one \
         whose logger never ran, looks like this.";
    SAMPLES_COLUMNS = "samples::columns", "the columns of a file of samples are not understood",
        "The first line names the columns: `time`, in seconds, then the signals as the monitors spell them \
         (`Dynamics.force[0]`), each once; every other line has as many cells. A cell that is left empty says that there \
         was no new sample at that time.";
    SAMPLES_MISSING = "samples::missing", "a monitor looks at something that was not recorded",
        "Every port, run state and counter that the monitors look at needs a column in the file of samples: without it, \
         their conditions would be false throughout, which says nothing. Record it, rename the column with \
         `--column SIGNAL=COLUMN`, or look at some of the monitors only.";
    SAMPLES_RENAMED = "samples::renamed", "`--column` names something that is not there",
        "`--column SIGNAL=COLUMN` takes a signal that the monitors look at from a column of another name. The signal is \
         spelt as the monitors spell it, the column as the first line of the recording does.";
    SAMPLES_UNUSED = "samples::unused", "columns of a file of samples that no monitor looks at",
        "A recording may hold more than the monitors need. If a monitor was meant to look at the column, its name is \
         spelt in another way there.";
    SAMPLES_BAD_NUMBER = "samples::bad_number", "a cell of a file of samples is no number",
        "Cells hold numbers (`0.5`, `-1e-3`), `true` or `false`, the name of a run state in the column of one, or nothing. \
         Units and other texts belong into the name of the column or nowhere.";
    SAMPLES_NAN = "samples::nan", "samples that are not a number",
        "The recording holds NaN. A comparison with it is false, whichever it is, and its robustness is minus infinity: \
         nothing can be said of a value that is none. Look at what produced it.";
    SAMPLES_MERGED = "samples::merged", "a condition over time saw more changes than it remembers one by one",
        "A condition over time remembers 4096 changes of its signal that may still matter; a signal that only falls (or \
         only rises) for as many samples needs more, and so does a sample rate over a time with more samples. Changes \
         that lie within 4/4096 of the time of each other are then told apart no more: its ends lie up to that much \
         further in, and a sample rate counts samples up to that much longer. docs/monitors.md says it exactly.";
    SAMPLES_BAD_TIME = "samples::bad_time", "a time of a file of samples is no time",
        "The column `time` holds seconds, 0 or more, in every line. A line without a time cannot be put anywhere.";
    SAMPLES_GAP = "samples::gap", "a gap between samples is too long to go through step by step",
        "Between two lines, monitors that run at a rate or repeat their events are evaluated at each of their times, up to \
         a bound. After it the rest of the gap is passed in one step: events that would be repeated in it are raised \
         once. Look whether the times of the recording are in seconds.";
    SAMPLES_BACKWARDS = "samples::backwards", "the time of a file of samples goes backwards",
        "Each line is at the time of the one before it or later. Recordings of several runs one after the other, and \
         clocks that were set meanwhile, look like this: cut the file there.";
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
