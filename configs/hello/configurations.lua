ConfiguratorConf {
  build = Configuration {
    create("sine",  "standard.Sine",       { activity = "loop", properties = { amplitude = 1.0, frequency = 0.5 } }),
    create("gain",  "standard.Gain",       { activity = "loop" }),
    create("limit", "standard.Saturation", { activity = "loop" }),
    connect("sine.y", "gain.u"),
    connect("gain.y", "limit.u"),
  },
  run   = Configuration { post_conf_state = { "_default:running" } },

  -- Alternatives: applying one replaces the other.
  quiet = Configuration { group = "volume", property_set("gain.k", 0.5) },
  loud  = Configuration { group = "volume", property_set("gain.k", 2.0) },
}
