-- What is in force dies while both robots copy:  davit run examples/scenarios/crash.lua --clock simulated
--
-- Its code panics, at a time of the clock. It is noticed, the drives brake and hold by themselves, and the other robot lets go. The
-- impedance controller is started again without asking; what else is dead keeps the robot stopped, and it is led down all the same.

local DEAD = {
  { "Cart_Impedance", "e_controller_lost" },
  { "Arm_Kinematics", "e_control_lost" },
  { "Base_Ctrl",      "e_control_lost" },
  { "Dynamics",       "e_cmd_watchdog" },
  { "Monitors",       "e_watch_lost" },
}

deploy("../../deployments/youbot_coupling.yaml")
for _, dead in ipairs(DEAD) do
  local component, event = table.unpack(dead)
  raise("e_start")     -- again, but for the first
  wait_state("left:copying", 20)
  wait_state("right:copying", 20)
  set("left/Operator.script", "sway 600 0.042 0.042 0 0.15", { force = true, within = 1 })
  wait(2)
  wait_state("left:copying", 0)
  local signals = { x = "World.robot1_tool_twist.v[0]", y = "World.robot1_tool_twist.v[1]", z = "World.robot1_tool_twist.v[2]" }
  for joint = 0, 4 do signals["t" .. joint] = "left/youbot.jointstate.eff[" .. joint .. "]" end
  local s = sample{ every = 0.001, name = component, signals = signals }
  local at = now() + 0.01
  inject("left/" .. component, "panic", {}, at)
  wait_answer("left/" .. event, 1)
  assert_state("left/" .. component, "faulted")
  expect{ name = component .. ": noticed after", value = 1000 * (now() - at), max = 50, unit = "ms" }
  wait_state("left:fault", 0.01)
  wait_answer("left/safe_hold.ok", 0.1)
  expect{ name = component .. ": braking after", value = 1000 * (now() - at), max = 55, unit = "ms" }
  if component == "Cart_Impedance" then
    wait_state("left:operational", 1)
    set("left/Operator.script", "align 8; free 600", { force = true, within = 1 })
    wait_state("left:harmonizing", 1)
    assert_running("left/" .. component)
    expect{ name = component .. ": harmonizing after", value = 1000 * (now() - at), max = 1000, unit = "ms" }
    wait_state("left:copying", 10)
  else
    -- A controller that is back within a tenth of a second is waited for.
    wait_state("right:harmonizing", 1)
    expect{ name = component .. ": the other lets go after", value = 1000 * (now() - at), max = 500, unit = "ms" }
    wait(at + 1 - now())
    local x, y, z, rest = s:values("x"), s:values("y"), s:values("z"), 0
    for i, t in ipairs(s:times()) do if t >= at + 0.35 then rest = math.max(rest, math.sqrt(x[i]^2 + y[i]^2 + z[i]^2)) end end
    expect{ name = component .. ": 0.35 s later the tool moves with", value = rest, max = 0.02, unit = "m/s" }
    wait_state("left:fault", 0)
  end
  s:stop()
  -- A force that is not told any more fades, and does not go on.
  local step = 0
  for joint = 0, 4 do
    local t = s:values("t" .. joint)
    for i = 2, #t do step = math.max(step, math.abs(t[i] - t[i - 1])) end
  end
  expect{ name = component .. ": torque in 1 ms", value = step, max = 0.5, unit = "N m" }
  raise("e_shutdown")
  wait_state("pair:idle", 20)
  assert(#stack() == 0, "something is left")
end

-- In a soft stop, which people have to release, it is not: nothing couples since the controller died.
raise("e_start")
wait_state("left:copying", 20)
set("left/Cart_Impedance.offset", { 0.3, 0, 0 }, { force = true, within = 1 })
wait_state("left:soft_stop", 0.1)
undo("left/Cart_Impedance.offset")
wait(0.5)
inject("left/Cart_Impedance", "panic")
wait_state("left:fault", 0.06)
wait(5)
wait_state("left:fault.waiting", 0)
local at = now()
raise("left/e_reset")
wait_state("left:harmonizing", 2)
assert_running("left/Cart_Impedance")
expect{ name = "dead in a soft stop: harmonizing, released, after", value = 1000 * (now() - at), max = 1000, unit = "ms" }
