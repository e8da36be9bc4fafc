-- A file with mistakes is refused before anything is begun:  davit run examples/scenarios/rejected.lua --clock simulated
--
-- An in-port that there is not, a value of another type, a component that nothing creates: each is named with its line. What a step refuses
-- only at run time is in refused.lua.

local WRONG = {
  { "an unknown port",            "wrong.lua:7: Cart_Impedance (youbot.Cart_Impedance) has no port `ext_ref_moed`: did you mean `ext_ref_mode`?" },
  { "a value of another type",    "wrong.lua:8: `Cart_Impedance.stiffness` cannot be \"stiff\": expected float" },
  { "a component that is not there", "wrong.lua:9: no configuration creates a component `Dynamics`" },
}

local begun = now()
local taken, why = pcall(deploy, "../refused/wrong.yaml")
assert(not taken, "it was deployed")
for _, mistake in ipairs(WRONG) do
  local name, text = table.unpack(mistake)
  expect{ name = "refused before anything is begun: " .. name, value = tostring(why):find(text, 1, true) and 1 or 0, min = 1 }
end
expect{ name = "that took, of the clock", value = 1000 * (now() - begun), max = 0, unit = "ms" }

-- Nothing of it is there: the same process deploys what is right.
deploy("../refused/arm.yaml")
assert_running("Cart_Impedance")
