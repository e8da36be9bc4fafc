-- The control loop of the left robot is late:  davit run examples/scenarios/late.lua --clock simulated
--
-- Its activity stands still for a while, with the driver and all that commands it. Up to 20 ms nobody notices but the torques, which go on from where they
-- were. After that the drives were off: that is a fault of the field bus, told by the driver when it is back if the monitors have not told it before. It
-- brakes, and nothing moves until somebody resets it.

deploy("../../deployments/youbot_coupling.yaml")
local ROBOTS = { "left", "right" }
local function hand(script) set("left/Operator.script", script, { force = true, within = 1 }) end
local function all_copy() for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":copying", 20) end end

local function watch(name)
  local signals = { mode = "left/youbot.control_mode" }
  for joint = 0, 4 do signals["t" .. joint] = "World.robot1_torque[" .. joint .. "]" end
  for i, axis in ipairs{ "x", "y", "z" } do
    signals["v" .. axis] = "World.robot1_tool_twist.v[" .. i - 1 .. "]"
    signals["p" .. axis] = "World.robot1_tool_pose.p[" .. i - 1 .. "]"
  end
  return sample{ every = 0.001, name = name, signals = signals }
end

local worst = { step = 0, rest = 0, way = 0, noticed = 0, braked = 0 }
-- What the motors give changes by so much in 1 ms, but for the moment in which the watchdog of the field bus switches them off; and how the tool moves
-- between two moments.
local function judge(s, from, to)
  local v, times = {}, s:times()
  for _, name in ipairs{ "t0", "t1", "t2", "t3", "t4", "vx", "vy", "vz", "px", "py", "pz" } do v[name] = s:values(name) end
  local first
  for i, t in ipairs(times) do
    local off = true
    for joint = 0, 4 do off = off and v["t" .. joint][i] == 0 end
    if i > 1 and not off then
      for joint = 0, 4 do worst.step = math.max(worst.step, math.abs(v["t" .. joint][i] - v["t" .. joint][i - 1])) end
    end
    if t >= from and t <= to then
      first = first or i
      worst.rest = math.max(worst.rest, math.sqrt(v.vx[i]^2 + v.vy[i]^2 + v.vz[i]^2))
      worst.way = math.max(worst.way, math.sqrt((v.px[i] - v.px[first])^2 + (v.py[i] - v.py[first])^2 + (v.pz[i] - v.pz[first])^2))
    end
  end
end

-- While both copy and the hand sways.
for _, late in ipairs{ { "Dynamics", 0.005 }, { "youbot", 0.015 }, { "youbot", 0.03 }, { "youbot", 0.06 }, { "Dynamics", 0.1 }, { "youbot", 0.2 },
                       { "Cart_Impedance", 0.5 } } do
  local component, seconds = table.unpack(late)
  all_copy()
  hand("sway 600 0.042 0.042 0 0.15")
  wait(2)
  wait_state("left:copying", 0)
  local s = watch("copying_" .. math.floor(1000 * seconds))
  wait(0.01)
  local at = now() + 0.01
  inject("left/" .. component, "stall", { seconds = seconds }, at)
  if seconds < 0.02 then
    wait(1)
    wait_state("left:copying", 0)
    s:stop()
    judge(s, 0, 0)
  else
    wait_answer("left/e_EC_TIMEOUT", 1)
    worst.noticed = math.max(worst.noticed, now() - at)
    wait_state("left:fault", 0.001)
    wait_answer("left/safe_hold.ok", 1)
    worst.braked = math.max(worst.braked, now() - at - seconds)
    wait_state("right:harmonizing", 0.5)
    wait(at + seconds + 2.3 - now())
    wait_state("left:fault", 0)
    s:stop()
    judge(s, at + seconds + 0.3, at + seconds + 2.3)
    hand("align 8; free 600")
    raise("left/e_reset")
    wait_state("left:operational", 0.1)
  end
end
all_copy()
raise("e_shutdown")
wait_state("pair:idle", 20)

-- While it unfolds.
for _, seconds in ipairs{ 0.015, 0.06, 0.2, 0.5 } do
  raise("e_start")
  wait_state("left:unfolding", 5)
  wait(1.5)
  local s = watch("unfolding_" .. math.floor(1000 * seconds))
  wait(0.01)
  local at = now() + 0.01
  inject("left/youbot", "stall", { seconds = seconds }, at)
  if seconds < 0.02 then
    wait_state("left:operational", 5)
    s:stop()
    judge(s, 0, 0)
  else
    wait_answer("left/e_EC_TIMEOUT", 1)
    worst.noticed = math.max(worst.noticed, now() - at)
    wait_state("left:halted", 0.001)
    wait(at + seconds + 2.3 - now())
    wait_state("left:halted", 0)
    s:stop()
    judge(s, at + seconds + 0.3, at + seconds + 2.3)
  end
  raise("e_shutdown")
  wait_state("pair:idle", 20)
end

expect{ name = "torque in 1 ms", value = worst.step, max = 0.5, unit = "N m" }
expect{ name = "noticed after", value = 1000 * worst.noticed, max = 50, unit = "ms" }
expect{ name = "braked behind the end", value = 1000 * worst.braked, max = 5, unit = "ms" }
expect{ name = "0.3 s behind the end the tool moves with", value = worst.rest, max = 0.02, unit = "m/s" }
expect{ name = "and in 2 s, until somebody resets it, by", value = 1000 * worst.way, max = 1, unit = "mm" }
