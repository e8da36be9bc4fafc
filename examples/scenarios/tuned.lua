-- Seventy switches, and somebody tunes after each:  davit run examples/scenarios/tuned.lua --clock simulated
--
-- Every switch and every tuning leaves a frame, and each of them sets the same gain. Past `limits.stack` the oldest are squashed, the
-- coordinator's and the operator's each by themselves; an emergency stop is reset as ever, and the shutdown leaves nothing.

deploy("../../deployments/youbot_arm.yaml")
wait_state("copying", 20)

local refused, frames = 0, 0
for n = 1, 70 do
  local mode = n % 2 == 1 and "five_DOF" or "eight_DOF"
  raise(n % 2 == 1 and "e_5dof" or "e_8dof")
  wait(0.02)
  local is_in = false
  for _, state in ipairs(active()) do is_in = is_in or state:find(mode, 1, true) ~= nil end
  if not is_in then refused = refused + 1 end
  set("Dynamics.force_gain", { 0.1, 0.1, 0.01 * (n % 7) }, { within = 1, force = true })
  frames = math.max(frames, #stack())
end
expect{ name = "switches that were refused", value = refused, max = 0, unit = "" }
expect{ name = "frames, at most", value = frames, max = 128, unit = "" }

raise("e_estop")
wait_answer("safe_hold.ok", 0.1)
raise("e_reset")
wait_answer("safe_hold.undone", 1)
