-- How soon the coordinators react, how long a configuration takes to apply, how long the components of a robot take to be there, and that a
-- call which hangs changes none of it:  davit run examples/scenarios/latency.lua --clock simulated
--
-- All of it is read off the log: from an event to the states that it leads to, from a request to its answer. In simulated time all of that
-- takes none; on the real clock the times are those of the machine, with the bounds of the acceptance figures. A reaction is a thread that is
-- woken, so what 99.9 % of all take is judged beside how late this machine wakes one that sleeps, both robots running:
--   davit run examples/scenarios/latency.lua --set real=true

local real = param("real", false)
local times = param("times", real and 2000 or 200)
assert(times >= 1, "`times` is how often each is measured: 1 at least")
deploy("../../deployments/youbot_coupling.yaml")

local function told(name, seconds, max_us)
  local row = { name = name, value = 1e6 * seconds, unit = "µs" }
  if not real then row.max = 0 else row.max = max_us end
  if row.max then expect(row) else figure(row) end
end

local function at_share(sorted, share) return sorted[math.max(1, math.ceil(share * #sorted))] end

-- Of what was asked for since then: how many steps it took and how long, in seconds.
local function applied(since, of)
  local asked, took = {}, {}
  for _, it in ipairs(log{ since = since }) do
    assert(it.what ~= "missed", "the log does not reach back so far")
    if it.what == "requested" and it.request and it.ask:find(of) then asked[it.request] = it.at end
    if it.what == "answered" and asked[it.request] then
      assert(it.ok, it.answer)
      table.insert(took, { ask = it.ask, seconds = it.at - asked[it.request], steps = #it.steps })
    end
  end
  return took
end

-- The right robot is asked for five and eight degrees of freedom in turn while it has nobody to copy: how long until its coordinator has it.
local mode, woken = "e_8dof", {}
local function reactions(took)
  local since, heard = now(), nil
  for _ = 1, 100 do
    mode = mode == "e_8dof" and "e_5dof" or "e_8dof"
    raise("right/" .. mode)
    local due = now() + 0.001
    wait(0.001)
    if real then table.insert(woken, now() - due) end
  end
  for _, it in ipairs(log{ since = since }) do
    if it.what == "event" and it.event:find("^right/e_%ddof$") then heard = it.at end
    if it.what == "state" and heard and it.active[1]:find("^right:") then
      table.insert(took, it.at - heard)
      heard = nil
    end
  end
end

for _, robot in ipairs{ "left", "right" } do wait_state(robot .. ":copying", 20) end

-- Components, connections and values, of both robots at once.
local steps, seconds = 0, 0
for _, it in ipairs(applied(0, "^left/")) do
  -- Calibrating and unfolding take what the arm takes.
  local moves = it.ask == "left/calibrate" or it.ask == "left/unfold"
  if not moves then steps, seconds = steps + it.steps, seconds + it.seconds end
end
figure{ name = "bring-up of one: steps", value = steps }
told("bring-up of one: all configurations in which nothing moves", seconds, 50000)

-- One profile for another: two values are taken back, and two set.
local took, since, profile = {}, now(), "soft"
for nth = 1, times do
  profile = profile == "soft" and "stiff" or "soft"
  apply("left/profile_" .. profile, { force = true })
  wait_answer("left/profile_" .. profile .. ".ok", 1)
  -- The log reaches some hundred of them back.
  if nth % 100 == 0 or nth == times then
    for _, it in ipairs(applied(since, "^left/profile_")) do table.insert(took, it) end
    wait(0.001)
    since = now()
  end
end
assert(#took == times, #took .. " of " .. times .. " were found in the log")
table.sort(took, function(a, b) return a.seconds < b.seconds end)
figure{ name = "a switch: steps", value = took[1].steps }
told("a switch: from the request to its answer, median", at_share(took, 0.5).seconds or 0, 200)

-- The left robot is stopped, and the right one lets go. A call to the left base's controller, which hangs, and none, in turn.
raise("left/e_estop")
wait_state("left:fault", 1)
wait_state("right:harmonizing", 1)
local hung, free = {}, {}
while #free < times do
  reactions(free)
  inject("left/Base_Ctrl", "stall", { seconds = 0.5 })
  wait(0.005)
  apply("left/base_stop", { force = true })
  local at = now()
  reactions(hung)
  for _, it in ipairs(log{ since = at }) do assert(it.what ~= "answered" or it.ask ~= "left/base_stop", "it has come back already") end
  wait_answer("left/base_stop.ok", 1)
  wait(0.1)
end
table.sort(woken)
if real then told("a sleeping thread is woken, 99.9 %", at_share(woken, 0.999)) end
for _, it in ipairs{ { "while a call of the left robot hangs", hung }, { "while none does", free } } do
  table.sort(it[2])
  figure{ name = "events, " .. it[1], value = #it[2] }
  told("event to reaction, " .. it[1] .. ", median", at_share(it[2], 0.5), 100)
  told("event to reaction, " .. it[1] .. ", 99.9 %", at_share(it[2], 0.999))
  if real then told("beyond what waking takes, " .. it[1], math.max(0, at_share(it[2], 0.999) - at_share(woken, 0.999)), 100) end
end
if real then expect{ name = "one median beside the other", value = at_share(hung, 0.5) / at_share(free, 0.5), max = 1.1 } end
