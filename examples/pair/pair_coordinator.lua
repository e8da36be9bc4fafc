-- Begins both, joins them while both are up, and leads both down.

-- Of the two the order is not known in which they come to it.
local function both(how)
  return state {
    neither = state {}, left = state {}, right = state {}, both = state {},
    trans { src = "initial", tgt = "neither" },
    trans { src = "neither", tgt = "left",  events = { "left/"  .. how } },
    trans { src = "neither", tgt = "right", events = { "right/" .. how } },
    trans { src = "left",    tgt = "both",  events = { "right/" .. how } },
    trans { src = "right",   tgt = "both",  events = { "left/"  .. how } },
  }
end

return state {
  idle     = state {},
  raising  = both("up"),
  joining  = state { entry = "join" },
  joined   = state {},
  failed   = state {},
  parting  = state { entry = "join.undo" },
  -- Who has not left yet is let go as soon as it says so.
  lowering = both("down"),

  trans { src = "initial", tgt = "idle" },
  trans { src = "idle",    tgt = "raising", events = { "e_start" }, effect = { "left/e_start", "right/e_start" } },
  trans { src = "raising", tgt = "failed",  events = { "left/failed", "right/failed" } },
  trans { src = ".raising.both", tgt = "joining", events = { "e_done" } },
  trans { src = "joining", tgt = "joined",  events = { "join.ok" } },
  trans { src = "joining", tgt = "failed",  events = { "join.failed", "join.broken" } },

  -- Either of them wants to leave, or all of it is to go down.
  trans { src = "joined",  tgt = "parting", events = { "e_shutdown", "left/e_leaving", "right/e_leaving" } },
  trans { src = "joining", tgt = "parting", events = { "e_shutdown", "left/e_leaving", "right/e_leaving" } },
  trans { src = "raising", tgt = "parting", events = { "e_shutdown", "left/e_leaving", "right/e_leaving" } },
  trans { src = "failed",  tgt = "parting", events = { "e_shutdown" } },
  trans { src = "parting", tgt = "lowering", events = { "join.undone", "join.undo.failed", "join.undo.broken" },
          effect = { "left/e_shutdown", "right/e_shutdown", "left/e_released", "right/e_released" } },
  trans { src = ".lowering.both", tgt = "idle", events = { "e_done" } },
}
