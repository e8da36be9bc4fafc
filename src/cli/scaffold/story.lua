-- What must be so, played in simulated time: `davit run story.lua --clock simulated`.
deploy("deployment.yaml")
assert(port("motor.speed") == 0.1)

raise("e_faster")
wait_state("fast", 1)
wait(0.1)
say("fast: " .. port("motor.speed") .. " m/s")

-- The first `brake` takes half a second, and an emergency comes meanwhile once more.
fault("operation_call motor.brake", "slow", 1, 0.5)
raise("e_stop")
wait(0.1)
raise("e_stop")
wait_state("stopped", 1)
wait(1)
say("stopped: " .. port("motor.speed") .. " m/s, " .. #stack() .. " frames in force")

shutdown()
