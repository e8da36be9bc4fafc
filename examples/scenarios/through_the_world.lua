-- What one robot pushes the other one feels, with no network between them:  davit run examples/scenarios/through_the_world.lua --clock simulated
--
-- Both are in one world. A bar on rails stands between their tools; both networks are cut, and both robots have let go of each other. A hand leads
-- the left tool against the bar, and the bar carries the right one along.

deploy("../../deployments/youbot_coupling.yaml")
local ROBOTS = { "left", "right" }
local function hand(robot, script) set(robot .. "/Operator.script", script, { force = true, within = 1 }) end
for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":copying", 20) end
hand("left", "hold 600")
hand("right", "free 600")
wait(2)
for _, net in ipairs{ "To_Right", "To_Left" } do set(net .. ".cut", true, { within = 1, force = true }) end
for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":unsync", 1) end
wait(1)

-- The left tool's face of the bar is 10 mm before it, the right one's 20 mm behind that: the right robot stands so far along.
local function tool(robot, axis) return signal("World.robot" .. robot .. "_tool_pose.p[" .. (axis or 0) .. "]") end
local THICK, GAP, BEHIND = 0.04, 0.01, 0.02
local bar = tool(1) + GAP + THICK / 2
set("World.robot2_place", bar + THICK / 2 + BEHIND - tool(2), { force = true, within = 1 })
set("World.bar", bar, { force = true, within = 1 })
wait(0.5)
local from = { tool(1), tool(2) }

local packets = signal("right/Link_Rx.link_stats.seq")
local s = sample{ every = 0.001, name = "pushed", signals = {
  bar = "World.bar_position", left = "World.robot1_tool_pose.p[0]", right = "World.robot2_tool_pose.p[0]",
  on_left = "World.robot1_contact[0]", on_right = "World.robot2_contact[0]", hand = "left/Operator.ext_force[0]",
  coupled = "left/Cart_Impedance.engaged" } }
hand("left", "go 3 0.08 0 0; hold 600")
wait(5)
s:stop()

local led, carried = tool(1) - from[1], tool(2) - from[2]
expect{ name = "the left tool was led", value = 1000 * led, min = 50, unit = "mm" }
expect{ name = "the right one was carried", value = 1000 * carried, min = 1000 * (led - GAP - BEHIND) - 5, unit = "mm" }
expect{ name = "which it felt", value = s:max("on_right"), min = 2, unit = "N" }
expect{ name = "and so did the left one", value = -s:min("on_left"), min = 2, unit = "N" }
expect{ name = "coupled meanwhile", value = s:max("coupled"), max = 0 }
expect{ name = "packets meanwhile", value = signal("right/Link_Rx.link_stats.seq") - packets, max = 0 }

-- What the bar is pushed with on one side it pushes with on the other, but for what its own mass takes when it is set moving, and its rails.
local sum, force = 0, 0
for i, on_left in ipairs(s:values("on_left")) do
  sum, force = sum + (on_left + s:values("on_right")[i])^2, force + on_left^2
end
figure{ name = "between push and being pushed, of the force", value = 100 * math.sqrt(sum / force), unit = "%" }

-- It is in the way of arms that fold.
set("World.bar", 100, { force = true, within = 1 })
hand("left", "free 600")
wait(1)
