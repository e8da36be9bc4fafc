-- One robot is led, and the other one's tool meets what is in its way:  davit run examples/scenarios/contact.lua --clock simulated
--
-- Free space, approach, hard contact (10 kN/m), release. The grid of docs/youbot.md, law and place and delay:
--   davit sweep examples/scenarios/contact.lua --set law=position,tank --set place=wall,table --set delay=0,0.005,0.02,0.05

local law   = param("law", "position") -- or tank: passive under delay
local place = param("place", "wall")   -- or table
local delay = param("delay", 0.005)    -- one way, s
local K     = param("K", 300)          -- N/m

assert(law == "position" or law == "tank", "`law` is position or tank")
assert(place == "wall" or place == "table", "`place` is wall or table")
deploy(law == "tank" and "../tank/coupling.yaml" or "../../deployments/youbot_coupling.yaml")

local ROBOTS = { "left", "right" }
local function tune(property, value) set(property, value, { force = true, within = 1 }) end
local function hand(robot, script) tune(robot .. "/Operator.script", script) end

for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":copying", 20) end
for _, robot in ipairs(ROBOTS) do raise(robot .. "/e_5dof") end
for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":five_DOF_mode", 1) end
hand("left", "align 3; free 600")
hand("right", "free 600")
for _, robot in ipairs(ROBOTS) do
  tune(robot .. "/Cart_Impedance.stiffness", K)
end
wait(3)
for _, net in ipairs{ "To_Right", "To_Left" } do tune(net .. ".delay", delay) end
wait(1)

-- The hand goes 5 cm in free space, then 5 cm on behind where the other tool is stopped.
local AWAY, BEHIND = 0.05, 0.05
local axis, way = "0", 1
if place == "table" then axis, way = "2", -1 end
local tool = "World.robot2_tool_pose.p[" .. axis .. "]"
local stopped = signal(tool) + way * AWAY
tune("World.robot2_" .. place, stopped)

local signals = {
  tool = tool, contact = "World.robot2_contact[" .. axis .. "]", hand = "left/Operator.ext_force[" .. axis .. "]",
  on_left = "left/Cart_Impedance.active", on_right = "right/Cart_Impedance.active",
}
for i = 0, 2 do
  signals["v" .. i] = "World.robot2_tool_twist.v[" .. i .. "]"
  signals["left" .. i] = "World.robot1_tool_pose.p[" .. i .. "]"
  signals["right" .. i] = "World.robot2_tool_pose.p[" .. i .. "]"
end
local s = sample{ every = 0.001, name = "contact", signals = signals }
local function going(metres)
  local d = { 0, 0, 0 }
  d[axis + 1] = way * metres
  return string.format("go 2 %g %g %g", d[1], d[2], d[3])
end
local began = now()
hand("left", "hold 1; " .. going(AWAY + BEHIND) .. "; hold 3; " .. going(-AWAY - BEHIND) .. "; hold 600")
wait(9)
s:stop()

local of = {}
for name in pairs(signals) do of[name] = s:values(name) end
local function norm(name, at)
  local sum = 0
  for i = 0, 2 do sum = sum + of[name .. i][at]^2 end
  return math.sqrt(sum)
end
-- It presses from 2.5 s after the tool was led there, at the latest; the last half second counts.
local meets, deep, lost, still, pressed, felt, counted, touched = nil, 0, 0, 0, 0, 0, 0, false
for at, time in ipairs(s:times()) do
  local since, touches = time - began, of.contact[at] ~= 0
  if touches and not meets then meets = norm("v", at) end
  deep = math.max(deep, way * (of.tool[at] - stopped))
  if since > 3.5 and since < 6 and touched and not touches then lost = lost + 1 end
  if since > 5.5 and since < 6 then
    still, counted = math.max(still, norm("v", at)), counted + 1
    pressed, felt = pressed + math.abs(of.contact[at]), felt + way * of.hand[at]
  end
  touched = touches
end
local apart = 0
for i = 0, 2 do apart = apart + (of["left" .. i][#of.tool] - of["right" .. i][#of.tool])^2 end

expect{ name = "meets it at", value = 1000 * (meets or 0), min = 30, unit = "mm/s" }
expect{ name = "penetration", value = 1000 * deep, max = 3, unit = "mm" }
expect{ name = "pressed with", value = pressed / counted, min = 2, max = 10, unit = "N" }
expect{ name = "the hand feels", value = felt / counted, min = 1.5, max = 10, unit = "N" }
expect{ name = "contact lost while pressed", value = lost, max = 0 }
expect{ name = "still while pressed", value = 1000 * still, max = 2, unit = "mm/s" }
expect{ name = "touches after the release", value = touched and 1 or 0, max = 0 }
expect{ name = "between the tools after it", value = 1000 * math.sqrt(apart), max = 8, unit = "mm" }
for _, side in ipairs(ROBOTS) do
  expect{ name = side .. ", copying", value = 100 * s:mean("on_" .. side), min = 100, unit = "%" }
end

-- It is in the way of an arm that folds.
tune("World.robot2_" .. place, place == "table" and -100 or 100)
hand("left", "free 600")
