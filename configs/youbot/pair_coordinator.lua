-- Coordinator of two coupled robots. It knows of each of them what that one's file accepts and emits, and no state, no component and no
-- configuration of it: it begins both, joins their links while both are up, and leads both down.
--
-- `left/up`, `left/failed`, `left/down` are told of every subsystem without being written.

-- Of the two the order is not known in which they come to it.
local function both(how, done)
  return state {
    neither = state {},
    left    = state {},
    right   = state {},
    both    = state { entry = done },
    trans { src = "initial", tgt = "neither" },
    trans { src = "neither", tgt = "left",  events = { "left/"  .. how } },
    trans { src = "neither", tgt = "right", events = { "right/" .. how } },
    trans { src = "left",    tgt = "both",  events = { "right/" .. how } },
    trans { src = "right",   tgt = "both",  events = { "left/"  .. how } },
  }
end

return state {

  idle = state {},

  alive = state { entry = { "left/e_start", "right/e_start" },
    raising = both("up", "join"),
    joined  = state {},
    -- One of them did not come up: it is said so, and both are led down when that is asked for.
    failed  = state {},
    trans { src = "initial",       tgt = "raising" },
    trans { src = "raising",       tgt = "failed", events = { "left/failed", "right/failed", "join.failed", "join.broken" } },
    trans { src = ".raising.both", tgt = "joined", events = { "join.ok" } },
  },

  -- The links are taken apart before either robot leaves.
  parting = state { entry = "join.undo" },

  -- They could not be: nothing is taken away under them. `e_shutdown` tries again.
  tied = state {},

  -- One that was stopped on its way waits to be asked once more; whoever is down already has nothing to do.
  lowering = state { entry = { "left/e_shutdown", "right/e_shutdown" },
    going = both("down"),
    trans { src = "initial",        tgt = "going" },
    trans { src = ".going.neither", tgt = ".going.neither", events = { "e_shutdown" }, effect = { "left/e_shutdown", "right/e_shutdown" } },
    trans { src = ".going.left",    tgt = ".going.left",    events = { "e_shutdown" }, effect = "right/e_shutdown" },
    trans { src = ".going.right",   tgt = ".going.right",   events = { "e_shutdown" }, effect = "left/e_shutdown" },
  },

  trans { src = "initial", tgt = "idle" },
  trans { src = "idle",    tgt = "alive",    events = { "e_start" } },
  trans { src = "alive",   tgt = "parting",  events = { "e_shutdown" } },
  trans { src = "parting", tgt = "lowering", events = { "join.undone" } },
  trans { src = "parting", tgt = "tied",     events = { "join.undo.failed", "join.undo.broken" } },
  trans { src = "tied",    tgt = "parting",  events = { "e_shutdown" } },
  trans { src = "lowering.going.both", tgt = "idle", events = { "e_done" } },
}
