return state {
  idle = state {},
  made = state { entry = "make", exit = "make.undo" },
  up   = state { config = "copy" },
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "made", events = { "e_start" } },
  trans { src = "made", tgt = "up",   events = { "make.ok" } },
  trans { src = "made", tgt = "idle", events = { "make.failed", "make.broken" } },
  trans { src = "up",   tgt = "idle", events = { "e_shutdown" } },
}
