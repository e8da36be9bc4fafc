-- Down, while both robots copy:  davit run examples/scenarios/shutdown_while_copying.lua --clock simulated
--
-- They let go before anything else of the way down is done, and nothing is left: no component, no connection, no frame.

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
local orders = 0
for _, robot in ipairs{ "left", "right" } do
  local asked = {}
  for _, it in ipairs(log{ since = at }) do
    if it.what == "answered" and it.ask:find("^" .. robot .. "/") then table.insert(asked, it.ask) end
  end
  local place = {}
  for i, ask in ipairs(asked) do place[ask] = place[ask] or i end
  assert(place[robot .. "/disable_copying"] and place[robot .. "/base_stop"], "neither was asked for")
  if place[robot .. "/disable_copying"] > place[robot .. "/base_stop"] then orders = orders + 1 end
end
expect{ name = "stopped the base before they let go", value = orders, max = 0 }
-- A base rolls out with its lag of 0.1 s.
wait(0.6)
local s = sample{ every = 0.001, signals = { x = "left/youbot.odometry.vx", y = "left/youbot.odometry.vy" } }
for _, robot in ipairs{ "left", "right" } do wait_answer(robot .. "/park.ok", 8) end
s:stop()
local fastest = 0
for _, axis in ipairs{ "x", "y" } do fastest = math.max(fastest, math.abs(s:max(axis)), math.abs(s:min(axis))) end
expect{ name = "the base moves while it parks", value = fastest, max = 0.001, unit = "m/s" }
wait_state("pair:idle", 20)
figure{ name = "down after", value = now() - at, unit = "s" }
local components, connections = 0, 0
for _ in pairs(system().components) do components = components + 1 end
for _ in pairs(system().connections) do connections = connections + 1 end
expect{ name = "components left", value = components, max = 0 }
expect{ name = "connections left", value = connections, max = 0 }
expect{ name = "frames left", value = #stack(), max = 0 }
