//! The youBot reference application, measured in simulated time.

mod before;
mod bench;
mod chatter;
mod composed;
mod contact;
#[path = "../support/counting.rs"]
#[allow(dead_code)] // only what one thread asks for
mod counting;
mod coupled;
mod coupling;
mod driver_dies;
mod faults;
mod files;
#[path = "../support/flat.rs"]
mod flat;
mod golden;
mod last_word;
mod live;
mod motion;
mod passive;
mod robot;
mod scenarios;
mod stability;
mod stops;
mod two;
mod variants;

#[global_allocator]
static ALLOCATOR: counting::Counting = counting::Counting;
