-- Coordinator of one robot of the youBot coupling, with the paper's explicit pair: entering `copying` asks for
-- enable_copying, leaving it for disable_copying.
--
-- It is pure: states, and names of events to raise. It names no component, no port, no platform: what the names mean
-- here is said by the deployment's configurations, and the same file coordinates another platform over other ones
-- (examples/scara). In an rFSM statechart the outer state's transition wins over the inner one's.

-- These stop the robot wherever its drives have power: it brakes, and nothing moves until it is asked for.
local STOPS = { "e_estop", "e_EMERGENCY_STOP", "e_OVERCURRENT", "e_OVERTEMP", "e_EC_TIMEOUT", "e_ENCODER_ERR",
                "e_UNDERVOLTAGE", "e_HALL_ERR", "e_SINE_COMM_INIT_ERR", "e_I2T_EXCEEDED",
                "e_overspeed", "e_base_overspeed", "e_arm_dropped", "e_arm_fell", "e_arm_gives_way" }

-- What is told where the drives take torques and part of what commands or watches them has died. Wherever they may, it stops the
-- robot as well, but for where the very next thing asked of them is to hold by themselves; what lasts is told again.
local LOSSES = { "e_cmd_watchdog", "e_base_cmd_watchdog", "e_control_lost", "e_watch_lost" }

-- How ending the coupling is answered where it could not be.
local COUPLED = { "disable_copying.failed", "disable_copying.broken" }

-- Braked, until somebody says how to go on: `e_reset`, or `e_shutdown`, which is heard in every moment. A stop is heard in every
-- moment as well, and what was said before it is not done any more: whatever moves meanwhile, since an operator insisted, is braked
-- `again`; one that comes while `safe_hold` is undone does so too, since that may have to wait for what moves, and applies it again when
-- that is answered. `more`: what is particular to a place. `uncouples`: it may have copied. Then the coupling is ended once more in the step in which it is
-- let go of: what became of that when `copying` was left is not known here (it may have been interrupted), and the end of the stop brings back what it
-- had found.
local function stopped(more, uncouples)
  local braked = { "safe_hold.ok", "safe_hold.failed", "safe_hold.broken" }
  local braked_again = { "brake_again.ok", "brake_again.failed", "brake_again.broken" }
  local not_braked = { "brake_again.failed", "brake_again.broken" }
  local ended = { "brake_again.undone", "brake_again.undo.failed", "brake_again.undo.broken" }
  local not_released = { "safe_hold.undo.failed", "safe_hold.undo.broken" }
  local releasing = { entry = { "safe_hold.undo", uncouples and "disable_copying" },
    on              = state {},
    leaving         = state {},
    stopped         = state {},
    stopped_leaving = state {},
    trans { src = "initial", tgt = "on" },
    trans { src = "on",      tgt = "leaving",         events = { "e_shutdown" } },
    trans { src = "stopped", tgt = "stopped_leaving", events = { "e_shutdown" } },
    trans { src = "on",              tgt = "stopped", events = STOPS, effect = "brake_again" },
    trans { src = "leaving",         tgt = "stopped", events = STOPS, effect = "brake_again" },
    trans { src = "stopped",         tgt = "stopped", events = STOPS, effect = "brake_again" },
    trans { src = "stopped_leaving", tgt = "stopped", events = STOPS, effect = "brake_again" },
    trans { src = "stopped",         tgt = "stopped", events = not_braked },
    trans { src = "stopped_leaving", tgt = "stopped_leaving", events = not_braked },
  }
  if uncouples then
    -- Both answers may come apart: let go of, and the other one is not there yet.
    releasing.freed = state {}
    table.insert(releasing, trans { src = "on", tgt = "freed", events = { "safe_hold.undone" } })
  end
  local all = {
    braking = state { entry = "safe_hold",
      staying = state {},
      leaving = state {},
      trans { src = "initial", tgt = "staying" },
      trans { src = "staying", tgt = "leaving", events = { "e_shutdown" } },
      trans { src = "leaving", tgt = "staying", events = STOPS },
    },
    waiting   = state {},
    again     = state { entry = "brake_again" },
    ending    = state { entry = "brake_again.undo",
      on      = state {},
      stopped = state {},
      trans { src = "initial", tgt = "on" },
      trans { src = "on",      tgt = "stopped", events = STOPS },
    },
    releasing = state(releasing),
    trans { src = "initial",                    tgt = "braking" },
    trans { src = ".braking.staying",           tgt = "waiting",            events = braked },
    trans { src = ".braking.leaving",           tgt = ".releasing.leaving", events = braked },
    trans { src = "waiting",                    tgt = "again",              events = STOPS },
    trans { src = "again",                      tgt = "ending",             events = braked_again },
    trans { src = ".ending.on",                 tgt = "waiting",            events = ended },
    trans { src = ".ending.stopped",            tgt = "again",              events = ended },
    trans { src = "waiting",                    tgt = ".releasing.leaving", events = { "e_shutdown" } },
    trans { src = "again",                      tgt = ".releasing.leaving", events = { "e_shutdown" }, effect = "brake_again.undo" },
    trans { src = "ending",                     tgt = ".releasing.leaving", events = { "e_shutdown" } },
    trans { src = ".releasing.stopped",         tgt = "braking",            events = { "safe_hold.undone" }, effect = "brake_again.undo" },
    trans { src = ".releasing.stopped_leaving", tgt = ".braking.leaving",   events = { "safe_hold.undone" }, effect = "brake_again.undo" },
    trans { src = ".releasing.on",              tgt = "waiting",            events = not_released },
    trans { src = ".releasing.leaving",         tgt = "waiting",            events = not_released },
    trans { src = ".releasing.stopped",         tgt = "again",              events = not_released },
    trans { src = ".releasing.stopped_leaving", tgt = "again",              events = not_released },
  }
  if uncouples then
    table.insert(all, trans { src = ".releasing.freed", tgt = "braking", events = STOPS })
    table.insert(all, trans { src = ".releasing.freed", tgt = "braking", events = LOSSES })
    -- It was let go of, and is coupled: it brakes again.
    table.insert(all, trans { src = ".releasing.on",    tgt = "braking", events = COUPLED })
    table.insert(all, trans { src = ".releasing.freed", tgt = "braking", events = COUPLED })
    -- What was asked for in leaving `operational` is answered here.
    for _, braked in ipairs{ "braking", "waiting", "again", "ending" } do
      table.insert(all, trans { src = braked, tgt = "again", events = COUPLED })
    end
  end
  for name, particular in pairs(more) do
    if type(name) == "number" then table.insert(all, particular) else all[name] = particular end
  end
  return state(all)
end

-- A step of the way down that is not asked for twice: a stop leaves it only with its answer.
local function once(request)
  return state { entry = request,
    going  = state {},
    braked = state { entry = "safe_hold",
      braking = state {},
      waiting = state {},
      trans { src = "initial", tgt = "braking" },
      trans { src = "braking", tgt = "waiting", events = { "safe_hold.ok", "safe_hold.failed", "safe_hold.broken" } },
    },
    trans { src = "initial", tgt = "going" },
    trans { src = "going",   tgt = "braked", events = STOPS },
  }
end

-- What ends copying without being a fault.
local PARTS = { "e_misaligned", "e_peer_left", "e_torque_sat", "e_JNT_SOFT_LIMIT_EXEEDED", "enable_copying.failed" }

return state {

  idle = state {},

  -- Bring-up: each step asks for one configuration and goes on when it is applied. Nothing here undoes anything: undoing
  -- is what `cancelling` does, from wherever the bring-up has come to.
  deploying = state {
    creating_core     = state { entry = "create_core" },
    creating_link     = state { entry = "create_link" },
    creating_monitors = state { entry = "create_monitors" },
    wiring            = state { entry = { "e_built", "connect_all" } },    -- from here on its parts are there for others to connect
    configuring       = state { entry = "load_properties" },
    powering          = state { entry = "start_driver" },
    calibrating       = state { entry = "calibrate" },
    unfolding         = state { entry = "unfold" },
    starting          = state { entry = "start_control" },
    taking_over       = state { entry = "take_over" },

    trans { src = "initial",           tgt = "creating_core" },
    trans { src = "creating_core",     tgt = "creating_link",     events = { "create_core.ok" } },
    trans { src = "creating_link",     tgt = "creating_monitors", events = { "create_link.ok" } },
    trans { src = "creating_monitors", tgt = "wiring",            events = { "create_monitors.ok" } },
    trans { src = "wiring",            tgt = "configuring",       events = { "connect_all.ok" } },
    trans { src = "configuring",       tgt = "powering",          events = { "load_properties.ok" } },
    trans { src = "powering",          tgt = "calibrating",       events = { "start_driver.ok" } },
    trans { src = "calibrating",       tgt = "unfolding",         events = { "calibrate.ok" } },
    trans { src = "unfolding",         tgt = "starting",          events = { "unfold.ok" } },
    trans { src = "starting",          tgt = "taking_over",       events = { "start_control.ok" } },
  },

  -- A bring-up that failed waits here: every applied step is still in force, and is undone by `cancelling`.
  deploy_failed = state {},

  -- The bring-up backwards. An undo is answered `undone` also when there was nothing to undo, so this serves from
  -- everywhere; it contains the folding of the arm, as the inverse of unfolding it.
  cancelling = state {
    handing_back   = state { entry = "take_over.undo" },
    stopping       = state { entry = "start_control.undo" },
    folding        = state { entry = "unfold.undo" },
    uncalibrating  = state { entry = "calibrate.undo" },
    powering_down  = state { entry = "start_driver.undo" },
    unconfiguring  = state { entry = "load_properties.undo" },
    unwiring       = state { entry = "connect_all.undo" },
    letting_go     = state { entry = "e_leaving" },
    removing_monitors = state { entry = "create_monitors.undo" },
    removing_link     = state { entry = "create_link.undo" },
    removing_core     = state { entry = "create_core.undo" },

    trans { src = "initial",           tgt = "handing_back" },
    trans { src = "handing_back",      tgt = "stopping",          events = { "take_over.undone" } },
    trans { src = "stopping",          tgt = "folding",           events = { "start_control.undone" } },
    trans { src = "folding",           tgt = "uncalibrating",     events = { "unfold.undone" } },
    trans { src = "uncalibrating",     tgt = "powering_down",     events = { "calibrate.undone" } },
    trans { src = "powering_down",     tgt = "unconfiguring",     events = { "start_driver.undone" } },
    trans { src = "unconfiguring",     tgt = "unwiring",          events = { "load_properties.undone" } },
    trans { src = "unwiring",          tgt = "letting_go",        events = { "connect_all.undone" } },
    trans { src = "letting_go",        tgt = "removing_monitors", events = { "e_released" } },
    trans { src = "removing_monitors", tgt = "removing_link",     events = { "create_monitors.undone" } },
    trans { src = "removing_link",     tgt = "removing_core",     events = { "create_link.undone" } },
  },

  -- The undoing itself failed: somebody has to look. `e_shutdown` tries again.
  cancel_failed = state {},

  operational = state {

    -- The other robot is not heard. What the operator chose is kept, here and in `harmonizing`.
    unsync = state {
      for_eight = state {},
      for_five  = state {},
      trans { src = "initial",   tgt = "for_eight" },
      trans { src = "for_eight", tgt = "for_five",  events = { "e_5dof" } },
      trans { src = "for_five",  tgt = "for_eight", events = { "e_8dof" } },
    },

    sync = state {

      -- Both robots are heard; the hands bring the arms together. The desired force is computed, not put out.
      harmonizing = state { entry = "five_DOF",
        for_eight = state {
          good     = state {},
          degraded = state {},
          trans { src = "initial",  tgt = "good" },
          trans { src = "good",     tgt = "degraded", events = { "e_qos_degraded" } },
          trans { src = "degraded", tgt = "good",     events = { "e_qos_restored" } },
        },
        for_five  = state {},
        trans { src = "initial",   tgt = "for_eight" },
        trans { src = "for_eight", tgt = "for_five",  events = { "e_5dof" } },
        trans { src = "for_five",  tgt = "for_eight", events = { "e_8dof" } },
      },

      copying = state { entry = "enable_copying", exit = "disable_copying",
        eight_DOF_mode = state { entry = "eight_DOF" },
        five_DOF_mode  = state { entry = "five_DOF",
          free     = state {},
          degraded = state {},      -- eight degrees of freedom need a quick link: e_8dof is not heard here
          trans { src = "initial",  tgt = "free" },
          trans { src = "free",     tgt = "degraded", events = { "e_qos_degraded" } },
          trans { src = "degraded", tgt = "free",     events = { "e_qos_restored" } },
        },
        trans { src = "initial",            tgt = "eight_DOF_mode" },
        trans { src = "eight_DOF_mode",     tgt = "five_DOF_mode",  events = { "e_5dof", "eight_DOF.failed" } },
        trans { src = "eight_DOF_mode",     tgt = ".five_DOF_mode.degraded", events = { "e_qos_degraded" } },
        trans { src = ".five_DOF_mode.free", tgt = "eight_DOF_mode", events = { "e_8dof" } },
      },

      trans { src = "initial",                         tgt = "harmonizing" },
      trans { src = ".harmonizing.for_eight.good",     tgt = "copying", events = { "e_aligned" } },
      trans { src = ".harmonizing.for_five",           tgt = ".copying.five_DOF_mode", events = { "e_aligned" } },
      trans { src = ".harmonizing.for_eight.degraded", tgt = ".copying.five_DOF_mode.degraded", events = { "e_aligned" } },
      trans { src = ".copying.eight_DOF_mode",         tgt = ".harmonizing.for_eight", events = PARTS },
      trans { src = ".copying.five_DOF_mode",          tgt = ".harmonizing.for_five",  events = PARTS },
    },

    -- Somebody pushed hard. Nothing couples and the base stands until the operator says so.
    soft_stop = state { entry = "base_stop" },

    trans { src = "initial",   tgt = "unsync" },
    trans { src = ".unsync.for_eight",            tgt = "sync",                       events = { "e_qos_ok" } },
    trans { src = ".unsync.for_five",             tgt = ".sync.harmonizing.for_five", events = { "e_qos_ok" } },
    trans { src = ".sync.harmonizing.for_eight",  tgt = ".unsync.for_eight", events = { "e_link_lost" } },
    trans { src = ".sync.harmonizing.for_five",   tgt = ".unsync.for_five",  events = { "e_link_lost" } },
    trans { src = ".sync.copying.eight_DOF_mode", tgt = ".unsync.for_eight", events = { "e_link_lost" } },
    trans { src = ".sync.copying.five_DOF_mode",  tgt = ".unsync.for_five",  events = { "e_link_lost" } },
    trans { src = ".sync.copying", tgt = "soft_stop", events = { "e_force_spike" } },
    trans { src = "soft_stop", tgt = ".unsync.for_five", events = { "e_reset" } },
  },

  -- Stopped in operation. When it is released the drives are asked to take torques, whatever they did meanwhile, and nothing
  -- couples before the arms are aligned again; then with five degrees of freedom, whatever it was before: a base that yields is asked for anew.
  fault = stopped({
    clearing  = state { entry = "clear_faults" },
    losing    = state { entry = "safe_hold",
      on      = state {},
      staying = state {},
      leaving = state {},
      trans { src = "initial", tgt = "on" },
      trans { src = "on",      tgt = "staying", events = STOPS },
      trans { src = "leaving", tgt = "staying", events = STOPS },
      trans { src = "on",      tgt = "leaving", events = { "e_shutdown" } },
      trans { src = "staying", tgt = "leaving", events = { "e_shutdown" } },
    },
    repairing = state { entry = "restart_controller" },
    resuming  = state { entry = "resume" },
    trans { src = "waiting",            tgt = "clearing",           events = { "e_reset" } },
    trans { src = "clearing",           tgt = "again",              events = STOPS },
    trans { src = "clearing",           tgt = "again",              events = COUPLED },
    trans { src = "clearing",           tgt = ".releasing.on",      events = { "clear_faults.ok" } },
    trans { src = "clearing",           tgt = "waiting",            events = { "clear_faults.failed", "clear_faults.broken" } },
    trans { src = "clearing",           tgt = ".releasing.leaving", events = { "e_shutdown" } },

    -- The controller itself stopped: the same, then it is started again without asking anybody.
    trans { src = ".losing.on",         tgt = "repairing",          events = { "safe_hold.ok" } },
    trans { src = ".losing.on",         tgt = "waiting",            events = { "safe_hold.failed", "safe_hold.broken" } },
    trans { src = ".losing.staying",    tgt = "waiting",
            events = { "safe_hold.ok", "safe_hold.failed", "safe_hold.broken" } },
    trans { src = ".losing.leaving",    tgt = ".releasing.leaving",
            events = { "safe_hold.ok", "safe_hold.failed", "safe_hold.broken" } },
    trans { src = "repairing",          tgt = "again",              events = STOPS },
    trans { src = "repairing",          tgt = ".releasing.on",      events = { "restart_controller.ok" } },
    trans { src = "repairing",          tgt = "waiting",
            events = { "restart_controller.failed", "restart_controller.broken" } },
    trans { src = "repairing",          tgt = ".releasing.leaving", events = { "e_shutdown" } },
    trans { src = "losing",             tgt = "braking",            events = COUPLED },
    trans { src = "repairing",          tgt = "again",              events = COUPLED },

    -- Released, the drives may take torques already: what has died is told from then on, and some of it once.
    trans { src = ".releasing.on",      tgt = ".releasing.stopped", events = LOSSES },
    trans { src = ".releasing.on",      tgt = "resuming",           events = { "disable_copying.ok" } },
    trans { src = ".releasing.freed",   tgt = "resuming",           events = { "disable_copying.ok" } },
    trans { src = "resuming",           tgt = "braking",            events = STOPS },
    trans { src = "resuming",           tgt = "braking",            events = LOSSES },
    trans { src = "resuming",           tgt = "braking",            events = { "resume.failed", "resume.broken" } },
    trans { src = "resuming",           tgt = "braking",            events = COUPLED },
  }, true),

  -- Stopped on the way up or on the way back, and on the way down: after `e_reset` it waits to be told what to do.
  halted   = stopped { trans { src = "waiting", tgt = ".releasing.on", events = { "e_reset" } } },
  lowering = stopped { trans { src = "waiting", tgt = ".releasing.on", events = { "e_reset" } } },

  -- Stopped when the arm lies on its stops already: how far the way down had come is kept.
  resting = state {
    parked  = stopped { trans { src = "waiting", tgt = ".releasing.on", events = { "e_reset" } } },
    stopped = stopped { trans { src = "waiting", tgt = ".releasing.on", events = { "e_reset" } } },
    cleaned = stopped { trans { src = "waiting", tgt = ".releasing.on", events = { "e_reset" } } },
    unwired = stopped { trans { src = "waiting", tgt = ".releasing.on", events = { "e_reset" } } },
    trans { src = "initial", tgt = "parked" },
  },

  -- The arm goes down before anything that holds it is stopped. Once the drives hold by themselves nothing is lost with what commands
  -- or watches them; nor is it on the way to that from a stop, or whatever has died would never let it go down.
  shutting_down = state {
    quieting     = state { entry = "base_stop",
      operated = state {},
      released = state {},
      trans { src = "initial", tgt = "operated" },
    },
    holding      = state { entry = "hold" },
    parking      = state { entry = "park" },
    stopping     = state { entry = "stop_control" },
    powering_off = state { entry = "stop_all" },
    cleaning     = state { entry = "cleanup_all" },
    unwiring     = once("disconnect_all"),
    letting_go   = state { entry = "e_leaving" },      -- whoever holds something of it is waited for, and asked again after a stop
    destroying   = once("destroy_all"),

    trans { src = "initial",      tgt = "quieting" },
    trans { src = "quieting",     tgt = "holding",      events = { "base_stop.ok" } },
    trans { src = "holding",      tgt = "parking",      events = { "hold.ok" } },
    trans { src = "parking",      tgt = "stopping",     events = { "park.ok" } },
    trans { src = "stopping",     tgt = "powering_off", events = { "stop_control.ok" } },
    trans { src = "powering_off", tgt = "cleaning",     events = { "stop_all.ok" } },
    trans { src = "cleaning",     tgt = "unwiring",     events = { "cleanup_all.ok" } },
    trans { src = ".unwiring.going", tgt = "letting_go", events = { "disconnect_all.ok" } },
    trans { src = "letting_go",   tgt = "destroying",   events = { "e_released" } },
  },

  -- A step of the teardown failed: everything stays as it is, the arm where it is. `e_shutdown` goes on from there.
  stranded = state {
    before_parking = state {},
    parked         = state {},
    stopped        = state {},
    cleaned        = state {},
    unwired        = state {},
    trans { src = "initial", tgt = "before_parking" },
  },

  trans { src = "initial",   tgt = "idle" },
  trans { src = "idle",      tgt = "deploying", events = { "e_start" } },

  trans { src = "deploying", tgt = "deploy_failed",
          events = { "create_core.failed", "create_link.failed", "create_monitors.failed", "connect_all.failed",
                     "load_properties.failed", "start_driver.failed", "calibrate.failed", "unfold.failed",
                     "start_control.failed", "take_over.failed",
                     "create_core.broken", "create_link.broken", "create_monitors.broken", "connect_all.broken",
                     "load_properties.broken", "start_driver.broken", "calibrate.broken", "unfold.broken",
                     "start_control.broken", "take_over.broken" } },
  trans { src = "deploying",     tgt = "cancelling", events = { "e_shutdown" } },
  trans { src = "deploy_failed", tgt = "cancelling", events = { "e_shutdown", "e_go_on" } },
  trans { src = "cancel_failed", tgt = "cancelling", events = { "e_shutdown" } },
  trans { src = "cancelling", tgt = "cancel_failed",
          events = { "take_over.undo.failed", "start_control.undo.failed", "unfold.undo.failed",
                     "calibrate.undo.failed", "start_driver.undo.failed", "load_properties.undo.failed",
                     "connect_all.undo.failed", "create_monitors.undo.failed", "create_link.undo.failed",
                     "create_core.undo.failed",
                     "take_over.undo.broken", "start_control.undo.broken", "unfold.undo.broken",
                     "calibrate.undo.broken", "start_driver.undo.broken", "load_properties.undo.broken",
                     "connect_all.undo.broken", "create_monitors.undo.broken", "create_link.undo.broken",
                     "create_core.undo.broken" } },
  trans { src = "cancelling.removing_core", tgt = "idle",        events = { "create_core.undone" } },
  trans { src = "deploying.taking_over",    tgt = "operational", events = { "take_over.ok" } },

  trans { src = "operational", tgt = "shutting_down", events = { "e_shutdown" } },
  trans { src = "operational", tgt = "fault", events = STOPS },
  trans { src = "operational", tgt = "fault", events = LOSSES },
  trans { src = "operational", tgt = "fault",
          events = { "e_drives_let_go", "five_DOF.failed", "five_DOF.broken", "eight_DOF.broken", "base_stop.failed", "base_stop.broken",
                     "enable_copying.broken", "disable_copying.failed", "disable_copying.broken" } },
  trans { src = "operational.unsync", tgt = "fault.losing", events = { "e_controller_lost" } },
  trans { src = "operational.sync",   tgt = "fault.losing", events = { "e_controller_lost" } },
  -- Somebody has to release a soft stop: it does not end since the controller died in it.
  trans { src = "operational.soft_stop", tgt = "fault", events = { "e_controller_lost" } },
  trans { src = "fault.resuming",            tgt = "operational.unsync.for_five", events = { "resume.ok" } },
  trans { src = "fault.resuming",            tgt = "shutting_down", events = { "e_shutdown" } },
  trans { src = "fault.releasing.leaving",   tgt = "shutting_down.quieting.released", events = { "safe_hold.undone" } },
  trans { src = "fault.releasing.freed",     tgt = "shutting_down.quieting.released", events = { "e_shutdown" } },

  trans { src = "shutting_down.quieting",     tgt = "lowering", events = STOPS },
  trans { src = "shutting_down.quieting.operated", tgt = "lowering", events = LOSSES },
  trans { src = "shutting_down.holding",      tgt = "lowering", events = STOPS },
  trans { src = "shutting_down.parking",      tgt = "lowering", events = STOPS },
  trans { src = "stranded.before_parking",    tgt = "lowering", events = STOPS },
  trans { src = "stranded.before_parking",    tgt = "lowering", events = LOSSES },
  trans { src = "lowering.releasing.on",      tgt = "stranded.before_parking", events = { "safe_hold.undone" } },
  trans { src = "lowering.releasing.leaving", tgt = "shutting_down.quieting.released", events = { "safe_hold.undone" } },

  trans { src = "shutting_down.stopping",     tgt = "resting.parked",  events = STOPS },
  trans { src = "shutting_down.powering_off", tgt = "resting.parked",  events = STOPS },
  trans { src = "shutting_down.cleaning",     tgt = "resting.stopped", events = STOPS },
  trans { src = "shutting_down.letting_go",   tgt = "resting.unwired", events = STOPS },
  trans { src = "shutting_down.unwiring.braked",   tgt = "resting.unwired.waiting", events = { "disconnect_all.ok" } },
  trans { src = "shutting_down.unwiring.braked",   tgt = "resting.cleaned.waiting",
          events = { "disconnect_all.failed", "disconnect_all.cancelled", "disconnect_all.broken" } },
  trans { src = "shutting_down.destroying.braked", tgt = "resting.unwired.waiting",
          events = { "destroy_all.failed", "destroy_all.cancelled", "destroy_all.broken" } },
  trans { src = "stranded.parked",            tgt = "resting.parked",  events = STOPS },
  trans { src = "stranded.stopped",           tgt = "resting.stopped", events = STOPS },
  trans { src = "stranded.cleaned",           tgt = "resting.cleaned", events = STOPS },
  trans { src = "stranded.unwired",           tgt = "resting.unwired", events = STOPS },
  trans { src = "resting.parked.releasing.on",       tgt = "stranded.parked",           events = { "safe_hold.undone" } },
  trans { src = "resting.stopped.releasing.on",      tgt = "stranded.stopped",          events = { "safe_hold.undone" } },
  trans { src = "resting.cleaned.releasing.on",      tgt = "stranded.cleaned",          events = { "safe_hold.undone" } },
  trans { src = "resting.unwired.releasing.on",      tgt = "stranded.unwired",          events = { "safe_hold.undone" } },
  trans { src = "resting.parked.releasing.leaving",  tgt = "shutting_down.stopping",    events = { "safe_hold.undone" } },
  trans { src = "resting.stopped.releasing.leaving", tgt = "shutting_down.cleaning",    events = { "safe_hold.undone" } },
  trans { src = "resting.cleaned.releasing.leaving", tgt = "shutting_down.unwiring",    events = { "safe_hold.undone" } },
  trans { src = "resting.unwired.releasing.leaving", tgt = "shutting_down.letting_go",  events = { "safe_hold.undone" } },

  trans { src = "deploying",                tgt = "halted", events = STOPS },
  trans { src = "deploy_failed",            tgt = "halted", events = STOPS },
  trans { src = "cancelling",               tgt = "halted", events = STOPS },
  trans { src = "cancel_failed",            tgt = "halted", events = STOPS },
  trans { src = "deploying.taking_over",    tgt = "halted", events = LOSSES },
  trans { src = "deploy_failed",            tgt = "halted", events = LOSSES },
  trans { src = "cancel_failed",            tgt = "halted", events = LOSSES },
  trans { src = "halted.releasing.on",      tgt = "deploy_failed", events = { "safe_hold.undone" } },
  trans { src = "halted.releasing.leaving", tgt = "cancelling",    events = { "safe_hold.undone" } },

  trans { src = "shutting_down", tgt = "stranded.before_parking",
          events = { "base_stop.failed", "hold.failed", "park.failed", "base_stop.broken", "hold.broken", "park.broken",
                     "disable_copying.failed", "disable_copying.broken" } },
  trans { src = "shutting_down", tgt = "stranded.parked",
          events = { "stop_control.failed", "stop_all.failed", "stop_control.broken", "stop_all.broken" } },
  trans { src = "shutting_down", tgt = "stranded.stopped", events = { "cleanup_all.failed", "cleanup_all.broken" } },
  trans { src = "shutting_down.unwiring.going",   tgt = "stranded.cleaned", events = { "disconnect_all.failed", "disconnect_all.broken" } },
  trans { src = "shutting_down.destroying.going", tgt = "stranded.unwired", events = { "destroy_all.failed", "destroy_all.broken" } },
  trans { src = "stranded.before_parking", tgt = "shutting_down",              events = { "e_shutdown", "e_go_on" } },
  trans { src = "stranded.parked",         tgt = "shutting_down.stopping",     events = { "e_shutdown", "e_go_on" } },
  trans { src = "stranded.stopped",        tgt = "shutting_down.cleaning",     events = { "e_shutdown", "e_go_on" } },
  trans { src = "stranded.cleaned",        tgt = "shutting_down.unwiring",     events = { "e_shutdown", "e_go_on" } },
  trans { src = "stranded.unwired",        tgt = "shutting_down.letting_go",   events = { "e_shutdown", "e_go_on" } },
  trans { src = "shutting_down.destroying", tgt = "idle", events = { "destroy_all.ok" } },
}
