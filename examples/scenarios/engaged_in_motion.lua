-- The hand sways the arm already when the robots find each other:  davit run examples/scenarios/engaged_in_motion.lua --clock simulated
--
-- Both engage with eight degrees of freedom while the tool is centimetres off its nominal place; the base leads it back gently.

deploy("../../deployments/youbot_coupling.yaml")
set("left/Operator.script", "sway 600 0.042 0.042 0 0.15", { force = true, within = 1 })
wait_state("left:copying", 20)
wait_state("right:copying", 20)

local signals = { active = "left/Cart_Impedance.active" }
for joint = 0, 4 do signals["joint " .. joint] = "left/youbot.jointstate.vel[" .. joint .. "]" end
for i = 0, 2 do signals["hand " .. i] = "left/Operator.ext_force[" .. i .. "]" end
local s = sample{ every = 0.001, signals = signals }
wait(20)
s:stop()
expect{ name = "time in copying", value = 100 * s:mean("active"), min = 100, unit = "%" }
local fastest = 0
for joint = 0, 4 do fastest = math.max(fastest, s:max("joint " .. joint), -s:min("joint " .. joint)) end
expect{ name = "fastest joint", value = fastest, max = 0.8, unit = "rad/s" }
local x, y, z, sum = s:values("hand 0"), s:values("hand 1"), s:values("hand 2"), 0
for i = 1, #x do sum = sum + x[i]^2 + y[i]^2 + z[i]^2 end
expect{ name = "hand, rms", value = math.sqrt(sum / #x), max = 8, unit = "N" }
wait_state("left:copying.eight_DOF_mode", 0)
