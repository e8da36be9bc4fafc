-- What the youBot's coordinator asks for, said for component types that are only declared: an arm with brakes on a cart.

ConfiguratorConf {
  create_core     = Configuration { create("arm", "Arm", { activity = "loop" }),
                                    create("cart", "Platform", { activity = "loop" }),
                                    create("follower", "Follower", { activity = "loop" }) },
  create_link     = Configuration { create("radio", "Radio", { activity = "slow" }) },
  create_monitors = Configuration { create("watch", "Watch", { activity = "slow" }) },

  connect_all = Configuration {
    connect("arm.state",       "follower.state"),
    connect("radio.partner",   "follower.partner"),
    connect("follower.torque", "arm.torque"),
    connect("follower.speed",  "cart.speed"),
    connect("radio.partner",   "watch.partner"),
    connect("follower.force",  "watch.force"),
    connect("arm.state",       "watch.state"),
  },

  load_properties = Configuration {
    property_set("arm.address", "192.0.2.7"),
    property_set("follower.spring", 150.0),
    property_set("radio.channel", 6),
    post_conf_state = { "_default:configured" },
  },

  start_driver  = Configuration { post_conf_state = { "arm:running" } },
  calibrate     = Configuration { operation_call("arm.home") },
  unfold        = Configuration { operation_call("arm.raise") },
  start_control = Configuration { post_conf_state = { "follower:running", "cart:running", "_default:running" } },
  take_over     = Configuration { operation_call("arm.release_brakes") },

  -- The coupling's switch.
  enable_copying  = Configuration { port_write("follower.follow", true) },
  disable_copying = Configuration { port_write("follower.follow", false) },
  eight_DOF       = Configuration { property_set("follower.cart_share", 0.5) },
  five_DOF        = Configuration { property_set("follower.cart_share", 0.0) },
  base_stop       = Configuration { operation_call("cart.halt") },

  safe_hold = Configuration { safe = true,
    port_write("follower.follow", false),
    property_set("follower.cart_share", 0.0),
    property_set("cart.enabled", false),
  },
  brake_again = Configuration { safe = true, group = "brake", port_write("follower.follow", false) },
  resume      = Configuration { operation_call("arm.acknowledge") },
  clear_faults       = Configuration { operation_call("arm.acknowledge") },
  restart_controller = Configuration { pre_conf_state  = { "follower:unconfigured" },
                                       post_conf_state = { "follower:running" } },

  hold           = Configuration { operation_call("arm.close_brakes") },
  park           = Configuration { operation_call("arm.lower") },
  stop_control   = Configuration { pre_conf_state = { "arm:running", "cart:stopped", "_default:stopped" } },
  stop_all       = Configuration { post_conf_state = { "arm:stopped" } },
  cleanup_all    = Configuration { post_conf_state = { "arm:unconfigured", "_default:unconfigured" } },
  disconnect_all = Configuration {
    disconnect("arm.state",       "follower.state"),
    disconnect("radio.partner",   "follower.partner"),
    disconnect("follower.torque", "arm.torque"),
    disconnect("follower.speed",  "cart.speed"),
    disconnect("radio.partner",   "watch.partner"),
    disconnect("follower.force",  "watch.force"),
    disconnect("arm.state",       "watch.state"),
  },
  destroy_all = Configuration { destroy("arm"), destroy("cart"), destroy("follower"), destroy("radio"), destroy("watch") },
}
