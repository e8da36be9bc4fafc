-- The configurator's own end, in the middle of a switch:  davit run examples/scenarios/configurator.lua --clock simulated
--
-- Its thread panics while a call of the left robot is under way. What was asked for is answered *broken*, and the thread begins anew with what the
-- platform shows. The robot whose switch it was is stopped; the other one lets go of it and goes on. Then the same while both arms unfold.

deploy("../../deployments/youbot_coupling.yaml")
wait_state("left:copying", 20)
wait_state("right:copying", 20)
set("left/Operator.script", "free 600", { force = true, within = 1 })
wait(1)

-- The base's controller takes 30 ms to stand, and 10 ms of them are over.
inject("left/Base_Ctrl", "stall", { seconds = 0.03 }, now() + 0.002)
wait(0.005)
set("left/Cart_Impedance.offset", { 0.3, 0, 0 }, { force = true, within = 1 })
wait_state("left:soft_stop", 0.02)
local at = now() + 0.005
inject("configurator", "panic", {}, at)
wait_answer("left/base_stop.broken", 0.1)
expect{ name = "answered after", value = 1000 * (now() - at), max = 1, unit = "ms" }
wait_state("left:fault", 0.001)
wait_answer("left/safe_hold.ok", 0.1)
expect{ name = "braked after", value = 1000 * (now() - at), max = 50, unit = "ms" }
local s = sample{ every = 0.001, signals = {
  x = "World.robot1_tool_twist.v[0]", y = "World.robot1_tool_twist.v[1]", z = "World.robot1_tool_twist.v[2]" } }
wait(1)
s:stop()
local x, y, z, rest = s:values("x"), s:values("y"), s:values("z"), 0
for i, t in ipairs(s:times()) do if t >= at + 0.35 then rest = math.max(rest, math.sqrt(x[i]^2 + y[i]^2 + z[i]^2)) end end
expect{ name = "0.35 s later the tool moves with", value = rest, max = 0.02, unit = "m/s" }
wait_state("left:fault", 0)
wait_state("right:harmonizing", 0)
expect{ name = "differs from what should be", value = #drift(), max = 0 }
undo("left/Cart_Impedance.offset")
set("left/Operator.script", "align 8; free 600", { force = true, within = 1 })
raise("left/e_reset")
wait_state("left:operational", 1)
wait_state("left:copying", 20)
wait_state("right:copying", 20)

-- While both arms unfold: the calls are given up, and what they had begun is folded on the way down, before the drives go off.
raise("e_shutdown")
wait_state("pair:idle", 20)
raise("e_start")
wait_state("left:unfolding", 5)
wait(2.5)
at = now()
inject("configurator", "panic")
wait_answer("left/unfold.broken", 0.5)
expect{ name = "while it unfolds: answered after", value = 1000 * (now() - at), max = 100, unit = "ms" }
wait(1)
s = sample{ every = 0.001, signals = { fast = "World.robot1_tool_twist.v[2]" } }
raise("e_shutdown")
wait_answer("left/unfold.undone", 6)
s:stop()
expect{ name = "on the way down the tool sinks with", value = -s:min("fast"), max = 0.3, unit = "m/s" }
wait_state("pair:idle", 5)
expect{ name = "frames left", value = #stack(), max = 0 }
