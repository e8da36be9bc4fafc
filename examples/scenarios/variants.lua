-- Robots as they may be, coupled:  davit run examples/scenarios/variants.lua --clock simulated
--
-- Masses of the arms within 10 % of what the controllers believe, friction 0.7 to 1.3 of it, motors that lag by 1 to 2 ms, drawn evenly with a
-- seed, each robot's for itself; encoders that count, speeds that are differences, motors that get hot. The nominal pair, and the worst of those drawn.
-- Each pair is brought up from nothing.
--   --set pairs=20                        the table of docs/youbot.md
--   --set seed=7                          others

local pairs_drawn, seconds, seed = param("pairs", 3), param("seconds", 20), param("seed", 2026)
deploy("../../deployments/youbot_coupling.yaml")

local ROBOTS, AXES = { "left", "right" }, { "x", "y", "z" }
local WORLD = { left = "World.robot1_", right = "World.robot2_" }
local function tune(property, value) set(property, value, { force = true, within = 1 }) end
local function both(event) for _, robot in ipairs(ROBOTS) do raise(robot .. "/" .. event) end end
local function until_both(state, seconds) for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":" .. state, seconds) end end
local function hand(script) tune("left/Operator.script", script) end
local state = seed % 2147483647
local function drawn(low, high)       -- Park and Miller, so that every Lua draws the same
  state = 48271 * state % 2147483647
  return low + (high - low) * state / 2147483647
end

-- How far the tools are apart (mm) and what the hand gives (N), both rms, the time in `copying` (%), and whether a joint was at its limit.
local function motion()
  local signals = {}
  for _, robot in ipairs(ROBOTS) do
    for i, axis in ipairs(AXES) do signals[robot .. axis] = WORLD[robot] .. "tool_pose.p[" .. i - 1 .. "]" end
    signals[robot .. "_active"] = robot .. "/Cart_Impedance.active"
    signals[robot .. "_limit"] = robot .. "/Dynamics.tau_sat"
  end
  for i, axis in ipairs(AXES) do signals["hand" .. axis] = "left/Operator.ext_force[" .. i - 1 .. "]" end
  local s = sample{ every = 0.005, signals = signals }
  wait(seconds)
  s:stop()
  local apart, force, n, v = 0, 0, s:count("leftx"), {}
  for name in pairs(signals) do v[name] = s:values(name) end
  for i = 1, n do
    for _, axis in ipairs(AXES) do
      apart, force = apart + (v["left" .. axis][i] - v["right" .. axis][i])^2, force + v["hand" .. axis][i]^2
    end
  end
  return { apart = 1000 * math.sqrt(apart / n), hand = math.sqrt(force / n),
           copying = 100 * math.min(s:mean("left_active"), s:mean("right_active")),
           limit = math.max(s:max("left_limit"), s:max("right_limit")) }
end

local MODES = { { name = "eight, 150 N/m", event = "e_8dof", state = "eight_DOF_mode", profile = "profile_normal", apart = 12 },
                { name = "five, 150 N/m",  event = "e_5dof", state = "five_DOF_mode",  profile = "profile_normal", apart = 25 },
                { name = "five, 300 N/m",  event = "e_5dof", state = "five_DOF_mode",  profile = "profile_stiff",  apart = 12 } }
local worst, nominal = {}, {}
for number = 0, pairs_drawn do
  raise("e_shutdown")
  wait_state("pair:idle", 40)
  raise("e_start")
  -- As they are from before they move: while it unfolds a driver finds out what its arm weighs and how much it rubs.
  for _, robot in ipairs(ROBOTS) do
    wait_state(robot .. ":calibrating", 5)
    local mass, friction, lag = drawn(0.9, 1.1), drawn(0.7, 1.3), drawn(0.001, 0.002)
    if number == 0 then mass, friction, lag = 1, 1, 0.0015 end
    tune(WORLD[robot] .. "mass_scale", mass)
    tune(WORLD[robot] .. "friction_scale", friction)
    tune(WORLD[robot] .. "torque_lag", lag)
  end
  until_both("operational", 10)
  for _, robot in ipairs(ROBOTS) do
    tune(robot .. "/youbot.encoders", true)
    tune(robot .. "/youbot.heat_limit", true)
  end
  for _, mode in ipairs(MODES) do
    hand("align 8; free 600")
    until_both("copying", 20)
    both("e_8dof")
    wait(4)                                -- the bases go to where the tools are in front of them
    both(mode.event)
    until_both(mode.state, 0.1)
    for _, robot in ipairs(ROBOTS) do apply(robot .. "/" .. mode.profile, { force = true }) wait_answer(robot .. "/" .. mode.profile .. ".ok", 1) end
    hand("free 0.5; sway 600 0.042 0.042 0 0.15")
    wait(2)
    local it = motion()
    if number == 0 then nominal[mode.name] = it end
    local so_far = worst[mode.name] or { apart = 0, hand = 0, copying = 100, limit = 0 }
    worst[mode.name] = { apart = math.max(so_far.apart, it.apart), hand = math.max(so_far.hand, it.hand),
                         copying = math.min(so_far.copying, it.copying), limit = math.max(so_far.limit, it.limit) }
  end
end
for _, mode in ipairs(MODES) do
  local it = nominal[mode.name]
  figure{ name = mode.name .. ": nominal, tools apart", value = it.apart, unit = "mm" }
  figure{ name = mode.name .. ": nominal, hand", value = it.hand, unit = "N" }
  local it = worst[mode.name]
  expect{ name = mode.name .. ": worst, tools apart", value = it.apart, max = mode.apart, unit = "mm" }
  expect{ name = mode.name .. ": worst, hand", value = it.hand, max = 8, unit = "N" }
  expect{ name = mode.name .. ": copying, at least", value = it.copying, min = 100, unit = "%" }
  expect{ name = mode.name .. ": joints at a limit", value = it.limit, max = 0 }
end
