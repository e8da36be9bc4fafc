-- The driver dies while both robots copy (driver_dies.rs): what shows its drives to take torques is what it said last.

deploy("../../deployments/youbot_coupling.yaml")
wait_state("left:copying", 20)
wait_state("right:copying", 20)
set("left/Operator.script", "free 600", { force = true, within = 1 })
wait(1)
local at = now() + 0.01
inject("left/youbot", "panic", {}, at)
wait_answer("left/e_EC_TIMEOUT", 1)
expect{ name = "noticed after", value = 1000 * (now() - at), max = 50, unit = "ms" }
wait_state("left:fault", 0.01)
wait_state("right:harmonizing", 1)
expect{ name = "the other lets go after", value = 1000 * (now() - at), max = 500, unit = "ms" }
wait(0.5)

-- Whoever resets it learns at once that nothing has changed, and nothing couples meanwhile.
local up = sample{ every = 0.001, signals = { on = "left/Cart_Impedance.active" } }
raise("left/e_reset")
wait(2)
up:stop()
wait_state("left:fault", 0)
local couples = 0
for _, on in ipairs(up:values("on")) do couples = math.max(couples, on) end
expect{ name = "it couples again", value = couples, max = 0 }
