-- A SCARA on a rail under the youBot's coordinator, in simulated time:
--
--     cargo run --example scara -- run examples/scara/story.lua --clock simulated
--
-- It comes up, finds the handle that it follows, and copies it: arm and rail (`eight_DOF`), then the arm alone (`five_DOF`). Then things go
-- wrong in the middle of that, and on the way up; each time all of it comes to rest and stays there. Down to nothing at the end.
--   --set seconds=60 --set seed=7 --set delay=0.01 --set friction=1.3    for how long each mode is measured; the network's seed, and one way
--   in s (over 15 ms the coordinator refuses rail and arm); the arm's friction as a multiple of what the drives believe

local seconds, seed, delay, friction = param("seconds", 20), param("seed", 1), param("delay", 0.005), param("friction", 1)

local function change(what, value) set(what, value, { force = true, within = 1 }) end

-- Recordings ----------------------------------------------------------------------------------------------------------

local TOOL, HANDLE = { "x", "y", "z" }, { "hx", "hy", "hz" }

local function record(name, every)
  local signals = { rail = "Drives.axes.pos[0]", turn = "Plant.tool.p[3]", hturn = "Leader.tool.p[3]", hand = "Leader.hand",
                    force = "Follower.wanted", copying = "Follower.active", limit = "Drives.at_limit",
                    shoulder = "Drives.command.effort[1]", elbow = "Drives.command.effort[2]" }
  for i = 1, 3 do
    signals[TOOL[i]] = "Plant.tool.p[" .. i - 1 .. "]"
    signals[HANDLE[i]] = "Leader.tool.p[" .. i - 1 .. "]"
    signals["v" .. i] = "Plant.tool.v[" .. i - 1 .. "]"
    signals["f" .. i] = "Follower.wrench[" .. i - 1 .. "]"
  end
  return sample{ every = every, name = name, signals = signals }
end

-- How far tool and handle are apart, rms: in mm, and in degrees about z.
local function apart(s)
  local square, turned, n = 0, 0, s:count("x")
  for i = 1, 3 do
    local a, b = s:values(TOOL[i]), s:values(HANDLE[i])
    for k = 1, n do square = square + (a[k] - b[k])^2 end
  end
  local a, b = s:values("turn"), s:values("hturn")
  for k = 1, n do turned = turned + (a[k] - b[k])^2 end
  return 1000 * math.sqrt(square / n), math.deg(math.sqrt(turned / n))
end

-- The fastest that the tool was between two times, in m/s; how far it came in it, in mm.
local function motion(s, from, to)
  local fastest, first, way = 0, nil, 0
  local p, v = {}, {}
  for i = 1, 3 do p[i], v[i] = s:values(TOOL[i]), s:values("v" .. i) end
  for k, at in ipairs(s:times()) do
    if at >= from and at <= to then
      first = first or k
      local speed, off = 0, 0
      for i = 1, 3 do speed, off = speed + v[i][k]^2, off + (p[i][k] - p[i][first])^2 end
      fastest, way = math.max(fastest, math.sqrt(speed)), math.max(way, 1000 * math.sqrt(off))
    end
  end
  assert(first, "nothing was recorded")
  return fastest, way
end

-- Copying, measured -----------------------------------------------------------------------------------------------------

local function measure(name, seconds, bounds)
  local s = record(name:gsub("%W+", "_"), 0.005)
  wait(seconds)
  s:stop()
  local mm, degrees = apart(s)
  local rail, led = s:max("rail") - s:min("rail"), s:max("hx") - s:min("hx")
  expect{ name = name .. ": tool from handle, rms", value = mm, max = 12, unit = "mm" }
  expect{ name = name .. ": turned from it, rms", value = degrees, max = 2, unit = "deg" }
  expect{ name = name .. ": hand, rms", value = s:rms("hand"), max = 8, unit = "N" }
  expect{ name = name .. ": led along the rail", value = 1000 * led, min = bounds.led, unit = "mm" }
  expect{ name = name .. ": way of the rail", value = 1000 * rail, min = bounds.rail, max = bounds.stands, unit = "mm" }
  expect{ name = name .. ": copying", value = 100 * s:mean("copying"), min = 100, unit = "%" }
  expect{ name = name .. ": motors at their limit", value = s:max("limit"), max = 0 }
end

local EIGHT = { 0.06, 0.03, 0.03, 0.3 }

local function couple()
  wait_state("copying", 10)
  change("Leader.amplitude", EIGHT)
  wait(3)
  wait_state("copying", 0)
end

-- What goes wrong -------------------------------------------------------------------------------------------------------

-- A recording that begins while the tool moves at about its fastest.
local function in_motion(name)
  for _ = 1, 1000 do
    local v, square = signal("Plant.tool.v"), 0
    for i = 1, 3 do square = square + v[i]^2 end
    if square > 0.07^2 then break end
    wait(0.01)
  end
  local s = record(name, 0.001)
  wait(0.05)
  return s, now()
end

-- It is stopped at `at`: at rest 0.3 s later, and nothing moves for two seconds after that. `by`: recorded since before.
local function stays(name, s, at)
  wait(at + 2.3 - now())
  s:stop()
  local before = motion(s, at - 0.02, at)
  local after, way = motion(s, at + 0.3, at + 2.3)
  expect{ name = name .. ": it was in motion", value = before, min = 0.05, unit = "m/s" }
  expect{ name = name .. ": 0.3 s later", value = after, max = 0.02, unit = "m/s" }
  expect{ name = name .. ": its way in 2 s from then on", value = way, max = 1, unit = "mm" }
  local step = 0
  for _, joint in ipairs{ "shoulder", "elbow" } do
    local torque = s:values(joint)
    for k = 2, #torque do step = math.max(step, math.abs(torque[k] - torque[k - 1])) end
  end
  expect{ name = name .. ": torque in 1 ms", value = step, max = 0.5, unit = "N m" }
end

-- Down: components, connections and frames that are left.
local function left_behind(within)
  wait_state("idle", within)
  wait(0.01)
  local left = #stack()
  for _, of in ipairs{ "components", "connections" } do
    for _ in pairs(system()[of]) do left = left + 1 end
  end
  return left
end

-- The story -------------------------------------------------------------------------------------------------------------

deploy("deployment.yaml")
figure{ name = "up after", value = now(), unit = "s" }
change("Leader.delay", delay)
change("Leader.seed", seed)
change("Plant.friction", friction)
wait_state("harmonizing", 2)
wait_state("eight_DOF_mode", 10)
expect{ name = "engaging: force in the first 0.3 s", value = (function()
  local s = record("engaging", 0.001)
  wait(0.3)
  s:stop()
  return s:max("force")
end)(), max = 2, unit = "N" }

change("Leader.amplitude", EIGHT)
wait(3)
assert(property("Torques.rail_gain") > 0)
measure("arm and rail", seconds, { led = 100, rail = 50 })

-- Farther than the arm reaches by itself: the rail carries it.
change("Leader.amplitude", { 0, 0, 0, 0 })
change("Leader.go", { 0.25, 0, 0 })
wait(6)
change("Leader.go", { -0.25, 0, 0 })
measure("arm and rail, half a metre", 8, { led = 400, rail = 400 })
change("Leader.go", { 0, 0, 0 })
wait(5)

raise("e_5dof")
wait_answer("five_DOF.ok", 1)
assert(property("Torques.rail_gain") == 0)
change("Leader.amplitude", EIGHT)
wait(3)
measure("the arm alone", seconds, { led = 100, stands = 1 })

-- Packets lost and late.
change("Leader.loss", 0.3)
change("Leader.jitter", 0.01)
measure("the arm alone, 30 % lost", seconds, { led = 100, stands = 1 })
change("Leader.loss", 0)
change("Leader.jitter", 0)

-- Eight and five in turn: nothing is felt of it, and the last one counts.
local s = record("in_turn", 0.001)
for _ = 1, 10 do
  raise("e_8dof")
  wait(0.2)
  raise("e_5dof")
  wait(0.2)
end
s:stop()
local jump, force = 0, s:values("force")
for k = 2, #force do jump = math.max(jump, math.abs(force[k] - force[k - 1])) end
expect{ name = "both in turn, 5 Hz: force in 1 ms", value = jump, max = 2, unit = "N" }
expect{ name = "both in turn, 5 Hz: copying", value = 100 * s:mean("copying"), min = 100, unit = "%" }
wait_state("five_DOF_mode", 0)

-- One frame by hand, and undone.
apply("profile_soft", { force = true })
wait_answer("profile_soft.ok", 1)
assert(property("Follower.stiffness") == 150)
undo()
wait_answer("undo.done", 1)
assert(property("Follower.stiffness") == 300)

-- The handle is not heard: the arm is let go, and it stands.
local s, at = in_motion("cut")
change("Leader.cut", true)
wait_answer("e_link_lost", 0.2)
expect{ name = "not heard: noticed after", value = 1000 * (now() - at), max = 120, unit = "ms" }
wait_answer("disable_copying.ok", 0.1)
wait(at + 0.16 - now())
expect{ name = "not heard: engaged 160 ms later", value = signal("Follower.engaged"), max = 0 }
stays("not heard", s, at)
change("Leader.cut", false)
wait_state("harmonizing", 2)
couple()
wait_state("five_DOF_mode", 0)                  -- what was chosen is kept
raise("e_8dof")
wait(1)

-- What the handle tells jumps: the arm is let go and the rail stands, until somebody says so.
local s, at = in_motion("jump")
inject("Leader", "jump", { x = 0.3, seconds = 0.2 })
wait_answer("e_force_spike", 1)
expect{ name = "the reference jumps: noticed after", value = 1000 * (now() - at), max = 20, unit = "ms" }
wait_answer("base_stop.ok", 0.01)
wait_state("soft_stop", 0)
stays("the reference jumps", s, at)
local step, f = 0, { s:values("f1"), s:values("f2"), s:values("f3") }
for k = 2, #f[1] do
  step = math.max(step, math.sqrt((f[1][k] - f[1][k - 1])^2 + (f[2][k] - f[2][k - 1])^2 + (f[3][k] - f[3][k - 1])^2))
end
expect{ name = "the reference jumps: force in 1 ms", value = step, max = 0.5, unit = "N" }
raise("e_reset")
couple()

-- Somebody shoves the tool: it gives way, and gets too fast. It brakes while the shove goes on.
local s, at = in_motion("push")
inject("Plant", "push", { x = 20, y = 50, seconds = 0.1 })
wait_answer("e_overspeed", 1)
local heard = now()
expect{ name = "54 N for 0.1 s: noticed after", value = 1000 * (heard - at), max = 200, unit = "ms" }
wait_answer("safe_hold.ok", 0.01)
stays("54 N for 0.1 s", s, heard)
raise("e_reset")
couple()

-- A motor takes too much current: heard, braked; after a reset it takes torques again before anything couples.
local s, at = in_motion("overcurrent")
inject("Drives", "overcurrent", {})
wait_answer("e_OVERCURRENT", 1)
expect{ name = "overcurrent: heard after", value = 1000 * (now() - at), max = 5, unit = "ms" }
wait_answer("safe_hold.ok", 0.01)
wait_state("fault", 0)
stays("overcurrent", s, at)
raise("e_reset")
wait_state("operational", 0.1)
assert(signal("Drives.wrong") == 0)
couple()

-- The controller dies: braked, and begun anew without asking.
local s, at = in_motion("controller")
inject("Follower", "panic", {})
wait_answer("e_controller_lost", 1)
expect{ name = "the controller dies: noticed after", value = 1000 * (now() - at), max = 50, unit = "ms" }
wait_answer("safe_hold.ok", 0.01)
wait_state("operational", 1)
assert_running("Follower")
wait_state("harmonizing", 2)
expect{ name = "the controller dies: harmonizing after", value = now() - at, max = 1, unit = "s" }
s:stop()
couple()

-- What commands the drives dies: they hold by themselves. It stays so, and it is led down all the same.
local s, at = in_motion("torques")
inject("Torques", "panic", {})
wait_answer("e_cmd_watchdog", 1)
expect{ name = "nobody commands the drives: noticed after", value = 1000 * (now() - at), max = 50, unit = "ms" }
wait_answer("safe_hold.ok", 0.01)
stays("nobody commands the drives", s, at)
wait_state("fault", 0)
raise("e_shutdown")
expect{ name = "down from there: left", value = left_behind(10), max = 0 }

-- On the way up again: an emergency stop while it unfolds. What is up is undone, the arm folded.
raise("e_start")
wait_state("unfolding", 5)
wait(1)
local s, at = in_motion("unfolding")
raise("e_estop")
wait_answer("safe_hold.ok", 0.001)
stays("stopped while it unfolds", s, at)
raise("e_reset")
wait_state("deploy_failed", 1)
raise("e_shutdown")
wait_state("cancelling.folding", 1)
expect{ name = "up undone: left", value = left_behind(10), max = 0 }

-- Up once more, and down while it copies.
raise("e_start")
wait_state("eight_DOF_mode", 20)
raise("e_shutdown")
wait_answer("disable_copying.ok", 0.01)
wait_state("parking", 1)
expect{ name = "down while it copies: left", value = left_behind(10), max = 0 }
figure{ name = "all of it took", value = now(), unit = "s" }
shutdown()
