ConfiguratorConf {
   disable_copying = Configuration{
       port_write("Cart_Impedance.ext_ref_mode", false)
   },
   
   enable_copying = Configuration {
       port_write("Cart_Impedance.ext_ref_mode", true)
   },

   eight_DOF = Configuration {
      property_set("Dynamics.force_gain", {0.1, 0.1, 0.1})
   },

   five_DOF = Configuration {
      property_set("Dynamics.force_gain", {0, 0, 0})
   },
}
