ConfiguratorConf {
  make = Configuration {
    create("Cart_Impedance", "youbot.Cart_Impedance"),
    post_conf_state = { "Cart_Impedance:running" },
  },
  copy = Configuration {
    port_write("Cart_Impedance.ext_ref_moed", true),            -- there is no such port
    property_set("Cart_Impedance.stiffness", "stiff"),          -- it is a number
    connect("Cart_Impedance.f_des", "Dynamics.f_ext"),          -- nothing creates that component
  },
}
