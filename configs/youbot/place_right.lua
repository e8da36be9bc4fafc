robot = "right"
return rfsm.load("place.lua")
