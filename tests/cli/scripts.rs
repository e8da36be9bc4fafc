//! What scripts measure, record and expect, and what is told when they fail.

use crate::demo::{Demo, Ran};
use serde_json::Value as Json;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Runs a script that lies beside the demo's files; `@` stands for the project's deployments.
pub fn script(demo: &Demo, text: &str, more: &[&str]) -> Ran {
    demo.write("script.lua", &text.replace('@', &format!("{ROOT}/deployments/")));
    demo.run(&[&["run", "script.lua", "--clock", "simulated"], more].concat())
}

fn hello(text: &str, more: &[&str]) -> Ran {
    script(&Demo::new(), &format!("deploy('@hello.yaml')\n{text}"), more)
}

/// What is said of a script that fails, on one line.
fn refused(text: &str) -> String {
    let ran = hello(text, &["--quiet"]);
    assert_eq!(ran.code, 1, "{text}: {}{}", ran.out, ran.err);
    ran.err.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ")
}

#[test]
fn a_signal_is_what_the_port_carries_now() {
    let ran = hello(
        "local first = signal('gain.y')
         local began = now()
         assert(signal('gain.y') == first and now() == began, 'what is looked at already takes no time')
         wait(0.5)
         local u = signal('gain.u')                 -- an in-port that is driven
         assert(math.abs(signal('gain.y') - 0.5 * u) < 1e-12 and u ~= first)
         wait(0.5)
         assert(signal('sine.y') == signal('gain.u') and signal('gain.u') ~= u)
         assert(property('gain.k') == 0.5)
         shutdown()
         deploy('@youbot_arm.yaml')
         local before = signal('youbot.jointstate.stamp')
         local at = signal('youbot.jointstate')       -- the arm stands, and time goes on
         assert(#at.pos == 5 and signal('youbot.jointstate.pos[1]') == at.pos[2] and at.stamp > before)
         shutdown()",
        &["--quiet"],
    );
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}

#[test]
fn the_log_is_what_davit_log_prints_from_a_time_on() {
    let ran = hello(
        "local all = log()
         assert(all[1].at == 0 and all[1].what == 'phase' and all[1].phase == 'deploying')
         for i = 2, #all do assert(all[i - 1].at <= all[i].at, 'oldest first') end
         wait(0.5)
         local asked = now()
         assert(#log{ since = asked } == 0)
         raise('e_loud')
         wait_answer('loud.ok', 1)
         local seen = {}
         for _, it in ipairs(log{ since = asked }) do
           assert(it.at == asked)
           table.insert(seen, it.what)
           if it.answer == 'loud.ok' then
             assert(it.what == 'answered' and it.ok and it.by == 'hello' and it.reasons == nil)
             assert(#it.steps == 1 and it.steps[1].outcome == 'done', it.steps[1].outcome)
           end
         end
         assert(table.concat(seen, ' ') == 'event state requested requested answered answered', table.concat(seen, ' '))
         assert(#log() == #all + #seen and #log{ since = 1e9 } == 0)
         shutdown()",
        &["--quiet"],
    );
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    assert!(refused("log{ from = 1 }").contains("`log`: there is no option `from`: known options: `since`"));
    assert!(refused("log{ since = 'now' }").contains("`log`: `since` is a number, and this is of the type string"));
    assert!(refused("log{ since = 0/0 }").contains("`log`: `since` is not a number"));
    assert!(refused("shutdown() log()").contains("nothing is deployed"));
}

/// What it no longer has is said, and not passed over.
#[test]
fn a_log_that_does_not_reach_back_so_far_says_so() {
    let ran = hello(
        "local first = now()
         wait(0.01)
         for i = 1, 900 do raise('e_loud') wait_answer('loud.ok', 1) raise('e_quiet') wait(0.01) end
         local all = log()
         assert(all[1].what == 'missed' and all[1].entries > 1000, all[1].what)
         for i = 2, #all do assert(all[i].what ~= 'missed' and all[1].at <= all[i].at, 'what is left is newer') end
         assert(log{ since = first }[1].what == 'missed')
         local left = log{ since = all[1].at + 0.001 }
         assert(#left > 3000 and left[1].what ~= 'missed', #left)
         shutdown()",
        &["--quiet"],
    );
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}

#[test]
fn an_in_port_that_nothing_drives_is_what_was_written() {
    let demo = Demo::new();
    let ran = script(
        &demo,
        "deploy('deployment.yaml') wait_answer('slow.ok', 1)
         assert(signal('sink.flag') == false and signal('sink.w') == nil)
         signal('source.y')",
        &["--quiet"],
    );
    assert_eq!(ran.code, 1);
    assert!(ran.err.contains("this platform does not show what goes through ports"), "{}", ran.err);
}

#[test]
fn what_leads_nowhere_is_named_at_its_line() {
    for (text, says) in [
        ("signal('gian.y')", "there is no component `gian`: did you mean `gain`?"),
        ("signal('gain.yy')", "`gain` has no property or port `yy`: did you mean `y`?"),
        ("signal('gain.k')", "`gain.k` is a property: `property(\"gain.k\")` reads it"),
        ("signal('gain.y[0]')", "`[0]` of float, which has no elements"),
        ("sample{ every = 0, signals = { y = 'gain.y' } }", "every 0 s: a number of seconds from"),
        ("sample{ signals = { y = 'gain.y' } }", "`sample` needs `every`"),
        ("sample{ every = 1, signals = {} }", "`sample` needs signals"),
        ("sample{ every = 1, signal = {} }", "there is no option `signal`: did you mean `signals`?"),
        ("sample{ every = 1, signals = { y = 'gain.z' } }", "`gain` has no property or port `z`"),
        (
            "local s = sample{ every = 1, signals = { y = 'gain.y' } } s:rms('x')",
            "has no signal `x`: known signals: `y`",
        ),
        ("local s = sample{ every = 1, signals = { y = 'gain.y' } } s:rms('y')", "has no value of `y` yet"),
        ("local s = sample{ every = 1, signals = { y = 'gain.y' } } s:rmss('y')", "has no `rmss`: did you mean `rms`?"),
        ("sample{ every = 1, signals = { 'gain.y' }, name = 'a/b' }", "`a/b` is no name"),
        ("expect{ name = 'e', value = 1 }", "`expect` needs `min`, `max` or both"),
        ("expect{ name = 'e', max = 1 }", "`expect` needs `value`"),
        ("expect{ name = 'e', value = '1', max = 1 }", "`value` is a number, and this is of the type string"),
        ("expect{ name = 'e', value = 1, maximum = 1 }", "there is no option `maximum`: did you mean `max`?"),
        (
            "figure{ name = 'e', value = 1 }\nfigure{ name = 'e', value = 1 }",
            "there is a figure `e` already (script.lua:2)",
        ),
    ] {
        let said = refused(text);
        assert!(said.contains(says) && said.contains("script.lua:"), "{text}: {said}");
    }
}

/// A table, a text without a place, what has gone on for too long, nothing: the line is where it was raised.
#[test]
fn what_is_raised_without_a_place_is_named_at_its_line() {
    for (text, says) in [
        ("error({ code = 2 })", "script.lua:2: the error is a table and no text"),
        ("local function f()\nerror('plain', 0)\nend\nf()", "script.lua:3: plain"),
        ("error()", "script.lua:2: nil"),
        ("error(setmetatable({}, { __tostring = function() return 'mine' end }))", "script.lua:2: mine"),
        ("local a = 1\nwhile true do a = a + 1 end", "script.lua:3: ended after 500 million instructions"),
    ] {
        let said = refused(text);
        assert!(said.contains(says), "{text}: {said}");
    }
}

#[test]
fn a_recording_is_summed_up_and_kept() {
    let demo = Demo::new();
    let ran = script(
        &demo,
        "deploy('@hello.yaml')
         local s = sample{ name = 'sine', every = 0.01, signals = { y = 'gain.y', u = 'sine.y', again = 'gain.y' } }
         wait(4.005)
         s:stop()
         local n = s:count('y')
         assert(n == 400, n)
         assert(math.abs(s:rms('u') - math.sqrt(0.5)) < 1e-3 and math.abs(s:mean('u')) < 1e-3)
         assert(math.abs(s:max('u') - 1) < 1e-3 and math.abs(s:min('u') + 1) < 1e-3)
         local y, u, t = s:values('y'), s:values('u'), s:times()
         assert(#y == n and #t == n and t[2] > t[1] and math.abs(t[2] - t[1] - 0.01) < 1e-9)
         for i = 1, n do assert(math.abs(y[i] - 0.5 * u[i]) < 1e-12) end
         assert(s:last('again') == y[n])
         wait(1)
         assert(s:count('y') == n, 'it was stopped')
         shutdown()",
        &["--quiet", "--samples", "kept"],
    );
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    let kept = demo.read("kept/sine.csv");
    assert_eq!(kept.lines().next(), Some("time,gain.y,sine.y"));
    assert_eq!(kept.lines().count(), 401);
    // It is a recording as monitors read it.
    demo.write("m.lua", "Monitors { high = monitor { when = above('sine.y', 0.9), event = 'e_high' } }");
    let ran = demo.run(&["monitor", "m.lua", "--samples", "kept/sine.csv", "--json"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    assert!(ran.out.contains("e_high"), "{}", ran.out);
}

/// The lines that are JSON with that `what`.
fn told<'a>(out: &'a str, what: &'a str) -> impl Iterator<Item = Json> + 'a {
    let lines = out.lines().filter_map(|line| serde_json::from_str::<Json>(line).ok());
    lines.filter(move |line| line["what"] == what)
}

#[test]
fn a_figure_out_of_bounds_fails_the_script_at_its_end() {
    let text = "wait(0.1)
         expect{ name = 'kept', value = 1, min = 0, max = 1, unit = 'm' }
         expect{ name = 'high', value = 2.5, max = 2, unit = 'N' }
         expect{ name = 'none', value = 0/0, min = 0 }
         figure{ name = 'seen', value = 7 }
         raise('e_loud') wait_answer('loud.ok', 1)
         say('went on')
         shutdown()";
    let ran = hello(text, &["--quiet"]);
    assert_eq!(ran.code, 1, "{}{}", ran.out, ran.err);
    for line in
        ["went on", "high    2.5 N  at most 2 N", "kept    1 m    at least 0 m and at most 1 m  ok", "seen    7"]
    {
        assert!(ran.out.contains(line), "{line}: {}", ran.out);
    }
    // Where it was missed: what was in force then, and not what came of it later.
    assert!(ran.out.contains("stack   quiet, run, build, newest first"), "{}", ran.out);
    assert!(ran.out.contains("answer     quiet.ok") && !ran.out.contains("loud.ok"), "{}", ran.out);
    for word in ["script::missed", "script.lua:4: high is 2.5 N, expected at most 2 N", "2 of 3 figures out of bounds"]
    {
        assert!(ran.err.contains(word), "{word}: {}", ran.err);
    }
    let ran = hello(text, &["--json"]);
    assert_eq!(ran.code, 1);
    let figures = told(&ran.out, "figures").next().expect("the table")["figures"].clone();
    let ok: Vec<bool> = figures.as_array().unwrap().iter().map(|f| f["ok"].as_bool().unwrap()).collect();
    assert_eq!(ok, [true, false, false, true]);
    assert_eq!((&figures[1]["value"], &figures[2]["value"]), (&2.5.into(), &Json::Null));
    let scene = told(&ran.out, "failed").next().expect("where it failed");
    assert_eq!(scene["stack"][2]["configuration"], "quiet");
    assert!(ran.out.lines().last().unwrap().contains("script::missed"), "{}", ran.out);
}

#[test]
fn a_fatal_one_fails_it_at_once_and_catching_it_is_no_way_out() {
    let ran = hello("expect{ name = 'e', value = 2, max = 1, fatal = true }\nsay('went on')", &["--quiet"]);
    assert!(ran.code == 1 && !ran.out.contains("went on"), "{}{}", ran.out, ran.err);
    assert!(ran.err.contains("script.lua:2: e is 2, expected at most 1"), "{}", ran.err);
    let ran = hello("pcall(expect, { name = 'e', value = 2, max = 1, fatal = true })\nsay('went on')", &["--quiet"]);
    assert!(ran.code == 1 && ran.out.contains("went on"), "{}{}", ran.out, ran.err);
}

#[test]
fn what_was_there_is_told_of_whatever_fails() {
    for text in ["assert(false, 'no luck')", "wait_state('hard', 0.1)", "assert_state('gain', 'stopped')"] {
        let ran = hello(&format!("raise('e_quiet') wait(0.05)\n{text}"), &["--quiet"]);
        assert_eq!(ran.code, 1);
        for word in ["where it failed: at", "root.operational.soft", "quiet, run, build", "event      e_quiet"] {
            assert!(ran.out.contains(word), "{text}: {word}: {}", ran.out);
        }
    }
}

#[test]
fn a_fault_goes_into_a_component_at_its_time() {
    let ran = hello(
        "inject('gain', 'panic', nil, now() + 0.25)
         wait(0.2)
         assert_running('gain')
         wait(0.1)
         assert_state('gain', 'faulted')
         shutdown()
         deploy('@youbot_arm.yaml')
         local at = now() + 0.5
         inject('youbot', 'overcurrent', {}, at)
         wait_answer('e_OVERCURRENT', 1)
         assert(now() - at < 0.002, now())
         wait_answer('safe_hold.ok', 1)",
        &[],
    );
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    assert!(ran.err.is_empty() && ran.out.contains("0.250 s  inject  gain: panic"), "{}{}", ran.out, ran.err);
    let types = crate::demo::at_home(&["types", "youbot.Driver"]);
    let stall = "stall(seconds: float, operation: string = \"\")";
    for line in ["overcurrent(joint: int = 0 (0 … 5))", "undervoltage()", stall, "its code panics"] {
        assert!(types.out.contains(line), "{line}: {}", types.out);
    }
}

/// What components raise of safety stands in the text while nothing is being stopped, too; what else they raise does not.
#[test]
fn what_is_of_safety_is_told_as_text() {
    for (what, event, from) in [
        (
            "raise('e_estop') wait_answer('safe_hold.ok', 1) apply('stop_all', { force = true })",
            "e_arm_dropped",
            "youbot",
        ),
        ("inject('youbot', 'panic')", "e_arm_fell", "World"),
    ] {
        let text =
            format!("wait_state('copying', 20) {what} wait_answer('{event}', 1) wait(0.1) say('on its way down')");
        let ran = script(&Demo::new(), &format!("deploy('@youbot_arm.yaml') {text}"), &[]);
        let (before, after) = ran.out.split_once("on its way down").unwrap_or_else(|| panic!("{}{}", ran.out, ran.err));
        assert_eq!(before.matches(&format!("..  {event} from {from}\n")).count(), 1, "{}", ran.out);
        assert!(!before.contains("e_qos_ok") && after.contains("..  e_qos_ok from Monitors\n"), "{}", ran.out);
    }
}

/// The configurator is no component: what it knows is said wherever something else is asked of it.
const ONE_FAULT: &str = "the configurator knows one fault, without parameters: `inject(\"configurator\", \"panic\")`";

#[test]
fn what_cannot_be_injected_is_named_at_its_line() {
    for (text, says) in [
        ("inject('gian', 'panic')", "no configuration creates a component `gian`: did you mean `gain`?"),
        ("inject('gain', 'panik')", "nothing called `panik` can be injected into standard.Gain: did you mean `panic`?"),
        ("inject('gain', 'stall', { secnds = 1 })", "`stall` has no parameter `secnds`: did you mean `seconds`?"),
        ("inject('gain', 'stall', { seconds = 'x' })", "expected float"),
        ("inject('gain', 'stall', 0.5)", "`inject` takes parameters as a table"),
        ("wait(1) inject('gain', 'panic', nil, 0.5)", "`inject` at 0.5 s, and it is 1 s already"),
        ("inject('gain', 'panic', nil, 9) wait(1) shutdown()", "script.lua:2: `panic` was to happen to `gain` at 9 s"),
        ("inject('configurator', 'panik')", ONE_FAULT),
        ("inject('configurator', 'stall', { seconds = 1 })", ONE_FAULT),
        ("inject('configurator', 'panic', { seconds = 1 })", ONE_FAULT),
        ("inject('configurator', 'panic', 0.5)", "`inject` takes parameters as a table, and this is a number"),
        ("wait(1) inject('configurator', 'panic', nil, 0.5)", "`inject` at 0.5 s, and it is 1 s already"),
        (
            "inject('configurator', 'panic', nil, 9) wait(1) shutdown()",
            "script.lua:2: `panic` was to happen to `configurator` at 9 s",
        ),
    ] {
        let said = refused(text);
        assert!(said.contains("script.lua:2"), "{text}: {said}");
        assert_eq!(said.matches(says).count(), 1, "{text}: {said}");
    }
    let ran = script(&Demo::new(), "deploy('deployment.yaml') inject('source', 'panic')", &["--quiet"]);
    assert!(ran.code == 1 && ran.err.contains("on this platform"), "{}", ran.err);
}

#[test]
fn a_value_that_is_set_is_waited_for_and_says_why_not() {
    let ran = hello(
        "set('gain.k', 3.0, { force = true, within = 1 })
         assert(property('gain.k') == 3)
         set('gain.k', 4.0, { force = true, within = 1 })
         assert(property('gain.k') == 4)
         undo('gain.k') wait_answer('gain.k.undone', 1)
         wait(0.1)
         shutdown()
         deploy('@youbot_arm.yaml')
         set('Peer.delay', 0.05, { force = true, within = 1 })
         assert(property('Peer.delay') == 0.05)
         shutdown()",
        &["--quiet"],
    );
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    let said = refused("set('gain.k', 3.0, { within = 1 })");
    assert!(said.contains("gain.k.failed") && said.contains("--force"), "{said}");
}

/// Same seed, same log and samples, byte for byte.
#[test]
fn a_scenario_is_the_same_every_time() {
    let story = "deploy('@youbot_arm.yaml')
        local s = sample{ every = 0.002, name = 'arm', signals = { f = 'Cart_Impedance.f_raw_norm', q = 'youbot.jointstate.pos[1]',
          x = 'youbot.odometry.x', i = 'youbot.motor_states.current[2]' } }
        wait_state('copying', 15)
        wait(0.5)
        set('Peer.delay', 0.02, { force = true, within = 1 })
        inject('Operator', 'stall', { seconds = 0.03 }, now() + 0.1)
        inject('youbot', 'ec_timeout', nil, now() + 0.3)
        wait_answer('e_EC_TIMEOUT', 1)
        wait(0.5)
        figure{ name = 'force', value = s:max('f'), unit = 'N' }";
    let run = || {
        let demo = Demo::new();
        let ran = script(&demo, story, &["--json", "--samples", "kept"]);
        assert!(ran.err.is_empty(), "{}", ran.err);
        (ran.code, ran.out, demo.read("kept/arm.csv"))
    };
    let first = run();
    assert!(first.1.contains("e_EC_TIMEOUT") && first.2.lines().count() > 500, "{}", first.1);
    for again in 2..=5 {
        let (code, out, samples) = run();
        assert_eq!(code, first.0);
        let differs = out.lines().zip(first.1.lines()).find(|(a, b)| a != b);
        assert!(out == first.1, "run {again}: {differs:?}");
        let differs = samples.lines().zip(first.2.lines()).find(|(a, b)| a != b);
        assert!(samples == first.2, "run {again}: {differs:?}");
    }
}

/// Also who goes over a table by its keys: Lua's own order is another one in each process.
#[test]
fn the_keys_of_a_table_come_in_an_order() {
    let ran = hello(
        "local t, s = { 7, 8, two = 2, one = 1, [10] = 3, [-1.5] = 4, [true] = 5 }, ''
         for key, value in pairs(t) do s = s .. tostring(key) .. '=' .. value .. ' ' if key == 1 then t.one = nil end end
         say(s)
         local ok, why = pcall(function() for _ in pairs(nil) do end end)
         say(why)
         local own = setmetatable({}, { __pairs = function() return next, { a = 1 } end })
         for key in pairs(own) do say('own ' .. key) end
         local hidden = setmetatable({ b = 1 }, { __metatable = {}, __pairs = function() return next, { c = 1 } end })
         for key in pairs(hidden) do say('own ' .. key) end
         local step, all = pairs{ x = 1, y = 2 }
         say('next ' .. step(all, 'x') .. step(all) .. tostring(step(all, 'y')))",
        &["--quiet"],
    );
    assert!(ran.out.contains("-1.5=4 1=7 2=8 10=3 two=2 true=5 \n"), "{}{}", ran.out, ran.err);
    assert!(
        ran.out.contains(":5: bad argument #1 to 'for iterator' (table expected, got nil)"),
        "{}{}",
        ran.out,
        ran.err
    );
    assert!(ran.out.contains("own a\nown c\nnext yxnil\n"), "{}{}", ran.out, ran.err);
}

/// A misspelt name is told with its line before anything is brought up, wherever in the script it stands.
#[test]
fn names_that_there_are_not_are_told_before_it_begins() {
    let story = "deploy('@hello.yaml')
local function later() rasie('e_stop') end
print('up')
say(raised and 1 or 2)
raise(e_go)";
    let ran = script(&Demo::new(), story, &[]);
    assert_eq!((ran.code, ran.out.contains("build.ok")), (2, false), "{}{}", ran.out, ran.err);
    for (name, place, help) in [
        ("rasie", ":2:24", "did you mean `raise`?"),
        ("print", ":3:1", "did you mean `say`?"),
        ("raised", ":4:5", "did you mean `raise`?"),
        ("e_go", ":5:7", "stands in quotes: `\"e_go\"`"),
    ] {
        assert!(ran.err.contains(&format!("`{name}` is not defined")), "{name}: {}", ran.err);
        assert!(
            ran.err.contains(&format!("script.lua{place}]")) && ran.err.replace("\n        ", " ").contains(help),
            "{name}: {}",
            ran.err
        );
    }
}
