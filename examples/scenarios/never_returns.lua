-- A call of the left driver never comes back:  davit run examples/scenarios/never_returns.lua --clock simulated
--
-- `setControlMode` is called on the way down, and that is its end. Everything that is raised is heard, the other robot goes its way, and what
-- was asked for is answered by its deadline. The left robot cannot be led down: its drives answer nobody. By force it is taken down as far as
-- that goes, and what is left is named. A new start knows nothing of it.

local FILE = "../../deployments/youbot_coupling.yaml"
local function expect_ms(name, since, max)
  expect{ name = name, value = 1000 * (now() - since), max = max, unit = "ms" }
end
local function copying() for _, robot in ipairs{ "left", "right" } do wait_state(robot .. ":copying", 20) end end

deploy(FILE)
copying()
wait(0.5)
inject("left/youbot", "hang", { operation = "setControlMode" })

local asked = now()
raise("e_shutdown")
for _, robot in ipairs{ "left", "right" } do wait_state(robot .. ":shutting_down", 0.01) end
expect_ms("both are being led down after", asked, 1)
-- The step has a second. That its drives are silent is seen before.
wait_answer("left/hold.broken", 2)
expect_ms("the left one is told that nothing is known of its drives after", asked, 1100)
wait_state("left:lowering.waiting", 2)

local stopped = now()
raise("e_estop")
wait_answer("right/safe_hold.ok", 0.1)
wait_state("right:lowering", 0.01)
expect_ms("an emergency stop: the other one, which parks, brakes after", stopped, 1)
wait(1)
raise("right/e_reset")
wait_state("right:before_parking", 1)
local again = now()
raise("e_shutdown")
wait_state("right:idle", 10)
expect{ name = "released, the other one is down after", value = now() - again, max = 5, unit = "s" }

-- What cannot be reached stays, and is named.
local ended, why = pcall(shutdown, { force = true })
assert(not ended, "all was taken down, with a call that has not come back")
assert(tostring(why):find("left/youbot", 1, true), "it is not told what is left: " .. tostring(why))

deploy(FILE)
copying()
