-- Two computers, two clocks: 7.5 s apart and drifting from each other by 50 millionths, then set while the robots copy.
--   davit run examples/scenarios/clocks.lua --clock simulated
--   --set apart=7.5 --set drift=50 --set step=0.05    in s, millionths, s

local apart, drift, step = param("apart", 7.5), param("drift", 50), param("step", 0.05)
deploy("../../deployments/youbot_coupling.yaml")

local ROBOTS, AXES = { "left", "right" }, { "x", "y", "z" }
local WORLD = { left = "World.robot1_", right = "World.robot2_" }
local function until_both(state, seconds) for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":" .. state, seconds) end end
-- The right robot's clock minus the left one's, and what it drifts by: the other direction has the negative.
local function clocks(name, value)
  set("To_Right." .. name, value, { force = true })
  set("To_Left." .. name, -value, { force = true, within = 1 })
end
clocks("clock_offset", apart)
clocks("clock_drift", drift)

local function measure(name, seconds)
  local signals = {}
  for _, robot in ipairs(ROBOTS) do
    for i, axis in ipairs(AXES) do signals[robot .. "_" .. axis] = WORLD[robot] .. "tool_pose.p[" .. i - 1 .. "]" end
    signals[robot .. "_active"] = robot .. "/Cart_Impedance.active"
    for _, what in ipairs{ "age", "clock_offset" } do signals[robot .. "_" .. what] = robot .. "/Link_Rx.link_stats." .. what end
  end
  local s = sample{ every = 0.005, name = name:gsub("%W+", "_"), signals = signals }
  wait(seconds)
  s:stop()
  local square, wrong, n = 0, 0, s:count("left_x")
  local v, at = {}, s:times()
  for signal in pairs(signals) do v[signal] = s:values(signal) end
  for i = 1, n do
    for _, axis in ipairs(AXES) do square = square + (v["left_" .. axis][i] - v["right_" .. axis][i])^2 end
    local true_one = apart + drift * 1e-6 * at[i]
    wrong = math.max(wrong, math.abs(v.left_clock_offset[i] - true_one), math.abs(v.right_clock_offset[i] + true_one))
  end
  local copying = 100 * math.min(s:mean("left_active"), s:mean("right_active"))
  local age = math.max(s:max("left_age"), s:max("right_age"))
  local least = math.min(s:min("left_age"), s:min("right_age"))
  return { apart = 1000 * math.sqrt(square / n), wrong = 1000 * wrong, copying = copying,
           age = 1000 * age, least = 1000 * least }
end

until_both("eight_DOF_mode", 20)
set("left/Operator.script", "sway 600 0.042 0.042 0 0.15", { force = true, within = 1 })
local m = measure("apart and drifting", 20)
expect{ name = "apart: clocks known to", value = m.wrong, max = 0.5, unit = "ms" }
expect{ name = "apart: packets' age, at most", value = m.age, max = 12, unit = "ms" }
expect{ name = "apart: packets' age, at least", value = m.least, min = 4.5, unit = "ms" }
expect{ name = "apart: tools apart, rms", value = m.apart, max = 12, unit = "mm" }
expect{ name = "apart: copying", value = m.copying, min = 100, unit = "%" }

-- The right one's clock is set, and set back: what was sent before and what comes after have no measure in common, and for up to two
-- seconds a packet looks older than it is. They go on, perhaps as on a slow network, in five degrees of freedom.
for _, by in ipairs{ step, -step } do
  local name = by > 0 and "set" or "set back"
  apart = apart + by
  clocks("clock_offset", apart)
  local m = measure(name, 3)
  figure{ name = name .. ": packets' age, at most", value = m.age, unit = "ms" }
  expect{ name = name .. ": copying", value = m.copying, min = 100, unit = "%" }
  local m = measure(name .. ", afterwards", 10)
  expect{ name = name .. ": clocks known to, 3 s later", value = m.wrong, max = 0.5, unit = "ms" }
  expect{ name = name .. ": tools apart, rms", value = m.apart, max = 25, unit = "mm" }
  expect{ name = name .. ": copying afterwards", value = m.copying, min = 100, unit = "%" }
end
