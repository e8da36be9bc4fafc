-- The coupling is led down while a tool touches something:  davit run examples/scenarios/parked_in_contact.lua --clock simulated
--
-- The left tool is led, the right one meets a wall, or a table, and both robots are led down: as soon as it touches, or after it has pressed for a
-- while, with five and with eight degrees of freedom. The arm comes to rest first, and a base that rolls out; what was pressed in is given back, and
-- on its way onto the stops the tool is taken up and back, not farther out. So it gets down, and presses on nothing.

local ROBOTS = { "left", "right" }
local worst, parked, cases = 0, 0, 0

local function meets(mode, wall, after, along)
  deploy("../../deployments/youbot_coupling.yaml")
  for _, robot in ipairs(ROBOTS) do
    wait_state(robot .. ":copying", 20)
    raise(robot .. "/e_" .. mode .. "dof")
    wait_state(robot .. ":" .. (mode == "5" and "five" or "eight") .. "_DOF_mode", 1)
  end
  local of, axis, to = "World.robot2_" .. (wall and "wall" or "table"), wall and 0 or 2, wall and 1 or -1
  set(of, signal("World.robot2_tool_pose.p[" .. axis .. "]") + to * 0.05, { force = true, within = 1 })
  local name = mode .. " dof, " .. (wall and "wall" or "table") .. ", " .. after .. " s" .. (along and ", sliding" or "")
  local contact = "World.robot2_contact[" .. axis .. "]"
  local s = sample{ every = 0.001, name = "d" .. name:gsub("[^%w]+", "_"), signals = { f = contact } }
  set("left/Operator.script", ("go 2 %g %g %g; hold 600"):format(wall and 0.1 or 0, along or 0, wall and 0 or -0.1),
    { force = true, within = 1 })
  for _ = 1, 5000 do
    wait(0.001)
    if math.abs(signal(contact)) > 0.1 then break end
  end
  wait(after)
  local at = now()
  raise("e_shutdown")
  wait_answer("right/park.ok", 12)
  s:stop()
  local before, behind = 0, 0
  local f = s:values("f")
  for i, t in ipairs(s:times()) do
    if t <= at + 0.1 then before = math.max(before, math.abs(f[i])) end
    if t >= at + 0.3 then behind = math.max(behind, math.abs(f[i])) end
  end
  assert(before > 0.1, "it met nothing")
  figure{ name = name .. ": pressed with", value = before, unit = "N" }
  figure{ name = name .. ": 0.3 s later", value = behind, unit = "N" }
  worst, parked, cases = math.max(worst, behind), parked + 1, cases + 1
  shutdown()
end

for _, mode in ipairs{ "8", "5" } do
  for _, after in ipairs{ 0, 0.1, 2 } do meets(mode, true, after) end
  meets(mode, true, 0.5, 0.12)
  meets(mode, false, 1)
end
expect{ name = "0.3 s later it presses with", value = worst, max = 5, unit = "N" }
expect{ name = "got down without force", value = parked, min = cases }
