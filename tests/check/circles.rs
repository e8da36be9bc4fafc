//! Circles: answers that go round for ever, and rounds on which frames pile up.

use crate::support::Small;

const CONFIGURATIONS: &str =
    "base = Configuration { create(\"a\", \"Drive\") }, one = Configuration { property_set(\"a.gain\", 2.0) },";

/// It is up in `up`, and at `e_go` it asks for `one` and undoes it, so many times round, without waiting for anything else.
fn round(times: usize) -> String {
    let (ok, undone) =
        ("\"one.ok\", \"one.failed\", \"one.broken\"", "\"one.undone\", \"one.undo.failed\", \"one.undo.broken\"");
    let one = |n: usize| {
        let next = (n + 1) % times;
        format!(
            "s{n} = state {{ entry = \"one\" }}, u{n} = state {{ entry = \"one.undo\" }},
             trans {{ src = \"s{n}\", tgt = \"u{n}\", events = {{ {ok} }} }},
             trans {{ src = \"u{n}\", tgt = \"s{next}\", events = {{ {undone} }} }},"
        )
    };
    let all: String = (0..times).map(one).collect();
    format!(
        "idle = state {{}}, building = state {{ entry = \"base\" }}, up = state {{}}, leaving = state {{ entry = \"base.undo\" }},
         last = state {{ entry = \"one.undo\" }}, stuck = state {{}},
         round = state {{ {all} trans {{ src = \"initial\", tgt = \"s0\" }} }},
         trans {{ src = \"initial\", tgt = \"idle\" }},
         trans {{ src = \"idle\", tgt = \"building\", events = {{ \"e_start\" }} }},
         trans {{ src = \"building\", tgt = \"up\", events = {{ \"base.ok\" }} }},
         trans {{ src = \"building\", tgt = \"leaving\", events = {{ \"base.failed\", \"base.broken\", \"e_shutdown\" }} }},
         trans {{ src = \"up\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},
         trans {{ src = \"up\", tgt = \"round\", events = {{ \"e_go\" }} }},
         trans {{ src = \"round\", tgt = \"last\", events = {{ \"e_shutdown\" }} }},
         trans {{ src = \"last\", tgt = \"leaving\", events = {{ \"one.undone\" }} }},
         trans {{ src = \"last\", tgt = \"stuck\", events = {{ \"one.undo.failed\", \"one.undo.broken\" }} }},
         trans {{ src = \"leaving\", tgt = \"idle\", events = {{ \"base.undone\" }} }},
         trans {{ src = \"leaving\", tgt = \"stuck\", events = {{ \"base.undo.failed\", \"base.undo.broken\" }} }},
         trans {{ src = \"stuck\", tgt = \"last\", events = {{ \"e_shutdown\" }} }},"
    )
}

/// However long a circle of answers is, it is found.
#[test]
fn a_circle_of_answers_is_found_whatever_its_length() {
    for times in [3, 70] {
        let said = Small::new(CONFIGURATIONS, &round(times), "").check();
        let found = said.of("coord::endless");
        let loud: Vec<_> = found.iter().filter(|f| f["severity"] == "warning").collect();
        assert_eq!(loud.len(), 1, "{times}: {found:#?}");
        assert!(loud[0]["message"].as_str().unwrap().contains("`root.round.s0`"), "{times}: {:#}", loud[0]);
        assert_eq!(said.0["verdict"], "warnings", "{times}: {found:#?}");
    }
}

/// A frame that nobody undoes is left on each round, and the next request fails each time: the oldest frames are squashed all
/// the same, and what the coordinator wants to undo is among them.
#[test]
fn frames_pile_up_on_rounds_on_which_a_request_fails() {
    let configurations =
        "base = Configuration { create(\"a\", \"Drive\") }, keep = Configuration { property_set(\"a.mode\", 1) },
        one = Configuration { property_set(\"a.gain\", 2.0) }, two = Configuration { property_set(\"a.gain\", 3.0) },
        all = Configuration { destroy(\"a\") },";
    let states =
        "idle = state {}, building = state { entry = \"base\" }, keeping = state { entry = \"keep\" }, up = state {},
        first = state { entry = \"one\" }, second = state { entry = \"two\" }, far = state {},
        undoing = state { entry = \"keep.undo\" }, leaving = state { entry = \"all\" }, stuck = state {},
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"keeping\", events = { \"base.ok\" } },
        trans { src = \"building\", tgt = \"stuck\", events = { \"base.failed\", \"base.broken\" } },
        trans { src = \"keeping\", tgt = \"up\", events = { \"keep.ok\" } },
        trans { src = \"up\", tgt = \"first\", events = { \"e_one\" } },
        trans { src = \"first\", tgt = \"second\", events = { \"one.ok\" } },
        trans { src = \"first\", tgt = \"up\", events = { \"one.failed\", \"one.broken\" } },
        trans { src = \"second\", tgt = \"far\", events = { \"two.ok\" } },
        trans { src = \"second\", tgt = \"up\", events = { \"two.failed\" } },
        trans { src = \"second\", tgt = \"leaving\", events = { \"two.broken\" } },
        trans { src = \"up\", tgt = \"undoing\", events = { \"e_undo\" } },
        trans { src = \"undoing\", tgt = \"leaving\", events = { \"keep.undone\", \"keep.undo.broken\" } },
        trans { src = \"undoing\", tgt = \"stuck\", events = { \"keep.undo.failed\" } },
        trans { src = \"keeping\", tgt = \"leaving\", events = { \"keep.failed\", \"keep.broken\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"all.ok\" } },
        trans { src = \"leaving\", tgt = \"stuck\", events = { \"all.failed\", \"all.broken\" } },"
            .to_owned()
            + &["building", "keeping", "up", "first", "second", "far", "stuck"]
                .map(|state| {
                    format!("trans {{ src = \"{state}\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},")
                })
                .join(" ");
    let said = Small::new(configurations, &states, "limits: { stack: 4 }\n").check();
    let refused = said.refused("keep.undo");
    let squashed = |(severity, message): &(&str, &str)| *severity == "warning" && message.contains("squashed");
    assert!(refused.iter().any(squashed), "{:#}", said.0);
    assert_eq!(said.0["verdict"], "warnings", "{:#}", said.0);
}

/// Beside another coordinator that may be anywhere meanwhile, a circle is told once, at the one that goes round.
#[test]
fn a_circle_is_told_of_the_coordinator_that_goes_round() {
    let configurations = format!("{CONFIGURATIONS} two = Configuration {{ create(\"b\", \"Drive\") }},");
    let calm = "idle = state {},
        up = state { entry = \"two\", low = state {}, heard = state {},
            trans { src = \"initial\", tgt = \"low\" },
            trans { src = \"low\", tgt = \"heard\", events = { \"e_hello\" } } },
        leaving = state { entry = \"two.undo\" }, failed = state {},
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"up\", events = { \"e_start\" } },
        trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\", \"two.failed\", \"two.broken\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"two.undone\" } },
        trans { src = \"leaving\", tgt = \"failed\", events = { \"two.undo.failed\", \"two.undo.broken\" } },
        trans { src = \"failed\", tgt = \"leaving\", events = { \"e_shutdown\" } },";
    let looper = round(2).replace("up = state {}", "up = state { entry = \"e_hello\" }");
    let small = Small::several(&configurations, &[("calm", calm), ("looper", &looper)], "emits: [e_hello]\n");
    let said = small.check();
    let found = said.of("coord::endless");
    assert_eq!(found.len(), 1, "{:#}", said.0);
    assert_eq!((found[0]["file"].as_str(), found[0]["severity"].as_str()), (Some("looper.lua"), Some("warning")));
    let message = found[0]["message"].as_str().unwrap();
    assert!(message.contains("looper:root.round.s0") && !message.contains("calm:"), "{message}");
}
