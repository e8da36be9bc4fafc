ConfiguratorConf {
  make = Configuration {
    create("Drive", "Drive"),
    property_set("Drive.gain", gain),
    post_conf_state = { "Drive:stopped" },
  },
  run = Configuration { post_conf_state = { "Drive:running" } },
}
