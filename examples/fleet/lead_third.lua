coupling = "third"
return rfsm.load("lead.lua")
