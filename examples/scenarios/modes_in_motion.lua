-- The operators go from five degrees of freedom to eight while the hand sways the arm:
--   davit run examples/scenarios/modes_in_motion.lua --clock simulated
--
-- In five the arm is wherever the hand took it when the base begins to go after it. It begins at many moments of the hand's way,
-- after less and after more of five, asked by one robot and by both.

deploy("../../deployments/youbot_coupling.yaml")

local robots, sway = { "left", "right" }, param("sway", 0.04)
local signals = {}
for _, robot in ipairs(robots) do
  wait_state(robot .. ":eight_DOF_mode", 20)
  for i = 0, 4 do
    signals[robot .. " joint " .. i] = robot .. "/youbot.jointstate.vel[" .. i .. "]"
    signals[robot .. " torque " .. i] = robot .. "/youbot.jointstate.eff[" .. i .. "]"
  end
  signals[robot .. " active"] = robot .. "/Cart_Impedance.active"
end
for i = 0, 2 do signals["hand " .. i] = "left/Operator.ext_force[" .. i .. "]" end
set("left/Operator.script", ("sway 600 %g 0 0 0.15"):format(sway), { force = true, within = 1 })
wait(4)

-- The recording of one way to eight says more than one of all of them.
local joint, torque, copying, square, count = 0, 0, 1, 0, 0
local function measure(s)
  copying = math.min(copying, s:mean("left active"), s:mean("right active"))
  for _, robot in ipairs(robots) do
    for i = 0, 4 do
      joint = math.max(joint, s:max(robot .. " joint " .. i), -s:min(robot .. " joint " .. i))
      local v = s:values(robot .. " torque " .. i)
      for n = 2, #v do torque = math.max(torque, math.abs(v[n] - v[n - 1])) end
    end
  end
  local x, y, z = s:values("hand 0"), s:values("hand 1"), s:values("hand 2")
  for n = 1, #x do square, count = square + x[n]^2 + y[n]^2 + z[n]^2, count + 1 end
end

for _, who in ipairs{ { "right" }, { "left", "right" } } do
  for _, five in ipairs{ 2, 8, 9 } do
    for _, robot in ipairs(who) do raise(robot .. "/e_5dof") end
    wait(five)
    local s = sample{ every = 0.001, signals = signals }
    for _, robot in ipairs(who) do raise(robot .. "/e_8dof") end
    wait(3)
    s:stop()
    measure(s)
  end
end
expect{ name = "copying", value = 100 * copying, min = 100, unit = "%" }
expect{ name = "fastest joint", value = joint, max = 0.8, unit = "rad/s" }
expect{ name = "torque in 1 ms", value = torque, max = 0.5, unit = "N m" }
expect{ name = "hand, rms", value = math.sqrt(square / count), max = 8, unit = "N" }
for _, robot in ipairs(robots) do wait_state(robot .. ":eight_DOF_mode", 0) end
