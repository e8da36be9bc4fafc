-- The coupling of two robots over UDP: each has an end of its own, and what one sends comes out at the other one.
--
-- `left_address`, `right_address`: of the two ends.
ConfiguratorConf {
  join = Configuration { description = "an end of the network at each robot",
    create("Udp_Left",  "youbot.Udp", { activity = "network", properties = { bind = left_address,  peer = right_address } }),
    create("Udp_Right", "youbot.Udp", { activity = "network", properties = { bind = right_address, peer = left_address } }),
    connect("left.tx",      "Udp_Left.rx",  { buffer = 64 }),
    connect("Udp_Left.tx",  "left.rx",      { buffer = 64 }),
    connect("right.tx",     "Udp_Right.rx", { buffer = 64 }),
    connect("Udp_Right.tx", "right.rx",     { buffer = 64 }),
    post_conf_state = { "Udp_Left:running", "Udp_Right:running" },
  },
}
