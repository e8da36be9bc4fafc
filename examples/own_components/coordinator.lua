-- Built on entry of `up`, undone on leaving it: nothing else has to be written for the shutdown.
return state {
  idle = state {},
  up = state { config = "build",
    running = state {},
    slow = state { config = "slow" },
    trans { src = "initial", tgt = "running" },
    trans { src = "running", tgt = "slow",    events = { "e_slow" } },
    trans { src = "slow",    tgt = "running", events = { "e_fast", "slow.failed", "slow.broken" } },
  },
  failed = state {},
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle",    tgt = "up",     events = { "e_start" } },
  trans { src = "up",      tgt = "failed", events = { "build.failed", "build.broken" } },
  trans { src = "up",      tgt = "idle",   events = { "e_shutdown" } },
  trans { src = "failed",  tgt = "idle",   events = { "e_shutdown" } },
}
