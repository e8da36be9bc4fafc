-- Two robots that copy with eight degrees of freedom are left alone:  davit run examples/scenarios/left_alone.lua --clock simulated
--
-- A hand sways one arm and lets go, at many moments of its way; then both bases and both arms come to rest, whatever the arms weigh and however
-- much they rub. An arm whose joints stick is not where the base wants it, and does not come nearer: the base would carry it along for ever. One
-- that rubs less than is believed would go on where it was pushed, one that is heavier sink.

deploy("../../deployments/youbot_coupling.yaml")

local ROBOTS = { "left", "right" }
local cases = param("cases", 8)
local function tune(property, value) set(property, value, { force = true, within = 1 }) end
local signals = {}
for number, robot in ipairs(ROBOTS) do
  for _, axis in ipairs{ "x", "y" } do
    signals[robot .. axis] = robot .. "/youbot.odometry." .. axis
    signals[robot .. "_tool" .. axis] = "World.robot" .. number .. "_tool_pose.p[" .. (axis == "x" and 0 or 1) .. "]"
  end
  signals[robot .. "_active"] = robot .. "/Cart_Impedance.active"
end
for _, arm in ipairs{ { mass = 1, friction = 1 }, { mass = 1, friction = 1.3 }, { mass = 1.1, friction = 0.7 }, { mass = 0.9, friction = 0.7 } } do
  raise("e_shutdown")
  wait_state("pair:idle", 40)
  raise("e_start")
  -- Before they move: while it unfolds a driver finds out what its arm weighs and how much it rubs.
  for number, robot in ipairs(ROBOTS) do
    wait_state(robot .. ":calibrating", 5)
    tune("World.robot" .. number .. "_mass_scale", arm.mass)
    tune("World.robot" .. number .. "_friction_scale", arm.friction)
  end
  for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":operational", 10) tune(robot .. "/Operator.script", "align 8; free 600") end
  for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":copying", 25) end
  for _, robot in ipairs(ROBOTS) do tune(robot .. "/Operator.script", "free 600") end
  local fastest, copying = 0, 100
  for case = 1, cases do
    local who = ROBOTS[1 + case % 2]
    tune(who .. "/Operator.script", ("sway %g %g 0.03 0 0.15; free 600"):format(1 + 0.83 * case, case % 3 == 0 and 0.03 or 0))
    wait(1 + 0.83 * case + 5)
    local s = sample{ every = 0.02, signals = signals }
    wait(3)
    s:stop()
    for name in pairs(signals) do
      if not name:find("active") then fastest = math.max(fastest, 1000 * math.abs(s:last(name) - s:values(name)[1]) / 3) end
    end
    copying = math.min(copying, 100 * s:mean("left_active"), 100 * s:mean("right_active"))
  end
  expect{ name = ("mass %g, friction %g: base or tool, 5 to 8 s later"):format(arm.mass, arm.friction), value = fastest, max = 0.2, unit = "mm/s" }
  expect{ name = ("mass %g, friction %g: copying meanwhile"):format(arm.mass, arm.friction), value = copying, min = 100, unit = "%" }
end
