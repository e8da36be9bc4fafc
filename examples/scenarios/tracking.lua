-- One hand leads, the other robot follows, for a minute each:  davit run examples/scenarios/tracking.lua --clock simulated
--
-- 42 mm to and fro in both directions (60 mm), 0.15 Hz, in eight degrees of freedom and in five, 150 and 300 N/m; then 40 cm away and back.
-- How long of it the robots copied is told of both: the less of the two.
--   --set seconds=20 --set delay=0.01    one way, in s; from 15 ms on they would not begin to couple

local seconds, delay = param("seconds", 60), param("delay", 0.005)
deploy("../../deployments/youbot_coupling.yaml")
for _, net in ipairs{ "To_Right", "To_Left" } do set(net .. ".delay", delay, { force = true, within = 1 }) end

local ROBOTS, AXES = { "left", "right" }, { "x", "y", "z" }
local WORLD = { left = "World.robot1_", right = "World.robot2_" }
local function both(event) for _, robot in ipairs(ROBOTS) do raise(robot .. "/" .. event) end end
local function until_both(state, seconds) for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":" .. state, seconds) end end
local function hand(script) set("left/Operator.script", script, { force = true, within = 1 }) end

local function measure(name, seconds, bounds)
  local signals = { energy = "Observer.energy" }
  for _, robot in ipairs(ROBOTS) do
    for i, axis in ipairs(AXES) do signals[robot .. "_" .. axis] = WORLD[robot] .. "tool_pose.p[" .. i - 1 .. "]" end
    signals[robot .. "_active"] = robot .. "/Cart_Impedance.active"
    signals[robot .. "_limit"] = robot .. "/Dynamics.tau_sat"
  end
  for i, axis in ipairs(AXES) do signals["hand_" .. axis] = "left/Operator.ext_force[" .. i - 1 .. "]" end
  local s = sample{ every = 0.005, name = name:gsub("%W+", "_"), signals = signals }
  wait(seconds)
  s:stop()
  local square, hand, peak, n = 0, 0, 0, s:count("left_x")
  -- Energy at both tools, the networks between them included: from whatever moment on, the coupling gives out no more than its spring held then.
  local ahead, beyond = -math.huge, 0
  local v = {}
  for signal in pairs(signals) do v[signal] = s:values(signal) end
  for i = 1, n do
    local push, apart = 0, 0
    for _, axis in ipairs(AXES) do
      apart = apart + (v["left_" .. axis][i] - v["right_" .. axis][i])^2
      push = push + v["hand_" .. axis][i]^2
    end
    square, hand, peak = square + apart, hand + push, math.max(peak, math.sqrt(push))
    ahead = math.max(ahead, v.energy[i] - bounds.stiffness * apart / 2)
    beyond = math.max(beyond, ahead - v.energy[i])
  end
  expect{ name = name .. ": tools apart, rms", value = 1000 * math.sqrt(square / n), max = bounds.apart, unit = "mm" }
  expect{ name = name .. ": hand, rms", value = math.sqrt(hand / n), max = 8, unit = "N" }
  figure{ name = name .. ": hand, peak", value = peak, unit = "N" }
  expect{ name = name .. ": copying", value = 100 * math.min(s:mean("left_active"), s:mean("right_active")), min = 100, unit = "%" }
  expect{ name = name .. ": joints at a limit", value = math.max(s:max("left_limit"), s:max("right_limit")), max = 0 }
  expect{ name = name .. ": energy taken in", value = 1000 * (s:last("energy") - v.energy[1]), min = 1, unit = "mJ" }
  expect{ name = name .. ": given out beyond what was held", value = 1000 * beyond, max = 1, unit = "mJ" }
  expect{ name = name .. ": led by", value = s:max("left_x") - s:min("left_x"), min = bounds.led or 0.06, unit = "m" }
end

until_both("eight_DOF_mode", 20)
local SWAY = "sway 600 0.042 0.042 0 0.15"
hand(SWAY)
measure("eight, 150 N/m", seconds, { apart = 12, stiffness = 150 })
hand("go 2 0 0 0; go 8 0.283 0.283 0; hold 4; go 8 -0.283 -0.283 0; hold 4")
measure("eight, 40 cm", 26, { apart = 14.7, led = 0.25, stiffness = 150 })

hand("free 600")
both("e_5dof")
until_both("five_DOF_mode", 0.01)
wait(5)
hand(SWAY)
measure("five, 150 N/m", seconds, { apart = 25, stiffness = 150 })
for _, robot in ipairs(ROBOTS) do apply(robot .. "/profile_stiff", { force = true }) wait_answer(robot .. "/profile_stiff.ok", 1) end
measure("five, 300 N/m", seconds, { apart = 12, stiffness = 300 })

-- Packets lost and late: 30 % lost one by one, 10 ms of jitter. It goes on, as a link that is degraded.
for _, net in ipairs{ "To_Right", "To_Left" } do
  set(net .. ".loss", 0.3, { force = true, within = 1 })
  set(net .. ".jitter", 0.01, { force = true, within = 1 })
end
wait_state("left:five_DOF_mode.degraded", 2)
measure("five, 300 N/m, 30 % lost", seconds, { apart = 12, stiffness = 300 })
