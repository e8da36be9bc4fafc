-- Coordinator of two coupled robots. It knows of each of them what that one's file accepts and emits, and no state, no component and no
-- configuration of it: it makes the world and the networks, begins both robots, leads both down, and takes world and networks away.
-- What keeps a robot in the world while it is built is a coordinator beside this one, for each robot (place.lua).
--
-- `left/up` and `left/failed` are told without being written.

-- Of the two the order is not known in which they come to it. `again`: what is asked of one that has not come to it yet.
local function both(left, right, again)
  local function on(of, how) return { src = of, tgt = of, events = { how[1] }, effect = how[2] } end
  local all = {
    neither = state {},
    left    = state {},
    right   = state {},
    both    = state {},
    trans { src = "initial", tgt = "neither" },
    trans { src = "neither", tgt = "left",  events = { left } },
    trans { src = "neither", tgt = "right", events = { right } },
    trans { src = "left",    tgt = "both",  events = { right } },
    trans { src = "right",   tgt = "both",  events = { left } },
  }
  for waiting, robots in pairs(again and { neither = { "left", "right" }, left = { "right" }, right = { "left" } } or {}) do
    for _, each in ipairs(again(robots)) do table.insert(all, trans(on(waiting, each))) end
  end
  return state(all)
end

return state {

  idle = state {},

  alive = state {
    making  = state { entry = "make" },
    raising = both("left/up", "right/up"),
    joined  = state {},
    -- One of them did not come up: it is said so, and both are led down when that is asked for.
    failed  = state {},
    trans { src = "initial",       tgt = "making" },
    trans { src = "making",        tgt = "raising", events = { "make.ok" }, effect = { "e_made", "left/e_start", "right/e_start" } },
    trans { src = "making",        tgt = "failed",  events = { "make.failed", "make.broken" } },
    trans { src = "raising",       tgt = "failed",
            events = { "left/failed", "right/failed", "e_left_unplaced", "e_right_unplaced" } },
    trans { src = ".raising.both", tgt = "joined",  events = { "e_done" } },
  },

  -- Each is out when it is in the world no more and will not be placed there again. One that is down when it is asked says so by having
  -- nothing to do; one that was stopped on its way waits to be asked once more.
  lowering = both("e_left_out", "e_right_out", function(robots)
    local asked, each = {}, {}
    for _, robot in ipairs(robots) do
      local close = "e_" .. robot .. "_close"
      table.insert(asked, close)
      table.insert(asked, robot .. "/e_shutdown")
      table.insert(each, { "e_" .. robot .. "_gone", close })
    end
    table.insert(each, { "e_shutdown", asked })
    return each
  end),

  unmaking = state { entry = "make.undo" },
  -- It could not be taken away. `e_shutdown` tries again.
  stuck    = state {},

  trans { src = "initial",        tgt = "idle" },
  trans { src = "idle",           tgt = "alive",    events = { "e_start" } },
  trans { src = "alive",          tgt = "lowering", events = { "e_shutdown" },
          effect = { "e_left_close", "e_right_close", "left/e_shutdown", "right/e_shutdown" } },
  trans { src = ".lowering.both", tgt = "unmaking", events = { "e_done" } },
  trans { src = "unmaking",       tgt = "idle",     events = { "make.undone" } },
  trans { src = "unmaking",       tgt = "stuck",    events = { "make.undo.failed", "make.undo.broken" } },
  trans { src = "stuck",          tgt = "unmaking", events = { "e_shutdown" } },
}
