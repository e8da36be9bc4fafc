-- A joint jams while an arm unfolds, and neither way is open:  davit run tests/youbot/jammed.lua --clock simulated
--
-- The bring-up fails, and the arm is held where it is: what has failed leaves nothing to be undone, so the way down does not fold it. When the
-- drives are to go off it would sink; they hold it, and wait for somebody to look. Free again it is folded by hand, and the rest taken down.

deploy("../../deployments/youbot_arm.yaml")
raise("e_shutdown")
wait_state("idle", 60)
raise("e_start")
wait_state("unfolding", 3)
wait(2)
set("World.robot1_friction_scale", 10.0, { force = true, within = 1 })
wait_state("deploy_failed", 12)
wait(1)
undo("World.robot1_friction_scale", { force = true })
wait_answer("World.robot1_friction_scale.undone", 1)
wait(1)
local function height() return 1000 * signal("World.robot1_tool_pose.p[2]") end
local folded, up = 520, height()
expect{ name = "it is held above its stops by", value = up - folded, min = 50, unit = "mm" }

local s = sample{ every = 0.001, signals = { v = "World.robot1_tool_twist.v[2]" } }
raise("e_shutdown")
wait_state("halted.waiting", 5)
wait(5)
s:stop()
expect{ name = "asked to come down it sinks by", value = up - height(), max = 5, unit = "mm" }
expect{ name = "at most with", value = -1000 * s:min("v"), max = 20, unit = "mm/s" }
expect{ name = "its drives hold it, mode", value = signal("youbot.control_mode"), min = 1, max = 1 }

apply("park", { force = true })
wait_answer("park.ok", 10)
expect{ name = "folded by hand, but for", value = math.abs(height() - folded), max = 5, unit = "mm" }
shutdown{ force = true }
