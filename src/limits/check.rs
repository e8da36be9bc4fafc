//! How much `check` follows, and at how much of each thing it looks.

/// Events and answers that `check` follows through a coordinator before it says that it has not seen everything, unless
/// `--budget` says otherwise. About a second of work; one robot of the youBot coupling beside another one needs 487,000.
pub const CHECK_TRANSITIONS: usize = 800_000;

/// Events and answers that are followed of a parent with all that is known of the order in which its subsystems tell things, or three of eight of
/// `--budget`. Where there are more it is followed with subsystems that may tell anything in any order: that has fewer states, and may refuse too much;
/// and before that with subsystems that take an event before the next one comes, only to see what is told where nobody waits for it.
pub const CHECK_BELIEVED: usize = 300_000;

/// States of a subsystem, each as often as it differs in what its parent was told and in what has failed, up to which an interface automaton is
/// made of them, or an eighth of `--budget`. One with more may tell anything in any order.
pub const CHECK_PLACES: usize = 100_000;

/// States of a parent, each with one in which a subsystem may be there, that are looked at for whether what that one tells leads down: they take some
/// 30 bytes each.
pub const CHECK_VAIN: usize = 1_000_000;

/// The largest number of transitions that `--budget` takes, and of states.
pub const CHECK_TRANSITIONS_MOST: usize = 1_000_000_000;

/// States after which `check` tells how far it is, and asks whether to go on: some milliseconds.
pub const CHECK_TELL: usize = 2_048;

/// Batches of one coordinator that `check` lets be unanswered at once: while so many are, it follows no event from outside
/// that this coordinator would take, and says so. What goes wrong when requests queue up goes wrong with two of them.
pub const CHECK_WAITING: usize = 2;

/// The same where following is easy.
pub const CHECK_WAITING_MOST: usize = 6;

/// Transitions up to which following counts as easy: then it is done anew with more batches that wait, if there are any.
pub const CHECK_EASY: usize = 10_000;

/// Worlds in which `check` goes round a cycle that leaves a frame of one configuration each time, until the oldest frames are
/// squashed, where following is easy; else in one. In each of them all requests of the cycle are planned as often as frames have
/// room.
pub const CHECK_ROUNDS: usize = 4;

/// Transitions of several coordinators up to which they are followed anew with it in mind whether the event that ends the
/// deployment has come: that makes up to twice as many of each state.
pub const CHECK_STOPPING: usize = 150_000;

/// Transitions up to which they are followed anew with what an operator's safe configuration leads to: that makes many times
/// as many.
pub const CHECK_BY_HAND: usize = 20_000;

/// Transitions up to which it is looked whether what is left out (orders of what comes to several coordinators, several frames of an
/// operator) would be judged otherwise; where there are more, it is said to be left out.
pub const CHECK_PROBED: usize = 10_000;

/// Transitions that are followed to look for that.
pub const CHECK_PROBE: usize = 50_000;

/// Transitions on which no undo fails from which on `check` at first follows only one batch of a coordinator at a time behind an undo
/// that fails, and says so where following all there is behind one is too much for the budget.
pub const CHECK_LEAN: usize = 5_000;

/// Configurations whose frames may be left by undos that failed, from which on that is known of one at a time: of fewer there are no more
/// subsets than that needs states.
pub const CHECK_ASIDE: usize = 5;

/// Requests that wait at once and are followed no further: past [`CHECK_WAITING`] only answers add to them, and what
/// adds more than it takes does so for ever. Several times as many as one step of a coordinator asks for.
pub const CHECK_PILED: usize = 32;

/// Frames of one configuration and one coordinator that `check` follows: a fourth one means that going round adds one
/// each time.
pub const CHECK_FRAMES: usize = 3;

/// The same behind an undoing that failed: there it is the failing that adds one each time, which is no mistake of the
/// coordinator. What one left frame under another leads to, further ones do too.
pub const CHECK_LEFT: usize = 2;

/// States on a way from a safety event to a safe configuration.
pub const CHECK_CYCLE: usize = 128;

/// Answers one after the other that `check` follows on the way up or down; more of them only a coordinator gives that goes
/// round for ever.
pub const CHECK_DRIVEN: usize = 10_000;

/// Configurations of a deployment and its subsystems that are driven up and down as one: what is asked for is planned in the whole system,
/// some 0.2 s for a robot's fifty.
pub const CHECK_TOGETHER: usize = 200;

/// States that are looked at for that: it mostly goes straight there.
pub const CHECK_TOGETHER_WAYS: usize = 4_000;

/// Batches that one event leads a coordinator to ask for, and that are followed; one that goes round by itself asks without end.
pub const CHECK_HANDED: usize = 64;

/// Times at which it is looked whether what a configuration stands for may come true by time alone.
pub const CHECK_STANDS: usize = 64;

/// Ways in which what one step asks for may meet what is under way, and that are followed.
pub const CHECK_FORKS: usize = 64;

/// Cycles of answers that are told; more of them say nothing new.
pub const CHECK_TOLD: usize = 4;

/// Types as which configurations create one component, up to which `check` judges each configuration by them: a hot swap
/// has a few. A connection is looked at for every pair of them.
pub const CHECK_TYPES: usize = 16;

/// Events on their way between coordinators that `check` follows, of more than three coordinators two for each: two that answer each other for
/// ever fill it.
pub const CHECK_INBOX: usize = 6;
