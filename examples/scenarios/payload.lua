-- A tool takes something up that nobody told its controller of, is stopped with it, led down with it:
--   davit run examples/scenarios/payload.lua --clock simulated
--
-- 0.28 kg (0.5 kg with the gripper) at the left tool, while both copy: what carries it is friction, and through the coupling the other
-- robot.

local LOAD, EMPTY = 0.5, 0.219      -- at the tool, in kg

local function carry(mass) set("World.robot1_payload", mass, { force = true, within = 1 }) end
local signals = { active = "left/Cart_Impedance.active" }
for i, axis in ipairs{ "x", "y", "z" } do
  signals["p" .. axis] = "World.robot1_tool_pose.p[" .. i - 1 .. "]"
  signals["v" .. axis] = "World.robot1_tool_twist.v[" .. i - 1 .. "]"
  signals["f" .. axis] = "left/Cart_Impedance.f_des[" .. i - 1 .. "]"
end
for joint = 0, 4 do
  signals["t" .. joint] = "left/youbot.jointstate.eff[" .. joint .. "]"
  signals["q" .. joint] = "left/youbot.jointstate.vel[" .. joint .. "]"
end
-- What a second or more of it shows: the largest of each millisecond.
local function seen(name, seconds, during)
  local s, found = sample{ every = 0.001, name = name, signals = signals }, { speed = 0, joint = 0, torque = 0, force = 0 }
  if during then during() end
  wait(seconds)
  s:stop()
  local v = {}
  for signal in pairs(signals) do v[signal] = s:values(signal) end
  for i = 1, #v.pz do
    found.speed = math.max(found.speed, math.sqrt(v.vx[i]^2 + v.vy[i]^2 + v.vz[i]^2))
    found.force = math.max(found.force, math.sqrt(v.fx[i]^2 + v.fy[i]^2 + v.fz[i]^2))
    for joint = 0, 4 do
      found.joint = math.max(found.joint, math.abs(v["q" .. joint][i]))
      if i > 1 then found.torque = math.max(found.torque, math.abs(v["t" .. joint][i] - v["t" .. joint][i - 1])) end
    end
  end
  found.sunk = v.pz[1] - v.pz[#v.pz]
  found.copying = 100 * s:mean("active")
  return found
end

local MODES = { { event = "e_8dof", state = "eight_DOF_mode", name = "eight" }, { event = "e_5dof", state = "five_DOF_mode", name = "five" } }
for _, mode in ipairs(MODES) do
  deploy("../../deployments/youbot_coupling.yaml")
  for _, robot in ipairs{ "left", "right" } do wait_state(robot .. ":copying", 20) end
  for _, robot in ipairs{ "left", "right" } do raise(robot .. "/" .. mode.event) end
  for _, robot in ipairs{ "left", "right" } do wait_state(robot .. ":" .. mode.state, 0.1) end
  wait(1)
  local up = seen(mode.name .. "_taken_up", 4, function() carry(LOAD) end)
  figure{ name = mode.name .. ": taken up: sinks by", value = 1000 * up.sunk, unit = "mm" }
  expect{ name = mode.name .. ": taken up: the tool moves with", value = up.speed, max = 0.1, unit = "m/s" }
  expect{ name = mode.name .. ": taken up: torque in 1 ms", value = up.torque, max = 0.5, unit = "N m" }
  expect{ name = mode.name .. ": taken up: force", value = up.force, max = 10, unit = "N" }
  expect{ name = mode.name .. ": taken up: copying", value = up.copying, min = 100, unit = "%" }
  local stop = seen(mode.name .. "_stopped", 2, function() raise("left/e_estop") end)
  expect{ name = mode.name .. ": stopped: sinks by", value = 1000 * stop.sunk, max = 2, unit = "mm" }
  expect{ name = mode.name .. ": stopped: torque in 1 ms", value = stop.torque, max = 0.5, unit = "N m" }
  raise("left/e_reset")
  wait_state("left:operational", 1)
  local again = seen(mode.name .. "_again", 3)
  expect{ name = mode.name .. ": reset: the tool moves with", value = again.speed, max = 0.1, unit = "m/s" }
  local down = seen(mode.name .. "_put_down", 3, function() carry(EMPTY) end)
  expect{ name = mode.name .. ": put down: the tool moves with", value = down.speed, max = 0.1, unit = "m/s" }
  expect{ name = mode.name .. ": put down: torque in 1 ms", value = down.torque, max = 0.5, unit = "N m" }

  -- Led down with the load.
  carry(LOAD)
  wait(1)
  local parked = seen(mode.name .. "_parked", 6, function() raise("e_shutdown") wait_answer("left/park.ok", 12) end)
  expect{ name = mode.name .. ": parked with it: fastest joint", value = parked.joint, max = 1.571, unit = "rad/s" }
  shutdown()
end

-- What is stopped and too heavy for its drives sinks, whatever they give: that is told, and told again.
deploy("../../deployments/youbot_coupling.yaml")
for _, robot in ipairs{ "left", "right" } do wait_state(robot .. ":copying", 20) end
raise("left/e_estop")
wait(1)
local began = now()
local heavy = seen("too_heavy", 2, function() set("World.robot1_mass_scale", 2.0, { force = true, within = 1 }) end)
local told
for _, entry in ipairs(log{ since = began }) do
  if entry.event == "left/e_arm_gives_way" then told = told or entry.at - began end
end
figure{ name = "too heavy: sinks by", value = 1000 * heavy.sunk, unit = "mm" }
expect{ name = "too heavy: told after", value = told or 99, max = 1, unit = "s" }
expect{ name = "too heavy: torque in 1 ms", value = heavy.torque, max = 0.5, unit = "N m" }
set("World.robot1_mass_scale", 1.0, { force = true, within = 1 })
wait(1)
shutdown()
