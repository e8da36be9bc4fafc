-- The coupling of two robots: one world that both are in, and a network in each direction. What each one sends goes to the other one. What
-- the coupling takes in and gives out at both tools, the networks between them included, is counted.
--
-- `delay_s`: one way, in s.
ConfiguratorConf {
  make = Configuration { description = "the world, a network in each direction, and who counts energy",
    create("World",    "youbot.World", { activity = "world" }),          -- arms, bases, and what they touch
    create("To_Right", "youbot.Net",   { activity = "network" }),
    create("To_Left",  "youbot.Net",   { activity = "network" }),
    create("Observer", "youbot.Passivity_Observer", { activity = "network" }),
    property_set("World.robot1_q_start", { 0.0, -1.1257, 2.5395, -1.7802, 0.0 }),
    property_set("World.robot2_q_start", { 0.0, -1.1257, 2.5395, -1.7802, 0.0 }),
    property_set("To_Right.delay", delay_s),
    property_set("To_Left.delay",  delay_s),
    property_set("To_Left.seed",   2),
    post_conf_state = { "World:running", "To_Right:running", "To_Left:running", "Observer:running" },
  },

  -- A robot is there from the moment when its components are built until it wants to take them away.
  place_left = Configuration { description = "the left robot into the world, and its link to the networks",
    connect("World.robot1_state",      "left.arm_state"),
    connect("left.arm_command",        "World.robot1_command"),
    connect("World.robot1_tool_pose",  "left.hand_pose"),
    connect("World.robot1_tool_twist", "left.hand_twist"),
    connect("left.hand_force",         "World.robot1_ext_force"),
    connect("left.tx",                 "To_Right.rx", { buffer = 64 }),
    connect("To_Left.tx",              "left.rx",     { buffer = 64 }),
    connect("left.force",              "Observer.left_force"),
    connect("left.tool_pose",          "Observer.left_tool_pose"),
    connect("left.engaged",            "Observer.left_engaged"),
  },
  place_right = Configuration { description = "the right robot into the world, and its link to the networks",
    connect("World.robot2_state",      "right.arm_state"),
    connect("right.arm_command",       "World.robot2_command"),
    connect("World.robot2_tool_pose",  "right.hand_pose"),
    connect("World.robot2_tool_twist", "right.hand_twist"),
    connect("right.hand_force",        "World.robot2_ext_force"),
    connect("right.tx",                "To_Left.rx",  { buffer = 64 }),
    connect("To_Right.tx",             "right.rx",    { buffer = 64 }),
    connect("right.force",             "Observer.right_force"),
    connect("right.tool_pose",         "Observer.right_tool_pose"),
    connect("right.engaged",           "Observer.right_engaged"),
  },
}
