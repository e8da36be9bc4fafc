//! The shipped coupling and the same system written flat give the same plans, step for step: the robots' own configurations, once for each
//! with its path before every name, and the pair's, with what is exported by its inner name.

use crate::flat_plans::planned;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

const ROBOTS: [&str; 2] = ["left", "right"];

/// A robot's activities, and their periods in ms.
const ACTIVITIES: [(&str, f64); 5] = [("control", 1.0), ("link", 1.0), ("base", 4.0), ("safety", 5.0), ("watch", 10.0)];

/// What a composition does for a robot's file, in Lua: every name gets the path, and `_default` is all of the robot.
const BY_HAND: &str = r#"
-- In the order in which `_default` takes them: as data flows, and against it where they start; what goes round with the networks by name.
local made = { "Monitors", "Arm_Kinematics", "Base_Ctrl", "Cart_Impedance", "Dynamics", "Link_Rx", "Link_Tx", "Operator", "youbot",
               "Mode_Switch", "Reporter" }
local starting = { "Reporter", "Mode_Switch", "Arm_Kinematics", "Base_Ctrl", "Cart_Impedance", "Dynamics", "Link_Tx", "Link_Rx", "Operator",
                   "youbot", "Monitors" }
local flat = { create = create, destroy = destroy, connect = connect, disconnect = disconnect, property_set = property_set,
               port_write = port_write, operation_call = operation_call, Configuration = Configuration, ConfiguratorConf = ConfiguratorConf }
-- The monitors of a flat file are one list, so they have names of their own.
local function at(name)
  local port = "Monitors.is_"
  if name:sub(1, #port) == port then name = port .. path .. "_" .. name:sub(#port + 1) end
  return path .. "/" .. name
end
local function create(name, ty, with)
  with.activity = path .. "_" .. with.activity
  return flat.create(at(name), ty, with)
end
local function destroy(name) return flat.destroy(at(name)) end
local function connect(from, to, policy) return flat.connect(at(from), at(to), policy) end
local function disconnect(from, to) return flat.disconnect(at(from), at(to)) end
local function property_set(member, value) return flat.property_set(at(member), value) end
local function port_write(member, value) return flat.port_write(at(member), value) end
local function operation_call(member, ...) return flat.operation_call(at(member), ...) end
local function parts(entry)
  local colon = 1
  while entry:sub(colon, colon) ~= ":" do colon = colon + 1 end
  return entry:sub(1, colon - 1), entry:sub(colon + 1)
end
local function states(list)
  local all, named = {}, {}
  for _, entry in ipairs(list) do named[parts(entry)] = true end
  for _, entry in ipairs(list) do
    local name, state = parts(entry)
    local default = state == "running" and starting or made
    for _, one in ipairs(name == "_default" and default or { name }) do
      if name ~= "_default" or not named[one] then table.insert(all, at(one) .. ":" .. state) end
    end
  end
  return all
end
local function Configuration(table)
  for _, key in ipairs{ "pre_conf_state", "post_conf_state" } do table[key] = table[key] and states(table[key]) end
  table.group = table.group and path .. "_" .. table.group
  return flat.Configuration(table)
end
local function ConfiguratorConf(all)
  local named = {}
  for id, configuration in pairs(all) do named[at(id)] = configuration end
  return flat.ConfiguratorConf(named)
end
"#;

/// All of a robot's life that its own configurations bring about, in an order in which each can be applied.
const LIFE: [&str; 33] = [
    "create_core",
    "create_link",
    "create_monitors",
    "connect_all",
    "load_properties",
    "start_driver",
    "calibrate",
    "unfold",
    "start_control",
    "take_over",
    "enable_copying",
    "five_DOF",
    "eight_DOF",
    "profile_soft",
    "profile_normal",
    "profile_stiff",
    "profile_slow_link",
    "relink",
    "disable_copying",
    "base_stop",
    "restart_controller",
    "restart_kinematics",
    "restart_dynamics",
    "restart_base",
    "restart_link",
    "restart_monitors",
    "clear_faults",
    "safe_hold",
    "hold",
    "park",
    "stop_control",
    "stop_all",
    "cleanup_all",
];

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn text(name: &str) -> String {
    std::fs::read_to_string(shipped(name)).expect("it is shipped")
}

/// What a robot exports: the name outside, and the one inside.
fn exports() -> Vec<(String, String)> {
    let robot = text("deployments/youbot_robot.yaml");
    let listed = robot.split_once("\nexports:").and_then(|(_, rest)| rest.split_once("\naccepts:")).expect("exports").0;
    let one = |line: &str| {
        let (outside, inside) = line.split('#').next()?.split_once(": ")?;
        inside.contains('.').then(|| (outside.trim().to_owned(), inside.trim().to_owned()))
    };
    listed.lines().filter_map(one).collect()
}

/// Writes the coupling flat, and says what it is called.
fn flat(folder: &Path) -> PathBuf {
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    let mut pair = text("configs/youbot/pair.lua");
    for (outside, inside) in exports() {
        for robot in ROBOTS {
            pair = pair.replace(&format!("\"{robot}.{outside}\""), &format!("\"{robot}/{inside}\""));
        }
    }
    write("pair.lua", &format!("local delay_s = 0.005\n{pair}"));
    let (mut files, mut activities, mut monitors) = (Vec::new(), String::new(), String::new());
    let hands = ["free 1.5; align 8; hold 1; sway 600 0.03 0 0 0.15", "free 1.5; align 8; free 600"];
    for (at, (robot, hand)) in ROBOTS.iter().zip(hands).enumerate() {
        let given = format!(
            "local path, stand_in, ifname, law, hand = \"{robot}\", false, \"sim{at}\", \"position\", \"{hand}\"\n{BY_HAND}"
        );
        for name in ["coupling.lua", "configurations.lua"] {
            // What an operation is undone by is said with a method.
            let own = text(&format!("configs/youbot/{name}")).replace(":undo(\"", &format!(":undo(\"{robot}/"));
            write(&format!("{robot}_{name}"), &format!("{given}{own}"));
            files.push(format!("{robot}_{name}"));
        }
        for (activity, period) in ACTIVITIES {
            _ = writeln!(activities, "  {robot}_{activity}: {{ period_ms: {period:.1} }}");
        }
        _ = writeln!(monitors, "  {robot}_near: {{ when: {{ above: [{robot}/Link_Rx.link_stats.age, 0.1] }} }}");
    }
    // What monitors watch is in no plan; which there are is.
    write("monitors.yaml", &format!("monitors:\n{monitors}"));
    write("idle.lua", "return state { idle = state {}, trans { src = \"initial\", tgt = \"idle\" } }");
    write(
        "flat.yaml",
        &format!(
            "davit: 1\nname: youbot_coupling\nplatform: embedded\nlibraries: [youbot]\n\
             activities:\n  world: {{ period_ms: 0.5 }}\n  network: {{ period_ms: 1.0 }}\n{activities}\
             configurations: [pair.lua, {}]\nmonitors: [monitors.yaml]\ncoordinator: idle.lua\n\
             deploy: {{ event: e_start, up: idle, within_s: 5 }}\nshutdown: {{ event: e_shutdown, down: idle, within_s: 5 }}\n",
            files.join(", ")
        ),
    );
    folder.join("flat.yaml")
}

/// Steps without what only the flat file has to spell otherwise: its monitors are one list, and one type, and its activities have plain names.
fn alike(steps: Vec<String>) -> Vec<String> {
    let one = |step: String| {
        ROBOTS.iter().fold(step, |step, robot| {
            let step = ACTIVITIES.iter().fold(step, |step, (activity, _)| {
                step.replace(&format!("{robot}_{activity}"), &format!("{robot}/{activity}"))
            });
            step.replace(&format!("{robot}/davit.Monitors"), "davit.Monitors")
                .replace(&format!("is_{robot}_near"), "is_near")
        })
    };
    steps.into_iter().map(one).collect()
}

#[test]
fn the_coupling_and_the_same_written_flat_have_the_same_steps() {
    let folder = tempfile::tempdir().unwrap();
    let mut ids = vec!["make".to_owned()];
    for (at, id) in LIFE.iter().enumerate() {
        ids.extend(ROBOTS.map(|robot| format!("{robot}/{id}")));
        if LIFE[at] == "connect_all" {
            ids.extend(ROBOTS.map(|robot| format!("place_{robot}")));
        }
    }
    let composed = alike(planned(&shipped("deployments/youbot_coupling.yaml"), &ids));
    let flat = alike(planned(&flat(folder.path()), &ids));
    let differs = composed.iter().zip(&flat).find(|(composed, flat)| composed != flat);
    assert!(composed == flat, "{differs:#?}, {} and {} steps", composed.len(), flat.len());
    for step in ["create left/youbot", "connect World.robot2_state", "start right/Monitors", "left/youbot.fold"] {
        assert!(composed.iter().any(|planned| planned.contains(step)), "{step}: {composed:#?}");
    }
    assert!(composed.len() > 250, "{}", composed.len());
}
