-- One robot of the youBot coupling, coordinated the traditional way: entry functions call the components and wait until they answer.
--
-- It does what configs/youbot/coordinator.lua does as long as nothing goes wrong: the same modes, the same calls in the same order, the same
-- events. What is made, connected and started is made by the same configurations, before and behind. What it has of the platform are
-- `call`, `set` and `write` of examples/before.rs. It knows the components by name, and it is deaf while it waits.

local STOPS = { "e_estop", "e_EMERGENCY_STOP", "e_OVERCURRENT", "e_OVERTEMP", "e_EC_TIMEOUT", "e_ENCODER_ERR",
                "e_UNDERVOLTAGE", "e_HALL_ERR", "e_SINE_COMM_INIT_ERR", "e_I2T_EXCEEDED", "e_overspeed", "e_base_overspeed",
                "e_cmd_watchdog", "e_base_cmd_watchdog", "e_control_lost", "e_watch_lost" }
local PARTS = { "e_misaligned", "e_peer_left", "e_torque_sat", "e_JNT_SOFT_LIMIT_EXEEDED" }

local function brake()
  call("youbot.brake")
  write("Cart_Impedance.ext_ref_mode", false)
  set("Dynamics.force_gain", { 0, 0, 0 })
  set("Base_Ctrl.enabled", false)
end

local function release()
  call("youbot.release")
  set("Base_Ctrl.enabled", true)
end

local function yields(gain) return function() set("Dynamics.force_gain", { gain, gain, gain }) end end

return rfsm.state {
  idle = rfsm.state {},

  deploying = rfsm.state {
    creating_core     = rfsm.state { entry = "create_core" },
    creating_link     = rfsm.state { entry = "create_link" },
    creating_monitors = rfsm.state { entry = "create_monitors" },
    wiring            = rfsm.state { entry = "connect_all" },
    configuring       = rfsm.state { entry = "load_properties" },
    powering          = rfsm.state { entry = "start_driver" },
    calibrating       = rfsm.state { entry = function() call("youbot.start_calibration") end },
    unfolding         = rfsm.state { entry = function() call("youbot.unfold") end },
    starting          = rfsm.state { entry = "start_control" },
    taking_over       = rfsm.state { entry = function() call("youbot.setControlMode", 6) end },
    rfsm.trans { src = "initial",           tgt = "creating_core" },
    rfsm.trans { src = "creating_core",     tgt = "creating_link",     events = { "create_core.ok" } },
    rfsm.trans { src = "creating_link",     tgt = "creating_monitors", events = { "create_link.ok" } },
    rfsm.trans { src = "creating_monitors", tgt = "wiring",            events = { "create_monitors.ok" } },
    rfsm.trans { src = "wiring",            tgt = "configuring",       events = { "connect_all.ok" } },
    rfsm.trans { src = "configuring",       tgt = "powering",          events = { "load_properties.ok" } },
    rfsm.trans { src = "powering",          tgt = "calibrating",       events = { "start_driver.ok" } },
    rfsm.trans { src = "calibrating",       tgt = "unfolding",         events = { "e_done" } },
    rfsm.trans { src = "unfolding",         tgt = "starting",          events = { "e_done" } },
    rfsm.trans { src = "starting",          tgt = "taking_over",       events = { "start_control.ok" } },
  },

  deploy_failed = rfsm.state {},

  operational = rfsm.state {
    unsync = rfsm.state {},
    sync = rfsm.state {
      harmonizing = rfsm.state { entry = yields(0.0) },
      copying = rfsm.state {
        entry = function() write("Cart_Impedance.ext_ref_mode", true) end,
        exit  = function() write("Cart_Impedance.ext_ref_mode", false) end,
        eight_DOF_mode = rfsm.state { entry = yields(0.1) },
        five_DOF_mode  = rfsm.state { entry = yields(0.0) },
        rfsm.trans { src = "initial",        tgt = "eight_DOF_mode" },
        rfsm.trans { src = "eight_DOF_mode", tgt = "five_DOF_mode",  events = { "e_5dof", "e_qos_degraded" } },
        rfsm.trans { src = "five_DOF_mode",  tgt = "eight_DOF_mode", events = { "e_8dof" } },
        -- What an operator of the other one asks its configurator for.
        rfsm.trans { src = "five_DOF_mode",  tgt = "five_DOF_mode",  events = { "e_base_stop" },
                     effect = function() call("Base_Ctrl.stop") end },
      },
      rfsm.trans { src = "initial",     tgt = "harmonizing" },
      rfsm.trans { src = "harmonizing", tgt = "copying",     events = { "e_aligned" } },
      rfsm.trans { src = "copying",     tgt = "harmonizing", events = PARTS },
    },
    soft_stop = rfsm.state { entry = function() call("Base_Ctrl.stop") end },
    rfsm.trans { src = "initial",       tgt = "unsync" },
    rfsm.trans { src = "unsync",        tgt = "sync",      events = { "e_qos_ok" } },
    rfsm.trans { src = "sync",          tgt = "unsync",    events = { "e_link_lost" } },
    rfsm.trans { src = ".sync.copying", tgt = "soft_stop", events = { "e_force_spike" } },
    rfsm.trans { src = "soft_stop",     tgt = "unsync",    events = { "e_reset" } },
  },

  -- Stopped in operation, and on the way up.
  fault = rfsm.state { entry = brake,
    waiting  = rfsm.state {},
    clearing = rfsm.state { entry = function() call("youbot.clear_faults") release() call("youbot.resume") end },
    rfsm.trans { src = "initial", tgt = "waiting" },
    rfsm.trans { src = "waiting", tgt = "clearing", events = { "e_reset" } },
  },
  halted = rfsm.state { entry = brake },

  shutting_down = rfsm.state {
    quieting     = rfsm.state { entry = function() call("Base_Ctrl.stop") end },
    holding      = rfsm.state { entry = function() call("youbot.setControlMode", 1) end },
    parking      = rfsm.state { entry = function() call("youbot.fold") end },
    stopping     = rfsm.state { entry = "stop_control" },
    powering_off = rfsm.state { entry = "stop_all" },
    cleaning     = rfsm.state { entry = "cleanup_all" },
    unwiring     = rfsm.state { entry = "disconnect_all" },
    destroying   = rfsm.state { entry = "destroy_all" },
    rfsm.trans { src = "initial",      tgt = "quieting" },
    rfsm.trans { src = "quieting",     tgt = "holding",      events = { "e_done" } },
    rfsm.trans { src = "holding",      tgt = "parking",      events = { "e_done" } },
    rfsm.trans { src = "parking",      tgt = "stopping",     events = { "e_done" } },
    rfsm.trans { src = "stopping",     tgt = "powering_off", events = { "stop_control.ok" } },
    rfsm.trans { src = "powering_off", tgt = "cleaning",     events = { "stop_all.ok" } },
    rfsm.trans { src = "cleaning",     tgt = "unwiring",     events = { "cleanup_all.ok" } },
    rfsm.trans { src = "unwiring",     tgt = "destroying",   events = { "disconnect_all.ok" } },
  },

  rfsm.trans { src = "initial",                   tgt = "idle" },
  rfsm.trans { src = "idle",                      tgt = "deploying",     events = { "e_start" } },
  rfsm.trans { src = "deploying",                 tgt = "halted",        events = STOPS },
  rfsm.trans { src = "deploying",                 tgt = "deploy_failed",
               events = { "create_core.failed", "create_link.failed", "create_monitors.failed", "connect_all.failed",
                          "load_properties.failed", "start_driver.failed", "start_control.failed" } },
  rfsm.trans { src = ".deploying.taking_over",    tgt = "operational",   events = { "e_done" } },
  rfsm.trans { src = "halted",                    tgt = "shutting_down", events = { "e_shutdown" }, effect = release },
  rfsm.trans { src = "operational",               tgt = "fault",         events = STOPS },
  rfsm.trans { src = ".fault.clearing",           tgt = "operational",   events = { "e_done" } },
  rfsm.trans { src = "fault",                     tgt = "shutting_down", events = { "e_shutdown" }, effect = release },
  rfsm.trans { src = "operational",               tgt = "shutting_down", events = { "e_shutdown" } },
  rfsm.trans { src = ".shutting_down.destroying", tgt = "idle",          events = { "destroy_all.ok" } },
}
