-- A joint comes near the end of its range while both robots copy:  davit run examples/scenarios/soft_limit.lua --clock simulated
--
-- With five degrees of freedom the hand leads the left tool in towards its base, until a joint has used up most of its range. The robot lets go
-- and says so, nothing couples as long as the hand holds it there, and led back they copy again.

local EXCEEDED = "left/e_JNT_SOFT_LIMIT_EXEEDED"

deploy("../../deployments/youbot_coupling.yaml")
local function hand(robot, script) set(robot .. "/Operator.script", script, { force = true, within = 1 }) end
for _, robot in ipairs{ "left", "right" } do wait_state(robot .. ":copying", 20) end
for _, robot in ipairs{ "left", "right" } do
  raise(robot .. "/e_5dof")
  wait_state(robot .. ":five_DOF_mode", 0.1)
end
wait(1)
local signals = {}
for joint = 0, 4 do
  signals["t" .. joint] = "left/youbot.jointstate.eff[" .. joint .. "]"
  signals["v" .. joint] = "left/youbot.jointstate.vel[" .. joint .. "]"
end
local s = sample{ every = 0.001, name = "soft_limit", signals = signals }
hand("right", "free 600")
hand("left", "go 4 -0.15 0 0; hold 600")
wait_answer(EXCEEDED, 5)
local told = now()
wait_state("left:harmonizing", 0.01)
wait_answer("left/disable_copying.ok", 0.01)
expect{ name = "harmonizing, and not coupled, behind it", value = 1000 * (now() - told), max = 5, unit = "ms" }
wait_state("right:harmonizing", 0.5)
expect{ name = "the other one has let go after", value = 1000 * (now() - told), max = 300, unit = "ms" }
wait(4)
wait_state("left:harmonizing", 0)
wait_state("right:harmonizing", 0)

hand("left", "align 8; free 600")
wait_answer(EXCEEDED .. "_EXIT", 5)
wait_state("left:copying", 10)
wait_state("right:copying", 10)
wait(2)
wait_state("left:copying", 0)
s:stop()
local torque, speed = 0, 0
for joint = 0, 4 do
  local t, v = s:values("t" .. joint), s:values("v" .. joint)
  for i = 2, #t do
    torque, speed = math.max(torque, math.abs(t[i] - t[i - 1])), math.max(speed, math.abs(v[i]))
  end
end
expect{ name = "torque in 1 ms", value = torque, max = 0.5, unit = "N m" }
expect{ name = "fastest joint", value = speed, max = 1.571, unit = "rad/s" }
