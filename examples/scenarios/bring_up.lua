-- Up, and coupled from arms that are apart:  davit run examples/scenarios/bring_up.lua --clock simulated
--
-- The second bring-up of the script is the one that is measured: from the first, `deploy` comes back when it is over.

deploy("../../deployments/youbot_coupling.yaml")
raise("e_shutdown")
wait_state("pair:idle", 20)
local begin = now()
raise("e_start")
wait_state("left:calibrating", 1)
local calibrating = now()
wait_state("left:unfolding", 2)
local unfolding = now()
wait_state("left:starting", 8)
local unfolded = now()
wait_state("left:unsync", 1)
wait_state("right:unsync", 1)
figure{ name = "calibrating took", value = unfolding - calibrating, unit = "s" }
figure{ name = "unfolding took", value = unfolded - unfolding, unit = "s" }
expect{ name = "all else of the bring-up", value = now() - begin - (unfolded - calibrating), max = 0.5, unit = "s" }

-- The hand carries the left tool 10 cm away before the link has settled, and then to the other one.
set("left/Operator.script", "go 1 0 0.1 0; hold 1; align 8; free 600", { force = true, within = 1 })
local signals = {}
for _, robot in ipairs{ "left", "right" } do
  for i = 0, 2 do signals[robot .. i] = robot .. "/Cart_Impedance.f_des[" .. i .. "]" end
end
local s = sample{ every = 0.001, signals = signals }
wait(1.5)
wait_state("left:harmonizing", 1)
expect{ name = "wanted while they are apart", value = signal("left/Cart_Impedance.f_raw_norm"), min = 8, unit = "N" }
for name in pairs(signals) do assert(s:max(name) == 0 and s:min(name) == 0, "force before they couple") end
wait_state("left:copying", 20)
wait_state("right:copying", 20)
local at = now()
wait(0.5)
s:stop()
local largest, first = 0, 0
for _, robot in ipairs{ "left", "right" } do
  local x, y, z = s:values(robot .. "0"), s:values(robot .. "1"), s:values(robot .. "2")
  for i, t in ipairs(s:times()) do
    if t <= at + 0.3 then largest = math.max(largest, math.sqrt(x[i]^2 + y[i]^2 + z[i]^2)) end
  end
end
expect{ name = "force in the first 0.3 s", value = largest, max = 2, unit = "N" }
