-- Made, started, stopped, taken away. Before what it exports goes, it says so and waits until its parent has let go.
return state {

  idle = state {},

  alive = state {
    making   = state { entry = "make" },
    starting = state { entry = { "e_built", "run" } },
    on       = state {},
    trans { src = "initial",  tgt = "making" },
    trans { src = "making",   tgt = "starting", events = { "make.ok" } },
    trans { src = "starting", tgt = "on",       events = { "run.ok" } },
  },

  -- A bring-up that failed, or a way down that did.
  undone = state {},

  leaving   = state { entry = "e_leaving" },
  stopping  = state { entry = "run.undo" },
  removing  = state { entry = "make.undo" },

  trans { src = "initial",  tgt = "idle" },
  trans { src = "idle",     tgt = "alive",    events = { "e_start" } },
  trans { src = "alive",    tgt = "undone",   events = { "make.failed", "make.broken", "run.failed", "run.broken" } },
  trans { src = "alive",    tgt = "leaving",  events = { "e_shutdown", "Drive.faulted" } },
  trans { src = "undone",   tgt = "leaving",  events = { "e_shutdown" } },
  trans { src = "leaving",  tgt = "stopping", events = { "e_released" } },
  trans { src = "stopping", tgt = "removing", events = { "run.undone", "run.undo.failed", "run.undo.broken" } },
  trans { src = "removing", tgt = "idle",     events = { "make.undone" } },
  trans { src = "removing", tgt = "undone",   events = { "make.undo.failed", "make.undo.broken" } },
}
