coupling = "fourth"
return rfsm.load("lead.lua")
