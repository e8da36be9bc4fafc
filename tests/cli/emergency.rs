//! An emergency: what is left of one that failed in part, who lets go of it, and what `check` says of that.

use crate::demo::Demo;
use serde_json::Value as Json;

/// What `davit new` writes, in YAML.
pub fn belt() -> Demo {
    let demo = Demo::new();
    let new = demo.run(&["new", "belt"]);
    assert_eq!(new.code, 0, "{}{}", new.out, new.err);
    demo
}

/// What a script says of it, on the simulated clock.
pub fn said(demo: &Demo, script: &str) -> Vec<String> {
    demo.write("belt/own.lua", script);
    let ran = demo.run(&["run", "belt/own.lua", "--clock", "simulated", "--quiet"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    ran.out.lines().map(str::to_owned).collect()
}

/// Errors and warnings of `check` with that code.
fn found(demo: &Demo, code: &str) -> Vec<Json> {
    let told = demo.run(&["check", "belt/deployment.yaml", "--json"]).json();
    let all = told["findings"].as_array().unwrap().iter();
    all.filter(|one| one["code"] == code && one["severity"] != "info").cloned().collect()
}

/// The brake fails, or the speed is not written: what was done stays until people say otherwise, and then nothing says 0.4 any more.
#[test]
fn one_that_fails_in_part_stays_and_is_undone_to_what_is_in_force() {
    let story = |fault: &str| {
        format!(
            "deploy('deployment.yaml') raise('e_faster') wait_answer('fast.ok', 1)
             fault('{fault}', 'fail') raise('e_stop') wait(5)
             wait_state('stopped.in_part', 0) say('stopped ' .. tostring(port('motor.speed')))
             raise('e_reset') wait_state('failed', 1) wait(1) say('reset ' .. tostring(port('motor.speed')))
             shutdown()"
        )
    };
    let demo = belt();
    assert_eq!(said(&demo, &story("operation_call motor.brake")), ["stopped 0.0", "reset nil"]);
    assert_eq!(said(&demo, &story("port_write motor.speed = 0.0")), ["stopped 0.4", "reset nil"]);
    // Also where something else is under way, which it interrupts.
    for fault in ["operation_call motor.brake", "port_write motor.speed = 0.0"] {
        let beside = story(fault).replace("raise('e_stop')", "set('motor.limit', 0.7) raise('e_stop')");
        assert_eq!(said(&demo, &beside)[1..], ["reset nil"], "{fault}");
    }
    // Also where its coordinator lets go of it at once.
    demo.replace("belt/coordinator.yaml", "events: [e_reset]", "events: [e_reset, stop.failed, stop.broken]");
    let at_once =
        story("operation_call motor.brake").replace("wait_state('stopped.in_part', 0)", "wait_state('failed', 0)");
    assert_eq!(said(&demo, &at_once), ["stopped nil", "reset nil"]);
}

/// The motor had never started, though the platform had said so: neither the end of the emergency, nor the way down through it, nor who
/// gives up what is under way has asked for it to start.
#[test]
fn letting_go_starts_nothing() {
    let story = |asks: &str, then: &str| {
        format!(
            "fault('start motor', 'lie', 1) deploy('deployment.yaml')
             {asks}
             for _, entry in ipairs(log{{ since = now() - 6 }}) do
               for _, done in ipairs(entry.steps or {{}}) do
                 if done.step == 'start motor' then say('started by ' .. entry.answer) end
               end
             end
             say(active()[#active()] .. ' ' .. tostring(state('motor')))
             for _, frame in ipairs(stack()) do if frame.lost then say('lost ' .. frame.configuration) end end
             for _, one in ipairs(drift()) do say(one.how .. ' ' .. one.text) end
             {then} raise('e_end') wait(1) say(active()[#active()])"
        )
    };
    let demo = belt();
    let stop = "fault('operation_call motor.brake', 'lost', 1) raise('e_stop') wait(4)
                for _, one in ipairs(stack()) do if one.partial then say('in part ' .. one.configuration) end end";
    let reset = said(&demo, &story(&format!("{stop} raise('e_reset') wait(0.5)"), ""));
    let left = ["started by run.ok", "root.failed stopped", "lost run", "differs stop motor", "root.off"];
    assert_eq!((reset[0].as_str(), &reset[1..]), ("in part stop", &left.map(str::to_owned)[..]));
    let down = said(&demo, &story(&format!("{stop} raise('e_end') wait(0.5)"), ""));
    assert_eq!(down[1..], ["started by run.ok", "root.off nil", "root.off"].map(str::to_owned));
    let gives_up = "fault('port_write motor.speed', 'lost', 1) raise('e_faster') wait(0.2) raise('e_slower') wait(4)";
    let gave_up = said(&demo, &story(gives_up, "recover('back')"));
    assert_eq!(gave_up[..2], ["started by run.ok", "root.failed stopped"].map(str::to_owned), "{gave_up:?}");
    assert_eq!(gave_up.last().unwrap(), "root.off", "a recovery mends it, and the way down is free");
    // Where all is known it has gone back, and only the motor is otherwise: nobody has to recover.
    let gives_up =
        "fault('port_write motor.speed', 'slow', 1, 0.5) raise('e_faster') wait(0.2) raise('e_slower') wait(1)";
    assert_eq!(said(&demo, &story(gives_up, "")), left);
}

/// A stop interrupts what is then taken back, and fails in part: its end makes nothing of that again, and starts nothing.
#[test]
fn what_was_taken_back_meanwhile_is_not_made_again() {
    let demo = belt();
    demo.replace(
        "belt/configurations.yaml",
        "- create: { component: motor, type: Motor }",
        "- create: { component: motor, type: Motor }\n      - create: { component: other, type: Motor }",
    );
    demo.replace("belt/configurations.yaml", "[\"motor:stopped\"]", "[\"motor:stopped\", \"other:stopped\"]");
    demo.replace("belt/configurations.yaml", "[\"motor:running\"]", "[\"motor:running\", \"other:running\"]");
    let story = |slow: &str, then: &str| {
        format!(
            "deploy('deployment.yaml') raise('e_end') wait_state('off', 2)
             fault('{slow}', 'slow', 1, 0.2) fault('operation_call motor.brake', 'lost', 1)
             raise('e_start') wait(0.1) raise('e_stop') wait(5) local since = now()
             for _, one in ipairs(drift()) do say(one.how) end
             {then} wait(1)
             for _, entry in ipairs(log{{ since = since }}) do
               for _, done in ipairs(entry.steps or {{}}) do
                 if done.step:find('^start') or done.step:find('^create') then say(done.step .. ' by ' .. (entry.answer or entry.what)) end
               end
             end
             raise('e_end') wait(1) say(active()[#active()])"
        )
    };
    for slow in ["start other", "create other"] {
        for then in ["raise('e_end')", "raise('e_reset')", "pcall(recover, 'back')"] {
            let mut told = said(&demo, &story(slow, then));
            told.retain(|line| !line.contains("note  "));
            assert_eq!(told, ["unknown", "root.off"], "{slow}, {then}");
        }
    }
}

/// A release of which nobody knows whether it happened, and a stop meanwhile: what is let go of later is let go of, and the way down is free.
#[test]
fn what_nobody_knows_of_something_that_is_over_stands_in_nobodys_way() {
    let told = said(
        &belt(),
        "deploy('deployment.yaml') raise('e_stop') wait_answer('stop.ok', 1)
         fault('operation_call motor.release', 'lost', 1) raise('e_end') wait(0.5) raise('e_stop') wait(5)
         raise('e_end') wait(2) say(active()[#active()])",
    );
    assert_eq!(told, ["root.off"]);
}

/// What something safe in force has written, or its place, is changed by hand only with force, also where it is listed; whoever looks takes it
/// for held.
#[test]
fn what_is_safe_is_overwritten_by_force_only() {
    let demo = belt();
    demo.replace("belt/deployment.yaml", "operator: [motor.limit]", "operator: [motor.limit, motor.speed, fast]");
    let story = "local function tries(what, ask) local ok, why = pcall(ask) say(what .. ' ' .. tostring(port('motor.speed')) .. (ok and '' or ': ' .. tostring(why):match('[^\\n]*$'))) end
         deploy('deployment.yaml') set('motor.speed', 0.2, { within = 1 }) say(tostring(port('motor.speed')))
         undo('motor.speed') wait_answer('motor.speed.undone', 1)
         raise('e_stop') wait_answer('stop.ok', 1)
         tries('set', function() set('motor.speed', 0.4, { within = 1 }) end)
         set('motor.limit', 0.3, { within = 1 }) say('beside ' .. property('motor.limit'))
         apply('fast') wait(0.5) say('apply ' .. tostring(port('motor.speed')))
         for _, frame in ipairs(stack()) do if frame.configuration == 'stop' then say('stop is there') end end
         set('motor.speed', 0.4, { within = 1, force = true }) say('forced ' .. port('motor.speed'))
         undo('motor.speed') wait(0.5) undo('motor.limit') wait(0.5)
         raise('e_reset') wait(0.5) shutdown()";
    let told = said(&demo, story);
    assert_eq!(told.len(), 6, "{told:?}");
    assert_eq!((&*told[0], &*told[2], &*told[3]), ("0.2", "beside 0.3", "apply 0.0"), "{told:?}");
    assert!(told[1].starts_with("set 0.0: "), "{told:?}");
    assert_eq!(told[4..], ["stop is there", "forced 0.4"]);
    let up = demo.run(&["deploy", "belt/deployment.yaml", "--detach"]);
    assert_eq!(up.code, 0, "{}{}", up.out, up.err);
    assert_eq!(demo.run(&["event", "e_stop", "--wait", "stop.ok"]).code, 0);
    let refused = demo.run(&["set", "motor.speed", "0.4"]);
    let why =
        "`port_write motor.speed = 0.4` changes what the safe configuration `stop`, which is in force, has written";
    assert!(refused.code == 1 && refused.out.contains(why), "{}{}", refused.out, refused.err);
    let refused = demo.run(&["apply", "fast"]);
    let why = "it would take the place of the safe configuration `stop`, which is in force";
    assert!(refused.code == 1 && refused.out.contains(why), "{}{}", refused.out, refused.err);
    assert_eq!(demo.run(&["shutdown"]).code, 0);
}

/// A value that the platform had lied about, and that something safe has written since, is right again: nothing stands in the way down.
#[test]
fn what_has_become_right_again_stands_in_nobodys_way() {
    let told = said(
        &belt(),
        "deploy('deployment.yaml') fault('port_write motor.speed', 'lie', 1) raise('e_faster') wait(7)
         assert(stack()[3].lost) raise('e_stop') wait(1) raise('e_end') wait(2) say(active()[#active()])",
    );
    assert!(told.last().is_some_and(|last| last == "root.off"), "{told:?}");
}

/// A slip in the name of a safety event is named where it was made.
#[test]
fn a_misspelt_safety_event_is_named() {
    let demo = belt();
    demo.replace(
        "belt/coordinator.yaml",
        "- { src: failed, tgt: stopped, events: [e_stop] }",
        "- { src: failed, tgt: stopped, events: [e_stpo] }",
    );
    let near = found(&demo, "coord::near_event");
    assert_eq!(near.len(), 1, "{near:?}");
    assert_eq!(near[0]["message"], "`e_stpo` is nearly `e_stop`, which `safety` lists");
}

/// Who lets go of it, and stops it again before that was heard, has it stopped: what comes last counts, though safety is heard first.
#[test]
fn a_stop_that_comes_last_is_the_last_word() {
    let story = "deploy('deployment.yaml') raise('e_stop') wait_answer('stop.ok', 1)
         raise('e_reset') raise('e_stop') wait(1) wait_state('stopped', 0)
         for _, frame in ipairs(stack()) do if frame.configuration == 'stop' then say('in force') end end
         raise('e_stop') raise('e_reset') wait_state('failed', 1) say('let go')
         shutdown()";
    let overtaken = "note  `e_reset` is not heard any more: an event of safety came before it was taken up";
    let told = said(&belt(), story);
    assert!(told.len() == 3 && told[0].ends_with(overtaken) && told[1..] == ["in force", "let go"], "{told:#?}");
}

/// Who recovers puts right what differs, and does not let go of what holds: that is done by its own undo. Applied once more, and whole, it
/// lacks nothing any more, and nothing is broken.
#[test]
fn what_holds_in_part_is_not_let_go_by_who_recovers() {
    let demo = belt();
    let story = "deploy('deployment.yaml') raise('e_faster') wait_answer('fast.ok', 1)
         fault('port_write motor.speed = 0.0', 'fail', 1) raise('e_stop') wait_state('stopped.in_part', 1)
         local ok, why = pcall(recover, 'back')
         say(tostring(ok) .. ' ' .. tostring(why):gsub('\\n', ' '))
         for _, entry in ipairs(log{ since = 0 }) do
             for _, step in ipairs(entry.steps or {}) do
                 if tostring(step.step):find('motor.release', 1, true) then say('released') end
             end
         end
         for _, frame in ipairs(stack()) do if frame.configuration == 'stop' then say('stop ' .. tostring(frame.partial)) end end
         apply('stop') wait_answer('stop.ok', 1) say('speed ' .. port('motor.speed'))
         recover('back') say('whole')
         undo('stop') wait_answer('stop.undone', 1) say(tostring(pcall(recover, 'back')))
         shutdown()";
    let told = said(&demo, story);
    let told: Vec<&String> = told.iter().filter(|line| !line.contains("note ")).collect();
    assert!(told[0].starts_with("false ") && told[0].contains("`stop` is safe and stays"), "{told:?}");
    assert!(told[0].contains("operation_call motor.brake() (done, and not taken back)"), "{told:?}");
    // The whole one has taken the place of its group's frame, and its undo leads to where both are gone.
    assert_eq!(told[1..], ["stop true", "speed 0.0", "whole", "true"]);
    // Where it is in no group both are in force, and the undo of the whole one leaves the other.
    demo.replace("belt/configurations.yaml", "    safe: true\n    group: speed\n", "    safe: true\n");
    let told = said(&demo, story);
    let told: Vec<&String> = told.iter().filter(|line| !line.contains("note ")).collect();
    assert_eq!(told[1..], ["stop true", "speed 0.0", "whole", "false"]);
}

/// The platform lies, a look finds that, and an emergency of the same group takes the place of what has lied: its undo leads to where that of
/// the other would have led, and nothing is mended to what nobody has in force any more.
#[test]
fn what_an_emergency_takes_the_place_of_is_expected_no_more() {
    let demo = belt();
    demo.replace(
        "belt/configurations.yaml",
        "      - create: { component: motor, type: Motor }",
        "      - create: { component: motor, type: Motor }\n      - create: { component: aux, type: Motor }",
    );
    demo.replace("belt/configurations.yaml", "[\"motor:stopped\"]", "[\"motor:stopped\", \"aux:stopped\"]");
    demo.replace(
        "belt/configurations.yaml",
        "      - port_write: { port: motor.speed, value: 0.4 }",
        "      - port_write: { port: motor.speed, value: 0.4 }\n      - create: { component: third, type: Motor }\n    post_conf_state: [\"aux:running\", \"third:stopped\"]",
    );
    for (lie, seen) in [
        ("port_write motor.speed = 0.4", "port_write motor.speed = 0.1"),
        ("start aux", "stop aux"),
        ("configure third", "cleanup third"),
    ] {
        let story = format!(
            "deploy('deployment.yaml')
             local function tell(when) say(when .. ' ' .. tostring(port('motor.speed')) .. ' ' .. state('aux') .. ' ' .. tostring(state('third')) .. ' ' .. #drift()) end
             fault('{lie}', 'lie') raise('e_faster') wait_answer('fast.ok', 1) wait(6)
             raise('e_stop') wait_state('stopped', 1) wait(1) raise('e_reset') wait_state('failed', 1) wait(6) tell('reset')
             recover('back') wait(1) tell('recovered') shutdown() wait(6)"
        );
        let told = said(&demo, &story);
        let reset: Vec<&String> = told.iter().filter(|line| !line.contains("note ")).collect();
        assert!(told.iter().any(|line| line.contains(seen)), "{lie}: {told:?}");
        assert_eq!(reset, ["reset nil stopped nil 0", "recovered nil stopped nil 0"], "{lie}");
    }
}

/// An operator has set what the frame below has set as well: an emergency of its group that fails in part takes its place all the same.
#[test]
fn one_that_fails_in_part_takes_the_place_of_its_group_below_an_operators_frame() {
    let demo = belt();
    demo.replace(
        "belt/configurations.yaml",
        "      - port_write: { port: motor.speed, value: 0.4 }",
        "      - port_write: { port: motor.speed, value: 0.4 }\n      - property_set: { property: motor.limit, value: 0.9 }",
    );
    let story = |fault: &str| {
        format!(
            "deploy('deployment.yaml')
             local function tell(when)
                 local frames = {{}}
                 for _, frame in ipairs(stack()) do frames[#frames + 1] = frame.configuration end
                 say(when .. ' ' .. tostring(port('motor.speed')) .. ' ' .. property('motor.limit') .. ' ' .. #drift() .. ' ' .. table.concat(frames, ' '))
             end
             raise('e_faster') wait_answer('fast.ok', 1) set('motor.limit', 0.7) wait_answer('motor.limit.ok', 1)
             fault('{fault}', 'fail') raise('e_stop') wait_answer('stop.broken', 1) tell('stopped')
             raise('e_reset') wait_answer('stop.undone', 1) tell('reset') undo() wait(1) tell('undone')
             shutdown()"
        )
    };
    for (fault, speed) in [("operation_call motor.brake", "0.0"), ("port_write motor.speed = 0.0", "0.4")] {
        let told = said(&demo, &story(fault));
        let stopped = format!("stopped {speed} 0.7 0 build run motor.limit stop");
        assert_eq!(
            told,
            [stopped.as_str(), "reset nil 0.7 0 build run motor.limit", "undone nil 0.5 0 build run"],
            "{fault}"
        );
    }
}

/// What an operator was setting when the emergency came is taken back where the emergency could not write the same.
#[test]
fn what_it_interrupts_is_taken_back_where_it_has_written_nothing() {
    let demo = belt();
    demo.replace("belt/configurations.yaml", "    safe: true\n    group: speed\n", "    safe: true\n");
    demo.replace(
        "belt/configurations.yaml",
        "      - operation_call: { operation: motor.brake }",
        "      - property_set: { property: motor.limit, value: 0.2 }\n      - operation_call: { operation: motor.brake }",
    );
    let story = |fault: &str| {
        format!(
            "deploy('deployment.yaml') raise('e_faster') wait_answer('fast.ok', 1)
             {fault} set('motor.limit', 0.7)
             raise('e_stop') wait_answer('motor.limit.failed', 1) wait(1) say('stopped ' .. property('motor.limit'))
             raise('e_reset') wait_answer('stop.undone', 1) say('reset ' .. property('motor.limit') .. ' ' .. #drift())
             shutdown()"
        )
    };
    assert_eq!(said(&demo, &story("fault('property_set motor.limit = 0.2', 'fail')")), ["stopped 0.5", "reset 0.5 0"]);
    assert_eq!(said(&demo, &story("")), ["stopped 0.2", "reset 0.5 0"]);
}

#[test]
fn who_lets_go_of_one_unasked_is_told() {
    let lets_go = |from: &str, to: &str| {
        let demo = belt();
        assert_eq!(found(&demo, "coord::safe_left"), [Json::Null; 0]);
        demo.replace("belt/coordinator.yaml", from, to);
        found(&demo, "coord::safe_left")
            .into_iter()
            .map(|one| one["message"].as_str().unwrap().to_owned())
            .collect::<Vec<_>>()
    };
    let reset = "{ src: stopped, tgt: failed, events: [e_reset] }";
    for (by, told) in [
        ("events: [e_reset, stop.failed]", "`stop.failed` leads from `root.stopped` to `root.failed`"),
        ("events: [e_reset, stop.ok]", "`stop.ok` leads from"),
        ("events: [e_after(5)]", "`e_after(5)"),
        ("pn: -1", "whatever comes next leads from"),
    ] {
        let told_of = lets_go(reset, &format!("{{ src: stopped, tgt: failed, {by} }}"));
        assert!(
            told_of.len() == 1 && told_of[0].contains(told) && told_of[0].contains("takes `stop` back"),
            "{told_of:?}"
        );
    }
    // From inside as well; and not where what is entered asks for what is safe.
    let inside = lets_go(reset, "{ src: stopped.in_part, tgt: failed, events: [stop.broken] }");
    assert_eq!(inside.len(), 1, "{inside:?}");
    let anew = lets_go(
        "{ src: stopped, tgt: stopped, events: [e_stop] }",
        "{ src: stopped, tgt: stopped, events: [e_stop, e_after(5)] }",
    );
    assert!(anew.is_empty(), "{anew:?}");
    // A fault; and two steps of which none was asked for, but not where people have asked for the first of them.
    let faulted = lets_go(reset, "{ src: stopped, tgt: failed, events: [e_reset, motor.faulted] }");
    assert!(faulted.len() == 1 && faulted[0].starts_with("`motor.faulted` leads"), "{faulted:?}");
    let in_part = "        - { src: whole, tgt: in_part, events: [stop.failed, stop.broken] }\n    down:";
    for (first, is_told) in [("stop.ok", true), ("e_after(1)", true), ("e_looked", false)] {
        let two = format!(
            "        - {{ src: whole, tgt: in_part, events: [stop.failed, stop.broken] }}
        - {{ src: in_part, tgt: ready, events: [e_looked] }}
        - {{ src: whole, tgt: ready, events: [{first}] }}\n    down:"
        );
        let demo = belt();
        demo.replace("belt/coordinator.yaml", in_part, &two);
        demo.replace("belt/coordinator.yaml", "        in_part: {}\n", "        in_part: {}\n        ready: {}\n");
        demo.replace(
            "belt/coordinator.yaml",
            reset,
            &format!("{reset}\n    - {{ src: stopped.ready, tgt: failed, events: [e_done] }}"),
        );
        let told = found(&demo, "coord::safe_left");
        assert_eq!(told.len(), usize::from(is_told), "{first}: {told:?}");
    }
    // What no state holds: by its name, or by what takes its place.
    for (by, told) in [
        (
            "tgt: failed, events: [e_after(5)], effect: stop.undo",
            "`e_after(5)@root.stopped` leads from `root.stopped` to `root.failed`, and `stop.undo` lets go of `stop`",
        ),
        ("tgt: failed, events: [stop.ok], effect: undo", "`undo` lets go of what was applied last"),
        ("tgt: up.fast, events: [motor.faulted]", "`fast` takes the place of `stop` there, which is of its group"),
        ("tgt: failed, events: [e_reset], effect: stop.undo", ""),
        ("tgt: up.fast, events: [e_reset]", ""),
        ("tgt: stopped, events: [e_after(5)], effect: stop.undo", ""),
    ] {
        let demo = belt();
        demo.replace("belt/coordinator.yaml", "      config: stop\n", "      entry: stop\n");
        demo.replace("belt/coordinator.yaml", reset, &format!("{{ src: stopped, {by} }}"));
        let found = found(&demo, "coord::safe_left");
        assert_eq!(found.len(), usize::from(!told.is_empty()), "{by}: {found:?}");
        assert!(found.iter().all(|one| one["message"].as_str().unwrap().contains(told)), "{by}: {found:?}");
    }
    // The help of a failure that nobody hears does not lead there.
    let demo = belt();
    demo.replace("belt/coordinator.yaml", "events: [stop.failed, stop.broken]", "events: [e_looked]");
    let unheard = found(&demo, "coord::failure_unhandled");
    assert!(unheard[0]["help"].as_str().unwrap().contains("between two states inside of this one"), "{unheard:?}");
}

#[test]
fn what_moves_and_has_none_is_told() {
    let demo = belt();
    demo.replace("belt/deployment.yaml", "safety: [e_stop]", "");
    let told = found(&demo, "coord::safety_unheard");
    assert!(told[0]["message"].as_str().unwrap().contains("no event is named under `safety`"), "{told:?}");
}

/// Without a group each is one more; its undo is no way round.
#[test]
fn one_of_no_group_is_given_one() {
    let demo = belt();
    demo.replace("belt/configurations.yaml", "safe: true\n    group: speed", "safe: true");
    let told = found(&demo, "coord::stack_grows");
    assert!(!told.is_empty() && told.iter().all(|one| one["help"].as_str().unwrap().contains("a group")), "{told:?}");
}

/// A second one is answered by its own answer.
#[test]
fn a_second_one_is_not_answered_by_the_first() {
    let twice = "raise('e_stop') wait_answer('stop.ok', 2) say(now())";
    let script = format!(
        "deploy('deployment.yaml') fault('operation_call motor.brake', 'slow', 5, 0.5) {twice} {twice} shutdown()"
    );
    assert_eq!(said(&belt(), &script), ["0.5", "1.0"]);
}

/// What was undone beside something broken is not expected any more by anything else that is broken: nobody makes it again, and the way down
/// is free. Two emergencies in part, and one whose end nobody knows of.
#[test]
fn what_was_undone_is_expected_by_nothing() {
    let tell = "say(active()[#active()] .. ' ' .. tostring(state('motor'))) for _, one in ipairs(drift()) do if one.how == 'differs' then say(one.text) end end";
    let lied = "fault('start motor', 'lie', 1) deploy('deployment.yaml')";
    let twice = format!(
        "{lied} fault('operation_call motor.brake', 'lost', 2) raise('e_stop') wait(2) raise('e_stop') wait(5)
         raise('e_reset') wait(2) raise('e_end') wait(2) {tell} pcall(recover, 'back') raise('e_end') wait(2) {tell}"
    );
    assert_eq!(said(&belt(), &twice), ["root.off nil", "root.off nil"]);
    let unknown = format!(
        "{lied} fault('operation_call motor.release', 'lost', 1) raise('e_stop') wait(6) raise('e_reset') wait(2)
         raise('e_end') wait(2) {tell} raise('e_stop') wait(1) raise('e_reset') wait(2) {tell} raise('e_end') wait(2) {tell}"
    );
    let mut told = said(&belt(), &unknown);
    told.retain(|line| !line.contains("note  "));
    assert_eq!(told, ["root.left unconfigured", "root.failed unconfigured", "root.off nil"]);
}

/// An emergency that cannot be done whole interrupts a change of speed, or the way down: it takes the place of its group's frame, as where nothing
/// is under way, and its undo leads to where that of this one would have led.
#[test]
fn one_in_part_takes_the_place_of_what_is_being_replaced_or_undone() {
    let demo = belt();
    let also = |from: &str, to: &str| demo.replace("belt/configurations.yaml", from, &format!("{from}\n      - {to}"));
    also("- create: { component: motor, type: Motor }", "create: { component: other, type: Motor }");
    for speed in ["0.1", "0.4", "0.0"] {
        let write = |of: &str| format!("port_write: {{ port: {of}.speed, value: {speed} }}");
        also(&format!("- {}", write("motor")), &write("other"));
    }
    demo.replace("belt/configurations.yaml", "[\"motor:stopped\"]", "[\"motor:stopped\", \"other:stopped\"]");
    demo.replace("belt/configurations.yaml", "[\"motor:running\"]", "[\"motor:running\", \"other:running\"]");
    let story = |faults: &str, asks: &str| {
        format!(
            "deploy('deployment.yaml') {faults} raise('{asks}') wait(0.1) raise('e_stop') wait(7)
             local function tell(when)
                 local frames = {{}}
                 for _, frame in ipairs(stack()) do frames[#frames + 1] = frame.configuration end
                 say(when .. ' ' .. tostring(port('motor.speed')) .. ' ' .. tostring(port('other.speed')) .. ' ' .. #drift() .. ' ' .. table.concat(frames, ' '))
             end
             tell('stopped') raise('e_reset') wait(7) tell('reset') shutdown()"
        )
    };
    let switch =
        "fault('port_write other.speed = 0.4', 'slow', 1, 0.3) fault('port_write motor.speed = 0.0', 'fail', 1)";
    let told = said(&demo, &story(switch, "e_faster"));
    assert_eq!(told, ["stopped 0.4 0.0 0 build run stop", "reset nil nil 0 build run"]);
    let undo = "fault('port_write other.speed', 'lost', 2)";
    let told = said(&demo, &story(undo, "e_end"));
    assert_eq!(told, ["stopped 0.0 0.1 0 build stop", "reset nil nil 0 build"]);
}

/// What ends the deployment leads to where nothing but an emergency leads on: nobody brings that about in order to end it.
#[test]
fn an_emergency_is_no_way_down() {
    let demo = belt();
    assert_eq!(found(&demo, "coord::no_way_down"), [Json::Null; 0]);
    demo.replace(
        "belt/coordinator.yaml",
        "{ src: up, tgt: down, events: [e_end] }",
        "{ src: up, tgt: failed, events: [e_end] }",
    );
    let told = found(&demo, "coord::no_way_down");
    let message = "from `root.failed` only a second `e_end`, or `e_stop`, which is for an emergency, leads on, and it is raised once";
    assert!(told.len() == 1 && told[0]["message"] == message, "{told:#?}");
    let story = "deploy('deployment.yaml') raise('e_end') wait(1) say(active()[#active()]) raise('e_end') wait(1) say(active()[#active()])";
    assert_eq!(said(&demo, story), ["root.failed", "root.off"]);
}
