-- What the coupling gives out when no hand is at the tools:  davit run examples/scenarios/energy.lua --clock simulated
--
-- An observer counts force times way at both tools, the networks between them included. Two hands pull the tools apart and let go at the same
-- time: from then on the coupling gives out no more than its spring held.

local STIFFNESS = 150

deploy("../../deployments/youbot_coupling.yaml")

local function hand(robot, script) set(robot .. "/Operator.script", script, { force = true, within = 1 }) end
local function apart()
  local sum = 0
  for axis = 0, 2 do
    local p = "_tool_pose.p[" .. axis .. "]"
    sum = sum + (signal("World.robot1" .. p) - signal("World.robot2" .. p))^2
  end
  return math.sqrt(sum)
end

-- A tenth of the joints' friction, most of that compensated: else it holds the tools where they are, and hides what the coupling does.
for number, robot in ipairs{ "left", "right" } do
  set("World.robot" .. number .. "_friction_scale", 0.1, { force = true, within = 1 })
  set(robot .. "/Dynamics.friction_comp", 0.09, { force = true, within = 1 })
end

local worst = { given = 0, least = math.huge, left = 0 }
for _, delay in ipairs{ 0.005, 0.02, 0.05 } do
  for _, net in ipairs{ "To_Right", "To_Left" } do set(net .. ".delay", delay, { force = true, within = 1 }) end
  hand("left", "align 8; free 600")
  hand("right", "align 8; free 600")
  wait_state("left:copying", 20)
  wait_state("right:copying", 20)
  raise("left/e_5dof")
  raise("right/e_5dof")
  wait(1)
  hand("right", "hold 600")
  hand("left", "go 2 0 0.07 0; hold 600")
  wait(2.5)
  wait_state("left:five_DOF_mode", 0)
  local s = sample{ every = 0.001, signals = { e = "Observer.energy" }, name = ("ms_%d"):format(1000 * delay) }
  wait(0.01)
  hand("left", "free 600")
  hand("right", "free 600")
  local e = apart()
  local stored, before = STIFFNESS * e^2 / 2, s:last("e")
  wait(4)
  wait_state("left:five_DOF_mode", 0)
  s:stop()
  local given = before - s:min("e")
  local name = ("%d ms one way: "):format(1000 * delay)
  figure{ name = name .. "apart when let go", value = 1000 * e, unit = "mm" }
  figure{ name = name .. "apart 4 s later", value = 1000 * apart(), unit = "mm" }
  figure{ name = name .. "the spring held", value = 1000 * stored, unit = "mJ" }
  expect{ name = name .. "given out", value = 1000 * given, max = 1000 * stored, unit = "mJ" }
  worst.least, worst.given = math.min(worst.least, stored), math.max(worst.given, given / stored)
end
-- So that there was something to give.
expect{ name = "the spring held, at least", value = 1000 * worst.least, min = 40, unit = "mJ" }
expect{ name = "given out of what it held, at most", value = 100 * worst.given, min = 5, max = 100, unit = "%" }
expect{ name = "ever more than taken in and held", value = signal("Observer.violated") and 1 or 0, max = 0 }
