//! What is safe stays in force where the state that has it is entered anew: an emergency that is heard twice lets nothing go.

use crate::demo::{Demo, at_home};

const DEPLOYMENT: &str = "davit: 1
name: twice
platform: simulated
types:
  Motor:
    actuator: true
    operations:
      release: { effect: { undo: brake } }
      brake:   { effect: { undo: release } }
configurations: [c.yaml]
coordinator: k.yaml
safety: [e_estop]
deploy:   { event: e_start, up: on, within_s: 5 }
shutdown: { event: e_shutdown, down: idle, within_s: 5 }
";

const CONFIGURATIONS: &str = "configurations:
  build: { changes: [{ create: { component: m, type: Motor } }], post_conf_state: [\"m:running\"] }
  ease:  { GROUP changes: [{ operation_call: { operation: m.release } }] }
  hold:  { safe: true, GROUP changes: [{ operation_call: { operation: m.brake } }] }
";

const COORDINATOR: &str = "coordinator:
  states:
    idle: {}
    alive:
      states:
        building: { entry: build }
        on: { config: ease }
        failed: {}
        held: { HELD }
        other: { HELD }
      transitions:
        - { src: initial, tgt: building }
        - { src: building, tgt: on, events: [build.ok] }
        - { src: building, tgt: failed, events: [build.failed, build.broken] }
        - { src: building, tgt: held, events: [e_estop] }
        - { src: on, tgt: held, events: [e_estop] }
        - { src: on, tgt: failed, events: [ease.failed, ease.broken] }
        - { src: failed, tgt: held, events: [e_estop] }
        - { src: held, tgt: held, events: [e_estop] }
        - { src: held, tgt: other, events: [e_other] }
        - { src: other, tgt: held, events: [e_estop] }
        - { src: held, tgt: failed, events: [e_reset, hold.failed, hold.broken] }
        - { src: other, tgt: failed, events: [e_reset, hold.failed, hold.broken] }
    leaving:
      states: { dropping: { entry: hold.undo }, destroying: { entry: build.undo } }
      transitions:
        - { src: initial, tgt: dropping }
        - { src: dropping, tgt: destroying, events: [hold.undone, hold.undo.failed, hold.undo.broken] }
  transitions:
    - { src: initial, tgt: idle }
    - { src: idle, tgt: alive, events: [e_start] }
    - { src: alive, tgt: leaving, events: [e_shutdown] }
    - { src: leaving, tgt: .alive.held, events: [e_estop] }
    - { src: leaving, tgt: idle, events: [build.undone] }
    - { src: leaving, tgt: .alive.failed, events: [build.undo.failed, build.undo.broken] }
";

#[test]
fn an_emergency_that_is_heard_again_lets_nothing_go() {
    for (group, held) in [
        ("group: g,", "config: hold"),
        ("group: g,", "entry: hold, exit: hold.undo"),
        ("", "config: hold"),
        ("", "entry: hold, exit: hold.undo"),
    ] {
        let demo = Demo::new();
        demo.write("deployment.yaml", DEPLOYMENT);
        demo.write("c.yaml", &CONFIGURATIONS.replace("GROUP", group));
        let mut coordinator = COORDINATOR.replace("HELD", held);
        if group.is_empty() {
            // Beside each other they would be in each other's way.
            coordinator =
                coordinator.replace("on: { config: ease }", "on: {}").replace("[ease.failed, ease.broken]", "[e_bad]");
        }
        demo.write("k.yaml", &coordinator);
        let script = "deploy('deployment.yaml')
            for _, event in ipairs({ 'e_estop', 'e_estop', 'e_other', 'e_estop', 'e_estop' }) do
              raise(event) wait(0.3)
              local holds = 0
              for _, frame in ipairs(stack()) do if frame.configuration == 'hold' then holds = holds + 1 end end
              say(event .. ': ' .. holds)
            end
            for _, it in ipairs(log()) do
              if it.what == 'answered' then say(it.answer) end
            end
            shutdown()";
        demo.write("story.lua", script);
        let ran = demo.run(&["run", "story.lua", "--clock", "simulated", "--json"]);
        let told = |what: &str| ran.out.matches(what).count();
        assert_eq!((told("e_estop: 1"), told("e_other: 1")), (4, 1), "{group} {held}: {}{}", ran.out, ran.err);
        // What is in the way of its group is released by nothing in between.
        let since = ran.out.find("hold.ok").unwrap_or_default();
        let until = ran.out.find("shutting_down").unwrap_or(ran.out.len());
        assert!(!ran.out[since..until].contains("m.release\",\"outcome"), "{group} {held}: {}", ran.out);
    }
}

/// What it has braked and stopped is not started for another brake: heard again, it does to that nothing, and its end leads back to where it began.
#[test]
fn an_emergency_that_is_heard_again_starts_nothing() {
    let types = DEPLOYMENT.replace("  Motor:", "  Lamp: { operations: { warn: { effect: none } } }\n  Motor:");
    let configurations = CONFIGURATIONS
        .replace(
            "[{ create: { component: m, type: Motor } }]",
            "[{ create: { component: m, type: Motor } }, { create: { component: l, type: Lamp } }]",
        )
        .replace("[\"m:running\"]", "[\"m:running\", \"l:running\"]")
        .replace(
            "operation: m.brake } }]",
            "operation: m.brake } }, { operation_call: { operation: l.warn } }], post_conf_state: [\"m:stopped\"]",
        );
    let coordinator =
        COORDINATOR.replace("[ease.failed, ease.broken]", "[e_bad]").replace("on: { config: ease }", "on: {}");
    let script = "deploy('deployment.yaml')
        local function told(answer)
          local steps = {}
          for _, it in ipairs(log()) do
            if it.answer == answer then steps = {} for _, done in ipairs(it.steps) do table.insert(steps, done.step) end end
          end
          say(answer .. ': ' .. table.concat(steps, ', '))
        end
        raise('e_estop') wait(0.3) told('hold.ok') raise('e_estop') wait(0.3) told('hold.ok')
        say(state('m') .. ', ' .. #drift() .. ' differ, ' .. #stack() .. ' frames')
        EVENT wait(1) told('hold.undone') shutdown()";
    let sorted = |line: &str| {
        line.replace("operation_call m.brake, operation_call l.warn", "operation_call l.warn, operation_call m.brake")
    };
    // What it has cut, too, is not made again for that.
    let ports = |ty: &str, port: &str, way: &str| {
        (format!("  {ty}: {{"), format!("  {ty}: {{ ports: {{ {port}: {{ direction: {way}, type: float }} }},"))
    };
    let (lamp, motor) =
        (ports("Lamp", "y", "out"), "    ports: { u: { direction: in, type: float } }\n    actuator: true\n");
    let wired = types.replace(&lamp.0, &lamp.1).replace("    actuator: true\n", motor);
    let cut = configurations
        .replace("type: Lamp } }]", "type: Lamp } }, { connect: { from: l.y, to: m.u } }]")
        .replace("l.warn } }]", "l.warn } }, { disconnect: { from: l.y, to: m.u } }]");
    let demo = Demo::new();
    demo.write("deployment.yaml", &wired);
    demo.write("c.yaml", &cut.replacen("GROUP", "", 1).replace("GROUP", "group: g,"));
    demo.write("k.yaml", &coordinator.replace("HELD", "entry: hold"));
    // It is not connected yet while it is being built.
    let replayed = script.replacen("yaml')", "yaml', { replay = true }) raise('e_start') wait(0.1)", 1);
    demo.write("story.lua", &replayed.replace("EVENT", "raise('e_shutdown')"));
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated", "--quiet"]);
    let told: Vec<&str> = ran.out.lines().collect();
    let again = ["hold.ok: operation_call l.warn, operation_call m.brake", "stopped, 0 differ, 2 frames"];
    assert!(
        told.len() == 4 && told[0].contains("disconnect l.y") && [&*sorted(told[1]), told[2]] == again,
        "{told:?}{}",
        ran.err
    );
    assert!(told[3].contains("connect l.y") && told[3].contains("start m"), "{told:?}");
    for (group, held, event) in [
        ("group: g,", "entry: hold", "raise('e_shutdown')"),
        ("group: g,", "config: hold", "raise('e_reset')"),
        ("", "entry: hold, exit: hold.undo", "raise('e_reset')"),
    ] {
        let demo = Demo::new();
        demo.write("deployment.yaml", &types);
        demo.write(
            "c.yaml",
            &configurations
                .replace(
                    "GROUP changes: [{ operation_call: { operation: m.release",
                    "changes: [{ operation_call: { operation: m.release",
                )
                .replace("GROUP", group),
        );
        demo.write("k.yaml", &coordinator.replace("HELD", held));
        demo.write("story.lua", &script.replace("EVENT", event));
        let ran = demo.run(&["run", "story.lua", "--clock", "simulated", "--quiet"]);
        let told: Vec<&str> = ran.out.lines().collect();
        let whole = "hold.ok: operation_call l.warn, operation_call m.brake, stop m";
        let [first, second, stands, back] = told.as_slice() else { panic!("{told:?}{}", ran.err) };
        assert_eq!(sorted(first), whole, "{group} {held}");
        let calls = "hold.ok: operation_call l.warn, operation_call m.brake";
        assert_eq!(sorted(second), calls, "{group} {held}");
        assert_eq!(*stands, "stopped, 0 differ, 2 frames", "{group} {held}");
        assert_eq!(*back, "hold.undone: start m, operation_call m.release", "{group} {held}");
    }
}

/// What is out of the first one may never come to be: who asks once more has it done once more, and is answered for that alone. It is taken back
/// once, however often it was asked for.
#[test]
fn what_is_out_is_done_once_more() {
    for (fault, times) in [("stop m", 2), ("stop m", 3), ("property_set m.power", 2), ("property_set m.power", 3)] {
        let demo = Demo::new();
        let power = "    actuator: true\n    properties: { power: { type: float, default: 1.0, tunable: always } }\n";
        demo.write("deployment.yaml", &DEPLOYMENT.replace("    actuator: true\n", power));
        let calm = "operation: m.brake } }, { property_set: { property: m.power, value: 0.0 } }], post_conf_state: [\"m:stopped\"]";
        let configurations = CONFIGURATIONS.replace("operation: m.brake } }]", calm).replace(
            "GROUP changes: [{ operation_call: { operation: m.b",
            "group: g, changes: [{ operation_call: { operation: m.b",
        );
        demo.write("c.yaml", &configurations.replace("GROUP", ""));
        let coordinator = COORDINATOR.replace("HELD", "entry: hold").replace("[ease.failed, ease.broken]", "[e_bad]");
        let coordinator =
            coordinator.replace("on: { config: ease }", "on: {}").replace(", hold.failed, hold.broken]", "]");
        let hears = "        - { src: held, tgt: held, events: [e_estop] }\n";
        let coordinator = coordinator.replace(
            hears,
            &format!("{hears}        - {{ src: held, tgt: other, events: [hold.failed, hold.broken] }}\n"),
        );
        demo.write("k.yaml", &coordinator.replace("other: { entry: hold }", "other: {}"));
        let script = format!(
            "deploy('deployment.yaml', {{ replay = true }}) raise('e_start') wait(0.1)
             fault('{fault}', 'lost', 1)
             for i = 1, {times} do raise('e_estop') wait(0.1) end wait(20)
             for _, it in ipairs(log()) do if it.answer and it.answer:find('^hold') then say(it.answer) end end
             say(state('m') .. ' ' .. property('m.power') .. ' ' .. #drift() .. ' ' .. #stack())
             raise('e_shutdown') wait_state('idle', 1) say(#stack())"
        );
        demo.write("story.lua", &script);
        let ran = demo.run(&["run", "story.lua", "--clock", "simulated", "--quiet"]);
        let mut whole = vec!["hold.broken"];
        whole.extend((1..times).map(|_| "hold.ok"));
        whole.extend(["stopped 0.0 0 2", "0"]);
        let told: Vec<&str> = ran.out.lines().collect();
        assert_eq!((told, ran.code), (whole, 0), "{fault} {times}: {}", ran.err);
    }
}

/// Who asks once more does not trust what it came to: it is looked at once, and what the platform had only said is told. Asked for a third time it is
/// done.
#[test]
fn what_was_only_said_to_be_done_is_told_when_it_is_asked_for_once_more() {
    let demo = Demo::new();
    demo.write("deployment.yaml", DEPLOYMENT);
    let calm = "operation: m.brake } }], post_conf_state: [\"m:stopped\"]";
    let configurations = CONFIGURATIONS.replace("operation: m.brake } }]", calm);
    demo.write("c.yaml", &configurations.replacen("GROUP", "", 1).replace("GROUP", "group: g,"));
    let coordinator = COORDINATOR.replace("HELD", "entry: hold").replace("[ease.failed, ease.broken]", "[e_bad]");
    demo.write("k.yaml", &coordinator.replace("on: { config: ease }", "on: {}"));
    let script = "deploy('deployment.yaml', { replay = true }) raise('e_start') wait(0.1)
        fault('stop m', 'lie', 1)
        for i = 1, 3 do
          raise('e_estop') wait(0.1)
          local lost = ''
          for _, frame in ipairs(stack()) do if frame.lost then lost = ', lost ' .. frame.configuration end end
          say(i .. ' ' .. state('m') .. ', ' .. #drift() .. ' differ' .. lost)
        end
        raise('e_shutdown') wait_state('idle', 1)";
    demo.write("story.lua", script);
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated", "--quiet"]);
    let told: Vec<&str> = ran.out.lines().filter(|line| !line.contains("note")).collect();
    let whole = ["1 stopped, 1 differ", "2 running, 1 differ, lost hold", "3 stopped, 0 differ"];
    assert_eq!((told.as_slice(), ran.code), (&whole[..], 0), "{}", ran.err);
}

/// Another one of its group takes over what the first one has still to do, and that is taken back once.
#[test]
fn what_one_does_in_the_place_of_another_one_is_taken_back_once() {
    let demo = Demo::new();
    demo.write("deployment.yaml", DEPLOYMENT);
    let own = |id: &str| {
        format!(
            "  {id}: {{ safe: true, group: g, changes: [{{ operation_call: {{ operation: m.brake }} }}], post_conf_state: [\"m:stopped\"] }}\n"
        )
    };
    let build = CONFIGURATIONS.lines().take(2).collect::<Vec<_>>().join("\n");
    demo.write("c.yaml", &format!("{build}\n{}{}", own("hold"), own("halt")));
    let coordinator = COORDINATOR
        .replace("held: { HELD }", "held: { entry: hold }")
        .replace("other: { HELD }", "other: { entry: halt }\n        easing: { entry: halt.undo }")
        .replace("on: { config: ease }", "on: {}")
        .replace("[ease.failed, ease.broken]", "[e_bad]")
        .replace(
            "- { src: other, tgt: failed, events: [e_reset, hold.failed, hold.broken] }",
            "- { src: other, tgt: easing, events: [e_reset] }
        - { src: other, tgt: other, events: [halt.failed, halt.broken] }
        - { src: easing, tgt: failed, events: [halt.undone, halt.undo.failed, halt.undo.broken] }
        - { src: easing, tgt: held, events: [e_estop] }",
        );
    demo.write("k.yaml", &coordinator);
    let script = "deploy('deployment.yaml', { replay = true }) raise('e_start') wait(0.1)
        fault('operation_call m.brake', 'slow', 1, 0.5) raise('e_estop') wait(0.1) raise('e_other') wait(2)
        say(state('m') .. ', ' .. #drift() .. ' differ, ' .. #stack() .. ' frames')
        raise('e_reset') wait_answer('halt.undone', 1)
        say(state('m') .. ', ' .. #drift() .. ' differ, ' .. #stack() .. ' frames')
        raise('e_shutdown') wait_state('idle', 1)";
    demo.write("story.lua", script);
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated", "--quiet"]);
    let told: Vec<&str> = ran.out.lines().collect();
    let whole = ["stopped, 0 differ, 2 frames", "running, 0 differ, 1 frames"];
    assert_eq!((told.as_slice(), ran.code), (&whole[..], 0), "{}", ran.err);
}

/// An emergency comes again while the first one is still being applied: one frame of its group is in force, and its undo lets all go.
#[test]
fn an_emergency_that_comes_while_it_is_being_heard_leaves_one_frame() {
    let checked = at_home(&["check", "examples/conveyor/conveyor.yaml"]);
    assert!(checked.code == 0 && !checked.err.contains('⚠'), "{}", checked.err);
    let ran = at_home(&["run", "examples/conveyor/story.lua", "--clock", "simulated"]);
    assert!(ran.code == 0 && ran.out.contains("oldest first: build run hold\n"), "{}{}", ran.out, ran.err);
}

/// Where nothing is there yet that it could hold, either.
#[test]
fn an_emergency_before_there_is_anything_leaves_one_frame() {
    let demo = Demo::new();
    demo.write("deployment.yaml", &DEPLOYMENT.replace("name: twice", "name: early"));
    demo.write("c.yaml", &CONFIGURATIONS.replace("GROUP", "group: g,"));
    demo.write("k.yaml", &COORDINATOR.replace("HELD", "config: hold"));
    let script = "fault('create m', 'slow', 1, 3)
        deploy('deployment.yaml', { replay = true })
        raise('e_start')
        wait(0.1)
        for _ = 1, 4 do raise('e_estop') wait(0.1) end
        local holds = 0
        for _, frame in ipairs(stack()) do if frame.configuration == 'hold' then holds = holds + 1 end end
        say('holds: ' .. holds)
        wait(5)
        shutdown()";
    demo.write("early.lua", script);
    let ran = demo.run(&["run", "early.lua", "--clock", "simulated"]);
    assert!(ran.code == 0 && ran.out.contains("holds: 1\n"), "{}{}", ran.out, ran.err);
}

/// Two that are safe and of one group, each asked for while the other one is still being applied: one frame, and all is as that says.
#[test]
fn alternatives_that_are_safe_take_each_others_place_however_quickly_they_come() {
    let demo = Demo::new();
    for one in ["slow", "fast"] {
        demo.replace(
            "configurations.lua",
            &format!("{one} = Configuration {{"),
            &format!("{one} = Configuration {{ safe = true,"),
        );
    }
    // `slow` changes one thing more, which `fast` has nothing to say about: what is safe lets go of nothing that another one has made safe.
    demo.replace("configurations.lua", "port_write(\"sink.flag\", false)", "property_set(\"source.name\", \"slow\")");
    let script = "fault('property_set source.k', 'slow', 9, 0.05)
        deploy('deployment.yaml')
        raise('e_fast') wait(1)
        local function told(what)
          local frames = {}
          for _, frame in ipairs(stack()) do frames[#frames + 1] = frame.configuration end
          say(what .. ': ' .. table.concat(frames, ' ') .. ' ' .. property('source.k') .. ' ' .. property('source.name'))
        end
        raise('e_slow') wait(0.01) raise('e_fast') wait(1) told('fast')
        raise('e_slow') wait(0.01) raise('e_fast') wait(0.01) raise('e_slow') wait(1) told('slow')
        raise('e_slow') wait(1)
        shutdown()";
    demo.write("quick.lua", script);
    let ran = demo.run(&["run", "quick.lua", "--clock", "simulated"]);
    let frames = "create_all connect_all start_all";
    for said in [format!("fast: {frames} fast 9.0 slow\n"), format!("slow: {frames} slow 1.0 slow\n")] {
        assert!(ran.code == 0 && ran.out.contains(&said), "{said}: {}{}", ran.out, ran.err);
    }
}

/// Of what was done of it in part, too: the undo of the one that stands takes all of it back.
#[test]
fn an_emergency_that_comes_twice_and_fails_in_part_is_taken_back_whole() {
    let demo = Demo::new();
    for file in ["conveyor.yaml", "configurations.yaml", "coordinator.yaml"] {
        let text = std::fs::read_to_string(format!("{}/examples/conveyor/{file}", env!("CARGO_MANIFEST_DIR"))).unwrap();
        demo.write(file, &text);
    }
    let script = "deploy('conveyor.yaml')
        fault('operation_call belt.brake', 'slow', 9, 0.05) fault('port_write belt.speed = 0.0', 'fail', 1)
        raise('e_stop') wait(0.02) raise('e_stop') wait(1)
        raise('e_end') wait(2)
        say('left: ' .. #stack())
        shutdown()";
    demo.write("part.lua", script);
    let ran = demo.run(&["run", "part.lua", "--clock", "simulated"]);
    assert!(ran.out.contains("hold.broken") && ran.out.contains("left: 0\n"), "{}{}", ran.out, ran.err);
}

/// Where what is safe is no alternative of what the state before brought with it: the undo of that waits while it is applied, or is interrupted
/// by it, and its frame stays. Nobody asks for it again, so it goes on the way down, in one with what it is in the way of.
#[test]
fn what_a_state_left_behind_goes_on_the_way_down() {
    let given = |demo: &Demo, paused: bool| {
        for file in ["conveyor.yaml", "configurations.yaml", "coordinator.yaml"] {
            let text =
                std::fs::read_to_string(format!("{}/examples/conveyor/{file}", env!("CARGO_MANIFEST_DIR"))).unwrap();
            demo.write(file, &text);
        }
        demo.replace("configurations.yaml", "slow:\n    group: speed\n", "slow:\n");
        demo.replace("configurations.yaml", "group: speed", "group: halt");
        if paused {
            demo.replace("configurations.yaml", "      - port_write: { port: belt.speed, value: 0.0 }\n", "");
            demo.replace("coordinator.yaml", "config: slow }", "config: slow }\n        paused: {}");
            let way = "        - { src: running, tgt: paused, events: [e_pause] }\n    failed: {}";
            demo.replace("coordinator.yaml", "    failed: {}", way);
        }
    };
    let twice = "fault('operation_call belt.brake', 'slow', 8, 0.2)
        deploy('conveyor.yaml')
        raise('e_stop') wait(0.05) raise('e_stop') wait(2) shutdown()";
    let once = "fault('port_write belt.speed', 'slow', 9, 0.2)
        deploy('conveyor.yaml') wait(0.5)
        raise('e_pause') wait(0.05) raise('e_stop') wait(2) shutdown()";
    for (paused, script) in [(false, twice), (true, once)] {
        let demo = Demo::new();
        given(&demo, paused);
        let checked = demo.run(&["check", "conveyor.yaml"]);
        assert!(checked.code == 0 && !checked.err.contains('⚠'), "{}", checked.err);
        demo.write("s.lua", script);
        let ran = demo.run(&["run", "s.lua", "--clock", "simulated"]);
        assert!(ran.out.contains("slow.undo.failed"), "{}{}", ran.out, ran.err);
        assert!(ran.out.contains("`slow`, whose undo had failed before, was undone with it"), "{}{}", ran.out, ran.err);
        assert_eq!((ran.code, ran.out.contains("build.undo.failed")), (0, false), "{}{}", ran.out, ran.err);
    }
}

/// What is safe as well, where its coordinator has left it and something else that is safe came in between: also before it was there.
#[test]
fn what_is_safe_and_was_left_goes_on_the_way_down() {
    let demo = Demo::new();
    let text = |file: &str| {
        std::fs::read_to_string(format!("{}/examples/conveyor/{file}", env!("CARGO_MANIFEST_DIR"))).unwrap()
    };
    for file in ["conveyor.yaml", "configurations.yaml", "coordinator.yaml"] {
        demo.write(file, &text(file));
    }
    demo.replace("configurations.yaml", "  hold:\n", "  clamp:\n    safe: true\n    group: clamps\n    changes: [{ operation_call: { operation: belt.brake } }]\n  hold:\n");
    demo.replace("configurations.yaml", "      - operation_call: { operation: belt.brake }\n", "");
    demo.replace("coordinator.yaml", "    left: {}\n", "    left: {}\n    clamped: { config: clamp }\n");
    demo.replace(
        "coordinator.yaml",
        "    - { src: held, tgt: held, events: [e_stop] }\n",
        "    - { src: held, tgt: held, events: [e_stop] }\n    - { src: held, tgt: clamped, events: [e_clamp] }
    - { src: clamped, tgt: held, events: [e_stop] }\n    - { src: clamped, tgt: failed, events: [e_reset, clamp.failed, clamp.broken] }
    - { src: clamped, tgt: down, events: [e_end] }\n",
    );
    for between in [1.0, 0.01] {
        let script = format!(
            "fault('port_write belt.speed', 'slow', 9, 0.2) fault('operation_call belt.brake', 'slow', 9, 0.1)
             deploy('conveyor.yaml') wait(0.5)
             raise('e_stop') wait({between}) raise('e_clamp') wait({between})
             raise('e_stop') wait(0.05) raise('e_stop') wait(2)
             shutdown()"
        );
        demo.write("s.lua", &script);
        let ran = demo.run(&["run", "s.lua", "--clock", "simulated"]);
        assert!(ran.out.contains("clamp.undo.failed"), "{between}: {}{}", ran.out, ran.err);
        assert_eq!((ran.code, ran.out.contains("build.undo.failed")), (0, false), "{between}: {}{}", ran.out, ran.err);
    }
}

/// What fails of one that another one counted on is told of both, and of each once.
#[test]
fn what_failed_of_both_is_told_once_of_each() {
    let demo = Demo::new();
    let conveyor = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/conveyor/conveyor.yaml");
    demo.write(
        "s.lua",
        &format!(
            "deploy('{conveyor}') wait(0.5)
             fault('port_write belt.speed', 'slow', 1, 0.05) fault('port_write belt.speed', 'fail', 2)
             raise('e_stop') wait(0.02) raise('e_stop') wait(2) shutdown()"
        ),
    );
    let ran = demo.run(&["run", "s.lua", "--clock", "simulated"]);
    let told: Vec<&str> =
        ran.out.lines().filter(|line| line.contains("hold.broken") || line.contains("injected")).collect();
    let alike = |at: usize| told.iter().skip(at).step_by(2);
    assert!(
        told.len() == 4
            && alike(0).all(|line| line.contains("hold.broken"))
            && alike(1).all(|line| line.contains("injected")),
        "{}{}",
        ran.out,
        ran.err
    );
}
