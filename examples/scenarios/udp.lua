-- Both robots over sockets:  davit run examples/scenarios/udp.lua --clock simulated   (with `--clock real` as on two machines)

deploy("../udp/coupling.yaml")
wait_state("left:copying", 20)
wait_state("right:copying", 20)
wait(8)                                 -- until the left hand leads

local before = signal("Udp_Right.counts.received")
local s = sample{ every = 0.01, signals = {
  ahead = "left/Arm_Kinematics.tool_pose.p[0]", behind = "right/Arm_Kinematics.tool_pose.p[0]", engaged = "right/Cart_Impedance.engaged" } }
wait(14)
s:stop()
local received = signal("Udp_Right.counts.received") - before
local a, b, sum = s:values("ahead"), s:values("behind"), 0
for i = 1, math.min(#a, #b) do sum = sum + (a[i] - b[i])^2 end
expect{ name = "packets received in 14 s", value = received, min = 3490, max = 3510 }
expect{ name = "led by", value = 1000 * (s:max("ahead") - s:min("ahead")), min = 30, unit = "mm" }
expect{ name = "other tool behind, rms", value = 1000 * math.sqrt(sum / s:count("ahead")), max = 25, unit = "mm" }
expect{ name = "engaged, least", value = s:min("engaged"), min = 0.99 }

-- The right robot's end says nothing, and hears nothing, for half a second.
local cut = now()
inject("Udp_Right", "stall", { seconds = 0.5 })
wait_state("left:unsync", 0.4)
wait_state("right:unsync", 0.4)
expect{ name = "cut: both have let go after", value = 1000 * (now() - cut), max = 160, unit = "ms" }
wait_state("left:copying", 20)
wait_state("right:copying", 20)
expect{ name = "datagrams that were no packets", value = signal("Udp_Right.counts.refused") + signal("Udp_Left.counts.refused"), max = 0 }
shutdown()
