//! Safe configurations of several groups, and such as cannot be done whole, asked for while others are being applied: as if they had come
//! one after the other.

use crate::demo::Demo;

/// A mode, and what is safe, of one group.
const HOLD: &str = "  slow: { changes: [{ port_write: { port: belt.speed, value: 0.1 } }], group: a }
  hold:
    group: a
    safe: true
    changes: [{ property_set: { property: belt.k, value: 0.5 } }, { operation_call: { operation: belt.brake } }]
";

/// The conveyor of the examples with a gain `k`, and these configurations beside `build` and `run`.
fn conveyor(configurations: &str) -> Demo {
    let demo = Demo::new();
    for file in ["conveyor.yaml", "coordinator.yaml"] {
        let text = std::fs::read_to_string(format!("{}/examples/conveyor/{file}", env!("CARGO_MANIFEST_DIR")));
        demo.write(file, &text.unwrap());
    }
    demo.replace("conveyor.yaml", "    ports:", "    properties: { k: { type: float, default: 0.0 } }\n    ports:");
    let base = "configurations:
  build: { changes: [{ create: { component: belt, type: Motor } }] }
  run: { pre_conf_state: [\"belt:stopped\"], post_conf_state: [\"belt:running\"] }
";
    demo.write("configurations.yaml", &format!("{base}{configurations}"));
    demo
}

/// Runs a script in simulated time: it ends well, and has said so.
fn says(demo: &Demo, script: &str, said: &[&str]) {
    let told = "local function told(what)
          local frames = {}
          for _, frame in ipairs(stack()) do frames[#frames + 1] = frame.configuration end
          say(what .. ': ' .. table.concat(frames, ' ') .. ' speed ' .. tostring(port('belt.speed')) .. ' k ' .. property('belt.k'))
        end\n";
    demo.write("s.lua", &format!("{told}{script}\nshutdown()"));
    let ran = demo.run(&["run", "s.lua", "--clock", "simulated"]);
    let missing: Vec<_> = said.iter().filter(|said| !ran.out.contains(&format!("{said}\n"))).collect();
    assert!(ran.code == 0 && missing.is_empty(), "{missing:?}\n{}{}", ran.out, ran.err);
}

/// One of another group writes the same in between: what the first has saved is handed to that one, also while both are being applied.
#[test]
fn one_of_another_group_in_between_keeps_its_value() {
    let other = "  hold2: { group: b, safe: true, changes: [{ property_set: { property: belt.k, value: 3.0 } }] }\n";
    let demo = conveyor(&format!("{HOLD}{other}"));
    for between in [0.01, 1.0] {
        let script = format!(
            "fault('operation_call belt.brake', 'slow', 9, 0.05)
             deploy('conveyor.yaml') wait(0.5)
             raise('e_stop') wait({between}) apply('hold2') wait({between}) raise('e_stop') wait(1) told('held')
             raise('e_reset') wait(1) told('reset')
             undo('hold2') wait(1) told('undone')"
        );
        let said = [
            "held: build run hold2 hold speed nil k 0.5",
            "reset: build run hold2 speed nil k 3.0",
            "undone: build run speed nil k 0.0",
        ];
        says(&demo, &script, &said);
    }
}

/// A component that it names is not there yet: it takes the place of its group's frame all the same.
#[test]
fn one_that_names_what_is_not_there_takes_its_groups_place() {
    let demo = conveyor(
        "  slow: { group: a, changes: [{ port_write: { port: belt.speed, value: 0.5 } }, { property_set: { property: belt.k, value: 5.0 } }] }
  add: { changes: [{ create: { component: aux, type: Motor } }] }
  hold:
    group: a
    safe: true
    changes: [{ property_set: { property: belt.k, value: 1.0 } }, { operation_call: { operation: aux.brake } }]
",
    );
    demo.replace("coordinator.yaml", "{ config: slow }", "{ config: slow }\n        adding: { entry: add }");
    demo.replace(
        "coordinator.yaml",
        "    failed: {}",
        "        - { src: running, tgt: adding, events: [e_add] }\n    failed: {}",
    );
    demo.replace("coordinator.yaml", "slow.broken,", "slow.broken, add.failed, add.broken,");
    demo.replace("coordinator.yaml", "        removing:", "        taking: { entry: add.undo }\n        removing:");
    demo.replace(
        "coordinator.yaml",
        "{ src: stopping, tgt: removing,",
        "{ src: taking, tgt: removing, events: [add.undone, add.undo.failed, add.undo.broken] }
        - { src: stopping, tgt: taking,",
    );
    let plain = "deploy('conveyor.yaml') wait(1) raise('e_stop') wait(1) told('held')";
    says(&demo, plain, &["held: build run hold speed nil k 1.0"]);
    let interrupted = "deploy('conveyor.yaml') wait(1)
        fault('port_write belt.speed', 'slow', 1, 0.2)
        raise('e_add') wait(0.05) raise('e_stop') wait(1) told('held')";
    says(&demo, interrupted, &["held: build run hold speed nil k 1.0"]);
}

/// For a moment there is one frame more than there may be: two of a group, of which one goes.
#[test]
fn nothing_is_squashed_for_two_of_a_group_of_which_one_goes() {
    let demo = conveyor(
        "  slow: { changes: [{ port_write: { port: belt.speed, value: 0.1 } }] }
  hold:
    safe: true
    group: halt
    changes: [{ property_set: { property: belt.k, value: 3.0 } }, { port_write: { port: belt.speed, value: 0.0 } }]
",
    );
    demo.replace("conveyor.yaml", "configurations:", "limits: { stack: 4 }\nconfigurations:");
    let script = "fault('property_set belt.k', 'slow', 9, 0.2)
        deploy('conveyor.yaml') wait(0.5)
        raise('e_stop') wait(0.05) raise('e_stop') wait(2) told('held')";
    says(&demo, script, &["held: build run slow hold speed 0.0 k 3.0"]);
}

/// One that is asked for anew and fails in part: what the first had done is taken back with what was done of the second.
#[test]
fn one_that_fails_when_it_is_asked_for_anew_takes_the_first_ones_place() {
    let demo = conveyor(HOLD);
    for between in [0.02, 1.0] {
        let script = format!(
            "fault('operation_call belt.brake', 'slow', 1, 0.2)
             deploy('conveyor.yaml') wait(0.5)
             raise('e_stop') wait({between}) fault('operation_call belt.brake', 'fail', 1) raise('e_stop') wait(1)
             raise('e_end') wait(1)
             local released = 0
             for _, it in ipairs(log()) do
               for _, step in ipairs(it.steps or {{}}) do
                 if step.step == 'operation_call belt.release' and step.outcome == 'done' then released = released + 1 end
               end
             end
             say('released ' .. released)"
        );
        says(&demo, &script, &["released 1"]);
    }
}

/// What nobody knows of one is done once more by the one that takes its place, the same or another one of its group: that one is whole, one frame
/// is in force, and its undo repairs what nobody knows of the earlier one.
#[test]
fn one_that_is_asked_for_anew_is_no_wholer_than_the_first() {
    for (fault, said) in [
        ("'port_write belt.speed = 0.0', 'late', 1", ["held: build run hold(partial)", "end: "]),
        ("'operation_call belt.brake', 'lost', 1", ["held: build run hold(partial)", "end: "]),
    ] {
        for second in ["e_stop", "e_other"] {
            let demo = conveyor(&HOLD.replace(
                "property_set: { property: belt.k, value: 0.5 }",
                "port_write: { port: belt.speed, value: 0.0 }",
            ));
            let other = "  hold2:\n    group: a\n    safe: true\n    changes: [{ port_write: { port: belt.speed, value: 0.0 } }, { operation_call: { operation: belt.brake } }]\n";
            demo.replace("configurations.yaml", "  hold:\n", &format!("{other}  hold:\n"));
            demo.replace("coordinator.yaml", "    held:\n", "    other: { config: hold2 }\n    held:\n");
            demo.replace(
                "coordinator.yaml",
                "    - { src: held, tgt: failed,",
                "    - { src: held, tgt: other, events: [e_other] }\n    - { src: other, tgt: held, events: [e_stop] }
    - { src: other, tgt: failed, events: [e_reset] }
    - { src: other, tgt: down, events: [e_end] }\n    - { src: held, tgt: failed,",
            );
            let script = format!(
                "local function frames(what)
                   local all = {{}}
                   for _, f in ipairs(stack()) do all[#all + 1] = f.configuration .. (f.partial and '(partial)' or '') end
                   say(what .. ': ' .. table.concat(all, ' '))
                 end
                 deploy('conveyor.yaml') wait(0.5) fault({fault})
                 raise('e_stop') wait(0.05) raise('{second}') wait(12) frames('held')
                 raise('e_end') wait(3) frames('end')
                 shutdown()"
            );
            demo.write("s.lua", &script);
            let ran = demo.run(&["run", "s.lua", "--clock", "simulated"]);
            let whole = if second == "e_stop" { "hold" } else { "hold2" };
            let said = said.map(|said| said.replace("hold(partial)", whole));
            let missing: Vec<_> = said.iter().filter(|said| !ran.out.contains(&format!("{said}\n"))).collect();
            assert!(ran.code == 0 && missing.is_empty(), "{fault} {second}: {missing:?}\n{}{}", ran.out, ran.err);
        }
    }
}
