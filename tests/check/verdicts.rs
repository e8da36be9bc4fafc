//! What a check comes to, and with which exit status.

use crate::demo::Demo;
use crate::support::Small;

const UP_AND_DOWN: &str = "idle = state {}, up = state { entry = \"base\" }, leaving = state { entry = \"base.undo\" },
    trans { src = \"initial\", tgt = \"idle\" },
    trans { src = \"idle\", tgt = \"up\", events = { \"e_start\" } },
    trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\", \"base.failed\", \"base.broken\" } },
    trans { src = \"leaving\", tgt = \"idle\", events = { \"base.undone\" } },
    trans { src = \"leaving\", tgt = \"leaving\", events = { \"e_shutdown\", \"base.undo.failed\", \"base.undo.broken\" } },";

const CONFIGURATIONS: &str = "base = Configuration { create(\"a\", \"Drive\") },";

fn verdict(small: &Small) -> (String, i32, i32, String) {
    let json = small.demo.run(&["check", "small.yaml", "--json"]);
    let strict = small.demo.run(&["check", "small.yaml", "--strict"]);
    let verdict = json.json()["verdict"].as_str().unwrap().to_owned();
    (verdict, json.code, strict.code, strict.out)
}

#[test]
fn sound_is_said_only_of_what_is_sound() {
    let sound = Small::new(
        CONFIGURATIONS,
        &UP_AND_DOWN.replace("\"e_shutdown\", \"base.undo.failed\"", "\"base.undo.failed\""),
        "",
    );
    let (word, code, strict, text) = verdict(&sound);
    assert_eq!((word.as_str(), code, strict), ("sound", 0, 0), "{text}");
    assert!(text.starts_with("small: sound;"), "{text}");
    // A warning.
    let warned = Small::new(CONFIGURATIONS, &UP_AND_DOWN.replace(", \"base.failed\", \"base.broken\"", ""), "");
    let (word, code, strict, text) = verdict(&warned);
    assert_eq!((word.as_str(), code, strict), ("warnings", 0, 1), "{text}");
    assert!(text.contains("has warnings") && !text.contains("sound"), "{text}");
    // An error.
    let refused =
        Small::new(&format!("{CONFIGURATIONS} base2 = Configuration {{ destroy(\"nobody\") }},"), UP_AND_DOWN, "");
    let (word, code, strict, _) = verdict(&refused);
    assert_eq!((word.as_str(), code, strict), ("refused", 1, 1));
}

/// Each event makes it ask for more than is answered meanwhile: nothing is found as far as that is followed.
#[test]
fn a_bound_that_cuts_something_off_is_told() {
    let states = UP_AND_DOWN.replace("\"e_shutdown\", \"base.undo.failed\"", "\"base.undo.failed\"")
        + "more = state { entry = \"set\" }, trans { src = \"up\", tgt = \"more\", events = { \"e_more\" } },
           trans { src = \"more\", tgt = \"more\", events = { \"e_more\" } },
           trans { src = \"more\", tgt = \"leaving\", events = { \"base.failed\", \"base.broken\", \"set.failed\", \"set.broken\", \"e_shutdown\" } },";
    // It stands in nobody's way and cannot fail.
    let configurations = format!("{CONFIGURATIONS} set = Configuration {{ group = \"g\", description = \"rest\" }},");
    let small = Small::new(&configurations, &states, "");
    let json = small.demo.run(&["check", "small.yaml", "--json"]).json();
    assert_eq!(json["explored"]["complete"], false, "{json:#}");
    let left: Vec<&str> = json["left"].as_array().unwrap().iter().map(|left| left.as_str().unwrap()).collect();
    assert!(left.iter().any(|left| left.contains("wait at once")), "{left:?}");
    let (word, code, strict, text) = verdict(&small);
    assert_eq!((word.as_str(), code, strict), ("followed", 0, 1), "{json:#}");
    assert!(text.starts_with("small: sound as far as followed;") && text.contains("wait at once"), "{text}");
}

/// Every finding that is met on a way has one, from the start.
#[test]
fn each_finding_has_its_own_way() {
    let demo = Demo::new();
    demo.replace("coordinator.lua", "config = \"slow\"", "entry = { \"slow\", \"create_all\" }");
    let json = demo.run(&["check", "deployment.yaml", "--json"]).json();
    let mut ways = Vec::new();
    for finding in json["findings"].as_array().unwrap() {
        let trace = finding["trace"].as_array().unwrap();
        if finding["code"] == "coord::request_refused" {
            assert_eq!(trace[0]["what"], "start", "{finding:#}");
            assert!(trace.len() > 3 && trace.iter().all(|step| !step["states"].as_array().unwrap().is_empty()));
            ways.push(trace.clone());
        }
    }
    assert!(!ways.is_empty(), "{json:#}");
}

/// Each time round an undo fails and leaves a frame more: that is followed only so far, and told.
#[test]
fn frames_that_failed_undoings_leave_are_followed_only_so_far() {
    let configurations = format!(
        "{CONFIGURATIONS} one = Configuration {{ property_set(\"a.gain\", 2.0) }}, two = Configuration {{ property_set(\"a.gain\", 3.0) }},"
    );
    let states =
        "idle = state {}, building = state { entry = \"base\" }, up = state {}, on = state { config = \"one\" },
        far = state { config = \"two\" },
        trans { src = \"on\", tgt = \"far\", events = { \"e_far\" } },
        trans { src = \"far\", tgt = \"on\", events = { \"e_near\" } },
        trans { src = \"far\", tgt = \"up\", events = { \"e_off\", \"two.failed\", \"two.broken\" } },
        trans { src = \"far\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        leaving = state { entry = \"base.undo\" }, stuck = state {},
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
        trans { src = \"building\", tgt = \"leaving\", events = { \"base.failed\", \"base.broken\", \"e_shutdown\" } },
        trans { src = \"up\", tgt = \"on\", events = { \"e_on\" } },
        trans { src = \"on\", tgt = \"up\", events = { \"e_off\", \"one.failed\", \"one.broken\" } },
        trans { src = \"on\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"base.undone\" } },
        trans { src = \"leaving\", tgt = \"stuck\", events = { \"base.undo.failed\", \"base.undo.broken\" } },
        trans { src = \"stuck\", tgt = \"leaving\", events = { \"e_shutdown\" } },";
    let small = Small::new(&configurations, states, "");
    let json = small.demo.run(&["check", "small.yaml", "--json"]).json();
    let left: Vec<&str> = json["left"].as_array().unwrap().iter().map(|left| left.as_str().unwrap()).collect();
    let told =
        |line: &&str| line.starts_with("more than 2 frames of one configuration were not followed, behind an undo");
    assert!(left.iter().any(told), "{left:?}");
    assert_eq!(json["explored"]["complete"], false, "{left:?}");
}

/// An operator may apply a safe configuration at any time, and that is followed. What it is in the way of is the operator's to
/// deal with: a note.
#[test]
fn what_an_operators_safe_configuration_leads_to_is_followed() {
    let configurations = "base = Configuration { create(\"a\", \"Drive\"), post_conf_state = { \"a:running\" } },
        stop = Configuration { safe = true, post_conf_state = { \"a:stopped\" } },";
    let states = UP_AND_DOWN.replace("\"e_shutdown\", \"base.undo.failed\"", "\"base.undo.failed\"");
    let small = Small::new(configurations, &states, "");
    let (word, code, strict, text) = verdict(&small);
    assert_eq!((word.as_str(), code, strict), ("sound", 0, 0), "{text}");
    let said = small.check();
    let notes = said.of("coord::refused_by_other");
    let [note] = notes[..] else { panic!("{:#}", said.0) };
    assert_eq!(note["severity"], "info");
    assert!(note["message"].as_str().unwrap().contains("before `stop` (a frame of operator)"), "{note:#}");
    assert_eq!(note["help"], "let the operator undo that first (`davit undo`)", "{note:#}");
    let script = "deploy('small.yaml') apply('stop') shutdown()";
    small.demo.write("forced.lua", script);
    let ran = small.demo.run(&["run", "forced.lua", "--clock", "simulated", "--platform", "simulated"]);
    assert!(ran.out.contains("base.undo.failed"), "{}{}", ran.out, ran.err);
}

/// Two coordinators that have nothing to do with each other make the same mistake: each is told of its own.
#[test]
fn findings_with_equal_words_at_two_places_are_two() {
    let coordinator = |base: &str| {
        UP_AND_DOWN.replace("base", base).replace("\"e_shutdown\", \"", "\"")
            + "lost = state {}, trans { src = \"up\", tgt = \"lost\", events = { \"e_lost\" } },"
            + "trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },"
    };
    let configurations =
        "one = Configuration { create(\"a\", \"Drive\") }, two = Configuration { create(\"b\", \"Drive\") },";
    let small = Small::several(configurations, &[("first", &coordinator("one")), ("second", &coordinator("two"))], "");
    let said = small.check();
    let stuck = said.of("coord::stuck");
    let places: Vec<_> = stuck.iter().map(|f| (f["file"].as_str(), f["message"].as_str())).collect();
    let message = Some("nothing leads on from `root.lost`");
    assert_eq!(places, [(Some("first.lua"), message), (Some("second.lua"), message)], "{:#}", said.0);
}

/// What was cut off may lead down; where all was followed and nothing does, that is told all the same.
#[test]
fn a_bound_hides_no_place_that_no_way_leads_down_from() {
    let configurations = format!("{CONFIGURATIONS} set = Configuration {{ group = \"g\", description = \"rest\" }},");
    let spins = UP_AND_DOWN.to_owned()
        + "spins = state { entry = \"set\" }, trans { src = \"up\", tgt = \"spins\", events = { \"e_spin\" } },
           trans { src = \"spins\", tgt = \"spins\", events = { \"e_done\" } },";
    let here = "here = state {}, there = state {}, trans { src = \"up\", tgt = \"here\", events = { \"e_here\" } },
        trans { src = \"here\", tgt = \"there\", events = { \"e_there\" } },
        trans { src = \"there\", tgt = \"here\", events = { \"e_here\" } },";
    let said = Small::new(&configurations, &spins, "").check();
    assert_eq!(said.0["explored"]["complete"], false, "{:#}", said.0);
    assert!(said.of("coord::no_way_down").is_empty(), "{:#}", said.0);
    let said = Small::new(&configurations, &(spins + here), "").check();
    assert_eq!(said.0["explored"]["complete"], false, "{:#}", said.0);
    let messages: Vec<_> = said.of("coord::no_way_down").iter().map(|found| found["message"].clone()).collect();
    assert_eq!(messages, ["from `root.here` no way leads to `idle`"], "{:#}", said.0);
}

pub const BASE: &str = "base = Configuration { create('a', 'Drive') }";

/// Up and down by `base`. `built` is where it comes when `base` is there, `stopped` when it is stopped in `up`; both end by themselves.
pub fn by_base(built: &str, stopped: &str, more: &str) -> String {
    format!(
        "idle = state {{}}, building = state {{ entry = 'base' }}, up = state {{}}, leaving = state {{ entry = 'base.undo' }},
         failed = state {{}},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'building', events = {{ 'e_start' }} }},
         trans {{ src = 'building', tgt = '{built}', events = {{ 'base.ok' }} }},
         trans {{ src = 'building', tgt = 'failed', events = {{ 'base.failed', 'base.broken' }} }},
         trans {{ src = 'building', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'up', tgt = '{stopped}', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'failed', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ 'base.undone' }} }},
         trans {{ src = 'leaving', tgt = 'failed', events = {{ 'base.undo.failed', 'base.undo.broken' }} }},{more}"
    )
}

/// The messages of a code, and how a run ends that brings it up, does `then`, and takes it down.
pub fn said_and_run(small: &Small, code: &str, then: &str) -> (Vec<String>, i32) {
    let said = small.check();
    let messages = said.of(code).iter().map(|found| found["message"].as_str().unwrap().to_owned()).collect();
    small.demo.write("run.lua", &format!("deploy('small.yaml')\nwait(0.1)\n{then}\n"));
    let ran = small.demo.run(&["run", "run.lua", "--clock", "simulated", "--platform", "simulated"]);
    (messages, ran.code)
}

/// That it is taken back unconfirmed, and that this fails, is not what everything being answered *ok* leads to.
#[test]
fn a_bring_up_waits_to_be_confirmed_or_to_be_taken_back() {
    let conf = format!(
        "{BASE}, try = Configuration {{ property_set('a.gain', 2.0), confirm = {{ event = 'e_conf', within = 1.0 }} }}"
    );
    let reports =
        "simulated: { reactions: [{ after: property_set a.gain = 2.0, delay_s: 0.2, raise: e_conf, component: a }] }\n";
    for (up, keys) in [("e_conf", reports), ("try.reverted", "")] {
        let warming = format!(
            "warming = state {{ entry = 'try' }},
             trans {{ src = 'warming', tgt = 'up', events = {{ '{up}' }} }},
             trans {{ src = 'warming', tgt = 'failed', events = {{ 'try.failed', 'try.broken', 'try.undo.failed' }} }},
             trans {{ src = 'warming', tgt = 'leaving', events = {{ 'e_shutdown' }} }},"
        );
        let states = by_base("warming", "leaving", &warming).replace("'base.undo' }", "{ 'try.undo', 'base.undo' } }");
        let small = Small::new(&conf, &states, keys);
        let (told, code) = said_and_run(&small, "deploy::never_up", "wait_state('up', 3)");
        assert_eq!((told, code), (Vec::new(), 0), "{up}");
        let plan = small.demo.run(&["plan", "small.yaml", "--bringup"]);
        assert!(plan.code == 0 && !plan.out.contains("never"), "{}{}", plan.out, plan.err);
    }
}

/// That a request is refused does not lead down.
#[test]
fn a_request_that_is_refused_is_no_way_down() {
    for entry in ["", "entry = 'base'", "entry = 'other.undo'"] {
        let left = format!(
            "left = state {{}}, again = state {{ {entry} }},
             trans {{ src = 'left', tgt = 'again', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'again', tgt = 'left', events = {{ 'base.failed', 'base.broken', 'other.undo.failed', 'e_shutdown' }} }},"
        );
        let states = by_base("up", "leaving", &left)
            .replace("tgt = 'failed', events = { 'base.undo.failed'", "tgt = 'left', events = { 'base.undo.failed'");
        let conf = format!("{BASE}, other = Configuration {{ property_set('a.gain', 2.0) }}");
        let small = Small::new(&conf, &states, "");
        small.demo.write("fault.lua", "fault('destroy a', 'fail', 1)\ndeploy('small.yaml')\nshutdown()\n");
        let ran = small.demo.run(&["run", "fault.lua", "--clock", "simulated", "--platform", "simulated"]);
        assert_eq!(ran.code, 4, "{entry} {}{}", ran.out, ran.err);
        let said = small.check();
        let found = said.of("coord::no_way_down");
        assert!(found.iter().any(|found| found["severity"] == "warning"), "{entry} {:#}", said.0);
    }
}

/// Of two times that run together the one with less left is over first, and what it leads to is all that comes.
#[test]
fn a_time_that_another_one_always_comes_before_leads_nowhere() {
    let up = |inside: &str, around: &str| {
        let warming = format!(
            "warming = state {{ a = state {{}}, trans {{ src = 'initial', tgt = 'a' }} }}, stays = state {{}},
             trans {{ src = 'warming', tgt = 'up', events = {{ 'e_after({around})' }} }},
             trans {{ src = 'warming.a', tgt = 'stays', events = {{ 'e_after({inside})' }} }},
             trans {{ src = 'warming', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'stays', tgt = 'leaving', events = {{ 'e_shutdown' }} }},"
        );
        Small::new(BASE, &by_base("warming", "leaving", &warming), "")
    };
    let never = "the bring-up stops at `root.stays` and never reaches `up`".to_owned();
    assert_eq!(said_and_run(&up("1.0", "3.0"), "deploy::never_up", ""), (vec![never.clone()], 1));
    assert_eq!(said_and_run(&up("3.0", "1.0"), "deploy::never_up", ""), (Vec::new(), 0));
    // What a simulated component reports has its time as well.
    let reported = |delay: &str| {
        let warming = "warming = state {}, stays = state {},
             trans { src = 'warming', tgt = 'up', events = { 'e_rep' } },
             trans { src = 'warming', tgt = 'stays', events = { 'e_after(0.2)' } },
             trans { src = 'warming', tgt = 'leaving', events = { 'e_shutdown' } },
             trans { src = 'stays', tgt = 'leaving', events = { 'e_shutdown' } },";
        let reaction = format!(
            "simulated: {{ reactions: [{{ after: create a, delay_s: {delay}, raise: e_rep, component: a }}] }}\n"
        );
        Small::new(BASE, &by_base("warming", "leaving", warming), &reaction)
    };
    assert_eq!(said_and_run(&reported("0.5"), "deploy::never_up", ""), (vec![never], 1));
    assert_eq!(said_and_run(&reported("0.1"), "deploy::never_up", ""), (Vec::new(), 0));
    // On the way down, and beside it.
    let down = |stopped: &str, inside: &str| {
        let cooling = format!(
            "cooling = state {{ tick = state {{}}, trans {{ src = 'initial', tgt = 'tick' }} }}, blip = state {{}}, hot = state {{}},
             trans {{ src = 'cooling.tick', tgt = 'blip', events = {{ 'e_after({inside})' }} }},
             trans {{ src = 'blip', tgt = 'cooling', events = {{ 'e_done' }} }},
             trans {{ src = 'cooling', tgt = 'leaving', events = {{ 'e_after(3.0)' }} }},
             trans {{ src = 'up', tgt = 'hot', events = {{ 'e_hot' }} }},
             trans {{ src = 'hot', tgt = 'cooling', events = {{ 'e_shutdown' }} }},"
        );
        Small::new(BASE, &by_base("up", stopped, &cooling), "")
    };
    let (told, code) = said_and_run(&down("cooling", "1.0"), "deploy::never_down", "");
    assert!(told.len() == 1 && told[0].starts_with("the shutdown stops at `root."), "{told:?}");
    assert_eq!(code, 1);
    assert_eq!(said_and_run(&down("cooling", "4.0"), "deploy::never_down", ""), (Vec::new(), 0));
    let beside = "from `root.cooling.tick` only what takes 3 s leads down, and what takes 1 s is always over before";
    assert_eq!(
        said_and_run(&down("leaving", "1.0"), "coord::no_way_down", "raise('e_hot') wait(0.1)"),
        (vec![beside.to_owned()], 4)
    );
    assert_eq!(
        said_and_run(&down("leaving", "4.0"), "coord::no_way_down", "raise('e_hot') wait(0.1)"),
        (Vec::new(), 0)
    );
}

/// What has to stand so long is not answered sooner, and what is reported so late does not come sooner.
#[test]
fn a_request_lasts_as_long_as_it_has_to_stand() {
    let conf = |time: &str| {
        format!(
            "base = Configuration {{ create('a', 'Drive'), post_conf_state = {{ 'a:running' }} }},
             park = Configuration {{ timeout = 10.0, holds = in_state('a', 'running'):for_at_least({time}),
               property_set('a.gain', 0.0) }}"
        )
    };
    let parking = "parking = state { entry = 'park' }, unpark = state { entry = 'park.undo' },
         trans { src = 'parking', tgt = 'NEXT', events = { 'park.ok' } },
         trans { src = 'parking', tgt = 'unpark', events = { 'park.failed', 'park.broken', 'park.lost' } },
         trans { src = 'unpark', tgt = 'leaving', events = { 'park.undone' } },
         trans { src = 'unpark', tgt = 'failed', events = { 'park.undo.failed', 'park.undo.broken', 'park.lost' } },
         trans { src = 'leaving', tgt = 'failed', events = { 'park.lost' } },
         trans { src = 'failed', tgt = 'unpark', events = { 'park.lost' } },";
    let up = format!(
        "{}trans {{ src = 'parking', tgt = 'unpark', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'up', tgt = 'unpark', events = {{ 'park.lost' }} }},",
        parking.replace("NEXT", "up")
    );
    let up = by_base("parking", "unpark", &up);
    let down = by_base("up", "parking", &parking.replace("NEXT", "unpark"));
    let lasts = |what: &str, key: &str| {
        format!("the {what} lasts 8 s at least (8 s until `park` stands), and `{key}.within_s` gives it 5 s")
    };
    let cases = [
        (&up, "deploy::never_up", lasts("bring-up", "deploy"), 1),
        (&down, "deploy::never_down", lasts("shutdown", "shutdown"), 1),
    ];
    for (states, code, message, exit) in cases {
        assert_eq!(said_and_run(&Small::new(&conf("8"), states, ""), code, ""), (vec![message], exit));
        assert_eq!(said_and_run(&Small::new(&conf("1"), states, ""), code, ""), (Vec::new(), 0));
    }
    // Beside the main way down.
    let beside = format!(
        "{}side = state {{}}, trans {{ src = 'up', tgt = 'side', events = {{ 'e_side' }} }},
         trans {{ src = 'side', tgt = 'parking', events = {{ 'e_shutdown' }} }},",
        parking.replace("NEXT", "unpark")
    );
    let (beside, code, story) = (by_base("up", "leaving", &beside), "coord::no_way_down", "raise('e_side') wait(0.1)");
    let long = "the way down by `root.parking` lasts 8 s at least, and `shutdown.within_s` gives it 5 s".to_owned();
    assert_eq!(said_and_run(&Small::new(&conf("8"), &beside, ""), code, story), (vec![long], 4));
    assert_eq!(said_and_run(&Small::new(&conf("1"), &beside, ""), code, story), (Vec::new(), 0));
    // What is over before leads elsewhere, or is waited for inside.
    let aside = format!(
        "{up}stays = state {{}}, trans {{ src = 'parking', tgt = 'stays', events = {{ 'e_after(1.0)' }} }},
         trans {{ src = 'stays', tgt = 'unpark', events = {{ 'e_shutdown', 'park.failed', 'park.broken', 'park.lost' }} }},"
    );
    let never = "the bring-up stops at `root.stays` and never reaches `up`".to_owned();
    assert_eq!(said_and_run(&Small::new(&conf("2"), &aside, ""), "deploy::never_up", ""), (vec![never], 1));
    let inside = "parking = state { entry = 'park', a = state {}, b = state {}, trans { src = 'initial', tgt = 'a' },
         trans { src = 'a', tgt = 'b', events = { 'e_after(1.0)' } } }";
    let inside = up.replace("parking = state { entry = 'park' }", inside);
    assert_eq!(said_and_run(&Small::new(&conf("2"), &inside, ""), "deploy::never_up", ""), (Vec::new(), 0));
    let reaction = "simulated: { reactions: [{ after: create a, delay_s: 8.0, raise: e_ready, component: a }] }\n";
    let warming = "warming = state {}, trans { src = 'warming', tgt = 'up', events = { 'e_ready' } },
         trans { src = 'warming', tgt = 'leaving', events = { 'e_shutdown' } },";
    let small = Small::new(BASE, &by_base("warming", "leaving", warming), reaction);
    let message =
        "the bring-up lasts 8 s at least (8 s until `e_ready` is reported), and `deploy.within_s` gives it 5 s";
    assert_eq!(said_and_run(&small, "deploy::never_up", ""), (vec![message.to_owned()], 1));
}

/// Which frames are squashed is followed for one order of frames that nobody tells apart: where they come in several, it is said.
#[test]
fn which_frames_are_squashed_is_told_where_they_come_in_several_orders() {
    let numbers: Vec<usize> = (0..9).collect();
    let each = |one: &dyn Fn(&usize) -> String| numbers.iter().map(one).collect::<String>();
    let conf = format!(
        "base = Configuration {{ {} }}, {}",
        each(&|n| format!("create('a{n}', 'Drive'),")),
        each(&|n| format!("p{n} = Configuration {{ property_set('a{n}.gain', 2.0) }},"))
    );
    // One asks for `first` and `second`, then for all others, and at last to undo the first of them.
    let chain = |name: &str, order: [usize; 3]| {
        let all: Vec<usize> = order.into_iter().chain(3..9).collect();
        let states = all.iter().map(|n| {
            format!(
                "{name}{n} = state {{ entry = 'p{n}' }},
                 trans {{ src = '{name}{n}', tgt = 'failed', events = {{ 'p{n}.failed', 'p{n}.broken' }} }},
                 trans {{ src = '{name}{n}', tgt = 'leaving', events = {{ 'e_shutdown' }} }},"
            )
        });
        let next = all.windows(2).map(|pair| {
            format!(
                "trans {{ src = '{name}{}', tgt = '{name}{}', events = {{ 'p{}.ok' }} }},",
                pair[0], pair[1], pair[0]
            )
        });
        let begin = format!("trans {{ src = 'up', tgt = '{name}{}', events = {{ 'e_{name}' }} }},", order[0]);
        let back = format!(
            "{name}_back = state {{ entry = 'p0.undo' }}, trans {{ src = '{name}8', tgt = '{name}_back', events = {{ 'p8.ok' }} }},
             trans {{ src = '{name}_back', tgt = 'leaving', events = {{ 'p0.undone', 'p0.undo.failed', 'p0.undo.broken', 'e_shutdown' }} }},"
        );
        states.chain(next).chain([begin, back]).collect::<String>()
    };
    let left = |states: &str| {
        let said = Small::new(&conf, &by_base("up", "leaving", states), "limits: { stack: 8 }\n").check();
        said.0["left"].to_string()
    };
    let told = "which frames are squashed was followed for one order";
    let both = left(&format!("{}{}", chain("x", [0, 1, 2]), chain("y", [1, 0, 2])));
    assert!(both.contains(told), "{both}");
    for one in [chain("x", [0, 1, 2]), chain("y", [1, 0, 2])] {
        let one = left(&one);
        assert!(!one.contains(told), "{one}");
    }
}
