//! What costs nothing where it must not: no allocation in control activities, events that are raised, prepared switches, requests, monitors and steps of pure
//! charts, and work that does not grow; and few where thousands of states are followed. Counted by the allocator, for each test in its own threads, so that tests may run beside each
//! other.

mod charts;
mod check;
#[path = "../support/counting.rs"]
mod counting;
#[path = "../support/family.rs"]
mod family;
mod monitors;
mod raising;
mod requests;
mod switch;
mod updates;

#[global_allocator]
static ALLOCATOR: counting::Counting = counting::Counting;
