Configuration {
    pre_conf_state = { 'compA:running', 'compB:configure',
                       '_default:stopped' },
  
    post_conf_state = { _default='running' },
    
    property_set("compA.prop1", { 2.3, 3.4, 5.34 } ),
    port_write("compB.portX", 33.4),
    operation_call("compG.op1", arg1, arg2,...),
}
