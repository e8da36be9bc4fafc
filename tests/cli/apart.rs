//! Subsystems side by side: what is on the stack of one is none of another's, and a parent's frame that touches two of them keeps neither
//! from leaving.

use crate::demo::Demo;
use crate::hierarchy::{apart, cell, example};

/// The pair, each of both led by itself, with these configurations of the parent and of each drive, and these lines of each file.
fn pair(parent: &str, drive: &str, changes: &[(&str, &str)]) -> Demo {
    let demo = cell();
    apart(&demo);
    for (file, more) in [("pair", parent), ("robot", drive)] {
        let configurations = format!("{file}_configurations.lua");
        let with = format!("ConfiguratorConf {{ {more}");
        demo.write(&configurations, &example(&configurations).replacen("ConfiguratorConf {", &with, 1));
    }
    let operations = "    operations: { home: { effect: none }, flash: { effect: irreversible } }";
    let gain = "    properties: { gain: { type: float, default: 1.0 } }";
    let robot = example("robot.yaml").replace(gain, &format!("{gain}\n{operations}"));
    let robot = robot.replace(
        "  properties: { gain: Drive.gain }",
        "  properties: { gain: Drive.gain }\n  operations: { home: Drive.home, flash: Drive.flash }",
    );
    demo.write("robot.yaml", &robot);
    let mut file = std::fs::read_to_string(demo.path("pair.yaml")).expect("it was written");
    for (before, after) in changes {
        assert!(file.contains(before), "{before}");
        file = file.replace(before, after);
    }
    demo.write("pair.yaml", &file);
    demo
}

fn tells(demo: &Demo, story: &str) -> String {
    demo.write("story.lua", &format!("deploy('pair.yaml')\n{story}\nshutdown()"));
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    ran.out
}

/// The parent's frame, and what it set, as a script sees them.
const IN_FORCE: &str = "local function in_force(id)
  for _, frame in ipairs(stack()) do if frame.configuration == id then return true end end
  return false
end
local function gains(l, r)
  assert(property('left/Drive.gain') == l, 'left ' .. property('left/Drive.gain'))
  assert(property('right/Drive.gain') == r, 'right ' .. property('right/Drive.gain'))
end
";

/// What operators did in two subsystems is never squashed into one: of each the bound counts, one is led down with what there is on it, and
/// the frames of the other one stay and are undone.
#[test]
fn what_operators_do_is_squashed_subsystem_by_subsystem() {
    let demo = pair("", "", &[("types: {}", "types: {}\nlimits: { stack: 2 }")]);
    tells(
        &demo,
        &format!(
            "{IN_FORCE}
for n = 1, 4 do
  for _, side in ipairs {{ 'left', 'right' }} do set(side .. '/Drive.gain', 1 + n / 10, {{ force = true, within = 1 }}) end
end
gains(1.4, 1.4)
-- Of its coordinator two, of operators two, and so of the other one.
assert(#stack() == 8, #stack())
raise('left/Drive.faulted')
wait_answer('left/make.undone', 5)
wait_answer('left/down', 5)
assert(#stack() == 4, #stack())
undo()
wait_answer('undo.done', 1)
assert(property('right/Drive.gain') == 1.3)
undo()
wait_answer('undo.done', 1)
assert(property('right/Drive.gain') == 0.5)"
        ),
    );
}

/// What a parent's frame did to a subsystem that has gone is void: it is in the way of neither its way down nor its next life, and the rest of it is
/// undone.
#[test]
fn what_a_parent_did_to_a_subsystem_that_has_gone_is_void() {
    let both = "both = Configuration { property_set('left.gain', 1.25), operation_call('left.home'), property_set('right.gain', 1.5) }, ";
    let demo = pair(both, "", &[]);
    let story = format!(
        "{IN_FORCE}
apply('both', {{ force = true }})
wait_answer('both.ok', 1)
gains(1.25, 1.5)
raise('left/Drive.faulted')
wait_answer('left/down', 5)
assert(in_force('both') and property('right/Drive.gain') == 1.5)
raise('e_start')
wait_answer('left/up', 5)
gains(0.7, 1.5)
undo('both')
wait_answer('both.undone', 1)
gains(0.7, 0.5)
assert(not in_force('both'))"
    );
    tells(&demo, &story);
    // With nothing left of it, it is gone.
    tells(
        &demo,
        &format!(
            "{IN_FORCE}
apply('both', {{ force = true }})
wait_answer('both.ok', 1)
raise('left/Drive.faulted')
raise('right/Drive.faulted')
wait_answer('left/down', 5)
wait_answer('right/down', 5)
assert(#stack() == 0)"
        ),
    );
}

/// A connection is none of that: it holds what it connects. Who had it made and taken away again holds nothing.
#[test]
fn only_what_is_connected_holds_a_subsystem() {
    let wires = "wire = Configuration { connect('left.pose', 'right.ref') }, cut = Configuration { disconnect('left.pose', 'right.ref') }, ";
    let demo = pair(wires, "", &[]);
    let story = |between: &str, then: &str| {
        format!(
            "apply('wire', {{ force = true }})\nwait_answer('wire.ok', 1)\n{between}\nraise('left/Drive.faulted')\n{then}"
        )
    };
    let held = "wait_answer('left/make.undo.failed', 5)\nundo('wire')\nwait_answer('wire.undone', 1)";
    let told = {
        demo.write("story.lua", &format!("deploy('pair.yaml')\n{}", story("", held)));
        demo.run(&["run", "story.lua", "--clock", "simulated"])
    };
    assert!(told.out.contains("`left/make` cannot be undone before `wire`"), "{}{}", told.out, told.err);
    let cut = "apply('cut', { force = true })\nwait_answer('cut.ok', 1)";
    tells(&demo, &story(cut, "wait_answer('left/down', 5)\nassert(#stack() == 2, #stack())"));
}

/// A floor is of its file: what a parent cannot take back keeps nothing of a subsystem, and what a subsystem cannot take back nothing of its parent.
#[test]
fn a_floor_holds_back_what_is_of_its_own_file() {
    let flash = |of: &str| format!("flash = Configuration {{ irreversible = true, operation_call('{of}.flash') }}, ");
    let tune = "tune = Configuration { property_set('left.gain', 1.25), property_set('right.gain', 1.5) }, ";
    let demo = pair(&format!("{tune}{}", flash("left")), &flash("Drive"), &[]);
    let by_parent = "apply('tune', { force = true })\nwait_answer('tune.ok', 1)
apply('flash', { force = true })\nwait_answer('flash.ok', 1)
undo('tune')\nwait_answer('tune.undo.failed', 1)
raise('left/Drive.faulted')\nwait_answer('left/down', 5)
undo('tune')\nwait_answer('tune.undone', 1)\nassert(property('right/Drive.gain') == 0.5 and #stack() == 2)";
    tells(&demo, by_parent);
    let by_child = "apply('tune', { force = true })\nwait_answer('tune.ok', 1)
apply('left/flash', { force = true })\nwait_answer('left/flash.ok', 1)
undo('tune')\nwait_answer('tune.undone', 1)\nassert(property('left/Drive.gain') == 0.7)";
    demo.write("story.lua", &format!("deploy('pair.yaml')\n{by_child}\nsay('as it was')"));
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    assert!(ran.out.contains("as it was"), "{}{}", ran.out, ran.err);
}

/// The coordinator of a drive with functions: what they hear and send is called as in its file, and nothing is heard of a sibling.
const RICH: &[(&str, &str)] = &[
    (
        "return state {\n",
        "local function has(events, name)
  for _, event in ipairs(events) do if event == name then return true end end
  return false
end
return state {
  pre_step_hook = function(_, events) for _, event in ipairs(events) do print('heard ' .. tostring(event)) end end,
",
    ),
    (
        "    starting = state { entry = { \"e_built\", \"run\" } },\n",
        "    starting = state { entry = { \"e_built\", function() print('starts') end, \"run\" } },
    settling = state { entry = function(fsm) rfsm.send_events(fsm, 'e_settled', 'e_unlisted') end },
",
    ),
    (
        "    trans { src = \"starting\", tgt = \"on\",       events = { \"run.ok\" } },\n",
        "    trans { src = \"starting\", tgt = \"settling\", events = { \"run.ok\" } },
    trans { src = \"settling\", tgt = \"on\", events = { \"e_settled\" } },
",
    ),
    (
        "  trans { src = \"idle\",     tgt = \"alive\",    events = { \"e_start\" } },\n",
        "  trans { src = \"idle\", tgt = \"alive\", guard = function(_, events) return has(events, 'e_start') end, events = { \"e_start\" } },\n",
    ),
];

fn rich() -> Demo {
    let demo = cell();
    let mut coordinator = example("robot_coordinator.lua");
    for (before, after) in RICH {
        assert!(coordinator.contains(before), "{before}");
        coordinator = coordinator.replacen(before, after, 1);
    }
    demo.write("robot_coordinator.lua", &coordinator);
    let robot = example("robot.yaml");
    demo.write(
        "robot.yaml",
        &robot.replace("coordinator: robot_coordinator.lua", "coordinator: robot_coordinator.lua\ntrusted: true"),
    );
    demo
}

#[test]
fn functions_of_a_subsystem_hear_and_send_by_the_names_of_their_file() {
    let demo = rich();
    let run = |file: &str, story: &str| {
        demo.write("story.lua", &format!("deploy('{file}')\n{story}"));
        let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
        assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
        format!("{}{}", ran.out, ran.err)
    };
    let count = |told: &str, event: &str| told.lines().filter(|line| line.ends_with(&format!("heard {event}"))).count();
    let running = "assert(state('duo/left/Drive') == 'running' and state('duo/right/Drive') == 'running')";
    let told = run("cell.yaml", &format!("{running}\nraise('duo/left/e_told')\nwait(0.1)\nshutdown()"));
    for event in ["e_start", "make.ok", "run.ok", "e_settled", "e_unlisted", "e_released", "run.undone", "make.undone"]
    {
        assert_eq!(count(&told, event), 2, "{event}: {told}");
    }
    // From outside, and what fails: of the one alone.
    assert_eq!(count(&told, "e_told"), 1, "{told}");
    assert!(!told.contains("heard left/") && !told.contains("heard right/") && !told.contains("heard duo/"), "{told}");
    let failed = run("pair.yaml", "fail('left/Drive')\nwait_state('pair:idle', 5)\nassert(#stack() == 0)\nshutdown()");
    assert_eq!(count(&failed, "Drive.faulted"), 1, "{failed}");
    // Each file is judged: what depends on functions is not verified, and that is said of the subsystem's.
    let checked = demo.run(&["check", "pair.yaml"]);
    let said = format!("{}{}", checked.out, checked.err);
    assert!(checked.code == 0 && said.contains("robot_coordinator.lua:6: the coordinator has functions"), "{said}");
}

/// Stepped by hand it is the same, by the names of the file and by those from outside.
#[test]
fn functions_of_a_subsystem_are_stepped_by_hand() {
    let demo = rich();
    for (args, path) in [(&["--in", "duo/left"][..], ""), (&["--of", "duo/left"][..], "duo/left/")] {
        demo.write("events", &format!("run\n{path}e_start\n{path}make.ok\n{path}run.ok\nrun\n"));
        let mut all = vec!["sim", "cell.yaml", "--events", "events"];
        all.extend(args);
        let ran = demo.run(&all);
        assert!(ran.code == 0 && ran.out.contains("root.alive.on"), "{args:?}: {}{}", ran.out, ran.err);
        assert!(ran.out.contains("heard make.ok"), "{args:?}: {}", ran.out);
    }
}
