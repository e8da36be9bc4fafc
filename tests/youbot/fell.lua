-- The driver of one robot dies, and that robot's arm comes down (driver_dies.rs): the world sees it, and its own robot is told, not the other one.

local who = param("who", "left")
local other, body = who == "left" and "right" or "left", who == "left" and "robot1" or "robot2"
deploy("../../deployments/youbot_coupling.yaml")
wait_state("left:copying", 20)
wait_state("right:copying", 20)
set("left/Operator.script", "free 600", { force = true, within = 1 })
wait(1)
local before = signal("World." .. body .. "_tool_pose.p[2]")
inject(who .. "/youbot", "panic")
wait_state(who .. ":fault.waiting", 0.1)

-- Its coordinator hears that: stopped already, it has brake once more whatever moves, and a dead driver is asked in vain. (That the driver is
-- dead is told every half second, with the same end.)
local function heard(event) return (pcall(wait_answer, event, 0)) end
local again, fell = 0, nil
for _ = 1, 2000 do
  wait(0.001)
  if heard(who .. "/brake_again.broken") then again = now() end
  if heard("e_" .. body .. "_fell") then fell = now() break end
end
assert(fell, "it stays up")
local down = before - signal("World." .. body .. "_tool_pose.p[2]")
expect{ name = "it came down by", value = 1000 * down, min = 20, max = 22, unit = "mm" }
wait_answer(who .. "/e_arm_fell", 0.001)
if again < fell then
  wait_answer(who .. "/brake_again.broken", 0.001)
  again = now()
end
expect{ name = "its robot has it braked again after", value = 1000 * (again - fell), max = 1, unit = "ms" }
wait(1)
local told = 0
for _, event in ipairs{ "e_arm_fell", "safe_hold.ok", "brake_again.ok" } do
  if pcall(wait_answer, other .. "/" .. event, 0) then told = told + 1 end
end
expect{ name = "the other one is told of it, or stopped", value = told, max = 0 }
wait_state(other .. ":harmonizing", 0)
