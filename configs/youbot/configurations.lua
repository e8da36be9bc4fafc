-- Bring-up, operation and teardown of one robot of the youBot coupling.
--
-- The order between configurations is the coordinator's; inside a configuration there is none.
-- The four configurations of the coupling's switch are in coupling.lua.

-- `stand_in`: the world that the robot is in and a stand-in for the other robot are part of the deployment (deployments/youbot_arm.yaml). In
-- the coupling of two robots they are not (deployments/youbot_robot.yaml): what driver and hand exchange with the world, and what the link
-- sends and hears, is exported. `hand`: what the operator's hand does, `ifname`: the network interface of the drives' bus, which a driver has
-- for itself, `law`: of the coupling, the same at both ends.

local function with_stand_in(changes, more)
  if stand_in then
    for _, change in ipairs(more()) do table.insert(changes, change) end
  end
  return changes
end

local function with_law(changes)
  if not stand_in and law ~= "position" then table.insert(changes, property_set("Cart_Impedance.law", law)) end
  return changes
end

local function with_world(list)
  if stand_in then table.insert(list, 1, "World:running") end
  return list
end

ConfiguratorConf {

  -- Bring-up ---------------------------------------------------------------------------------------------------------

  create_core = Configuration(with_stand_in({ description = "the control loop",
    create("youbot",         "youbot.Driver",         { activity = "control", properties = { ifname = stand_in and "sim0" or ifname } }),
    create("Arm_Kinematics", "youbot.Arm_Kinematics", { activity = "control" }),
    create("Cart_Impedance", "youbot.Cart_Impedance", { activity = "control" }),
    create("Dynamics",       "youbot.Dynamics",       { activity = "control" }),
    create("Base_Ctrl",      "youbot.Base_Ctrl",      { activity = "base" }),
  }, function() return {
    create("World",          "youbot.World",          { activity = "world" }),      -- arm, base and what they touch
  } end)),

  create_link = Configuration(with_stand_in({ description = "the link to the other robot, and perhaps a stand-in for that robot",
    create("Link_Tx", "youbot.Link_Tx", { activity = "link" }),
    create("Link_Rx", "youbot.Link_Rx", { activity = "link" }),
  }, function() return {
    create("Peer",    "youbot.Peer",    { activity = "link" }),
  } end)),

  create_monitors = Configuration { description = "what watches, and the hand of the operator",
    create("Monitors",    "davit.Monitors",     { activity = "safety" }),      -- monitors.lua
    create("Operator",    "youbot.Operator",    { activity = "link" }),
    create("Mode_Switch", "youbot.Mode_Switch", { activity = "watch" }),
    create("Reporter",    "youbot.Reporter",    { activity = "watch" }),
  },

  connect_all = Configuration(with_stand_in({
    -- control loop
    connect("youbot.jointstate",             "Arm_Kinematics.jointstate"),
    connect("youbot.odometry",               "Arm_Kinematics.odometry"),
    connect("Arm_Kinematics.tool_pose",      "Cart_Impedance.tool_pose"),
    connect("Arm_Kinematics.tool_twist",     "Cart_Impedance.tool_twist"),
    connect("Link_Rx.ext_ref",               "Cart_Impedance.ext_ref"),
    connect("Cart_Impedance.f_des",          "Dynamics.f_des"),
    connect("Cart_Impedance.engaged",        "Dynamics.engaged"),
    connect("youbot.jointstate",             "Dynamics.jointstate"),
    connect("youbot.odometry",               "Dynamics.odometry"),
    connect("youbot.identified",             "Dynamics.identified"),
    connect("Arm_Kinematics.jacobian",       "Dynamics.jacobian"),
    connect("Dynamics.joint_effort_command", "youbot.joint_effort_command"),
    connect("Dynamics.base_twist",           "Base_Ctrl.base_twist"),
    connect("youbot.odometry",               "Base_Ctrl.odometry"),
    connect("Base_Ctrl.cmd_twist",           "youbot.cmd_twist"),
    -- link
    connect("Arm_Kinematics.tool_pose",      "Link_Tx.tool_pose"),
    connect("Arm_Kinematics.tool_twist",     "Link_Tx.tool_twist"),
    connect("Cart_Impedance.active",         "Link_Tx.copying"),
    connect("Monitors.is_near",              "Link_Tx.aligned"),
    connect("Cart_Impedance.energy_sent",     "Link_Tx.energy"),
    connect("Dynamics.yields",                "Link_Tx.yields"),
    connect("Link_Rx.echo",                   "Link_Tx.echo"),
    connect("Link_Rx.peer_state",             "Dynamics.peer_state"),
    -- the operator's hand
    connect("Link_Rx.ext_ref",               "Operator.ext_ref"),
    connect("youbot.control_mode",           "Operator.control_mode"),
    -- who watches is watched
    connect("Monitors.is_near",              "youbot.watched"),
    -- record
    connect("Arm_Kinematics.tool_pose",      "Reporter.tool_pose"),
    connect("Link_Rx.ext_ref",               "Reporter.ext_ref"),
    connect("youbot.jointstate",             "Reporter.jointstate"),
    connect("youbot.odometry",               "Reporter.odometry"),
    connect("Cart_Impedance.f_des",          "Reporter.f_des"),
    connect("Cart_Impedance.f_raw_norm",     "Reporter.f_raw_norm"),
    connect("Cart_Impedance.active",         "Reporter.active"),
  }, function() return {
    -- driver and hand, and what they have hold of
    connect("World.robot1_state",            "youbot.plant_state"),
    connect("youbot.plant_command",          "World.robot1_command"),
    connect("World.robot1_tool_pose",        "Operator.tool_pose"),
    connect("World.robot1_tool_twist",       "Operator.tool_twist"),
    connect("Operator.ext_force",            "World.robot1_ext_force"),
    -- the stand-in
    connect("Link_Tx.tx",                    "Peer.rx",    { buffer = 64 }),
    connect("Peer.tx",                       "Link_Rx.rx", { buffer = 64 }),
  } end)),

  load_properties = Configuration(with_law(with_stand_in({ description = "this robot's own numbers, then everything configured",
    property_set("Cart_Impedance.stiffness",     150.0),
    property_set("Cart_Impedance.damping_abs",   5.0),
    property_set("Cart_Impedance.offset",        { 0.0, 0.0, 0.0 }),
    property_set("Operator.script",              stand_in and "free 0.5; align 8; hold 1; sway 600 0.06 0 0 0.15" or hand),
    post_conf_state = { "_default:configured" },
  }, function() return {
    property_set("World.robot1_q_start",         { 0.0, -1.1257, 2.5395, -1.7802, 0.0 }),
    property_set("Peer.delay",                   0.005),
    property_set("Peer.force_gain",              { 0.1, 0.1, 0.1 }),   -- its base yields as ours does
  } end))),

  start_driver = Configuration { description = "drives on, brakes closed: the arm rests on its stops. From here on they are watched",
    post_conf_state = with_world{
      "youbot:running",
      "Monitors:running",
    },
  },

  calibrate = Configuration { timeout = 10.0,
    operation_call("youbot.start_calibration"),
  },

  unfold = Configuration { timeout = 10.0, description = "from the stops to the working pose; the drives hold it there",
    operation_call("youbot.unfold"):undo("youbot.fold"),
  },

  start_control = Configuration { description = "everything runs; the drives do not listen to the control loop yet",
    post_conf_state = { "Arm_Kinematics:running", "Cart_Impedance:running", "Dynamics:running", "Base_Ctrl:running",
                        "_default:running" },
  },

  take_over = Configuration { description = "the drives take torques (mode 6); taking it back, they hold (mode 1)",
    operation_call("youbot.setControlMode", 6):undo("youbot.setControlMode", 1),
  },

  -- Operation --------------------------------------------------------------------------------------------------------

  base_stop = Configuration {
    operation_call("Base_Ctrl.stop"),
  },

  profile_soft   = Configuration { group = "profile",
    property_set("Cart_Impedance.stiffness", 70.0),  property_set("Cart_Impedance.damping_abs", 5.0) },
  profile_normal = Configuration { group = "profile",
    property_set("Cart_Impedance.stiffness", 150.0), property_set("Cart_Impedance.damping_abs", 5.0) },
  profile_stiff  = Configuration { group = "profile",
    property_set("Cart_Impedance.stiffness", 300.0), property_set("Cart_Impedance.damping_abs", 7.0) },
  -- Damping for a link of up to 100 ms before it is so slow: the controller follows what it sees by itself (delay_damping).
  profile_slow_link = Configuration { group = "profile",
    property_set("Cart_Impedance.stiffness", 150.0), property_set("Cart_Impedance.damping_abs", 18.0) },

  relink = Configuration { description = "the link from the beginning: its statistics, its clocks",
    pre_conf_state  = { "Link_Tx:stopped", "Link_Rx:stopped" },
    operation_call("Link_Rx.reset_stats"),
    post_conf_state = { "Link_Rx:running", "Link_Tx:running" },
  },

  -- Faults -----------------------------------------------------------------------------------------------------------

  safe_hold = Configuration { safe = true, description = "the drives brake and hold the arm; no coupling, no base",
    operation_call("youbot.brake"),
    port_write("Cart_Impedance.ext_ref_mode", false),
    property_set("Dynamics.force_gain", { 0, 0, 0 }),
    property_set("Base_Ctrl.enabled", false),
  },

  brake_again = Configuration { safe = true, group = "brake", description = "what an operator moves in spite of safe_hold; nothing is released by its end",
    operation_call("youbot.stop"),
  },

  resume = Configuration { description = "what take_over stands for is so again, whatever the drives did meanwhile",
    operation_call("youbot.resume"),
  },

  clear_faults = Configuration {
    operation_call("youbot.clear_faults"),
  },

  restart_controller = Configuration { description = "the impedance controller from the beginning",
    pre_conf_state  = { "Cart_Impedance:unconfigured" },
    post_conf_state = { "Cart_Impedance:running" },
  },

  restart_kinematics = Configuration { description = "the kinematics from the beginning",
    pre_conf_state  = { "Arm_Kinematics:unconfigured" },
    post_conf_state = { "Arm_Kinematics:running" },
  },
  restart_dynamics = Configuration { description = "the dynamics from the beginning",
    pre_conf_state  = { "Dynamics:unconfigured" },
    post_conf_state = { "Dynamics:running" },
  },
  restart_base = Configuration { description = "the base's controller from the beginning",
    pre_conf_state  = { "Base_Ctrl:unconfigured" },
    post_conf_state = { "Base_Ctrl:running" },
  },
  restart_link = Configuration { description = "both ends of the link from the beginning",
    pre_conf_state  = { "Link_Tx:unconfigured", "Link_Rx:unconfigured" },
    post_conf_state = { "Link_Rx:running", "Link_Tx:running" },
  },
  restart_monitors = Configuration { description = "the monitors from the beginning",
    pre_conf_state  = { "Monitors:unconfigured" },
    post_conf_state = { "Monitors:running" },
  },

  -- Teardown ---------------------------------------------------------------------------------------------------------

  hold = Configuration { description = "the drives hold the arm by themselves",
    operation_call("youbot.setControlMode", 1):undo("youbot.setControlMode", 6),
  },

  park = Configuration { timeout = 10.0, description = "onto the stops, where nothing has to hold the arm",
    operation_call("youbot.fold"):undo("youbot.unfold"),
  },

  stop_control = Configuration { description = "everything but the driver",
    pre_conf_state = stand_in and { "youbot:running", "World:running", "_default:stopped" } or { "youbot:running", "_default:stopped" },
  },

  stop_all = Configuration {
    operation_call("youbot.setControlMode", 0):undo("youbot.setControlMode", 1),
    post_conf_state = { "youbot:stopped" },
  },

  cleanup_all = Configuration {
    post_conf_state = { "youbot:unconfigured", "_default:unconfigured" },
  },

  disconnect_all = Configuration(with_stand_in({
    disconnect("youbot.jointstate",             "Arm_Kinematics.jointstate"),
    disconnect("youbot.odometry",               "Arm_Kinematics.odometry"),
    disconnect("Arm_Kinematics.tool_pose",      "Cart_Impedance.tool_pose"),
    disconnect("Arm_Kinematics.tool_twist",     "Cart_Impedance.tool_twist"),
    disconnect("Link_Rx.ext_ref",               "Cart_Impedance.ext_ref"),
    disconnect("Cart_Impedance.f_des",          "Dynamics.f_des"),
    disconnect("Cart_Impedance.engaged",        "Dynamics.engaged"),
    disconnect("youbot.jointstate",             "Dynamics.jointstate"),
    disconnect("youbot.odometry",               "Dynamics.odometry"),
    disconnect("youbot.identified",             "Dynamics.identified"),
    disconnect("Arm_Kinematics.jacobian",       "Dynamics.jacobian"),
    disconnect("Dynamics.joint_effort_command", "youbot.joint_effort_command"),
    disconnect("Dynamics.base_twist",           "Base_Ctrl.base_twist"),
    disconnect("youbot.odometry",               "Base_Ctrl.odometry"),
    disconnect("Base_Ctrl.cmd_twist",           "youbot.cmd_twist"),
    disconnect("Arm_Kinematics.tool_pose",      "Link_Tx.tool_pose"),
    disconnect("Arm_Kinematics.tool_twist",     "Link_Tx.tool_twist"),
    disconnect("Cart_Impedance.active",         "Link_Tx.copying"),
    disconnect("Monitors.is_near",              "Link_Tx.aligned"),
    disconnect("Cart_Impedance.energy_sent",     "Link_Tx.energy"),
    disconnect("Dynamics.yields",                "Link_Tx.yields"),
    disconnect("Link_Rx.echo",                   "Link_Tx.echo"),
    disconnect("Link_Rx.peer_state",             "Dynamics.peer_state"),
    disconnect("Link_Rx.ext_ref",               "Operator.ext_ref"),
    disconnect("youbot.control_mode",           "Operator.control_mode"),
    disconnect("Monitors.is_near",              "youbot.watched"),
    disconnect("Arm_Kinematics.tool_pose",      "Reporter.tool_pose"),
    disconnect("Link_Rx.ext_ref",               "Reporter.ext_ref"),
    disconnect("youbot.jointstate",             "Reporter.jointstate"),
    disconnect("youbot.odometry",               "Reporter.odometry"),
    disconnect("Cart_Impedance.f_des",          "Reporter.f_des"),
    disconnect("Cart_Impedance.f_raw_norm",     "Reporter.f_raw_norm"),
    disconnect("Cart_Impedance.active",         "Reporter.active"),
  }, function() return {
    disconnect("World.robot1_state",            "youbot.plant_state"),
    disconnect("youbot.plant_command",          "World.robot1_command"),
    disconnect("World.robot1_tool_pose",        "Operator.tool_pose"),
    disconnect("World.robot1_tool_twist",       "Operator.tool_twist"),
    disconnect("Operator.ext_force",            "World.robot1_ext_force"),
    disconnect("Link_Tx.tx",                    "Peer.rx"),
    disconnect("Peer.tx",                       "Link_Rx.rx"),
  } end)),

  destroy_all = Configuration(with_stand_in({
    destroy("youbot"), destroy("Arm_Kinematics"), destroy("Cart_Impedance"), destroy("Dynamics"), destroy("Base_Ctrl"),
    destroy("Link_Tx"), destroy("Link_Rx"),
    destroy("Monitors"), destroy("Operator"), destroy("Mode_Switch"), destroy("Reporter"),
  }, function() return {
    destroy("World"), destroy("Peer"),
  } end)),
}
