//! The rules of the `Platform` trait, tried on the platforms that there are, on that of the example, and on some that break them.

mod broken;
mod embedded;
mod own_platform;

use davit::platform::conformance::{Bed, StandIn, run};

/// Every rule is kept, and none was left out.
#[track_caller]
fn keeps_all(bed: &dyn Bed) {
    let report = run(bed);
    assert!(report.is_kept() && report.skipped().next().is_none(), "{report}");
}

#[test]
fn the_simulated_platform_keeps_every_rule() {
    keeps_all(&StandIn);
}

#[test]
fn the_embedded_platform_keeps_every_rule() {
    keeps_all(&embedded::EmbeddedBed);
}
