-- One direction of the network is dead:  davit run examples/scenarios/one_way.lua --clock simulated
--
-- Who does not hear the other one lets go and says so; the other one hears that, and lets go too. Neither is told to be near by who does not know
-- where it is, and nobody shows to copy. Healed, both copy again.

deploy("../../deployments/youbot_coupling.yaml")
local function norm(s, name, i) return math.sqrt(s[name .. 0][i]^2 + s[name .. 1][i]^2 + s[name .. 2][i]^2) end

local worst = { force = 0, state = 0, told = 0, again = 0, copying = 0 }
for _, cut in ipairs{ { net = "To_Right", deaf = "right", heard = "left" }, { net = "To_Left", deaf = "left", heard = "right" } } do
  wait_state("left:copying", 20)
  wait_state("right:copying", 20)
  set("left/Operator.script", "sway 600 0.042 0.042 0 0.15", { force = true, within = 1 })
  wait(2)
  local signals = { aligned = cut.heard .. "/Link_Rx.peer_state.aligned", left = "left/Cart_Impedance.active", right = "right/Cart_Impedance.active" }
  for _, robot in ipairs{ "left", "right" } do
    for i = 0, 2 do signals[robot .. "_f" .. i] = robot .. "/Cart_Impedance.f_des[" .. i .. "]" end
  end
  local s = sample{ every = 0.001, name = cut.net, signals = signals }
  local at = now() + 0.1
  inject(cut.net, "cut", { seconds = 3 }, at)
  wait_answer(cut.deaf .. "/e_link_lost", 0.5)
  wait_state(cut.deaf .. ":unsync", 0.01)
  wait_state(cut.heard .. ":harmonizing", 5)
  worst.state = math.max(worst.state, now() - at)
  wait(at + 3 - now())
  wait_state(cut.deaf .. ":unsync", 0)
  wait_state(cut.heard .. ":harmonizing", 0)
  s:stop()
  local v = {}
  for name in pairs(signals) do v[name] = s:values(name) end
  for i, t in ipairs(s:times()) do
    if t >= at + 0.3 then worst.force = math.max(worst.force, norm(v, "left_f", i), norm(v, "right_f", i)) end
    if v.aligned[i] == 1 then worst.told = math.max(worst.told, t - at) end
    if t >= at + 0.4 then worst.copying = math.max(worst.copying, v.left[i], v.right[i]) end
  end
  set("left/Operator.script", "align 8; free 600", { force = true, within = 1 })
  at = at + 3
  wait_state("left:copying", 20)
  wait_state("right:copying", 20)
  worst.again = math.max(worst.again, now() - at)
end
expect{ name = "both have let go after", value = 1000 * worst.state, max = 400, unit = "ms" }
expect{ name = "force after 0.3 s", value = worst.force, max = 0.1, unit = "N" }
expect{ name = "who hears nobody tells that it is near for", value = 1000 * worst.told, max = 100, unit = "ms" }
expect{ name = "coupled after 0.4 s", value = worst.copying, max = 0 }
figure{ name = "both copy again after", value = worst.again, unit = "s" }
