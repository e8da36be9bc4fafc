robot = "left"
return rfsm.load("place.lua")
