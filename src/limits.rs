//! Every bound of the system, with its unit and its reason.

mod asking;
mod check;
mod kept;
mod script;
mod sweep;
mod texts;

pub use asking::*;
pub use check::*;
pub use kept::*;
pub use script::*;
use std::time::Duration;
pub use sweep::*;
pub use texts::*;

/// Frames on a stack before the oldest are squashed into one. Enough for every switch of a session to be undone singly,
/// small enough that selective undo, which looks at the frames above, stays instant.
pub const STACK: usize = 64;

/// Plans of one configuration that are kept to be carried out again: for each set of demands that may be true already when
/// it is applied, of which few occur in turn.
pub const PREPARED: usize = 4;

/// Signals that follow each other so closely have one cause.
pub const SIGNAL_REPEATS: Duration = Duration::from_millis(100);

/// Without a pause as long as that no signal asks for the end at once: a key that is held down repeats sooner than that.
pub const SIGNAL_HELD: Duration = Duration::from_millis(500);

/// So long before its processor time is over a process is led down, or when half of it is.
pub const TIME_TO_LEAD_DOWN: Duration = Duration::from_secs(10);

/// How long one step may take where the deployment does not say: longer than any software-only change, short enough that
/// an operator does not think the program hangs.
pub const STEP_TIMEOUT: Duration = Duration::from_secs(1);

/// Connections a control socket serves at once: a coordinator, a few terminals and displays; each costs a thread.
pub const SOCKET_CONNECTIONS: usize = 32;

/// Connections beside them, for what must get through when all others are taken (`shutdown`, `status`, safety events): two
/// people who ask at the same time, and two that are still being told that they are too many.
pub const SOCKET_KEPT: usize = 4;

/// Bytes of a name up to which it is compared with those that are known, for *did you mean*.
pub const NEAR_NAME: usize = 512;

/// Descriptors that stay free beside all connections: what a deployment opens since (its log, its record) and for a moment (a snapshot, a folder
/// that is read).
pub const SOCKET_SPARE: usize = 12;

/// How many of these one process may have at a time: one that asks again and again takes none from the others.
pub const SOCKET_KEPT_EACH: usize = 1;

/// How long a connection on one of these may take to say what it wants: a program that connects knows it.
pub const SOCKET_SAY: Duration = Duration::from_secs(2);

/// How long a connection that has not subscribed may take from one line to the end of the next before its place is given
/// away: longer than any program is silent that still wants something; one that was only left open does not last.
pub const SOCKET_IDLE: Duration = Duration::from_secs(60);

/// How long a client waits for the socket of a deployment whose process lives: between taking its name and listening, and
/// between its last answer and its end, it has none.
pub const SOCKET_APPEARS: Duration = Duration::from_secs(2);

/// How often it looks.
pub const SOCKET_STEP: Duration = Duration::from_millis(10);

/// How often a command that follows a quiet deployment looks whether anybody reads it still.
pub const FOLLOW_LOOK: Duration = Duration::from_millis(250);

/// How long after the end of its time a bring-up is looked at once more: what came at that moment is heard first.
pub const LAST_LOOK: Duration = Duration::from_micros(700);

/// How many events are named of those that lead on from where something stands still.
pub const EVENTS_NAMED: usize = 3;

/// How often a subsystem whose time is over is looked at while something safe holds it.
pub const HELD_LOOK: Duration = Duration::from_millis(500);

/// How long stopping stands still, held by a safe configuration, before it is told what leads on.
pub const STANDS_TOLD: Duration = Duration::from_secs(2);

/// How soon an event that a component goes on raising while it is being stopped is told again.
pub const REPORTED_AGAIN: Duration = Duration::from_secs(5);

/// Different events of components that are kept while a deployment is being stopped.
pub const REPORTED: usize = 64;

/// How often a script that waits looks whether it is to end.
pub const SIGNAL_LOOK: Duration = Duration::from_millis(100);

/// How often whoever waits for an answer looks whether the client is still there.
pub const SOCKET_LOOK: Duration = Duration::from_millis(100);

/// How long nothing is accepted after the system had no descriptor left for it: some will be closed by then, and trying
/// at once would only keep a processor busy.
pub const SOCKET_PAUSE: Duration = Duration::from_millis(100);

/// Bytes of one line on the control socket: far more than any request, little enough to buffer for every connection.
pub const SOCKET_LINE: usize = 1 << 20;

/// Notifications that may wait for a slow subscriber before it is cut off.
pub const SOCKET_QUEUE: usize = 1024;

/// How long a client may take to accept what is written to it.
pub const SOCKET_WRITE: Duration = Duration::from_secs(5);

/// Things that may wait for a slow observer (a terminal, the subscribers) before they are dropped: the log's own length.
/// They are shared with the log, so that they take little more memory than it.
pub const TAP: usize = LOG_ENTRIES;

/// Lines beside them that a command says of itself (up, down, what is left): they have room when the queue is full.
pub const TAP_OWN: usize = 256;

/// How long simulated time stands still for an observer that takes nothing: somebody pages through the output. Then it
/// goes on without it.
pub const TAP_PATIENCE: Duration = Duration::from_secs(30);

/// How long the end of a command waits for an observer that takes nothing of what is left: a terminal that was stopped
/// (Ctrl-S) does not keep the process alive.
pub const TAP_END: Duration = Duration::from_secs(3);

/// How long it waits for what it says after that: the one stream may be read where the other one is not.
pub const TAP_END_AGAIN: Duration = Duration::from_millis(300);

/// Entries of the log kept in memory: an hour of busy switching, a few megabytes.
pub const LOG_ENTRIES: usize = 4096;

/// Of these, events that components and monitors raise by themselves: one that chatters a thousand times a second displaces
/// such events, its own and those of others, and nothing else of the log.
pub const LOG_REPORTS: usize = 1024;

/// How long a coordinator may react to one event before it is told that it does: a hundred times what a call of a function
/// may take by its budget. What takes longer waits outside of Lua.
pub const REACTION_LONG: Duration = Duration::from_secs(1);

/// How often it is told that events were dropped because a coordinator does not keep up; what comes in between is counted.
pub const DROPS_TOLD: Duration = Duration::from_secs(1);

/// Events that may wait inside a statechart for its next step. A pure chart never has more than one completion and one
/// time event per active state; the rest is for functions that send events, and for sets given to `davit sim`.
pub const CHART_QUEUE: usize = 1024;

/// Turns a statechart may take to come to rest. More than any chart needs that comes to rest at all; rFSM would never
/// return from one that does not.
pub const CHART_RUN: u64 = 10_000;

/// Reactions of a statechart that are worked out when it is compiled, with all they enter and raise: about 40 MB at most. A
/// chart past it is stepped by searching, which takes longer but not the more the larger it is.
pub const CHART_REACTIONS: usize = 1 << 20;

/// What finding these reactions may cost, in transitions and events looked at: a tenth of a second.
pub const CHART_WORK: u64 = 1 << 24;

/// Outgoing transitions of a node past which those of an event are looked up; up to it they are gone through faster.
pub const CHART_WIDE: usize = 32;

/// Transitions of a statechart that a running model may still add to, with the rows that are left behind when they move:
/// about 20 MB.
pub const GROWN_EDGES: usize = 1 << 18;

/// Levels of states in a statechart. People write five; the walk through a chart is recursive.
pub const CHART_DEPTH: usize = 100;

/// Elements of an XML document inside each other: as deep as states may be nested, and what the innermost holds.
pub const XML_DEPTH: usize = CHART_DEPTH + 8;

/// Lines of an interactive `davit sim` that can be taken back: taking one back does all the others again.
pub const SIM_LINES: usize = 10_000;

/// Actions of one line of `davit sim` that are shown from its beginning, and as many from its end: nobody reads what a machine
/// that does not come to rest does in ten thousand turns.
pub const SIM_ACTIONS_SHOWN: usize = 200;

/// Notes of one line of `davit sim` (what functions print, what goes wrong); more are counted.
pub const SIM_NOTES: usize = 1024;

/// Attributes of one XML element; ours has a few. Whether one stands twice is found by comparing each with each.
pub const XML_ATTRIBUTES: usize = 64;

/// Declarations of namespaces in one XML document: what an element declares is copied for it with all that is declared around it.
pub const XML_NAMESPACES: usize = 256;

/// Bytes of one line of `davit sim`: more events than its queue takes.
pub const SIM_LINE: usize = 1 << 20;

/// Bytes of events for one `davit sim`: days of an eager typist. What it has read of names it keeps.
pub const SIM_BYTES: u64 = 64 * 1024 * 1024;

/// Names of events that no transition lists and that come from outside all the same, since functions may see them. A name is
/// kept for ever.
pub const EVENTS_UNLISTED: usize = 4096;

/// Bytes of such a name.
pub const UNLISTED_BYTES: usize = 256;

/// Connectors one after the other on a path. People write three; the search is recursive.
pub const CONNECTOR_CHAIN: usize = 200;

/// Answers that a coordinator may wait for or has not heard yet: it asks for a few in one step. What it asks for beyond that is
/// answered *failed* at once.
pub const INBOX_ANSWERS: usize = 1024;

/// Requests of a coordinator that are not answered, from which on no event from outside is taken up: a crowd of these waits, and then
/// is refused, before it leads to more requests than the configurator's queue holds.
pub const INBOX_ASKED: usize = 32;

/// Events of monitors, components and other coordinators that may wait for a coordinator: some milliseconds of reacting. What
/// waits longer is no news any more; of each event that it waits for there is room for one beside them.
pub const INBOX_REPORT: usize = 4096;

/// Events from outside that may wait for a coordinator: a person types, and a program that sends faster than that is told.
pub const INBOX_OUTSIDE: usize = 1024;

/// Safety events, losses and the like for which an inbox has room from the beginning. There are two of each name at most;
/// beyond that it grows, and stays as large.
pub const INBOX_SINGLES: usize = 64;

/// Clients that may want to know what becomes of one urgent event that waits: one a connection.
pub const INBOX_JOINED: usize = SOCKET_CONNECTIONS + SOCKET_KEPT;

/// Turns in a row that a class of waiting events has while another one waits: enough for a burst of answers to be heard
/// before anything else, few enough that nobody notices the wait.
pub const INBOX_ROW: usize = 16;

/// Reactions of a coordinator at one moment of simulated time, after which each further one takes [`MOMENT_PAUSE`]: more than
/// what its inbox holds.
pub const MOMENT_ITERATIONS: u32 = 10_000;

/// What a reaction takes then: a deadline of seconds comes after some thousand rounds.
pub const MOMENT_PAUSE: Duration = Duration::from_millis(1);

/// Findings shown on a terminal in one go; more are counted, since nobody reads on.
pub const FINDINGS_SHOWN: usize = 50;

/// Instructions of the Lua machine one file may take. A written configuration takes a few; a generated deployment of
/// 100,000 components some millions.
pub const LUA_INSTRUCTIONS: u64 = 20_000_000;

/// Bytes the Lua state of one file may hold.
pub const LUA_BYTES: usize = 96 * 1024 * 1024;

/// Longest time of the processor one Lua file may use: the backstop for library calls, which count as one instruction
/// however long they take.
pub const LUA_TIME: Duration = Duration::from_millis(1500);

/// Longest string the Lua library functions make at once, in bytes.
pub const LUA_STRING: usize = 1024 * 1024;

/// Events and answers remembered for those who wait for one: a wait begins before what it waits for is asked, so only what
/// happens between two looks of the waiter must fit.
pub const HEARD: usize = 1024;

/// Events that components have raised and that are still to be written down: whoever raises one more writes them down itself.
pub const UNWRITTEN: usize = 256;
/// Operation calls in the inverse of squashed frames. Calls do not cancel like writes do, so they would pile up; with more
/// than this the oldest frames become a floor instead.
pub const SQUASHED_CALLS: usize = 256;

/// Requests that may wait for the configurator. A coordinator raises a few per step; hundreds waiting mean that it asks
/// faster than anything can be done, and the answer *failed* tells it so.
pub const REQUEST_QUEUE: usize = 256;
/// Requests that may wait where an operator asks for one more: the rest of the queue is the coordinators'.
pub const REQUEST_OPERATORS: usize = REQUEST_QUEUE / 2;

/// Requests for safe configurations that may wait beside them: these get in when the queue is full.
pub const SAFE_QUEUE: usize = 64;

/// How long whoever evaluates what configurations stand for waits after something came before it looks: what is written at
/// one moment is seen together, and components that write without pause cost at most ten thousand looks a second.
pub const HOLDS_LOOK: Duration = Duration::from_micros(100);

/// How often the configurator looks whether components that nothing is under way with are as its steps have left them: a
/// residual that nobody reported is found within some seconds, at a cost that nobody notices.
pub const OBSERVE_EVERY: Duration = Duration::from_secs(5);

/// How often what is broken is looked at again, since a safe configuration touched it while it was looked; a safe
/// configuration that comes more often than that is not a repair's to wait for.
pub const LOOKS_AGAIN: usize = 4;

/// So many lines of the log are looked through for what a recovery has done: what else happens in its seconds fits beside that.
pub const RECOVERY_LOOKS_BACK: usize = 1000;

/// Components looked at in one call then; a larger system is looked at in several, so that no step waits for long while a
/// platform reads.
pub const OBSERVED_AT_ONCE: usize = 256;

/// How often conditions on counters of activities are looked at: nobody tells when a counter goes on.
pub const HOLDS_COUNTERS: Duration = Duration::from_millis(100);

/// Reports of the platform (faults, late returns, confirmations) that may wait for the configurator. When more come at
/// once, it looks at the whole platform instead.
pub const PLATFORM_REPORTS: usize = 1024;

/// Commands that only ask (views, `drift`, `recover`) and may wait for the configurator.
pub const CONFIGURATOR_COMMANDS: usize = 32;

/// Commands that must not be lost: that a coordinator is down, that stopping begins, its stages, the end. A coordinator that
/// comes down again and again tells it once each time, behind which it waits for its answers.
pub const CONFIGURATOR_CONTROL: usize = 256;

/// Blocking platform calls made at the same time at most, whatever the deployment says: each takes a thread.
pub const WORKERS_MOST: usize = 64;

/// Panics of the configurator's thread, one after the other without its ever having nothing to do, after which what was under way
/// and what waits is given up.
pub const PANICS_IN_A_ROW: usize = 8;

/// Steps handed to a platform in one call: the way there and back is then a small part of them.
pub const BATCH_STEPS: usize = 256;

/// How long after the first step of a batch the embedded platform begins the last one of one call, and after which it tells
/// what was done so far: what waits for that is not kept waiting by their number, nor by one that hangs.
pub const BATCH_SEQUENCE: Duration = Duration::from_millis(10);

/// Workers that may be stuck in calls a platform never answered, beside those at work: then no further call is made, since
/// each holds a thread for ever.
pub const WORKERS_GIVEN_UP: usize = 64;

/// Workers beside all those, at work or stuck, for what is safe and for what is taken down: it must get through though others
/// hold all threads there are. Half of them may also look what came of a call.
pub const WORKERS_SAFE: usize = 64;

/// How long after its deadline a platform call may answer before its worker is given up: a platform promises "a little
/// later at most".
pub const PLATFORM_GRACE: Duration = Duration::from_millis(100);

/// Events that may wait in the queue of a connection of event ports whose policy is `data`.
pub const EVENT_FIFO: u32 = 64;

/// How long one round of an activity may take before it is reported stuck: a thousand periods of a fast control loop.
pub const ACTIVITY_STUCK: Duration = Duration::from_secs(1);

/// The shortest period of an activity; a shorter one would leave the operating system no time.
pub const SHORTEST_PERIOD: Duration = Duration::from_micros(10);

/// The period of the activity that components without one run in: quick enough to look at, cheap enough to forget.
pub const DEFAULT_PERIOD: Duration = Duration::from_millis(10);

/// Rounds that an event-driven activity makes without a rest before it takes one of [`EVENT_PAUSE`]: longer than any chain
/// of components, short enough that a loop of them is noticed.
pub const EVENT_ROUNDS: u32 = 1000;

/// The rest of an event-driven activity whose components wake each other without end.
pub const EVENT_PAUSE: Duration = Duration::from_millis(1);

/// Operations that may wait for an activity. They are called one after the other by a few workers.
pub const ACTIVITY_REQUESTS: usize = 64;

/// How often one fault of the simulated platform may happen at most: what is to go wrong more often is a slip of the pen.
pub const FAULT_TIMES: u32 = 1_000_000;

/// How long after its deadline a call that is to come back late does so on the simulated platform: long enough that whoever
/// waited has settled what became of it.
pub const FAULT_LATE: Duration = Duration::from_secs(5);

/// How long taking down the embedded runtime waits for each thread of it; one that hangs is left behind.
pub const RUNTIME_END: Duration = Duration::from_secs(1);
/// Blocking platform calls one session makes at the same time: enough to configure the components of a robot side by
/// side, few enough that a platform that answers nothing costs a handful of threads.
pub const SESSION_WORKERS: usize = 8;

/// How long a look at the configurator or the platform may take: they answer between two steps.
pub const VIEW: Duration = Duration::from_secs(5);

/// Steps remembered with an answer in the log; a deployment of thousands of components need not stay in memory.
pub const STEPS_LOGGED: usize = 256;

/// How long a script waits for a recovery, or for the platform to be read: a few hundred steps that take their usual time.
pub const SCRIPT_RECOVERY: Duration = Duration::from_secs(10);

/// Bytes of memory of one script.
pub const SCRIPT_MEMORY: usize = 256 << 20;
/// Instructions of one script: hours of stories, and a few seconds of an endless loop.
pub const SCRIPT_INSTRUCTIONS: u64 = 500_000_000;

/// Instructions of the Lua machine that one call of a coordinator's function may take (one resumption of a `doo`, one
/// guard): some ten milliseconds, a thousand times more than a reaction should take.
pub const CALL_INSTRUCTIONS: u64 = 1_000_000;

/// What one turn of a machine that a model steps itself costs the call's budget, in instructions, beside one for each
/// transition looked at and what its functions take: about as long as so many take. Without it a loop of turns without
/// functions would run for minutes.
pub const TURN_INSTRUCTIONS: u32 = 20;

/// Instructions between two looks at a call's budget.
pub const CALL_LOOK: u32 = 1_000;
/// The same where every instruction is counted, in simulated time: single ones may take long, so looks are closer. What
/// costs is that there are looks at all.
pub const CALL_LOOK_EXACT: u32 = 100;

/// Elements of a list, or bytes of a text, that a function of Lua's library goes through in the time of one instruction.
pub const CALL_ELEMENTS: u64 = 4;

/// Bytes of memory that a call may ask for in the place of one instruction, counted of pieces of at least this: together
/// half a gigabyte, a tenth of a second of copying.
pub const CALL_BYTES: usize = 512;

/// Processor time of one call in simulated time, a hundred times what its instructions take: for what no count sees (a
/// comparison of texts of megabytes is one instruction).
pub const CALL_TIME: Duration = Duration::from_secs(10);

/// The same of a script.
pub const SCRIPT_TIME: Duration = Duration::from_secs(60);

/// Processor time of its thread after which a call on the real clock has its instructions counted (at the latest after
/// twice this). Longer than a good function takes, whose calls then cost nothing but themselves; shorter than anybody
/// waits for a reaction.
pub const CALL_TICK: Duration = Duration::from_millis(10);

/// Instructions that one [`CALL_TICK`] of a counted call stands for, beside those that it executed: so instructions that
/// take long (long texts put together) end too, after two seconds of processor time. One that keeps its budget of plain
/// instructions is over before that counts.
pub const CALL_TICK_INSTRUCTIONS: u32 = 5_000;

/// Bytes that the Lua state of one coordinator with functions may hold.
pub const FUNCTIONS_BYTES: usize = 64 * 1024 * 1024;

/// Lines that functions may print between two looks of the coordinator; more are counted.
pub const SAID_LINES: usize = 256;

/// Characters of one printed line; the rest is cut off.
pub const SAID_LENGTH: usize = 4096;

/// Machines that the functions of one coordinator may make with `rfsm.init`.
pub const INNER_MACHINES: usize = 256;

/// How long a coordinator pauses before it resumes a `doo` that is not content to wait: rFSM would call it again at once
/// and keep a processor busy for nothing but that.
pub const DOO_BUSY: Duration = Duration::from_millis(1);

/// How long a coordinator pauses before it resumes a `doo` that is content to wait, or asks `getevents` again: as a host
/// that steps its machine a hundred times a second.
pub const DOO_IDLE: Duration = Duration::from_millis(10);

/// How soon a safety event that nobody leads after acts again by itself: a component may raise it in each update.
pub const SAFETY_AGAIN: Duration = Duration::from_secs(1);

/// How often what is there is brought to rest and taken away by force, where something is left of it: once more for what failed by chance, and
/// once for what that uncovers.
pub const FORCE_ROUNDS: usize = 3;

/// Between two moves of a way that a script replays: what is to happen at one instant on the way must not happen then by
/// chance in another order.
pub const REPLAY_STEP: Duration = Duration::from_millis(20);

/// So many rounds of a cycle that a script goes again and again are written out: the first, the last, and one between that is
/// repeated.
pub const REPLAY_ROUNDS: usize = 3;

/// Forced steps told one by one; more are told by number, so that a line can be read.
pub const FORCED_SHOWN: usize = 8;

/// Pieces of a signal that one operator over time of a monitor keeps; past it neighbours are merged. A window keeps the
/// extremes still to come, a few dozen for a signal that goes up and down; this many pieces are 130 kB.
pub const MONITOR_PIECES: usize = 4096;

/// Conditions and signals of a monitor within each other. People write five levels; each is two levels of YAML, which must
/// fit into [`TEXT_DEPTH`] with the file around it.
pub const MONITOR_DEPTH: usize = 24;

/// Bytes of one line of a file of samples: thousands of columns.
pub const SAMPLES_LINE: usize = 1 << 20;

/// Evaluations of monitors between two lines of a file of samples. A monitor that runs at 1 kHz has this many in a gap of a
/// quarter of an hour; more are not made one by one.
pub const SAMPLES_WAKES: u32 = 1_000_000;

/// Events that parents have raised and that subsystems have not taken up yet, of which it is told that nobody took them: more than that wait
/// in no inbox.
pub const OFFERED: usize = 1024;

/// Subsystems of one deployment, in each other or beside each other: of no more it is known, where coordinators are followed, how each stands
/// (`check/children.rs` keeps that in one word of a state), and what is not followed must not be called sound.
pub const SUBSYSTEMS: usize = 20;

/// Coordinators of one deployment, its subsystems' among them: `check` keeps a bit of each in one word of a state.
pub const COORDINATORS: usize = 60;

/// Subsystems in each other: a cell with robots with arms with grippers is four.
pub const SUBSYSTEM_DEPTH: usize = 8;
