-- A configuration that fails when it is asked for:  davit run examples/scenarios/refused.lua --clock simulated
--
-- `enable_copying` is answered *failed*, once at once and once because nothing is heard of it by its deadline. Its coordinator goes back,
-- and nothing of what was asked for together with it stays. On the simulated platform, where steps can be made to fail.

deploy("../refused/arm.yaml")
raise("e_qos_ok")
wait_state("harmonizing", 1)

local function enabled()
  local gain = property("Dynamics.force_gain")
  return port("Cart_Impedance.ext_ref_mode") == true or gain[1] ~= 0 or gain[2] ~= 0 or gain[3] ~= 0
end

for _, how in ipairs{ "fail", "lost" } do
  local longest = how == "fail" and 1 or 1100     -- the deadline of a step is 1 s
  fault("port_write Cart_Impedance.ext_ref_mode = true", how)
  local at = now()
  raise("e_aligned")
  wait_answer("enable_copying.failed", 2)
  local failed
  for _, it in ipairs(log{ since = at }) do if it.answer == "enable_copying.failed" then failed = it end end
  local reasons = table.concat(failed.reasons, "; ")
  assert(reasons:find("port_write Cart_Impedance.ext_ref_mode = true", 1, true), "it is not told which step failed: " .. reasons)
  wait_state("harmonizing", 0.01)
  wait_answer("five_DOF.ok", 0.01)
  expect{ name = how .. ": harmonizing again after", value = 1000 * (now() - at), max = longest, unit = "ms" }
  wait(0.5)
  wait_state("harmonizing", 0)
  expect{ name = how .. ": enabled all the same", value = enabled() and 1 or 0, max = 0 }
  expect{ name = how .. ": differs from what should be", value = #drift(), max = 0 }
end

raise("e_aligned")
wait_state("copying", 0.1)
wait_answer("enable_copying.ok", 0.1)
wait_answer("eight_DOF.ok", 0.1)
expect{ name = "asked for once more, it is enabled", value = enabled() and 1 or 0, min = 1 }
