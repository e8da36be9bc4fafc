-- What has died is started again:  davit run examples/scenarios/repair.lua --clock simulated
--
-- One after the other, in the middle of copying, each part of the left robot's control panics. The robot stops (of the link: lets go), stays
-- where it is while an operator has the part start from the beginning, and copies again when that was done. The other one goes on standing.
-- The impedance controller is started again without asking: crash.lua.

local DEAD = {
  { "Arm_Kinematics", "restart_kinematics", "fault" },
  { "Dynamics",       "restart_dynamics",   "fault" },
  { "Base_Ctrl",      "restart_base",       "fault" },
  { "Monitors",       "restart_monitors",   "fault" },
  { "Link_Rx",        "restart_link",       "unsync" },
  { "Link_Tx",        "restart_link",       "unsync" },
}

deploy("../../deployments/youbot_coupling.yaml")
set("left/Operator.script", "free 1.5; align 600", { force = true, within = 1 })      -- nobody sways it meanwhile
for axis = 0, 2 do signal("World.robot1_tool_pose.p[" .. axis .. "]") end
local function place()
  local p = {}
  for axis = 0, 2 do p[axis + 1] = signal("World.robot1_tool_pose.p[" .. axis .. "]") end
  return p
end

for _, dead in ipairs(DEAD) do
  local component, restart, where = table.unpack(dead)
  wait_state("left:copying", 20)
  wait_state("right:copying", 20)
  wait(0.5)
  local at = now() + 0.01
  inject("left/" .. component, "panic", {}, at)
  wait_state("left:" .. where, 0.3)
  expect{ name = component .. ": stopped after", value = 1000 * (now() - at), max = where == "fault" and 55 or 120, unit = "ms" }
  wait(0.5)
  assert_state("left/" .. component, "faulted")
  local before = place()
  apply("left/" .. restart, { force = true })
  wait_answer("left/" .. restart .. ".ok", 0.1)
  assert_running("left/" .. component)
  wait(0.5)
  local after, way = place(), 0
  for axis = 1, 3 do way = way + (after[axis] - before[axis])^2 end
  expect{ name = component .. ": way of the tool meanwhile", value = 1000 * math.sqrt(way), max = 1, unit = "mm" }
  local reset = now()
  if where == "fault" then
    wait_state("left:fault", 0)
    raise("left/e_reset")
    wait_state("left:operational", 0.5)
  end
  wait_state("left:copying", 5)
  wait_state("right:copying", 5)
  expect{ name = component .. ": both copy again after", value = now() - reset, max = 3, unit = "s" }
end
wait(2)
wait_state("left:copying", 0)
