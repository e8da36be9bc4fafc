-- The other robot's link begins anew while both copy:  davit run examples/scenarios/peer_restart.lua --clock simulated

deploy("../../deployments/youbot_coupling.yaml")
wait_state("left:copying", 20)
wait_state("right:copying", 20)
wait(1)
local at = now()
set("right/Link_Tx.epoch", 1, { force = true, within = 1 })
wait_answer("left/e_peer_left", 1)
expect{ name = "e_peer_left after", value = 1000 * (now() - at), max = 300, unit = "ms" }
wait_state("left:harmonizing", 0.1)
expect{ name = "let go after", value = 1000 * (now() - at), max = 300, unit = "ms" }
wait_state("left:copying", 10)
wait_state("right:copying", 10)
figure{ name = "coupled again after", value = now() - at, unit = "s" }
