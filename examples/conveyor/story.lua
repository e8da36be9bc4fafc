-- A belt is stopped by an emergency, twice, also while its brake still takes its time, and led down.
local function held()
  local names = {}
  for _, frame in ipairs(stack()) do names[#names + 1] = frame.configuration end
  return table.concat(names, " ")
end

fault("operation_call belt.brake", "slow", 8, 0.05)
deploy("conveyor.yaml")
raise("e_stop")
wait(0.02)
raise("e_stop")
wait_state("held", 1)
wait(0.2)
say("in force, oldest first: " .. held())
raise("e_reset")
wait_state("failed", 1)
raise("e_stop")
wait_state("held", 1)
wait(0.1)
shutdown()
