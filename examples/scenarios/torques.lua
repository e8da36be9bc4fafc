-- What the drives are told does not jump, whatever is switched:  davit run examples/scenarios/torques.lua --clock simulated
--
-- The torques of both robots are looked at every millisecond, from nothing to nothing: while they are brought up, engage, change their modes and
-- profiles, let go of each other, lose the link, are stopped by people, by drives and by what dies, are started again, and are led down from
-- within a motion.

local ROBOTS = { "left", "right" }
local BOUND = 0.5      -- N m in 1 ms

deploy("../../deployments/youbot_coupling.yaml")
local signals = {}
for _, robot in ipairs(ROBOTS) do
  for joint = 0, 4 do signals[robot .. joint] = robot .. "/youbot.jointstate.eff[" .. joint .. "]" end
end

local function hand(script) set("left/Operator.script", script, { force = true, within = 1 }) end
local function sway() hand("sway 600 0.042 0.042 0 0.15") wait(3) end
local function align() hand("align 8; free 600") end
local function couple()
  for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":copying", 20) end
  for _, robot in ipairs(ROBOTS) do raise(robot .. "/e_8dof") end
  for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":eight_DOF_mode", 0.1) end
end
local function reset()
  align()
  raise("left/e_reset")
  wait_state("left:operational", 1)
  couple()
end

-- What happens meanwhile may change a torque by so much in 1 ms.
local worst = 0
local function during(name, happens)
  local s, step = sample{ every = 0.001, name = name:gsub("[^%w]+", "_"), signals = signals }, 0
  happens()
  wait(0.5)
  s:stop()
  for signal in pairs(signals) do
    local v = s:values(signal)
    for i = 2, #v do
      -- Before there is a driver, and behind it, there are none.
      if v[i] == v[i] and v[i - 1] == v[i - 1] then step = math.max(step, math.abs(v[i] - v[i - 1])) end
    end
  end
  worst = math.max(worst, step)
  expect{ name = name, value = step, max = BOUND, unit = "N m" }
end

wait_state("left:unsync", 1)
during("engaging", function() couple() end)
sway()
during("modes", function()
  for _, event in ipairs{ "e_5dof", "e_8dof", "e_5dof", "e_8dof" } do
    for _, robot in ipairs(ROBOTS) do raise(robot .. "/" .. event) end
    wait(0.7)
  end
end)
during("profiles", function()
  for _, profile in ipairs{ "soft", "stiff", "normal" } do
    for _, robot in ipairs(ROBOTS) do
      apply(robot .. "/profile_" .. profile, { force = true })
      wait_answer(robot .. "/profile_" .. profile .. ".ok", 1)
    end
    wait(0.7)
  end
end)
during("the link is cut, and healed", function()
  for _, net in ipairs{ "To_Right", "To_Left" } do inject(net, "cut", { seconds = 1 }) end
  wait(0.9)
  for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":unsync", 0) end
  align()
  couple()
end)
sway()
during("the reference jumps, and a reset", function()
  inject("To_Left", "corrupt", { by = { 0.3, 0, 0 }, seconds = 0.5 })
  wait_state("left:soft_stop", 0.1)
  wait(1)
  reset()
end)
sway()
during("the other one leaves", function()
  raise("right/e_estop")
  wait_state("left:harmonizing", 1)
  wait(1)
  align()
  raise("right/e_reset")
  couple()
end)
for _, fault in ipairs{ "overcurrent", "ec_timeout", "emergency" } do
  sway()
  during("drives: " .. fault .. ", and a reset", function()
    inject("left/youbot", fault, fault == "overcurrent" and { joint = 2 } or {})
    wait_state("left:fault", 0.1)
    wait(1)
    reset()
  end)
end
for _, dies in ipairs{ { "Cart_Impedance" }, { "Arm_Kinematics", "restart_kinematics" }, { "Dynamics", "restart_dynamics" },
                       { "Base_Ctrl", "restart_base" }, { "Monitors", "restart_monitors" } } do
  local component, restart = table.unpack(dies)
  sway()
  during(component .. " dies, and starts again", function()
    inject("left/" .. component, "panic", {})
    wait_state("left:fault", 0.2)
    wait(1)
    if restart then
      apply("left/" .. restart, { force = true })
      wait_answer("left/" .. restart .. ".ok", 0.1)
      reset()
    else
      align()
      couple()
    end
  end)
end
sway()
during("an emergency stop, and a reset", function()
  raise("e_estop")
  wait_state("left:fault", 0.1)
  wait(1)
  raise("right/e_reset")
  reset()
end)
sway()
during("led down from within a motion, held and parked", function()
  raise("e_shutdown")
  for _, robot in ipairs(ROBOTS) do wait_answer(robot .. "/park.ok", 12) end
end)
wait_state("pair:idle", 20)
raise("e_start")
wait_state("left:unfolding", 2)
during("unfolding, and taking over", function()
  for _, robot in ipairs(ROBOTS) do wait_state(robot .. ":unsync", 8) end
end)
figure{ name = "all of it", value = worst, unit = "N m" }
