-- What an operation that takes its time, or hangs, does to a robot under a rich coordinator and under Davit's:
--   cargo run --example before -- run examples/before/story.lua --clock simulated
--
-- Each time `e_estop` is raised while a call is under way. On both sides the components, their connections, the monitors, the hand and
-- the clock are the same.

local HANG = 0.8     -- how long the base's controller does not answer, in s

local SIGNALS = {}
for i, axis in ipairs{ "x", "y", "z" } do
  SIGNALS["v" .. axis] = "World.robot1_tool_twist.v[" .. i - 1 .. "]"
  SIGNALS["p" .. axis] = "World.robot1_tool_pose.p[" .. i - 1 .. "]"
  SIGNALS["h" .. axis] = "Operator.ext_force[" .. i - 1 .. "]"
  SIGNALS["f" .. axis] = "Cart_Impedance.f_des[" .. i - 1 .. "]"
end

local SIDES = {
  { name = "rich", file = "deployment.yaml", stop_base = function() raise("e_base_stop") end,
    braked = function(situation) wait_state(situation.state, 10) end },
  { name = "Davit", file = "../../deployments/youbot_arm.yaml", stop_base = function() apply("base_stop", { force = true }) end,
    braked = function(situation) wait_answer(situation.answer, 10) end },
}

-- Both robots copy with five degrees of freedom, and the hand is at work.
local function engaged(side)
  deploy(side.file)
  wait_state("copying", 20)
  raise("e_5dof")
  wait_state("five_DOF_mode", 1)
  set("Operator.script", "sway 600 0.06 0 0 0.3", { force = true, within = 1 })
  wait(1.5)
  wait_state("five_DOF_mode", 0)
end

-- The call is to hang when it comes.
local function hangs()
  inject("Base_Ctrl", "stall", { seconds = HANG }, now() + 0.001)
  wait(0.002)
end

-- `begin` comes to where the call is about to begin, `call` has it begin; `later`, so many seconds behind that, comes `e_estop`.
local SITUATIONS = {
  -- It takes 4.4 s, and nothing is wrong with it.
  { name = "unfolding", later = 1.9, least = 2.0, state = "halted", answer = "safe_hold.ok",
    begin = function(side)
      deploy(side.file)
      raise("e_shutdown")
      wait_state("idle", 20)
    end,
    call = function() raise("e_start") end },
  -- An operator wants the base to stand, and its controller does not answer. What else that brings about has not been told yet.
  { name = "copying", later = 0.02, least = HANG - 0.03, state = "fault", answer = "safe_hold.ok",
    begin = engaged, call = function(side) hangs() side.stop_base() end },
  -- By then the monitors have told that the base's controller is not heard.
  { name = "copying, later", later = 0.1, least = HANG - 0.11, state = "fault", answer = "brake_again.ok",
    begin = engaged, call = function(side) hangs() side.stop_base() end },
  -- The reference jumps, which lets go of the tool and stops the base; somebody pushes it with 20 N from the stop on.
  { name = "soft stop, pushed", later = 0.1, least = HANG - 0.11, state = "fault", answer = "brake_again.ok",
    begin = engaged,
    call = function() hangs() set("Cart_Impedance.offset", { 0.3, 0, 0 }, { force = true, within = 1 }) end,
    then_too = function() set("Operator.script", "push 2 0 20 0", { force = true, within = 1 }) end },
}

-- What is seen from the stop on: when it was heard and the drives braked, when the tool was at rest, how far it went, and the largest
-- forces on it from 0.15 s on.
local function measured(situation, side)
  local arm = situation.name ~= "unfolding"   -- what computes forces is not started yet
  local signals = {}
  for name, signal in pairs(SIGNALS) do if arm or not name:match("^[hf]") then signals[name] = signal end end
  situation.begin(side)
  situation.call(side)
  wait(situation.later)
  if situation.then_too then situation.then_too() end
  local s = sample{ every = 0.001, signals = signals, name = (side.name .. "_" .. situation.name):gsub("%W+", "_") }
  wait(0.002)
  local at = now()
  raise("e_estop")
  side.braked(situation)
  local seen = { heard = now() - at, way = 0, rest = 0, hand = 0, coupling = 0 }
  wait(at + (arm and 1.5 or 3) - now())
  s:stop()
  local v, first = {}, nil
  for name in pairs(signals) do v[name] = s:values(name) end
  for i, t in ipairs(s:times()) do
    if t >= at then
      first = first or i
      seen.way = math.max(seen.way, math.sqrt((v.px[i] - v.px[first])^2 + (v.py[i] - v.py[first])^2 + (v.pz[i] - v.pz[first])^2))
      if v.vx[i]^2 + v.vy[i]^2 + v.vz[i]^2 > 0.02^2 then seen.rest = t - at end
      if arm and t >= at + 0.15 then
        seen.hand = math.max(seen.hand, math.sqrt(v.hx[i]^2 + v.hy[i]^2 + v.hz[i]^2))
        seen.coupling = math.max(seen.coupling, math.sqrt(v.fx[i]^2 + v.fy[i]^2 + v.fz[i]^2))
      end
    end
  end
  shutdown()
  return seen
end

-- What, its factor and unit, and what it may be at most under Davit's coordinator.
local ROWS = {
  { "heard and braking after", "heard", 1000, "ms", 1 },
  { "tool at rest after", "rest", 1000, "ms", 300 },
  { "way of the tool", "way", 1000, "mm", 20 },
  { "hand on the tool, 0.15 s later", "hand", 1, "N", 0 },
  { "coupling on the tool, 0.15 s later", "coupling", 1, "N", 0.1 },
}

local FORM = "%-18s  %-34s  %9s  %9s %s"
say(FORM:format("e_estop while", "", "rich", "Davit", ""))
for _, situation in ipairs(SITUATIONS) do
  local rich, davit = measured(situation, SIDES[1]), measured(situation, SIDES[2])
  for _, row in ipairs(ROWS) do
    local what, key, scale, unit, most = table.unpack(row)
    if situation.name ~= "unfolding" or (key ~= "hand" and key ~= "coupling") then
      say(FORM:format(situation.name, what, ("%.1f"):format(scale * rich[key]), ("%.1f"):format(scale * davit[key]), unit))
      local name = situation.name .. ": " .. what
      -- Deaf for what is left of the call: it cannot be less.
      if key == "heard" then expect{ name = name .. ", rich", value = scale * rich[key], min = scale * situation.least, unit = unit }
      else figure{ name = name .. ", rich", value = scale * rich[key], unit = unit } end
      expect{ name = name .. ", Davit", value = scale * davit[key], max = most, unit = unit }
    end
  end
end
