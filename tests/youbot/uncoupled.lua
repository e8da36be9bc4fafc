-- One write that ends the coupling fails, is lost or late while `copying` is left (tests/cli/uncoupled.rs): the robot brakes, and what leads on from
-- there does not bring the coupling back, neither the reset nor the way down. `arm`: its deployment; `port`: what commands the coupling; `stop`: an
-- emergency interrupts it, so long after it began.
local port_name = param("port", "follower.follow")
local how = param("how", "fail")
deploy("../../deployments/" .. param("arm", "generic_arm") .. ".yaml")
raise("e_qos_ok") wait(0.01)
raise("e_aligned") wait(0.5)
expect{ name = "coupled in copying", value = port(port_name) and 1 or 0, min = 1 }
fault("port_write " .. port_name, how, 1, how == "slow" and 1.5 or nil)
raise(param("event", "e_link_lost"))
local stop = param("stop", 0)
if stop > 0 then wait(stop) raise("e_estop") end
-- What was told to be done, and was not, is seen after 5 s.
wait(how == "lie" and 6 or 3)
wait_state("fault.waiting", 0)
local ever = 0
local function watched(seconds)
  for _ = 1, seconds * 100 do
    local there, follows = pcall(port, port_name)     -- until it is taken away
    if there and follows then ever = ever + 1 end
    wait(0.01)
  end
end
if param("on", "e_reset") == "e_reset" then
  if how == "lie" then raise("e_reset") wait(6) end
  raise("e_reset") watched(1)
  wait_state("operational.unsync", 0)
  raise("e_shutdown")
else
  raise("e_shutdown")
end
watched(2)
expect{ name = "times seen coupled since", value = ever, max = 0 }
expect{ name = "differences", value = #drift(), max = 0 }
