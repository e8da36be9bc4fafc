//! Is it sound: everything that can be said about a deployment before it runs. One file per family.
//!
//! Pure: no I/O, no clock, no platform. An [`Accepted`] deployment can come only from here, and whoever starts something
//! takes nothing else, so nothing runs that was not looked at.

mod adjacency;
mod alone;
mod arrive;
mod aside;
mod bars;
mod bound;
mod children;
mod closed;
mod comes;
mod composed;
mod configurations;
mod coordinator;
mod coupling;
mod declared;
mod desks;
mod detours;
mod down;
mod drive;
mod effort;
mod endless;
mod ends;
mod equivalence;
mod explore;
mod failing;
#[cfg(any(test, feature = "internals"))]
mod follow;
mod held;
mod inbox;
mod interface;
mod judge;
mod kept;
mod lasts;
mod late;
mod lets_go;
mod library;
mod links;
mod loss;
mod members;
mod monitors;
mod nowhere;
mod once;
mod orders;
mod outcome;
mod outside;
mod places;
mod probe;
mod product;
mod promises;
mod purity;
mod reactions;
mod replay;
mod report;
mod rounds;
mod run;
mod safety;
mod settings;
mod shape;
mod shared_list;
mod shown;
mod shows;
mod simulated;
mod standings;
mod stands;
mod state;
mod systems;
mod timers;
mod told;
mod trace;
mod tried;
mod types;
mod undo_failed;
mod undriven;
mod unhandled;
mod universe;
mod unknown;
mod unwatched;
mod verdict;
mod way;
mod ways;
mod when;
mod world;

pub use drive::{Drive, Until, WayEvent, drive};
pub use effort::{Effort, Far, Halt};
#[cfg(any(test, feature = "internals"))]
pub use follow::{Follower, Known, Seen, Shown};
pub use library::platform as on_platform;
pub use report::{Accepted, Explored, Report};
pub use run::{configurations, fault, monitors, run, run_with};
pub use shown::why_no_way;
#[cfg(any(test, feature = "internals"))]
pub use shown::{FOLLOWED, READ};
pub use trace::{Again, Answered, Does, Happened, HeardEvent, MoveReplay, Place, TraceStep};
pub use verdict::CheckVerdict;
