robot, body = "left", "robot1"
return rfsm.load("place.lua")
