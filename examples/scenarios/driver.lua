-- What the drives tell that is wrong with them, each while both robots copy:  davit run examples/scenarios/driver.lua --clock simulated
--
-- The fault comes from the world, at a time of the clock. The robot stops; the other one lets go and is not stopped. After `e_reset` the
-- drives take torques again before anything couples, and the base yields no more until somebody asks for it.

local FAULTS = { "overcurrent", "undervoltage", "overtemp", "hall", "sine_comm", "i2t", "ec_timeout", "encoder", "emergency" }
local EVENTS = { overcurrent = "e_OVERCURRENT", undervoltage = "e_UNDERVOLTAGE", overtemp = "e_OVERTEMP", hall = "e_HALL_ERR",
                 sine_comm = "e_SINE_COMM_INIT_ERR", i2t = "e_I2T_EXCEEDED", ec_timeout = "e_EC_TIMEOUT", encoder = "e_ENCODER_ERR",
                 emergency = "e_EMERGENCY_STOP" }
-- What a single motor tells is of the one that drives joint 2; the rest is a matter of all drives.
local OF_A_MOTOR = { overcurrent = true, overtemp = true, hall = true, sine_comm = true, i2t = true, encoder = true }

deploy("../../deployments/youbot_coupling.yaml")

local worst = { heard = 0, left = 0, rest = 0, elsewhere = 0, kept = 0 }
for _, fault in ipairs(FAULTS) do
  wait_state("left:copying", 20)
  wait_state("right:copying", 20)
  set("left/Operator.script", "sway 600 0.042 0.042 0 0.15", { force = true, within = 1 })
  wait(2)
  wait_state("left:copying", 0)
  local s = sample{ every = 0.001, name = fault, signals = {
    x = "World.robot1_tool_twist.v[0]", y = "World.robot1_tool_twist.v[1]", z = "World.robot1_tool_twist.v[2]",
    mode = "left/youbot.control_mode", engaged = "left/Cart_Impedance.engaged", active = "left/Cart_Impedance.active" } }
  local at = now() + 0.25
  inject("left/youbot", fault, OF_A_MOTOR[fault] and { joint = 2 } or {}, at)
  wait_answer("left/" .. EVENTS[fault], 1)
  worst.heard = math.max(worst.heard, now() - at)
  wait_state("left:fault", 0.01)
  wait_answer("left/safe_hold.ok", 0.1)
  wait_state("right:harmonizing", 0.5)
  worst.left = math.max(worst.left, now() - at)
  wait(at + 1 - now())
  wait_state("left:fault", 0)
  for joint, flags in ipairs(signal("left/youbot.motor_states.joint_error_flags")) do
    local told = OF_A_MOTOR[fault] and joint == 2
    if (flags ~= 0) ~= (told or false) then worst.elsewhere = worst.elsewhere + 1 end
  end
  set("left/Operator.script", "align 8; free 600", { force = true, within = 1 })
  raise("left/e_reset")
  wait_state("left:operational", 0.1)
  wait_state("left:five_DOF_mode", 20)
  wait(0.5)
  for _, flags in ipairs(signal("left/youbot.motor_states.joint_error_flags")) do
    if flags ~= 0 then worst.kept = worst.kept + 1 end
  end
  raise("left/e_8dof")
  wait_state("left:eight_DOF_mode", 0.1)
  s:stop()
  local x, y, z, times = s:values("x"), s:values("y"), s:values("z"), s:times()
  local mode, active = s:values("mode"), s:values("active")
  for i, t in ipairs(times) do
    if t >= at + 0.3 and t < at + 1 then worst.rest = math.max(worst.rest, math.sqrt(x[i]^2 + y[i]^2 + z[i]^2)) end
    if active[i] == 1 and mode[i] ~= 6 and (t < at or t > at + 0.01) then error("it couples in mode " .. mode[i] .. " at " .. t) end
  end
end
expect{ name = "the fault is heard after", value = worst.heard, max = 0.005, unit = "s" }
expect{ name = "the other robot has let go after", value = worst.left, max = 0.5, unit = "s" }
expect{ name = "0.3 s later the tool moves with", value = worst.rest, max = 0.02, unit = "m/s" }
expect{ name = "error flags at another joint, or missing", value = worst.elsewhere, max = 0 }
expect{ name = "error flags that a reset has not cleared", value = worst.kept, max = 0 }
