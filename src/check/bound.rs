//! Bounds of what is followed, and what is said of those that cut something off.

use super::belief::MOST_UNTAKEN;
use super::effort::Effort;
use super::state::Failed;
use crate::limits;

/// A bound that cut something off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Bound {
    /// The transitions of an [`Effort`](super::Effort).
    Budget,
    /// The states of one.
    States,
    /// [`Halt::Memory`](super::Halt).
    Memory,
    /// [`Halt::Interrupted`](super::Halt).
    Interrupted,
    /// [`limits::CHECK_WAITING`].
    Waiting,
    /// [`limits::CHECK_LEAN`].
    Lean,
    /// [`limits::CHECK_PILED`].
    Piled,
    /// [`limits::CHECK_FRAMES`].
    Frames,
    /// [`limits::CHECK_LEFT`].
    Left,
    /// What fails where frames are squashed.
    Squashed,
    /// Which frames are squashed, where those that share nothing were pushed in one order and in another.
    Orders,
    /// What several undos that failed leave together, where that of one is known at a time.
    Aside,
    /// [`limits::CHECK_INBOX`].
    Inbox,
    /// [`limits::CHECK_HANDED`], [`limits::CHECK_FORKS`].
    Forks,
    /// [`limits::CHECK_BY_HAND`]: a safe configuration of an operator.
    ByHand,
    /// Several frames of an operator in force at once.
    Together,
    /// Frames of an operator that are squashed into one, and tie together who was followed apart.
    Tied,
    /// Whether it is led down where an operator has frames and a coordinator that is followed apart begins again.
    Begun,
    /// Two times that are over at the same moment, and lead to different ends.
    Ties,
    /// Ways up and down that come elsewhere in another order of answers and of what coordinators tell each other.
    Turns,
    /// What leads up from *down* and came just before the event that ends the deployment.
    Stale,
    /// Events from outside that come before all have heard what came before.
    Across,
    /// [`limits::CHECK_ROUNDS`].
    Rounds,
    /// [`limits::CHECK_STOPPING`].
    Stopping,
    /// A coordinator that is down goes on while others, followed apart, are not.
    Apart,
    /// A subsystem that is down goes on by itself, by a time.
    ByItself,
    /// [`limits::CHECK_STOPPING`]: that a coordinator begins again while others, followed apart, are led down.
    Anew,
    /// What a safe configuration of coordinators that are followed apart interrupts behind something that failed, and what comes while
    /// it is being applied.
    Elsewhere,
    /// A coordinator could not be entered.
    Entered,
    /// Whether what a configuration stands for becomes true where others change what it looks at.
    Stands,
    /// [`limits::CHECK_PLACES`]: in which order subsystems tell things.
    Told,
    /// [`limits::CHECK_BELIEVED`]: the same.
    Forgotten,
    /// [`MOST_UNTAKEN`](super::belief::MOST_UNTAKEN).
    Untaken,
    /// [`limits::CHECK_VAIN`]: whether what a subsystem tells from each of its states leads its parent on.
    Vain,
    /// [`limits::CHECK_DRIVEN`]: how long a way up or down lasts.
    Times,
    /// Times that count from when a coordinator began.
    Clocked,
}

/// What is not followed where nothing is known of what subsystems tell when.
const TOLD: &str = "in which order subsystems tell things, and that these do not wait to be heard, was not followed";

impl Bound {
    /// Where one of these cut something off, there is no telling what.
    pub(super) const CUT_OFF: [Self; 5] = [Self::Budget, Self::States, Self::Memory, Self::Interrupted, Self::Entered];

    /// What a bound left out; `failed` is what had to fail before, at least, and so many batches of a coordinator waited.
    pub(super) fn told(self, failed: Failed, most_waiting: usize, effort: &Effort<'_>) -> String {
        let what = match self {
            Self::Budget => format!(
                "what comes after the first {} transitions was not followed, for they are as many as are looked at \
                 (`--budget`)",
                effort.transitions
            ),
            Self::States => format!(
                "what comes after the first {} states was not followed, for they are as many as are looked at (`--budget`)",
                effort.states
            ),
            Self::Memory => "what takes up more memory than `--budget` gives was not followed".to_owned(),
            Self::Interrupted => "what was left when it was interrupted was not followed".to_owned(),
            Self::Waiting => {
                format!("more than {most_waiting} batches of one coordinator that wait at once were not followed")
            }
            Self::Lean => {
                return "what a coordinator asks for behind an undo that failed, before it was answered what it had asked for, \
                        was not followed"
                    .to_owned();
            }
            Self::Piled => format!("what comes when more than {} requests are not answered was not followed", limits::CHECK_PILED),
            Self::Frames => {
                format!("more than {} frames of one configuration were not followed", limits::CHECK_FRAMES)
            }
            Self::Left => {
                format!("more than {} frames of one configuration were not followed", limits::CHECK_LEFT)
            }
            Self::Squashed => "what fails where frames have been squashed was not followed".to_owned(),
            Self::Orders => "which frames are squashed was followed for one order of frames that share nothing and were pushed in \
                             several"
                .to_owned(),
            Self::Aside => "what only several undos that failed bring about together was not followed".to_owned(),
            Self::Inbox => format!("more than {} events between coordinators, or two for each, were not followed", limits::CHECK_INBOX),
            Self::Forks => format!(
                "a step that asks for more than {} things, or that may meet what is under way in more than {} ways, was not \
                 followed to its end",
                limits::CHECK_HANDED,
                limits::CHECK_FORKS
            ),
            Self::ByHand => "what an operator's safe configuration leads to was not followed".to_owned(),
            Self::Together => "what an operator's frames come to of which several are in force at once was not followed".to_owned(),
            Self::Tied => {
                "what comes of it that an operator's frames for coordinators that have nothing to do with each other are squashed into one \
                 was not followed"
                    .to_owned()
            }
            Self::Begun => {
                "what an undo takes along of an operator's frames was not followed where a coordinator that is followed apart begins again \
                 while others are led down"
                    .to_owned()
            }
            Self::Ties => {
                "which of two times comes first that are over at the same moment, and lead to different ends, is not known".to_owned()
            }
            Self::Turns => "whether it comes up, or down, was followed for one order of answers and of what coordinators tell each other, \
                            and another one leads elsewhere"
                .to_owned(),
            Self::Stale => {
                "what comes of an event that leads up from where all are down, and came just before the one that ends the deployment, was \
                 not followed"
                    .to_owned()
            }
            Self::Across => {
                "what comes of an event from outside, or a time, that comes before all coordinators have heard what came before was not followed"
                    .to_owned()
            }
            Self::Rounds => {
                "where each round leaves a frame more, not all rounds were followed to where the oldest frames are squashed"
                    .to_owned()
            }
            Self::Stopping => {
                "whether one event that ends the deployment leads all coordinators down was not followed".to_owned()
            }
            Self::Stands => "whether what a configuration stands for (`holds`) becomes true was not followed where others may change the \
                             run states that it looks at"
                .to_owned(),
            Self::Apart => {
                "what leads a coordinator on that is down already, while others that it has nothing to do with are not, was not followed"
                    .to_owned()
            }
            Self::ByItself => "what its parent comes to where it goes on by itself though it is down was not followed".to_owned(),
            Self::Anew => {
                "what comes of the event that begins the deployment was not followed where a coordinator is down already and others that it \
                 has nothing to do with are still being led down"
                    .to_owned()
            }
            Self::Elsewhere => {
                "what a safe configuration of a coordinator that is followed apart interrupts was not followed behind something that \
                 failed, nor what comes while it is being applied"
                    .to_owned()
            }
            Self::Told => TOLD.to_owned(),
            Self::Forgotten => {
                format!("{TOLD}, for with that there are more than {} transitions (`--budget`)", effort.believed())
            }
            Self::Untaken => format!("more than {MOST_UNTAKEN} events that a subsystem has not taken yet were not followed"),
            Self::Vain => {
                "whether a parent is led down wherever a subsystem may have been led by something else was not followed to the end".to_owned()
            }
            Self::Entered => "a coordinator could not be entered".to_owned(),
            Self::Clocked => "when times that count from the beginning of the coordinator (`e_at`) are over was not followed: at once, each time \
                              that such a state is entered late, or later than there is time for (`e_after` counts from the state)"
                .to_owned(),
            Self::Times => {
                "whether one comes up, or down, in time was not followed to the end: a time may add up to too much, and there are too many \
                 ways to look for the shortest"
                    .to_owned()
            }
        };
        let behind = match failed {
            Failed::Nothing => "",
            Failed::Apply => ", behind a request that failed",
            Failed::Undo => ", behind an undo that failed",
            Failed::Broken => ", behind something that broke",
        };
        format!("{what}{behind}")
    }
}
