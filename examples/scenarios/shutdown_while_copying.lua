-- Down, while both robots copy:  davit run examples/scenarios/shutdown_while_copying.lua --clock simulated
--
-- They let go before they park, and nothing is left: no component, no connection, no frame.

deploy("../../deployments/youbot_coupling.yaml")
wait_state("left:copying", 20)
wait_state("right:copying", 20)
set("left/Operator.script", "sway 600 0.042 0.042 0 0.15", { force = true, within = 1 })
wait(5)
local at = now()
raise("e_shutdown")
for _, robot in ipairs{ "left", "right" } do
  wait_state(robot .. ":parking", 0.5)
  expect{ name = robot .. ": still wants to couple while it parks", value = port(robot .. "/Cart_Impedance.ext_ref_mode") and 1 or 0, max = 0 }
end
local s = sample{ every = 0.001, signals = { x = "left/youbot.odometry.vx", y = "left/youbot.odometry.vy" } }
wait(0.5)
expect{ name = "the base moves while it parks", value = math.max(math.abs(s:last("x")), math.abs(s:last("y"))), max = 0.001, unit = "m/s" }
wait_state("pair:idle", 20)
figure{ name = "down after", value = now() - at, unit = "s" }
local components, connections = 0, 0
for _ in pairs(system().components) do components = components + 1 end
for _ in pairs(system().connections) do connections = connections + 1 end
expect{ name = "components left", value = components, max = 0 }
expect{ name = "connections left", value = connections, max = 0 }
expect{ name = "frames left", value = #stack(), max = 0 }
