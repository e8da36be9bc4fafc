-- The driver dies where nobody operates the robot (driver_dies.rs): in `fault`, in `halted`, on the way up. What shows its drives to have power is
-- what it said last; whatever it is asked from then on is refused.

local where = param("where", "fault")
deploy("../../deployments/youbot_coupling.yaml")
if where == "fault" then
  wait_state("left:copying", 20)
  set("left/Operator.script", "free 600", { force = true, within = 1 })
  inject("left/youbot", "emergency")
  wait_state("left:waiting", 0.1)
else
  raise("e_shutdown")
  wait_state("pair:idle", 20)
  raise("e_start")
  wait_state("left:" .. (where == "calibrating" and where or "unfolding"), 5)
  wait(1)
  if where == "halted" then
    inject("left/youbot", "emergency")
    wait_state("left:waiting", 0.1)
  end
end
wait(1)
assert(signal("left/youbot.control_mode") == 1, "its drives have power")
local at = now() + 0.01
inject("left/youbot", "panic", {}, at)
wait_answer("left/e_EC_TIMEOUT", 1)
expect{ name = "noticed after", value = 1000 * (now() - at), max = 50, unit = "ms" }
wait_state(where == "fault" and "left:fault" or "left:halted", 0.01)
wait_answer((where == "fault" or where == "halted") and "left/brake_again.broken" or "left/safe_hold.broken", 0.1)

-- What is asked for behind that is refused too, and nothing goes on as if it were not.
wait(0.01)
raise("left/e_reset")
if where == "fault" then wait_answer("left/clear_faults.failed", 0.1) end
wait(2)
if where == "fault" then wait_state("left:fault", 0) end
