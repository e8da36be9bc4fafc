-- What the youBot's coordinator asks for, said for a SCARA on a rail.
--
-- Its names are the coordinator's, who knows no robot. Here `five_DOF` is the arm alone (its four axes; the carriage stands), `eight_DOF`
-- arm and rail (five axes); `unfold` and `park` fold the arm out of the way at the rail's end, with the quill at its top; `calibrate`
-- looks for the stops of quill and rail.

local WIRES = {
  { "Drives.command",    "Plant.command" },
  { "Plant.state",       "Drives.plant" },
  -- control loop
  { "Drives.axes",       "Follower.axes" },
  { "Leader.told",       "Follower.told" },
  { "Monitors.is_near",  "Follower.near" },
  { "Drives.axes",       "Torques.axes" },
  { "Follower.wrench",   "Torques.wrench" },
  { "Follower.engaged",  "Torques.engaged" },
  { "Torques.effort",    "Drives.effort" },
  { "Torques.rail",      "Drives.rail" },
  -- the handle, at the other end of the network
  { "Follower.tells",    "Leader.heard" },
  -- who watches is watched
  { "Monitors.is_near",  "Drives.watched" },
}

local function each(change)
  local changes = {}
  for _, wire in ipairs(WIRES) do table.insert(changes, change(wire[1], wire[2])) end
  return changes
end

ConfiguratorConf {

  -- Bring-up ---------------------------------------------------------------------------------------------------------

  create_core = Configuration { description = "the arm and its control loop",
    create("Plant",    "scara.Plant",    { activity = "plant" }),
    create("Drives",   "scara.Drives",   { activity = "control" }),
    create("Follower", "scara.Follower", { activity = "control" }),
    create("Torques",  "scara.Torques",  { activity = "control" }),
  },
  create_link     = Configuration { create("Leader", "scara.Leader", { activity = "link" }) },
  create_monitors = Configuration { create("Monitors", "davit.Monitors", { activity = "safety" }) },   -- monitors.lua

  connect_all = Configuration(each(connect)),

  load_properties = Configuration { description = "this arm's own numbers, then everything configured",
    property_set("Follower.stiffness", 300.0),
    property_set("Follower.damping_abs", 5.0),
    property_set("Leader.delay", 0.005),
    post_conf_state = { "_default:configured" },
  },

  start_driver = Configuration { description = "the drives are there, off: the quill's brake carries it",
    -- What dies from here on is noticed.
    post_conf_state = { "Plant:running", "Drives:running", "Monitors:running" },
  },
  calibrate = Configuration { timeout = 10.0, operation_call("Drives.home") },
  unfold    = Configuration { timeout = 10.0, operation_call("Drives.unfold"):undo("Drives.fold") },

  start_control = Configuration { description = "everything runs; the drives do not listen to the control loop yet",
    post_conf_state = { "Follower:running", "Torques:running", "_default:running" },
  },
  take_over = Configuration { description = "the drives take torques (mode 2); taking it back, they hold (mode 1)",
    operation_call("Drives.set_mode", 2):undo("Drives.set_mode", 1),
  },

  -- Operation --------------------------------------------------------------------------------------------------------

  enable_copying  = Configuration { port_write("Follower.follow", true) },
  disable_copying = Configuration { port_write("Follower.follow", false) },

  eight_DOF = Configuration { description = "the carriage gives way too", property_set("Torques.rail_gain", 0.02) },
  five_DOF  = Configuration { description = "the arm alone: the carriage stands", property_set("Torques.rail_gain", 0.0) },
  base_stop = Configuration { operation_call("Torques.stand") },

  profile_soft = Configuration { group = "profile", property_set("Follower.stiffness", 150.0) },

  -- Faults -----------------------------------------------------------------------------------------------------------

  safe_hold = Configuration { safe = true, description = "every axis brakes and is held; no coupling, no rail",
    operation_call("Drives.brake"),
    port_write("Follower.follow", false),
    property_set("Torques.rail_gain", 0.0),
    property_set("Torques.enabled", false),
  },
  brake_again = Configuration { safe = true, group = "brake", operation_call("Drives.stop") },
  resume      = Configuration { operation_call("Drives.resume") },
  clear_faults = Configuration { operation_call("Drives.acknowledge") },
  restart_controller = Configuration { description = "the controller from the beginning",
    pre_conf_state  = { "Follower:unconfigured" },
    post_conf_state = { "Follower:running" },
  },

  -- Teardown ---------------------------------------------------------------------------------------------------------

  hold = Configuration { description = "the drives hold every axis by themselves",
    operation_call("Drives.set_mode", 1):undo("Drives.set_mode", 2),
  },
  park = Configuration { timeout = 10.0, operation_call("Drives.fold"):undo("Drives.unfold") },
  stop_control = Configuration { description = "everything but the drives",
    pre_conf_state = { "Drives:running", "Plant:running", "_default:stopped" },
  },
  stop_all = Configuration { description = "the brake closes, and the drives are off",
    operation_call("Drives.set_mode", 0):undo("Drives.set_mode", 1),
    post_conf_state = { "Drives:stopped" },
  },
  cleanup_all    = Configuration { post_conf_state = { "Drives:unconfigured", "_default:unconfigured" } },
  disconnect_all = Configuration(each(disconnect)),
  destroy_all    = Configuration {
    destroy("Plant"), destroy("Drives"), destroy("Follower"), destroy("Torques"), destroy("Leader"), destroy("Monitors"),
  },
}
