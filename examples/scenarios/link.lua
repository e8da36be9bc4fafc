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
  local signals = { base_x = "left/youbot.odometry.x", base_y = "left/youbot.odometry.y" }
  for _, robot in ipairs{ "left", "right" } do
    for i, axis in ipairs{ "x", "y", "z" } do
      signals[robot .. "_" .. axis] = robot .. "/Cart_Impedance.f_des[" .. i - 1 .. "]"
    end
  end
  return sample{ every = 0.001, name = name, signals = signals }
end

until_both("eight_DOF_mode", 20)
hand(SWAY)
both("e_5dof")
until_both("five_DOF_mode", 0.01)
wait(5)

-- Cut, for 2 s. Which of the two robots is told first is not said; each lets go by itself.
local s, at = forces("cut"), nets("cut", { seconds = 2 })
wait_answer("left/e_link_lost", 0.5)
local lost = now()
wait_state("left:unsync", 0.01)
wait_answer("left/disable_copying.ok", 0.01)
local disabled = now()
until_both("unsync", 0.1)
wait(at + 2 - now())
expect{ name = "cut: e_link_lost after", value = lost - at, max = 0.12, unit = "s" }
expect{ name = "cut: disable_copying behind it", value = disabled - lost, max = 0.005, unit = "s" }
expect{ name = "cut: force after 0.16 s", value = math.max(after(s, "left", at + 0.16), after(s, "right", at + 0.16)), max = 0.1, unit = "N" }
hand("align 8; free 600")
local healed = at + 2
expect{ name = "healed: harmonizing after", value = until_both("harmonizing", 3) - healed, min = 1.0, max = 1.2, unit = "s" }
until_both("five_DOF_mode", 20)
hand(SWAY)
wait(3)
until_both("five_DOF_mode", 0)
s:stop()
expect{ name = "healed: the base went, with five", unit = "m", max = 0.002,
        value = math.max(s:max("base_x") - s:min("base_x"), s:max("base_y") - s:min("base_y")) }

-- 50 ms one way: eight degrees of freedom are left, and nobody takes them again but an operator.
both("e_8dof")
until_both("eight_DOF_mode", 0.01)
wait(3)
local s, at = sample{ every = 0.001, name = "slow", signals = { "left/Cart_Impedance.active", "right/Cart_Impedance.active" } }, nets("delay", { delay = 0.05 })
wait_answer("left/e_qos_degraded", 0.5)
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

-- A third of the packets lost: the same.
nets("loss", { loss = 0.3 })
until_both("five_DOF_mode.degraded", 2)
heal()
until_both("five_DOF_mode.free", 5)
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
