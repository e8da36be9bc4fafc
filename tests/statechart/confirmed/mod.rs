//! Every statement about pure charts that was confirmed by running rFSM (marked [P] in `docs/rfsm.md`), and the gaps that its
//! own tests leave (`docs/rfsm.md` §10), by theme. What functions and the API have to do with is in `tests/functions/confirmed`.

mod choosing;
mod construction;
mod doubts;
mod executing;
mod order;
mod references;
mod sim;
mod stepping;

use crate::support::*;

/// Refused with that code.
fn refused(parts: Vec<Part>, code: &str) {
    let found = findings(parts);
    assert!(found.iter().any(|f| f.is_error() && f.code.0 == code), "{code} expected: {found:#?}");
}

/// Accepted, with a finding of that code.
fn doubted(parts: Vec<Part>, code: &str) {
    let found = findings(parts);
    assert!(!found.iter().any(|f| f.is_error()), "{found:#?}");
    assert!(found.iter().any(|f| f.code.0 == code), "{code} expected: {found:#?}");
}
