coupling = "first"
return rfsm.load("lead.lua")
