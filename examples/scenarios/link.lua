-- The link between two robots that copy: cut and healed, slower, bad, and with packets that are wrong.
--   davit run examples/scenarios/link.lua --clock simulated

deploy("../../deployments/youbot_coupling.yaml")

local function both(event) raise("left/" .. event) raise("right/" .. event) end
local function until_both(state, seconds)
  wait_state("left:" .. state, seconds)
  wait_state("right:" .. state, seconds)
  return now()
end
-- What goes wrong with both networks at a moment of the clock: a fault of the world, which no configuration knows of.
local function nets(fault, parameters)
  local at = now() + 0.1
  for _, net in ipairs{ "To_Right", "To_Left" } do inject(net, fault, parameters, at) end
  return at
end
local function heal() for _, net in ipairs{ "To_Right", "To_Left" } do inject(net, "heal") end end
local function norm(s, name)
  local x, y, z, all = s:values(name .. "_x"), s:values(name .. "_y"), s:values(name .. "_z"), {}
  for i = 1, #x do all[i] = math.sqrt(x[i]^2 + y[i]^2 + z[i]^2) end
  return all
end
local function after(s, name, since)
  local largest = 0
  for i, value in ipairs(norm(s, name)) do if s:times()[i] >= since then largest = math.max(largest, value) end end
  return largest
end
local SWAY = "sway 600 0.042 0.042 0 0.15"
local function hand(script) set("left/Operator.script", script, { force = true, within = 1 }) end
local function forces(name)
  local signals = { base_x = "left/youbot.odometry.x", base_y = "left/youbot.odometry.y", left_up = "World.robot1_tool_pose.p[2]", right_up = "World.robot2_tool_pose.p[2]" }
  for _, robot in ipairs{ "left", "right" } do
    for i, axis in ipairs{ "x", "y", "z" } do
      signals[robot .. "_" .. axis] = robot .. "/Cart_Impedance.f_des[" .. i - 1 .. "]"
    end
  end
  return sample{ every = 0.001, name = name, signals = signals }
end

until_both("eight_DOF_mode", 20)
set("right/Operator.script", "free 600", { force = true, within = 1 })

-- Cut, for 2 s, with five degrees of freedom and with eight; then the hand holds the tools apart. Which of the two robots is told first is not
-- said; each lets go by itself, and its arm stays up.
for _, mode in ipairs{ "five", "eight" } do
  both(mode == "five" and "e_5dof" or "e_8dof")
  until_both(mode .. "_DOF_mode", 0.01)
  hand(SWAY)
  wait(3)
  local s, at = forces(mode .. "_cut"), nets("cut", { seconds = 2 })
  wait_state("left:unsync", 0.5)
  wait_state("right:unsync", 0.5)
  local lost, disabled = 0, 0
  for _, it in ipairs(log{ since = at }) do
    if it.what == "event" and it.event:find("e_link_lost") then lost = math.max(lost, it.at) end
  end
  for _, robot in ipairs{ "left", "right" } do wait_answer(robot .. "/disable_copying.ok", 0.01) end
  disabled = now()
  hand("hold 600")
  wait(at + 2 - now())
  expect{ name = mode .. ", cut: e_link_lost after", value = lost - at, max = 0.12, unit = "s" }
  expect{ name = mode .. ", cut: disable_copying behind it", value = disabled - lost, max = 0.005, unit = "s" }
  expect{ name = mode .. ", cut: force after 0.16 s", value = math.max(after(s, "left", at + 0.16), after(s, "right", at + 0.16)), max = 0.1, unit = "N" }
  -- Healed, and the left tool is 10 cm away: nothing couples before somebody has brought them together.
  hand("go 1 0 0 0.1; hold 600")
  local healed = at + 2
  expect{ name = mode .. ", healed: harmonizing after", value = until_both("harmonizing", 3) - healed, min = 1.0, max = 1.2, unit = "s" }
  wait(3)
  until_both("harmonizing", 0)
  s:stop()
  expect{ name = mode .. ", healed and apart: force", value = math.max(after(s, "left", at + 0.16), after(s, "right", at + 0.16)), max = 0.1, unit = "N" }
  expect{ name = mode .. ", without a link: the right arm came down by", value = 1000 * (s:max("right_up") - s:last("right_up")), max = 2, unit = "mm" }
  local s = forces(mode .. "_healed")
  hand("align 8; free 600")
  until_both(mode .. "_DOF_mode", 20)
  hand(SWAY)
  wait(3)
  until_both(mode .. "_DOF_mode", 0)
  s:stop()
  if mode == "five" then
    expect{ name = "healed: the base went, with five", unit = "m", max = 0.002,
            value = math.max(s:max("base_x") - s:min("base_x"), s:max("base_y") - s:min("base_y")) }
  end
end

-- From 2 ms one way to 50: eight degrees of freedom are left, and nobody takes them again but an operator.
both("e_8dof")
until_both("eight_DOF_mode", 0.01)
nets("delay", { delay = 0.002 })
wait(3)
local s, at = sample{ every = 0.001, name = "slow", signals = { "left/Cart_Impedance.active", "right/Cart_Impedance.active" } }, nets("delay", { delay = 0.05 })
for _, robot in ipairs{ "left", "right" } do wait_answer(robot .. "/e_qos_degraded", 0.5) end
expect{ name = "50 ms: e_qos_degraded after", value = now() - at, max = 0.1, unit = "s" }
until_both("five_DOF_mode", 0.1)
both("e_8dof")
wait(5)
until_both("five_DOF_mode", 0)
-- The damper on the own velocity follows the delay by itself: 1.2 times stiffness times delay.
expect{ name = "50 ms: damping", value = math.min(signal("left/Cart_Impedance.damping"), signal("right/Cart_Impedance.damping")), min = 9, unit = "N s/m" }
heal()
until_both("five_DOF_mode.free", 5)
wait(1)
until_both("five_DOF_mode.free", 0)
s:stop()
expect{ name = "healed: damping", value = math.max(signal("left/Cart_Impedance.damping"), signal("right/Cart_Impedance.damping")), max = 5, unit = "N s/m" }
expect{ name = "50 ms: copying", value = 100 * math.min(s:mean("left/Cart_Impedance.active"), s:mean("right/Cart_Impedance.active")), min = 100, unit = "%" }
both("e_8dof")
until_both("eight_DOF_mode", 0.01)
wait(2)

-- 30 % of the packets lost, and up to 10 ms of jitter: the same, and they go on copying. 300 N/m.
for _, robot in ipairs{ "left", "right" } do
  apply(robot .. "/profile_stiff", { force = true })
  wait_answer(robot .. "/profile_stiff.ok", 1)
end
hand("sway 600 0.06 0 0 0.15")
wait(4)
local signals = { left = "left/Cart_Impedance.active", right = "right/Cart_Impedance.active" }
for robot = 1, 2 do
  for i = 0, 2 do signals["p" .. robot .. i] = "World.robot" .. robot .. "_tool_pose.p[" .. i .. "]" end
end
local s = sample{ every = 0.001, name = "lossy", signals = signals }
nets("loss", { loss = 0.3 })
nets("jitter", { jitter = 0.01 })
until_both("five_DOF_mode.degraded", 2)
wait(20)
until_both("five_DOF_mode.degraded", 0)
s:stop()
local squares, v = 0, {}
for name in pairs(signals) do v[name] = s:values(name) end
for i = 1, #v.p10 do squares = squares + (v.p10[i] - v.p20[i])^2 + (v.p11[i] - v.p21[i])^2 + (v.p12[i] - v.p22[i])^2 end
expect{ name = "30 % lost: copying", value = 100 * math.min(s:mean("left"), s:mean("right")), min = 100, unit = "%" }
expect{ name = "30 % lost: tools apart, RMS", value = 1000 * math.sqrt(squares / #v.p10), max = 12, unit = "mm" }
heal()
until_both("five_DOF_mode.free", 5)
for _, robot in ipairs{ "left", "right" } do undo(robot .. "/profile_stiff") end
hand("align 8; free 600")
both("e_8dof")
until_both("eight_DOF_mode", 0.01)
wait(2)

-- 150 ms: that is no link any more.
local at = nets("delay", { delay = 0.15 })
wait_answer("left/e_link_lost", 1)
expect{ name = "150 ms: e_link_lost after", value = now() - at, max = 0.25, unit = "s" }
until_both("unsync", 0.2)
wait(3)
until_both("unsync", 0)
hand("align 8; free 600")
heal()
until_both("eight_DOF_mode", 20)
wait(2)

-- What the right robot says of its tool jumps by 30 cm on the way, for half a second.
local s, at = forces("jump"), now() + 0.1
inject("To_Left", "corrupt", { by = { 0.3, 0, 0 }, seconds = 0.5 }, at)
wait_state("left:soft_stop", 0.5)
local stopped = now()
wait_answer("right/e_peer_left", 1)
wait(1)
s:stop()
expect{ name = "jump: soft_stop after", value = stopped - at, max = 0.02, unit = "s" }
expect{ name = "jump: force, at most", value = math.max(after(s, "left", at), after(s, "right", at)), max = 10, unit = "N" }
-- The packets are right again: it is an operator who goes on, and who asks for a base that yields.
wait_state("left:soft_stop", 0)
raise("left/e_reset")
wait_state("left:five_DOF_mode", 20)
wait_state("right:copying", 20)
raise("left/e_8dof")
until_both("eight_DOF_mode", 20)
