robot, body = "right", "robot2"
return rfsm.load("place.lua")
