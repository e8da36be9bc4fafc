-- Drives that cannot give what is asked of them:  davit run examples/scenarios/saturated.lua --clock simulated
--
-- The left robot's motors have the torques that its description allows, less than its controller believes (joint 2: 9.5 N m and not 13).
-- Both arms are led far out, one is held there, and the other one is pressed down: what has to carry the arm and pull it up again comes to
-- its limit, long before the tools are too far apart.

local WEAK = { 9.5, 9.5, 6.0, 2.0, 1.0 }

deploy("../../deployments/youbot_coupling.yaml")

local function hand(robot, script) set(robot .. "/Operator.script", script, { force = true, within = 1 }) end

wait_state("left:copying", 20)
wait_state("right:copying", 20)
for _, robot in ipairs{ "left", "right" } do
  raise(robot .. "/e_5dof")
  wait_state(robot .. ":five_DOF_mode", 0.1)
end
set("left/youbot.tau_max", WEAK, { force = true, within = 1 })
hand("left", "go 4 0.2 0 -0.05; hold 10")
wait(5)
local signals = { force = "left/Cart_Impedance.f_raw_norm", active = "left/Cart_Impedance.active" }
for joint = 0, 4 do
  signals["t" .. joint] = "left/youbot.jointstate.eff[" .. joint .. "]"
  signals["v" .. joint] = "left/youbot.jointstate.vel[" .. joint .. "]"
end
local s = sample{ every = 0.001, name = "saturated", signals = signals }
hand("right", "hold 600")
hand("left", "go 2 0 0 -0.08; hold 10")
wait_state("left:five_DOF_mode", 0)
wait_answer("left/e_torque_sat", 5)
local told = now()
wait_state("left:harmonizing", 0.01)
wait_answer("left/disable_copying.ok", 0.01)
local back = now()
wait(0.2)
wait_state("left:harmonizing", 0)
s:stop()

-- Since when a drive gave all that it had, without a break until that was told.
local v, since = {}, nil
for name in pairs(signals) do v[name] = s:values(name) end
local force, fastest = 0, 0
for i, t in ipairs(s:times()) do
  local full = false
  for joint = 0, 4 do
    full = full or math.abs(v["t" .. joint][i]) >= WEAK[joint + 1]
    fastest = math.max(fastest, math.abs(v["v" .. joint][i]))
  end
  if t <= told then
    force = math.max(force, v.force[i])
    since = full and (since or t) or nil
  end
end
expect{ name = "told after a drive was at its limit for", value = 1000 * (told - (since or told)), min = 490, max = 520, unit = "ms" }
expect{ name = "harmonizing, and not coupled, behind it", value = 1000 * (back - told), max = 5, unit = "ms" }
expect{ name = "the tools apart: N until then", value = force, max = 8, unit = "N" }
expect{ name = "fastest joint", value = fastest, max = 1.571, unit = "rad/s" }

-- With motors as strong as they are believed to be, and led back, they couple again.
undo("left/youbot.tau_max")
hand("right", "free 600")
hand("left", "align 4; go 4 -0.2 0 0.05; align 8; free 600")
wait_state("left:copying", 20)
wait_state("right:copying", 20)
wait(5)

-- The arm stretched out level, with 0.5 kg at its tool and masses of 1.1 times those believed: what carries it is joint 2, which comes to its limit.
shutdown()
deploy("../../deployments/youbot_coupling.yaml")
for _, robot in ipairs{ "left", "right" } do wait_state(robot .. ":copying", 20) end
for _, robot in ipairs{ "left", "right" } do
  raise(robot .. "/e_5dof")
  wait_state(robot .. ":five_DOF_mode", 0.1)
end
set("left/youbot.tau_max", WEAK, { force = true, within = 1 })
set("World.robot1_payload", 0.5, { force = true, within = 1 })
set("World.robot1_mass_scale", 1.1, { force = true, within = 1 })
hand("right", "free 600")
local s = sample{ every = 0.001, name = "level", signals = signals }
hand("left", "go 8 0.3 0 -0.03; hold 600")
wait_answer("left/e_torque_sat", 12)
told = now()
wait_state("left:harmonizing", 0.01)
wait_answer("left/disable_copying.ok", 0.01)
back = now()
wait(2)
s:stop()
local torque, fastest, times = s:values("t1"), 0, s:times()
local full, speeds = 0, {}
for joint = 0, 4 do table.insert(speeds, s:values("v" .. joint)) end
for i, t in ipairs(times) do
  if t > told - 0.49 and t <= told and math.abs(torque[i]) >= WEAK[2] - 0.01 then full = full + 1 end
  for joint = 1, 5 do fastest = math.max(fastest, math.abs(speeds[joint][i])) end
end
expect{ name = "level: joint 2 was at its limit in the half second before", value = 100 * full / 490, min = 99, unit = "%" }
expect{ name = "level: harmonizing, and not coupled, behind it", value = 1000 * (back - told), max = 5, unit = "ms" }
expect{ name = "level: fastest joint", value = fastest, max = 1.571, unit = "rad/s" }

-- The load is put down, and the motors are as strong as they are believed to be: so it is led down.
for _, changed in ipairs{ "World.robot1_mass_scale", "World.robot1_payload", "left/youbot.tau_max" } do undo(changed) end
wait(0.5)
