-- Somebody pushes the left tool with 40 N for a whole second, and does not let go when the drives brake:
--   davit run examples/scenarios/push_on.lua --clock simulated
--
-- That is more than the arm's drives can hold, whoever commands them: what 40 N ask of each joint is told beside what its drive has. So it is
-- noticed and braked in time, and the arm gives way as long as it is pushed; then it rests at once.

local PUSHES = { { "+x", 40, 0, 0 }, { "-x", -40, 0, 0 }, { "+y", 0, 40, 0 }, { "-y", 0, -40, 0 }, { "up", 0, 0, 40 }, { "down", 0, 0, -40 } }

deploy("../../deployments/youbot_coupling.yaml")
local MOST = property("left/youbot.tau_max")
local worst = { noticed = 0, braked = 0, asked = math.huge, speed = 0, joint = 0, enough = 0, held = 0 }
for number, push in ipairs(PUSHES) do
  local name, force = push[1], { push[2], push[3], push[4] }
  -- Each from the beginning: what is pushed away far is no place to begin at.
  raise("e_start")     -- again, but for the first
  wait_state("left:copying", 20)
  wait_state("right:copying", 20)
  set("left/Operator.insists", true, { force = true, within = 1 })
  wait(1)
  -- The torque that a joint gives against the push: its column of the Jacobian.
  local asked = 0
  for joint = 1, 5 do
    local torque = 0
    for axis = 1, 3 do torque = torque + signal("left/Arm_Kinematics.jacobian[" .. 3 * (joint + 2) + axis - 1 .. "]") * force[axis] end
    asked = math.max(asked, math.abs(torque) / MOST[joint])
  end
  figure{ name = name .. ": asks of a drive, as a share of what it has", value = 100 * asked, unit = "%" }
  local signals = {}
  for i, axis in ipairs{ "x", "y", "z" } do
    signals["v" .. axis] = "World.robot1_tool_twist.v[" .. i - 1 .. "]"
    signals["p" .. axis] = "World.robot1_tool_pose.p[" .. i - 1 .. "]"
  end
  for joint = 0, 4 do signals["q" .. joint] = "left/youbot.jointstate.vel[" .. joint .. "]" end
  local s = sample{ every = 0.001, name = "push_" .. number, signals = signals }
  local at = now()
  set("left/Operator.script", ("push 1 %g %g %g; free 600"):format(table.unpack(force)), { force = true, within = 1 })
  wait_state("left:fault", 0.5)
  worst.noticed = math.max(worst.noticed, now() - at)
  wait_answer("left/safe_hold.ok", 0.1)
  worst.braked = math.max(worst.braked, now() - at)
  wait(at + 3 - now())
  s:stop()
  local v, way, joints = {}, 0, 0
  for signal in pairs(signals) do v[signal] = s:values(signal) end
  for i, t in ipairs(s:times()) do
    local speed = math.sqrt(v.vx[i]^2 + v.vy[i]^2 + v.vz[i]^2)
    worst.speed = math.max(worst.speed, speed)
    if t >= at + 1.3 then worst.held = math.max(worst.held, speed) end
    way = math.max(way, math.sqrt((v.px[i] - v.px[1])^2 + (v.py[i] - v.py[1])^2 + (v.pz[i] - v.pz[1])^2))
    for joint = 0, 4 do joints = math.max(joints, math.abs(v["q" .. joint][i])) end
  end
  worst.joint = math.max(worst.joint, joints)
  if asked < 1 then worst.enough = math.max(worst.enough, joints) end
  figure{ name = name .. ": way of the tool", value = way, unit = "m" }
  wait_state("left:fault", 0)
  raise("e_shutdown")
  wait_state("pair:idle", 25)
  assert(#stack() == 0, "something is left")
end
raise("e_start")
wait_state("left:operational", 10)
expect{ name = "noticed after", value = 1000 * worst.noticed, max = 100, unit = "ms" }
expect{ name = "braking after", value = 1000 * worst.braked, max = 100, unit = "ms" }
expect{ name = "0.3 s after the push the tool moves with", value = worst.held, max = 0.02, unit = "m/s" }
expect{ name = "where the drives have enough: fastest joint", value = worst.enough, min = 0.01, max = 1.571, unit = "rad/s" }
figure{ name = "meanwhile: the tool, at most", value = worst.speed, unit = "m/s" }
figure{ name = "meanwhile: a joint, at most", value = worst.joint, unit = "rad/s" }
