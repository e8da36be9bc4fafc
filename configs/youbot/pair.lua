-- The coupling of two robots: what each one sends, the other one hears.
ConfiguratorConf {
  join = Configuration { description = "the two links, one into the other",
    connect("left.tx",  "right.rx", { buffer = 64 }),
    connect("right.tx", "left.rx",  { buffer = 64 }),
  },
}
