-- One robot is stopped while both go down: the other one goes on.  davit run examples/scenarios/one_stops.lua --clock simulated

deploy("../../deployments/youbot_coupling.yaml")
wait_state("left:copying", 20)
wait_state("right:copying", 20)

raise("e_shutdown")
wait_state("left:parking", 1)
wait_state("right:parking", 1)
wait(1)
local at = now()
inject("left/youbot", "overcurrent")
wait_answer("left/safe_hold.ok", 0.1)
expect{ name = "its drives brake after", value = 1000 * (now() - at), max = 1, unit = "ms" }

-- The right arm folds to the end, as if nothing had happened.
wait_answer("right/park.ok", 5)
expect{ name = "the other one has parked after", value = now() - at, max = 3.5, unit = "s" }
wait_state("right:idle", 2)

-- The left one rests where it was stopped, until somebody has looked and asks for the way down again.
wait_state("left:lowering.waiting", 0)
raise("left/e_reset")
wait_state("left:stranded.before_parking", 1)
raise("e_shutdown")
wait_answer("left/park.ok", 8)
wait_state("pair:idle", 5)
local components = 0
for _ in pairs(system().components) do components = components + 1 end
expect{ name = "left over: components", value = components, max = 0 }
