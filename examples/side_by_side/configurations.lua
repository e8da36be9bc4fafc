ConfiguratorConf {
  arm_base = Configuration { create("Arm", "Joints"), post_conf_state = { "Arm:running" } },
  arm_slow = Configuration { property_set("Arm.speed", 0.1) },
  gripper_base = Configuration { create("Gripper", "Fingers"), post_conf_state = { "Gripper:running" } },
  gripper_hold = Configuration { property_set("Gripper.force", 20.0) },
}
