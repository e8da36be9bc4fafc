-- What one robot is asked is done at once, whatever the other one does:  davit run examples/scenarios/beside.lua --clock simulated
--
-- Both arms are parked, which takes seconds, and people tune the robots meanwhile. Then, while both come up again, the left driver's calibration does
-- not come back for 12 s: the right robot comes up, and people tune it. All times are from asking to hearing the answer; on the real clock they are those of
-- the machine, and are told only:
--   davit run examples/scenarios/beside.lua --set real=true

local real, times = param("real", false), param("times", 100)
deploy("../../deployments/youbot_coupling.yaml")

-- Asks the robots in turn, each for another profile every time; median and worst.
local function tuned(name, robots)
  local took = {}
  for i = 1, times do
    local profile = robots[1 + i % #robots] .. (i // #robots % 2 == 0 and "/profile_soft" or "/profile_stiff")
    local asked = now()
    apply(profile, { force = true })
    wait_answer(profile .. ".ok", 1)
    table.insert(took, now() - asked)
    wait(0.01)
  end
  table.sort(took)
  for _, it in ipairs{ { "median", took[(#took + 1) // 2] }, { "worst", took[#took] } } do
    local told, seconds = name .. ": asked and answered, " .. it[1], it[2]
    if real then figure{ name = told, value = 1e6 * seconds, unit = "µs" } else expect{ name = told, value = seconds, max = 0, unit = "s" } end
  end
end

for _, robot in ipairs{ "left", "right" } do wait_state(robot .. ":copying", 15) end
raise("e_shutdown")
for _, robot in ipairs{ "left", "right" } do wait_state(robot .. ":parking", 2) end
tuned("both park", { "left", "right" })
for _, robot in ipairs{ "left", "right" } do wait_state(robot .. ":parking", 0) end
wait_state("pair:idle", 10)

raise("e_start")
wait_answer("left/create_core.ok", 1)
inject("left/youbot", "stall", { operation = "start_calibration", seconds = 12 })
wait_state("right:operational", 6)
wait_state("left:calibrating", 0)
tuned("a call of the other one hangs", { "right" })
wait_state("left:calibrating", 0)
wait_answer("left/calibrate.broken", 7)
wait(2.5)
