//! What was confirmed of rFSM by probes (docs/rfsm.md, marked there) as far as functions, the checks of `init` and the API are
//! concerned, and the gaps of its own tests. What the engine does without functions is in `tests/statechart/confirmed`.

mod api;
mod checks;
mod construction;
mod enabled;
mod executing;
mod ext;
mod plugins;
mod references;
mod stepping;
mod timeevent;
