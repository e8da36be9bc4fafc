-- A robot is stopped whose tool touches something:  davit run examples/scenarios/pressed.lua --clock simulated
--
-- The left tool is led, the right one meets a wall, or a table, straight on or sliding along it, and is stopped: at once, or a little later, with five
-- and with eight degrees of freedom. Whatever it pressed with, the drives that hold it press with no more than they did, and a base that rolls out does
-- not press at all.

deploy("../../deployments/youbot_coupling.yaml")
local ROBOTS = { "left", "right" }
local function hand(script) set("left/Operator.script", script, { force = true, within = 1 }) end

local function at(axis) return signal("World.robot1_tool_pose.p[" .. axis .. "]") end

local worst, home = { held = 0, more = 0, rest = 0 }, nil
local function meets(mode, wall, seconds, after, along)
  for _, robot in ipairs(ROBOTS) do
    wait_state(robot .. ":copying", 20)
    raise(robot .. "/e_" .. mode .. "dof")
    wait_state(robot .. ":" .. (mode == "5" and "five" or "eight") .. "_DOF_mode", 1)
  end
  -- From where it was the first time: in five degrees of freedom nothing brings an arm back.
  home = home or { at(0), at(1), at(2) }
  hand(("go 2 %g %g %g; hold 600"):format(home[1] - at(0), home[2] - at(1), home[3] - at(2)))
  wait(3)
  local of, axis, to = "World.robot2_" .. (wall and "wall" or "table"), wall and 0 or 2, wall and 1 or -1
  local name = mode .. " dof, " .. (wall and "wall" or "table") .. ", " .. seconds .. " s, " .. after .. " s" .. (along and ", sliding" or "")
  set(of, signal("World.robot2_tool_pose.p[" .. axis .. "]") + to * 0.05, { force = true, within = 1 })
  local s = sample{ every = 0.001, name = "p" .. name:gsub("[^%w]+", "_"), signals = {
    f = "World.robot2_contact[" .. axis .. "]", v = "World.robot2_tool_twist.v[" .. axis .. "]" } }
  hand(("go %g %g %g %g; hold 600"):format(seconds, wall and 0.1 or 0, along or 0, wall and 0 or -0.1))
  for _ = 1, 5000 do
    wait(0.001)
    if math.abs(signal("World.robot2_contact[" .. axis .. "]")) > 0.1 then break end
  end
  wait(after)
  local at = now()
  raise("e_estop")
  wait(2)
  s:stop()
  local f, v, before, held = s:values("f"), s:values("v"), 0, 0
  for i, t in ipairs(s:times()) do
    if t <= at + 0.1 then before = math.max(before, math.abs(f[i])) end
    if t >= at + 0.3 then held, worst.rest = math.max(held, math.abs(f[i])), math.max(worst.rest, math.abs(v[i])) end
  end
  assert(before > 0.1, "it met nothing")
  figure{ name = name .. ": pressed with", value = before, unit = "N" }
  figure{ name = name .. ": held", value = held, unit = "N" }
  worst.held, worst.more = math.max(worst.held, held), math.max(worst.more, held - before)
  undo(of)
  hand("align 8; free 600")
  for _, robot in ipairs(ROBOTS) do raise(robot .. "/e_reset") end
end

for _, mode in ipairs{ "8", "5" } do
  for _, wall in ipairs{ true, false } do
    for _, after in ipairs{ 0, 0.1 } do meets(mode, wall, 2, after) end
  end
  meets(mode, true, 2, 2)
  meets(mode, true, 1.2, 0.05)
  -- Faster, and sliding along it, to and fro.
  meets(mode, true, 1.5, 0)
  for _, wall in ipairs{ true, false } do
    meets(mode, wall, 1.5, 0.02, 0.12)
    meets(mode, wall, 1.5, 1, -0.12)
  end
end
expect{ name = "held against it with", value = worst.held, max = 10, unit = "N" }
expect{ name = "more than before the stop", value = worst.more, max = 0, unit = "N" }
expect{ name = "0.3 s later the tool moves with", value = worst.rest, max = 0.02, unit = "m/s" }
