-- The networks between two robots, as configs/youbot/pair.lua has them, and what counts the energy that the coupling takes in and gives out at
-- both tools, the networks between them included.
ConfiguratorConf {
  join = Configuration {
    create("To_Right", "youbot.Net", { activity = "network" }),
    create("To_Left",  "youbot.Net", { activity = "network" }),
    create("Observer", "youbot.Passivity_Observer", { activity = "network" }),
    property_set("To_Right.delay", delay_s),
    property_set("To_Left.delay",  delay_s),
    property_set("To_Left.seed",   2),
    connect("left.tx",         "To_Right.rx", { buffer = 64 }),
    connect("To_Right.tx",     "right.rx",    { buffer = 64 }),
    connect("right.tx",        "To_Left.rx",  { buffer = 64 }),
    connect("To_Left.tx",      "left.rx",     { buffer = 64 }),
    connect("left.force",      "Observer.left_force"),
    connect("left.tool_pose",  "Observer.left_tool_pose"),
    connect("left.engaged",    "Observer.left_engaged"),
    connect("right.force",     "Observer.right_force"),
    connect("right.tool_pose", "Observer.right_tool_pose"),
    connect("right.engaged",   "Observer.right_engaged"),
    post_conf_state = { "To_Right:running", "To_Left:running", "Observer:running" },
  },
}
