-- Whether the coupling of two robots stays stable over a network that is slow, both coordinators in the loop. The chart of docs/youbot.md:
--   davit sweep examples/stability.lua --set K=70,150,300,600 --set delay=0,0.005,0.01,0.02,0.03,0.05 --set law=position,tank
--
-- The arms have a tenth of their friction, most of it compensated, and hardly any damping: these hide it. The left tool is pushed for half a second and let alone.

local K     = param("K", 150)           -- N/m
local delay = param("delay", 0.005)     -- one way, s
local law   = param("law", "position")  -- or tank
local Ba    = param("damping", 2)       -- N s/m
local friction = param("friction", 0.1) -- of the joints, as a share of the nominal one
local rule  = param("rule", 0)          -- damping per stiffness and delay, where that is more; 1.2: as the coupling has it

assert(law == "position" or law == "tank", "`law` is position or tank")
deploy(law == "tank" and "tank/coupling.yaml" or "../deployments/youbot_coupling.yaml")

local ROBOTS = { "left", "right" }
local function hand(robot, script) set(robot .. "/Operator.script", script, { force = true, within = 1 }) end
local function of_both(property, value)
  for _, robot in ipairs(ROBOTS) do set(robot .. "/" .. property, value, { force = true, within = 1 }) end
end

hand("left", "free 1.5; align 8; hold 1; free 600")
set("Observer.stiffness", K, { force = true, within = 1 })
for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":copying", 20) end
for _, robot in ipairs(ROBOTS) do raise(robot .. "/e_5dof") end
of_both("Cart_Impedance.damping_rel", 0)
of_both("Cart_Impedance.damping_abs", Ba)
of_both("Cart_Impedance.delay_damping", rule)
of_both("Cart_Impedance.stiffness", K)
for number = 1, 2 do set("World.robot" .. number .. "_friction_scale", friction, { force = true, within = 1 }) end
of_both("Dynamics.friction_comp", 0.9 * friction)
hand("right", "free 600")
-- Slow from here on: over a slow network they would not begin to couple.
for _, net in ipairs{ "To_Right", "To_Left" } do set(net .. ".delay", delay, { force = true, within = 1 }) end
wait(0.5)

local signals = { energy = "Observer.energy", force = "left/Cart_Impedance.f_raw_norm" }
for number, robot in ipairs(ROBOTS) do
  signals[robot] = robot .. "/Cart_Impedance.active"
  for i, axis in ipairs{ "x", "y", "z" } do signals[robot .. axis] = "World.robot" .. number .. "_tool_pose.p[" .. i - 1 .. "]" end
end
hand("left", "free 0.1; push 0.5 0 3 0; free 600")
local s = sample{ every = 0.002, signals = signals }
local at = now()
wait(10.1)
s:stop()

-- By how much the way between the tools swings in two seconds soon after the push and eight seconds later; and that way over all of it,
-- root mean square. Where friction has them rest a little apart nothing swings.
local v, times = {}, s:times()
for name in pairs(signals) do v[name] = s:values(name) end
local function swing(from, to)
  local least, most = math.huge, 0
  for i, t in ipairs(times) do
    if t >= at + from and t < at + to then
      local e = math.sqrt((v.leftx[i] - v.rightx[i])^2 + (v.lefty[i] - v.righty[i])^2 + (v.leftz[i] - v.rightz[i])^2)
      least, most = math.min(least, e), math.max(most, e)
    end
  end
  return most - least
end
local early, late = swing(1.1, 3.1), swing(8.1, 10.1)
local square, coupled = 0, 0
for i in ipairs(times) do
  square = square + (v.leftx[i] - v.rightx[i])^2 + (v.lefty[i] - v.righty[i])^2 + (v.leftz[i] - v.rightz[i])^2
  if v.left[i] > 0 and v.right[i] > 0 then coupled = coupled + 1 end
end
-- 2: it dies out; 1: it rings on; 0: it grows, or has grown until the robots let go.
local stable = (coupled < #times or late > math.max(early, 0.001)) and 0 or late < 0.001 and 2 or 1
figure{ name = "stable", value = stable }
figure{ name = "early", value = 1000 * early, unit = "mm" }
figure{ name = "late", value = 1000 * late, unit = "mm" }
figure{ name = "RMS", value = 1000 * math.sqrt(square / #times), unit = "mm" }
figure{ name = "peak force", value = s:max("force"), unit = "N" }
figure{ name = "given out", value = math.max(0, -s:min("energy")), unit = "J" }
figure{ name = "coupled", value = 100 * coupled / #times, unit = "%" }
