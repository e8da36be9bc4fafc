-- Going down is the bring-up undone: no teardown is written.
return state {
  idle     = state {},
  building = state { entry = "build" },
  starting = state { entry = "run" },

  operational = state {
    soft = state { config = "quiet" },
    hard = state { config = "loud" },
    trans { src = "initial", tgt = "soft" },
    trans { src = "soft", tgt = "hard", events = { "e_loud" } },
    trans { src = "hard", tgt = "soft", events = { "e_quiet" } },
  },

  stopping = state { entry = "run.undo" },
  removing = state { entry = "build.undo" },
  failed   = state {},

  trans { src = "initial",     tgt = "idle" },
  trans { src = "idle",        tgt = "building",    events = { "e_start" } },
  trans { src = "building",    tgt = "starting",    events = { "build.ok" } },
  trans { src = "starting",    tgt = "operational", events = { "run.ok" } },
  trans { src = "building",    tgt = "failed",      events = { "build.failed", "build.broken" } },
  trans { src = "starting",    tgt = "failed",      events = { "run.failed", "run.broken" } },
  trans { src = "operational", tgt = "failed",
          events = { "quiet.failed", "quiet.broken", "loud.failed", "loud.broken" } },

  trans { src = "operational", tgt = "stopping",    events = { "e_stop" } },
  trans { src = "building",    tgt = "stopping",    events = { "e_stop" } },
  trans { src = "starting",    tgt = "stopping",    events = { "e_stop" } },
  trans { src = "failed",      tgt = "stopping",    events = { "e_stop" } },
  trans { src = "stopping",    tgt = "removing",    events = { "run.undone" } },
  trans { src = "removing",    tgt = "idle",        events = { "build.undone" } },
  trans { src = "stopping",    tgt = "failed",
          events = { "run.undo.failed", "run.undo.broken", "quiet.undo.failed", "quiet.undo.broken",
                     "loud.undo.failed", "loud.undo.broken" } },
  trans { src = "removing",    tgt = "failed",      events = { "build.undo.failed", "build.undo.broken" } },
}
