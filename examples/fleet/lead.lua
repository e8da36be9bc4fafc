-- Leads one of several couplings (`coupling`) up and down, whatever the others do.
local function of(word) return coupling .. "/" .. word end

return state {
  idle     = state {},
  raising  = state { entry = of "e_start" },
  up       = state {},
  failed   = state {},
  lowering = state { entry = of "e_shutdown" },

  trans { src = "initial",  tgt = "idle" },
  trans { src = "idle",     tgt = "raising",  events = { "e_start" } },
  trans { src = "raising",  tgt = "up",       events = { of "up" } },
  trans { src = "raising",  tgt = "failed",   events = { of "failed" } },
  trans { src = "raising",  tgt = "lowering", events = { "e_shutdown" } },
  trans { src = "up",       tgt = "lowering", events = { "e_shutdown" } },
  trans { src = "failed",   tgt = "lowering", events = { "e_shutdown" } },
  trans { src = "lowering", tgt = "lowering", events = { "e_shutdown" } },
  trans { src = "lowering", tgt = "idle",     events = { of "down" } },
}
