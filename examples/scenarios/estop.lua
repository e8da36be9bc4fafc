-- An emergency stop, in the states in which the drives have power:  davit run examples/scenarios/estop.lua --clock simulated
--
-- Both robots hear it at once; 0.3 s later both tools are at rest, and nothing moves until somebody resets. Then all of it goes
-- down to nothing, and up again for the next state. The same by an error of the left robot's drives, which stops that one:
--   davit run examples/scenarios/estop.lua --clock simulated --set by=overcurrent

deploy("../../deployments/youbot_coupling.yaml")

local by = param("by", "e_estop")
local ROBOTS = { "left", "right" }
local STOPPED = by == "e_estop" and ROBOTS or { "left" }
local WORLD = { left = "World.robot1_", right = "World.robot2_" }
local function both(event) for _, robot in ipairs(ROBOTS) do raise(robot .. "/" .. event) end end
local function until_both(state, seconds) for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":" .. state, seconds) end end
local function stopped() raise("e_estop") wait(0.5) end
local function go_down() raise("e_shutdown") end
-- What takes no time is made to take some, on both sides.
local function slow(component, operation)
  for _, robot in ipairs(ROBOTS) do inject(robot .. "/" .. component, "stall", { operation = operation, seconds = 0.03 }) end
end

-- Where it is stopped, and how one comes there from the beginning of the bring-up.
local PLACES = {
  { "as it is powered",        function() until_both("powering", 1) end },
  { "calibrating",             function() until_both("calibrating", 1) wait(0.06) end },
  { "unfolding",               function() until_both("unfolding", 1) wait(2) end },
  { "unsync",                  function() until_both("unsync", 6) wait(0.1) end },
  { "harmonizing",             function() until_both("harmonizing", 7) wait(0.1) end },
  { "copying with eight",      function() until_both("eight_DOF_mode", 20) wait(13.5) end },
  { "copying with five",       function() until_both("copying", 20) both("e_5dof") until_both("five_DOF_mode", 0.01) wait(13.5) end },
  { "soft stop",               function()
      until_both("copying", 20)
      set("left/Cart_Impedance.offset", { 0.3, 0, 0 }, { force = true, within = 1 })
      wait_state("left:soft_stop", 0.1)
    end },
  { "parking",                 function() until_both("copying", 20) go_down() until_both("parking", 1) wait(1.8) end },
  { "folding on the way back", function() until_both("unfolding", 1) wait(3) go_down() until_both("folding", 5) wait(1) end },
  { "failed on the way up",    function() until_both("unfolding", 1) wait(1) stopped() both("e_reset") until_both("deploy_failed", 1) end },
  { "taking over",             function() until_both("unfolding", 1) slow("youbot", "setControlMode") until_both("taking_over", 8) end, state = "taking_over" },
  { "as the control starts",   function() until_both("starting", 8) end },
  { "as the control stops",    function() until_both("copying", 20) go_down() until_both("shutting_down.stopping", 8) end },
  { "powering off",            function() until_both("copying", 20) go_down() until_both("parking", 8) slow("youbot", "setControlMode") until_both("powering_off", 8) end, state = "powering_off" },
  { "quieting",                function() until_both("copying", 20) slow("Base_Ctrl", "stop") go_down() until_both("quieting", 1) end, state = "quieting" },
  { "holding",                 function() until_both("copying", 20) slow("youbot", "setControlMode") go_down() until_both("holding", 1) end, state = "holding" },
  { "stranded before parking", function()
      until_both("unsync", 6) go_down() until_both("parking", 1) wait(1)
      stopped() both("e_reset") until_both("before_parking", 1)
    end },
  -- Where it is stopped already an operator may insist on what moves: that is braked again.
  { "stopped, and moved all the same", function()
      until_both("copying", 20) stopped()
      for _, robot in ipairs(ROBOTS) do apply(robot .. "/park", { force = true }) end
      wait(1.5)
    end, answer = "brake_again.ok" },
}

-- The fastest that a tool was from `since` on, in m/s; the largest change of a torque in 1 ms, in N m; and how far a tool went from then on, in m.
local function measured(s, since)
  local fastest, step, way, times = 0, 0, 0, s:times()
  for _, robot in ipairs(STOPPED) do
    local v, p, first = {}, {}, nil
    for i, axis in ipairs{ "x", "y", "z" } do v[i], p[i] = s:values(robot .. "_" .. axis), s:values(robot .. "_p" .. axis) end
    for i, at in ipairs(times) do
      if at >= since then
        first = first or i
        fastest = math.max(fastest, math.sqrt(v[1][i]^2 + v[2][i]^2 + v[3][i]^2))
        way = math.max(way, math.sqrt((p[1][i] - p[1][first])^2 + (p[2][i] - p[2][first])^2 + (p[3][i] - p[3][first])^2))
      end
    end
    for joint = 0, 4 do
      local torque = s:values(robot .. "_torque_" .. joint)
      for i = 2, #torque do step = math.max(step, math.abs(torque[i] - torque[i - 1])) end
    end
  end
  return fastest, step, way
end

local worst = { taking = 0, heard = 0, behind = 0, speed = 0, step = 0, way = 0 }
for number, place in ipairs(PLACES) do
  local name, go = table.unpack(place)
  go_down()
  wait_state("pair:idle", 20)
  assert(#stack() == 0, "something is left")
  raise("e_start")
  go()

  local signals = {}
  for _, robot in ipairs(ROBOTS) do
    for i, axis in ipairs{ "x", "y", "z" } do
      signals[robot .. "_" .. axis] = WORLD[robot] .. "tool_twist.v[" .. i - 1 .. "]"
      signals[robot .. "_p" .. axis] = WORLD[robot] .. "tool_pose.p[" .. i - 1 .. "]"
    end
    for joint = 0, 4 do signals[robot .. "_torque_" .. joint] = robot .. "/youbot.jointstate.eff[" .. joint .. "]" end
  end
  local s = sample{ every = 0.001, signals = signals, name = "place_" .. number }
  wait(0.01)
  if place.state then until_both(place.state, 0) end
  local at = now()
  if by == "e_estop" then raise(by) else inject("left/youbot", by, by == "overcurrent" and { joint = 2 } or {}) end
  for _, robot in ipairs(STOPPED) do wait_answer(robot .. "/" .. (place.answer or "safe_hold.ok"), 0.1) end
  local heard = now() - at
  wait(6)
  s:stop()
  local before = measured(s, at)
  local after, step, way = measured(s, at + 0.3)
  figure{ name = name .. ": fastest", value = before, unit = "m/s" }
  expect{ name = name .. ": 0.3 s later", value = after, max = 0.02, unit = "m/s" }
  if place.state then worst.behind, heard = math.max(worst.behind, heard), 0 end
  worst = { taking = worst.taking, heard = math.max(worst.heard, heard), behind = worst.behind, speed = math.max(worst.speed, before), step = math.max(worst.step, step), way = math.max(worst.way, way) }
  for _, robot in ipairs(STOPPED) do
    if signal(robot .. "/youbot.control_mode") == 6 then worst.taking = worst.taking + 1 end
  end
  both("e_reset")
  wait(0.5)
end
expect{ name = "braking begins within", value = worst.heard, max = 0.001, unit = "s" }
expect{ name = "where a call of the drives, or the base, is out for 30 ms: within", value = worst.behind, max = 0.03, unit = "s" }
expect{ name = "from 0.3 s on until it is reset the tool goes", value = 1000 * worst.way, max = 2, unit = "mm" }
expect{ name = "stopped, and takes torques", value = worst.taking, max = 0 }
expect{ name = "it was in motion, at most", value = worst.speed, min = 0.1, unit = "m/s" }
expect{ name = "torque in 1 ms", value = worst.step, max = 0.5, unit = "N m" }
