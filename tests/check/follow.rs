//! What a running deployment does is followed: moments that random cases of `tests/oracle` have shown first.

use crate::support::Small;
use davit::check::{Follower, Seen, Shown};
use davit::model::{Ask, ComponentName, ConfigId, EventName, Snapshot};
use davit::stack::Requester;
use davit::statechart::{Chart, compile};
use std::sync::Arc;

/// Follows a story, one line of it after the other: `event e_start`; `operator one.undo`; `drive: one.ok`, an answer to whom;
/// `rests root.up | base by drive 1 | work by drive` how coordinators and frames stand then, and what is not answered, with the
/// components left out that this is about.
#[track_caller]
fn follow(small: &Small, story: &[&str]) {
    let read = small.read();
    let charts: Vec<Arc<Chart>> = read.deployment.charts().map(|chart| Arc::new(compile(chart).0.unwrap())).collect();
    let lent: Vec<&Chart> = charts.iter().map(|chart| &**chart).collect();
    let mut follower = Follower::new(&read.deployment, &lent, &read.catalogue).unwrap();
    for line in story {
        let went = match line.split_once(' ').unwrap() {
            ("event", name) => follower.see(Seen::Event(EventName::new(name).unwrap())),
            ("operator", name) => {
                let id = |name: &str| ConfigId::new(name).unwrap();
                let ask = match name.strip_suffix(".undo") {
                    Some(name) => Ask::UndoOf(id(name)),
                    None if name == "undo" => Ask::Undo,
                    None => Ask::Apply(id(name)),
                };
                follower.see(Seen::Operator { ask, force: true })
            }
            ("rests", rest) => {
                let (leaves, rest) = rest.split_once(" | ").unwrap();
                let (frames, open) = rest.split_once(" | ").unwrap();
                let list = |text: &str| text.split(", ").filter(|one| !one.is_empty()).map(str::to_owned).collect();
                let frame = |text: &str| {
                    let words: Vec<&str> = text.split(' ').collect();
                    (words[0].to_owned(), words[2].to_owned(), words[3].parse().unwrap())
                };
                let shown = Shown {
                    leaves: list(leaves),
                    system: Snapshot::default(),
                    frames: frames.split(", ").filter(|one| !one.is_empty()).map(frame).collect(),
                    open: list(open),
                };
                follower.rests(&shown).map(|_| ())
            }
            (by, event) => {
                let by = match by.strip_suffix(':').unwrap() {
                    "operator" => Requester::Operator,
                    name => Requester::Coordinator(ComponentName::new(name).unwrap()),
                };
                follower.see(Seen::Answer { by, event: EventName::new(event).unwrap() })
            }
        };
        if let Err(why) = went {
            panic!("`{line}` of {story:#?}: {why}");
        }
    }
}

/// While this is under way only coordinators and frames are compared.
const REST: &str = "operator undo";

/// An operator's undo holds the frame with which another one would be squashed; but the push began before it.
#[test]
fn a_push_keeps_the_place_that_it_found_when_it_began() {
    let configurations =
        "base = Configuration { create(\"c\", \"Drive\") }, first = Configuration { create(\"a\", \"Drive\") },
        second = Configuration { property_set(\"c.gain\", 2.0) },";
    let states =
        "idle = state {}, building = state { entry = \"base\" }, up = state { entry = { \"first\", \"second\" } },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
        trans { src = \"up\", tgt = \"idle\", events = { \"e_shutdown\" } },";
    let small = Small::several(configurations, &[("drive", states)], "limits: { stack: 2 }\n");
    let begun = ["event e_start", "drive: base.ok", "operator first.undo", "drive: first.ok"];
    let ends = [
        "drive: second.ok",
        "operator: first.undone",
        REST,
        "rests root.up | base by drive 1, second by drive 1 | undo by operator",
    ];
    follow(&small, &[&begun[..], &ends[..]].concat());
    // Undone first, it makes no difference.
    follow(&small, &[&begun[..], &["operator: first.undone", "drive: second.ok"]].concat());
}

/// Two coordinators hear one event: what one of them has under way is interrupted by the other, and given up by itself.
#[test]
fn what_is_interrupted_and_given_up_at_once_is_cancelled_also_where_nothing_is_known() {
    let configurations =
        "bad = Configuration { create(\"a\", \"Drive\") }, work = Configuration { create(\"b\", \"Drive\") },
        stop = Configuration { safe = true, post_conf_state = { \"a:stopped\" } },
        other = Configuration { property_set(\"b.gain\", 2.0) },";
    let one = "idle = state {}, up = state { entry = \"bad\" }, stopping = state { entry = \"stop\" },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"up\", events = { \"e_start\" } },
        trans { src = \"up\", tgt = \"stopping\", events = { \"e_stop\" } },
        trans { src = \"stopping\", tgt = \"idle\", events = { \"e_shutdown\" } },";
    let two =
        "idle = state {}, up = state { entry = \"work\" }, leaving = state { entry = { \"work.undo\", \"other\" } },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"up\", events = { \"e_work\" } },
        trans { src = \"up\", tgt = \"leaving\", events = { \"e_stop\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"e_shutdown\" } },";
    let small = Small::several(configurations, &[("one", one), ("two", two)], "");
    // `other` is not cancelled: it came when `stop` was there, and the undo with it.
    let rests = "rests root.stopping, root.leaving |  | other by two, stop by one, work by two, work.undo by two";
    let story = ["event e_start", "one: bad.broken", "event e_work", "event e_stop", rests, "one: stop.ok"];
    let ends = ["two: work.cancelled", "two: work.undone", "two: other.failed"];
    follow(&small, &[&story[..], &ends[..]].concat());
}

/// A state that holds something still is left twice: its first undo is refused and waits for the answer of what was begun with
/// it; the second one is about the second visit's frame.
#[test]
fn an_undo_of_a_later_visit_is_not_about_a_frame_that_stays() {
    let configurations =
        "base = Configuration { create(\"a\", \"Drive\"), post_conf_state = { \"a:running\" } }, make = Configuration { create(\"b\", \"Drive\") },
        hold = Configuration { safe = true, post_conf_state = { \"a:stopped\" } },";
    let states =
        "idle = state {}, building = state { entry = \"base\" }, up = state {}, still = state { config = \"hold\" },
        out = state { entry = { \"hold\", \"make\" } }, again = state { entry = \"hold\" },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
        trans { src = \"up\", tgt = \"still\", events = { \"e_still\" } },
        trans { src = \"still\", tgt = \"out\", events = { \"e_out\" } },
        trans { src = \"out\", tgt = \"still\", events = { \"e_still\" } },
        trans { src = \"still\", tgt = \"up\", events = { \"e_up\" } },
        trans { src = \"up\", tgt = \"again\", events = { \"e_again\" } },
        trans { src = \"again\", tgt = \"idle\", events = { \"e_shutdown\" } },";
    let small = Small::several(configurations, &[("drive", states)], "limits: { stack: 2 }\n");
    let twice = ["event e_start", "drive: base.ok", "event e_still", "drive: hold.ok", "event e_out", "drive: hold.ok"];
    let waits =
        ["event e_still", "drive: hold.ok", "event e_up", "event e_again", "drive: hold.undo.failed", "drive: hold.ok"];
    // That of the first visit still belongs to its state, and is not squashed; all that came later are one.
    let rests =
        "rests root.again | base by drive 1, hold by drive 1, hold by drive 1 | hold.undo by drive, make by drive";
    follow(&small, &[&twice[..], &waits[..], &[rests]].concat());
}

/// The frame of a visit is undone by name; leaving the state is not about that of the next visit, which is there before.
#[test]
fn leaving_a_state_whose_frame_is_gone_leaves_the_next_visits_frame_alone() {
    let configurations = "base = Configuration { create(\"a\", \"Drive\"), post_conf_state = { \"a:running\" } },
        hold = Configuration { safe = true, post_conf_state = { \"a:stopped\" } },";
    let states = "idle = state {}, up = state { entry = \"base\" },
        still = state { config = \"hold\", as_is = state {}, freed = state { entry = \"hold.undo\" },
            trans { src = \"initial\", tgt = \"as_is\" },
            trans { src = \"as_is\", tgt = \"freed\", events = { \"e_free\" } },
        },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"up\", events = { \"e_start\" } },
        trans { src = \"up\", tgt = \"still\", events = { \"e_still\" } },
        trans { src = \"still\", tgt = \"still\", events = { \"e_again\" } },
        trans { src = \"still\", tgt = \"idle\", events = { \"e_shutdown\" } },";
    let small = Small::several(configurations, &[("drive", states)], "");
    let first = ["event e_start", "drive: base.ok", "event e_still", "drive: hold.ok"];
    let freed = ["event e_free", "drive: hold.undone"];
    let again = |verdict: &'static str| ["event e_again", "drive: hold.ok", verdict, REST];
    let rests = "rests root.still.as_is | base by drive 1, hold by drive 1 | undo by operator";
    follow(&small, &[&first[..], &freed[..], &again("drive: hold.undone")[..], &[rests]].concat());
    // Not freed, it is about the first visit's frame, and the next one's stands in its way.
    let both = "rests root.still.as_is | base by drive 1, hold by drive 1, hold by drive 1 | undo by operator";
    follow(&small, &[&first[..], &again("drive: hold.undo.failed")[..], &[both]].concat());
    // The last one's goes when that is left.
    let left =
        ["event e_again", "drive: hold.ok", "drive: hold.undone", "event e_shutdown", "drive: hold.undone", REST];
    let rests = "rests root.idle | base by drive 1 | undo by operator";
    follow(&small, &[&first[..], &freed[..], &left[..], &[rests]].concat());
}

/// Frames that look alike are not taken for each other, however often the same was there before: the one that is being undone is
/// not squashed.
#[test]
fn a_frame_that_is_held_is_not_mistaken_for_one_like_it() {
    let configurations = "make = Configuration { create(\"b\", \"Drive\") },
        hold = Configuration { safe = true, post_conf_state = { \"a:stopped\" } },";
    let states =
        "idle = state {}, up = state { config = \"hold\", entry = \"hold\", exit = \"hold.undo\" }, out = state { entry = { \"hold\", \"make\" } },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"up\", events = { \"e_start\" } },
        trans { src = \"up\", tgt = \"up\", events = { \"e_again\" } },
        trans { src = \"up\", tgt = \"out\", events = { \"e_out\" } },
        trans { src = \"out\", tgt = \"up\", events = { \"e_back\" } },
        trans { src = \"up\", tgt = \"idle\", events = { \"e_shutdown\" } },";
    let small = Small::several(configurations, &[("drive", states)], "limits: { stack: 3 }\n");
    let (ok, undone) = ("drive: hold.ok", "drive: hold.undone");
    let again = ["event e_again", ok, ok, undone, undone];
    let held = ["event e_out", ok, "event e_back", ok, ok];
    let rests = "rests root.up | hold by drive 1, hold by drive 1, hold by drive 1, hold by drive 1 | hold.undo by drive, hold.undo by drive, make by drive";
    follow(&small, &[&["event e_start", ok, ok], &again[..], &again[..], &held[..], &[rests]].concat());
}
