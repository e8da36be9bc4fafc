-- What can be applied, by name: as a whole or not at all, and taken back by NAME.undo. In which order its changes are done is
-- not written: it follows from what they are.
return ConfiguratorConf {
  build = Configuration {
    create("motor", "Motor"),
  },
  -- Run states that must hold before and after; what leads from one to the other is found.
  run = Configuration {
    pre_conf_state = { "motor:stopped" },
    post_conf_state = { "motor:running" },
  },
  -- Of a group one is in force at a time: the next takes the place of the one before.
  slow = Configuration { group = "speed",
    port_write("motor.speed", 0.1),
  },
  fast = Configuration { group = "speed",
    port_write("motor.speed", 0.4),
  },
  -- What is safe is applied at once, as far as it goes, whatever else is being done.
  stop = Configuration { safe = true, group = "speed",
    port_write("motor.speed", 0.0),
    operation_call("motor.brake"),
  },
}
