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
