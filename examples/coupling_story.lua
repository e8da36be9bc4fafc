-- The coupling of two robots, in simulated time:  davit run examples/coupling_story.lua --clock simulated
--
-- Both come up side by side and find each other; their hands bring the arms together; both engage. One hand leads, the other robot
-- follows: eight degrees of freedom, then five. The network is cut, and both let go; it heals, and they couple again. An emergency stop is for
-- both; then all of it goes down to nothing.
--   --set delay=0.02    one way, in s

deploy("../deployments/youbot_coupling.yaml")
local up = now()
wait_state("left:harmonizing", 5)
wait_state("right:harmonizing", 5)

wait_state("left:copying", 20)
wait_state("right:copying", 20)
set("To_Right.delay", param("delay", 0.005), { within = 1, force = true })
set("To_Left.delay",  param("delay", 0.005), { within = 1, force = true })
wait(5)

-- How far the other tool is from the one that leads, while both couple.
local function act(mode, seconds)
  local s = sample{ every = 0.01, name = mode, signals = {
    ahead = "left/Arm_Kinematics.tool_pose.p[0]", behind = "right/Arm_Kinematics.tool_pose.p[0]",
    force = "left/Cart_Impedance.f_raw_norm", engaged = "right/Cart_Impedance.engaged" } }
  wait(seconds)
  s:stop()
  local sum, n = 0, s:count("ahead")
  local a, b = s:values("ahead"), s:values("behind")
  for i = 1, math.min(#a, #b) do sum = sum + (a[i] - b[i])^2 end
  expect{ name = mode .. ": other tool behind, rms", value = math.sqrt(sum / n), max = 0.025, unit = "m" }
  expect{ name = mode .. ": led by", value = s:max("ahead") - s:min("ahead"), min = 0.03, unit = "m" }
  expect{ name = mode .. ": force, rms", value = s:rms("force"), max = 8, unit = "N" }
  expect{ name = mode .. ": engaged, least", value = s:min("engaged"), min = 0.99 }
end

figure{ name = "both up", value = up, unit = "s" }
act("eight", 14)

raise("left/e_5dof")
raise("right/e_5dof")
wait_state("left:five_DOF_mode", 0.01)
wait_state("right:five_DOF_mode", 0.01)
act("five", 14)

-- What each does when nothing of the other one comes any more.
local cut = now()
set("To_Right.cut", true, { within = 1, force = true })
set("To_Left.cut",  true, { within = 1, force = true })
wait_state("left:unsync", 0.5)
wait_state("right:unsync", 0.5)
expect{ name = "cut: both have let go after", value = now() - cut, max = 0.16, unit = "s" }
wait(0.2)
expect{ name = "cut: force", value = signal("left/Cart_Impedance.f_raw_norm") and math.abs(signal("left/Cart_Impedance.f_des")[1]) or 0, max = 0.1, unit = "N" }
undo("To_Right.cut")
undo("To_Left.cut")
wait_state("left:five_DOF_mode", 20)
wait_state("right:five_DOF_mode", 20)

raise("e_estop")
wait_state("left:fault", 0.01)
wait_state("right:fault", 0.01)
wait(0.5)                               -- braked
raise("left/e_reset")
raise("right/e_reset")
wait_state("left:operational", 5)
wait_state("right:operational", 5)
shutdown()
