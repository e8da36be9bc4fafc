-- The operators change between eight and five degrees of freedom at 5 Hz:  davit run examples/scenarios/modes.lua --clock simulated

deploy("../../deployments/youbot_coupling.yaml")

local signals = {}
for _, robot in ipairs{ "left", "right" } do
  wait_state(robot .. ":eight_DOF_mode", 20)
  for i = 0, 2 do signals[robot .. i] = robot .. "/Cart_Impedance.f_des[" .. i .. "]" end
  for i = 0, 4 do signals[robot .. "_torque" .. i] = robot .. "/youbot.jointstate.eff[" .. i .. "]" end
  signals[robot .. "_active"] = robot .. "/Cart_Impedance.active"
end
set("left/Operator.script", "sway 600 0.042 0.042 0 0.15", { force = true, within = 1 })
wait(5)
local s, mode = sample{ every = 0.001, name = "modes", signals = signals }, "e_8dof"
for _ = 1, 101 do
  mode = mode == "e_8dof" and "e_5dof" or "e_8dof"
  raise("left/" .. mode)
  raise("right/" .. mode)
  wait(0.1)
end
s:stop()
local force, torque = 0, 0
for name in pairs(signals) do
  local v = s:values(name)
  for i = 2, #v do
    local step = math.abs(v[i] - v[i - 1])
    if name:find("torque") then torque = math.max(torque, step) elseif not name:find("active") then force = math.max(force, step) end
  end
end
expect{ name = "force in 1 ms", value = force, max = 2, unit = "N" }
expect{ name = "torque in 1 ms", value = torque, max = 0.5, unit = "N m" }
expect{ name = "copying", value = 100 * math.min(s:mean("left_active"), s:mean("right_active")), min = 100, unit = "%" }
-- The last word was five.
for _, robot in ipairs{ "left", "right" } do
  wait_state(robot .. ":five_DOF_mode", 0)
  expect{ name = robot .. ": force_gain", value = property(robot .. "/Dynamics.force_gain")[1], max = 0 }
end
