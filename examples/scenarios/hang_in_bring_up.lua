-- A call of the left driver does not come back while both robots are brought up:
--   davit run examples/scenarios/hang_in_bring_up.lua --clock simulated
--
-- Nobody waits for it: an emergency stop is heard, the other robot comes up, and its configuration ends by its deadline. When the call
-- comes back at last, the way down is open.

deploy("../../deployments/youbot_coupling.yaml")

local robots = { "left", "right" }
-- Down to nothing, and up again to where the drives are on, where a call of the left driver is made to take so long more.
local function again(operation, seconds)
  raise("e_shutdown")
  wait_state("pair:idle", 40)
  assert(#stack() == 0, "something is left in force")
  raise("e_start")
  wait_state("left:powering", 1)
  inject("left/youbot", "stall", { operation = operation, seconds = seconds })
end
local function expect_ms(name, since, max)
  expect{ name = name, value = 1000 * (now() - since), max = max, unit = "ms" }
end

-- The calibration hangs, and somebody stops everything.
again("start_calibration", 3)
wait_state("left:calibrating", 0.1)
wait_state("right:unfolding", 1)
wait(0.5)
local asked = now()
raise("e_estop")
for _, robot in ipairs(robots) do wait_state(robot .. ":halted", 0.1) end
expect_ms("calibrating, e_estop: both heard it after", asked, 1)
wait_answer("right/safe_hold.ok", 0.1)
expect_ms("calibrating, e_estop: the other arm, which unfolds, brakes after", asked, 1)
wait_answer("left/safe_hold.broken", 2)
wait_state("left:halted.waiting", 0.01)
expect_ms("calibrating, e_estop: told that its own drives were not reached after", asked, 1100)
wait(2.5)

-- The same, and nobody says anything: the deadline of `calibrate` is 10 s.
again("start_calibration", 12)
wait_state("left:calibrating", 0.1)
local asked = now()
wait_state("right:operational", 6)
expect{ name = "calibrating: the other robot is up after", value = now() - asked, max = 4.5, unit = "s" }
wait_answer("left/calibrate.broken", 7)
wait_state("left:deploy_failed", 0.01)
expect{ name = "calibrating: broken after", value = now() - asked, min = 9.99, max = 10.01, unit = "s" }
wait(2.5)

-- The drives are asked to take torques, and do not answer for half a second: they are silent, which is seen before the step's deadline.
-- (One that is given up begins anew when it comes back, and does not know any more where its joints are: that needs somebody.)
again("setControlMode", 0.5)
wait_state("left:taking_over", 10)
local asked = now()
wait_state("left:halted", 0.2)
expect_ms("taking over: noticed after", asked, 50)
wait_answer("left/take_over.failed", 2)
expect_ms("taking over: failed, and taken back, after", asked, 550)
wait_answer("left/safe_hold.ok", 0.1)
expect_ms("taking over: its drives brake after", asked, 550)
wait_state("right:operational", 0.1)
wait(1)

-- And once more, with nothing in the way.
raise("e_shutdown")
wait_state("pair:idle", 40)
raise("e_start")
for _, robot in ipairs(robots) do wait_state(robot .. ":operational", 10) end
for _, robot in ipairs(robots) do wait_state(robot .. ":unsync", 0) end
