coupling = "second"
return rfsm.load("lead.lua")
