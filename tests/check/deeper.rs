//! `check` follows anew with more where there is room for it. What it knew before is kept where that has to end, and a larger budget never
//! finds less.

use crate::support::Small;
use davit::check::{Effort, Halt, Report, run_with};
use davit::model::{Code, Severity, codes};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Two coordinators that tell each other something, of which the one asks for what is refused behind an event.
fn refused() -> Small {
    let of = |name: &str, told: &str, more: &str| {
        format!(
            "idle = state {{}}, starting = state {{ entry = '{name}_base' }}, up = state {{}}, on = state {{ entry = 'gain' }},
             leaving = state {{ entry = {{ '{told}', '{name}_base.undo' }} }}, again = state {{ entry = '{name}_base.undo' }},
             trans {{ src = 'initial', tgt = 'idle' }},
             trans {{ src = 'idle', tgt = 'starting', events = {{ 'e_start' }} }},
             trans {{ src = 'starting', tgt = 'up', events = {{ '{name}_base.ok' }} }},
             trans {{ src = 'starting', tgt = 'idle', events = {{ '{name}_base.failed' }} }},
             trans {{ src = 'starting', tgt = 'leaving', events = {{ '{name}_base.broken', 'e_shutdown' }} }},
             trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown' {more} }} }},
             trans {{ src = 'leaving', tgt = 'idle', events = {{ '{name}_base.undone' }} }},
             trans {{ src = 'leaving', tgt = 'again', events = {{ '{name}_base.undo.failed', '{name}_base.undo.broken' }} }},
             trans {{ src = 'again', tgt = 'leaving', events = {{ '{name}_base.undo.failed', '{name}_base.undo.broken' }} }},
             trans {{ src = 'again', tgt = 'idle', events = {{ '{name}_base.undone' }} }},"
        )
    };
    // `gain` wants a component that is not there before it has come up.
    let asks = "trans { src = 'idle', tgt = 'on', events = { 'e_gain' } }, trans { src = 'on', tgt = 'idle', events = { 'gain.failed' } },
        trans { src = 'on', tgt = 'idle', events = { 'gain.ok', 'e_shutdown' } },";
    let coordinators = [("a", of("a", "e_a_told", "") + asks), ("b", of("b", "e_b_told", ", 'e_a_told'"))];
    let coordinators: Vec<_> = coordinators.iter().map(|(name, text)| (*name, text.as_str())).collect();
    let configurations =
        "a_base = Configuration { create('a', 'Drive') }, b_base = Configuration { create('b', 'Drive') },
        gain = Configuration { property_set('a.gain', 2.0) }";
    Small::several(configurations, &coordinators, "emits: [e_a_told, e_b_told]\n")
}

fn told(report: &Report) -> BTreeSet<Code> {
    // That something is shared is a warning only where it was not followed to its end.
    let worth = report
        .findings
        .iter()
        .filter(|finding| finding.severity > Severity::Info && finding.code != codes::COORD_SHARED);
    worth.map(|finding| finding.code).collect()
}

/// Wherever it has to end: what was followed to its end is not judged by what was begun behind it.
#[test]
fn what_was_found_before_it_had_to_end_stays_found() {
    let small = refused();
    let followed = |most: usize, why: Halt| {
        let read = small.read();
        let (asked, anew) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let goes_on = |far: davit::check::Far| {
            anew.fetch_add(usize::from(far.transitions == 0), Ordering::Relaxed);
            if asked.fetch_add(1, Ordering::Relaxed) < most { Ok(()) } else { Err(why) }
        };
        let report = run_with(read.deployment, &read.catalogue, Effort { goes_on: &goes_on, ..Effort::default() });
        (report, asked.into_inner(), anew.into_inner())
    };
    let (whole, asked, anew) = followed(usize::MAX, Halt::Memory);
    let all = told(&whole);
    assert!(all.contains(&codes::COORD_REQUEST_REFUSED), "{:#?}", whole.findings);
    for why in [Halt::Memory, Halt::Interrupted] {
        let mut before = BTreeSet::new();
        let mut ended = 0;
        for most in 0..asked {
            let (report, ..) = followed(most, why);
            let now = told(&report);
            let gone: Vec<_> = before.difference(&now).collect();
            assert!(gone.is_empty(), "{gone:?} were found when it ended sooner, not after {most} of {asked}");
            assert!(!report.explored.complete && !report.left.is_empty(), "after {most}: {:?}", report.left);
            ended += usize::from(now.contains(&codes::COORD_REQUEST_REFUSED));
            before = now;
        }
        // It is followed more than once, and ends there, too.
        assert!(ended >= 1 && anew > 3, "found {ended} times of {asked}; followed anew {anew} times");
    }
}

/// Where all that lies behind an undo that fails is followed it is as much as to leave out other things: these come first.
#[test]
fn more_is_never_less() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/side_by_side/deployment.yaml");
    let left = |transitions: usize| {
        let read = davit::app::read(&file, &davit::lang::LoadOptions::default(), davit::runtime::Libraries::default());
        let read = read.unwrap_or_else(|_| panic!("it is readable"));
        let report = run_with(read.deployment, &read.catalogue, Effort { transitions, ..Effort::default() });
        report.left.into_iter().collect::<BTreeSet<_>>()
    };
    let (less, more) = (left(150_000), left(400_000));
    let gone: Vec<_> = less.difference(&more).collect();
    let new: Vec<_> = more.difference(&less).collect();
    assert!(new.is_empty(), "{new:#?} are left out with more, and {gone:#?} with less");
    assert!(!less.iter().any(|left| left.contains("leads all coordinators down")), "{less:#?}");
    assert!(!gone.is_empty(), "the smaller budget leaves something out: {less:#?}");
}
