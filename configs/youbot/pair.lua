-- The coupling of two robots: what each one sends goes to the other one, through a network in each direction.
--
-- `delay_s`: one way, in s.
ConfiguratorConf {
  join = Configuration { description = "both networks, from link to link",
    create("To_Right", "youbot.Net", { activity = "network" }),
    create("To_Left",  "youbot.Net", { activity = "network" }),
    property_set("To_Right.delay", delay_s),
    property_set("To_Left.delay",  delay_s),
    property_set("To_Left.seed",   2),
    connect("left.tx",     "To_Right.rx", { buffer = 64 }),
    connect("To_Right.tx", "right.rx",    { buffer = 64 }),
    connect("right.tx",    "To_Left.rx",  { buffer = 64 }),
    connect("To_Left.tx",  "left.rx",     { buffer = 64 }),
    post_conf_state = { "To_Right:running", "To_Left:running" },
  },
}
