-- Somebody pushes the left tool with 40 N, along each axis, edge and diagonal of a cube, while both robots copy:
--   davit run examples/scenarios/push.lua --clock simulated
--
-- The robot notices, brakes, and holds. The other one lets go. The hand of the simulation lets go when the drives brake.

local PUSHES = {}
for x = -1, 1 do
  for y = -1, 1 do
    for z = -1, 1 do
      local length = math.sqrt(x^2 + y^2 + z^2)
      if length > 0 then table.insert(PUSHES, { name = x .. " " .. y .. " " .. z, x = 40 * x / length, y = 40 * y / length, z = 40 * z / length }) end
    end
  end
end

deploy("../../deployments/youbot_coupling.yaml")

-- A drive that gives all that it has is pushed along all the same: joint 4 has 3 N m.
local MOST = property("left/youbot.tau_max")

local worst = { held = 0, noticed = 0, rest = 0, joint = 0, way = 0, step = 0, other = 0 }
for number, push in ipairs(PUSHES) do
  set("left/Operator.script", "align 8; free 600", { force = true, within = 1 })
  wait_state("left:copying", 20)
  wait_state("right:copying", 20)
  wait(1)
  local signals = {}
  for i, axis in ipairs{ "x", "y", "z" } do
    signals["v" .. axis] = "World.robot1_tool_twist.v[" .. i - 1 .. "]"
    signals["p" .. axis] = "World.robot1_tool_pose.p[" .. i - 1 .. "]"
  end
  for joint = 0, 4 do
    signals["q" .. joint] = "left/youbot.jointstate.vel[" .. joint .. "]"
    signals["t" .. joint] = "left/youbot.jointstate.eff[" .. joint .. "]"
  end
  local s = sample{ every = 0.001, name = "push_" .. number, signals = signals }
  wait(0.01)
  local at = now()
  set("left/Operator.script", string.format("push 1 %.2f %.2f %.2f", push.x, push.y, push.z), { force = true, within = 1 })
  wait_state("left:fault", 0.5)
  local fault = now()
  wait_state("right:harmonizing", 1)
  worst.other = math.max(worst.other, now() - at)
  wait(2)
  s:stop()
  local v, times = {}, s:times()
  for name in pairs(signals) do v[name] = s:values(name) end
  local way, rest = 0, 0
  for i, t in ipairs(times) do
    if t >= fault + 0.3 then rest = math.max(rest, math.sqrt(v.vx[i]^2 + v.vy[i]^2 + v.vz[i]^2)) end
    way = math.max(way, math.sqrt((v.px[i] - v.px[1])^2 + (v.py[i] - v.py[1])^2 + (v.pz[i] - v.pz[1])^2))
    for joint = 0, 4 do
      local speed = math.abs(v["q" .. joint][i])
      worst.joint = math.max(worst.joint, speed)
      -- All that it has, now or 2 ms before.
      local full = false
      for k = math.max(1, i - 2), i do full = full or math.abs(v["t" .. joint][k]) >= MOST[joint + 1] - 0.01 end
      if not full then worst.held = math.max(worst.held, speed) end
      if i > 1 then worst.step = math.max(worst.step, math.abs(v["t" .. joint][i] - v["t" .. joint][i - 1])) end
    end
  end
  figure{ name = push.name .. ": noticed after", value = fault - at, unit = "s" }
  figure{ name = push.name .. ": way of the tool", value = way, unit = "m" }
  worst.noticed, worst.way, worst.rest = math.max(worst.noticed, fault - at), math.max(worst.way, way), math.max(worst.rest, rest)
  raise("left/e_reset")
  wait_state("left:operational", 1)
end
expect{ name = "noticed after", value = 1000 * worst.noticed, max = 100, unit = "ms" }
expect{ name = "0.3 s later the tool moves with", value = worst.rest, max = 0.02, unit = "m/s" }
expect{ name = "way of the tool", value = worst.way, max = 0.2, unit = "m" }
expect{ name = "fastest joint whose drive had torque left", value = worst.held, max = 1.571, unit = "rad/s" }
expect{ name = "fastest joint", value = worst.joint, max = 1.571, unit = "rad/s" }
expect{ name = "torque in 1 ms", value = worst.step, max = 0.5, unit = "N m" }
expect{ name = "the other robot has let go after", value = worst.other, max = 0.8, unit = "s" }
