-- An operation does not come back while the coordinators go on:  davit run examples/scenarios/hang.lua --clock simulated
--
-- The left base's controller hangs for 0.8 s, and in that time a stop of the base is asked for. The emergency stop is heard meanwhile, and so is, another
-- time, the event that ends it all.

deploy("../../deployments/youbot_coupling.yaml")
wait_state("left:copying", 20)
wait_state("right:copying", 20)

-- A reference that is 30 cm away stops the base: that call is out when this comes back, which is when.
local function hung()
  local at = now() + 0.002
  inject("left/Base_Ctrl", "stall", { seconds = 0.8 }, at)
  wait(0.005)
  set("left/Cart_Impedance.offset", { 0.3, 0, 0 }, { force = true, within = 1 })
  wait_state("left:soft_stop", 0.02)
  wait(0.005)
  return at + 0.8
end

local returns = hung()
local asked = now()
raise("e_estop")
for _, robot in ipairs{ "left", "right" } do
  wait_state(robot .. ":fault", 0.1)
  wait_answer(robot .. "/safe_hold.ok", 0.1)
end
expect{ name = "both brake after", value = 1000 * (now() - asked), max = 1, unit = "ms" }
expect{ name = "while the call has not come back for", value = returns - now(), min = 0.5, unit = "s" }
wait(2)
undo("left/Cart_Impedance.offset")
raise("left/e_reset")
raise("right/e_reset")
wait_state("left:operational", 1)
wait_state("left:copying", 20)
wait_state("right:copying", 20)

wait(1)
returns = hung()
asked = now()
raise("e_shutdown")
for _, robot in ipairs{ "left", "right" } do wait_state(robot .. ":shutting_down", 0.1) end
expect{ name = "both are being led down after", value = 1000 * (now() - asked), max = 1, unit = "ms" }
expect{ name = "while that call has not come back for", value = returns - now(), min = 0.5, unit = "s" }
-- A control loop that hangs brakes its robot, on the way down too: what becomes of it people decide. The other one waits for nothing of that.
wait_state("left:lowering.waiting", 0.1)
expect{ name = "the left one brakes after", value = 1000 * (now() - asked), max = 50, unit = "ms" }
wait_state("right:idle", 10)
expect{ name = "the right one is down after", value = now() - asked, max = 5, unit = "s" }
undo("left/Cart_Impedance.offset")
