-- When: a statechart that performs nothing itself. It asks for configurations (`entry = "build"`), which are answered by events
-- (`build.ok`, `build.failed`, `build.broken`; `build.undone`, …). What is the `config` of a state is in force while that is active.
return state {
  off = state {},
  up = state {
    building = state { entry = "build" },
    starting = state { entry = "run" },
    slowly = state { config = "slow" },
    fast = state { config = "fast" },
    trans { src = "initial", tgt = "building" },
    trans { src = "building", tgt = "starting", events = { "build.ok" } },
    trans { src = "starting", tgt = "slowly", events = { "run.ok" } },
    trans { src = "slowly", tgt = "fast", events = { "e_faster" } },
    trans { src = "fast", tgt = "slowly", events = { "e_slower" } },
  },
  failed = state {},
  -- However much of it could be done: it is in force until people say that it is over.
  stopped = state {
    config = "stop",
    whole = state {},
    in_part = state {},
    trans { src = "initial", tgt = "whole" },
    trans { src = "whole", tgt = "in_part", events = { "stop.failed", "stop.broken" } },
  },
  down = state {
    stopping = state { entry = "run.undo" },
    removing = state { entry = "build.undo" },
    trans { src = "initial", tgt = "stopping" },
    trans { src = "stopping", tgt = "removing", events = { "run.undone", "run.undo.failed", "run.undo.broken" } },
  },
  -- Something could not be undone: people look, and say `e_end` once more.
  left = state {},

  trans { src = "initial", tgt = "off" },
  trans { src = "off", tgt = "up", events = { "e_start" } },
  -- From wherever it is in `up`.
  trans { src = "up", tgt = "failed", events = { "build.failed", "build.broken", "run.failed", "run.broken",
    "slow.failed", "slow.broken", "fast.failed", "fast.broken", "motor.faulted" } },
  trans { src = "up", tgt = "stopped", events = { "e_stop" } },
  trans { src = "failed", tgt = "stopped", events = { "e_stop" } },
  trans { src = "stopped", tgt = "stopped", events = { "e_stop" } },
  trans { src = "stopped", tgt = "failed", events = { "e_reset" } },
  trans { src = "up", tgt = "down", events = { "e_end" } },
  trans { src = "failed", tgt = "down", events = { "e_end" } },
  trans { src = "stopped", tgt = "down", events = { "e_end" } },
  trans { src = "down", tgt = "stopped", events = { "e_stop" } },
  trans { src = "down", tgt = "off", events = { "build.undone" } },
  trans { src = "down", tgt = "left", events = { "build.undo.failed", "build.undo.broken" } },
  trans { src = "left", tgt = "stopped", events = { "e_stop" } },
  trans { src = "left", tgt = "down", events = { "e_end" } },
}
