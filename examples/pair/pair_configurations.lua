ConfiguratorConf {
  join = Configuration { connect("left.pose", "right.ref"), connect("right.pose", "left.ref") },
}
