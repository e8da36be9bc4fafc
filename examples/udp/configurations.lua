-- The coupling of two robots over UDP: each has an end of its own, and what one sends comes out at the other one. One world that both are in,
-- as configs/youbot/pair.lua has it.
--
-- `left_address`, `right_address`: of the two ends.
ConfiguratorConf {
  make = Configuration { description = "the world, and an end of the network for each robot",
    create("World",     "youbot.World", { activity = "world" }),
    create("Udp_Left",  "youbot.Udp", { activity = "network", properties = { bind = left_address,  peer = right_address } }),
    create("Udp_Right", "youbot.Udp", { activity = "network", properties = { bind = right_address, peer = left_address } }),
    property_set("World.robot1_q_start", { 0.0, -1.1257, 2.5395, -1.7802, 0.0 }),
    property_set("World.robot2_q_start", { 0.0, -1.1257, 2.5395, -1.7802, 0.0 }),
    post_conf_state = { "World:running", "Udp_Left:running", "Udp_Right:running" },
  },

  place_left = Configuration {
    connect("World.robot1_state",      "left.arm_state"),
    connect("left.arm_command",        "World.robot1_command"),
    connect("World.robot1_tool_pose",  "left.hand_pose"),
    connect("World.robot1_tool_twist", "left.hand_twist"),
    connect("left.hand_force",         "World.robot1_ext_force"),
    connect("left.tx",                 "Udp_Left.rx", { buffer = 64 }),
    connect("Udp_Left.tx",             "left.rx",     { buffer = 64 }),
  },
  place_right = Configuration {
    connect("World.robot2_state",      "right.arm_state"),
    connect("right.arm_command",       "World.robot2_command"),
    connect("World.robot2_tool_pose",  "right.hand_pose"),
    connect("World.robot2_tool_twist", "right.hand_twist"),
    connect("right.hand_force",        "World.robot2_ext_force"),
    connect("right.tx",                "Udp_Right.rx", { buffer = 64 }),
    connect("Udp_Right.tx",            "right.rx",     { buffer = 64 }),
  },
}
