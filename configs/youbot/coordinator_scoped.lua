-- Coordinator of one robot of the youBot coupling, with state-scoped configurations: being in `copying` means that enable_copying is in force, and
-- leaving it undoes it. No inverse is asked for, but for the end of a stop. All else is that of the other variant.
local robot = rfsm.load("coordinator.lua")

local function scoped(state, configuration) state.entry, state.exit, state.config = nil, nil, configuration end
local sync = robot.operational.sync
scoped(sync.harmonizing, "five_DOF")
scoped(sync.copying, "enable_copying")
scoped(sync.copying.eight_DOF_mode, "eight_DOF")
scoped(sync.copying.five_DOF_mode, "five_DOF")

-- Wherever it is heard that ending the coupling by itself has not gone well, it is heard of what was undone with the state, too.
local function hears(transition, event)
  for _, heard in ipairs(transition.events or {}) do
    if heard == event then return true end
  end
end
local function also(within)
  for _, of in pairs(within) do
    if type(of) == "table" then
      if hears(of, "disable_copying.failed") then
        local events = { "enable_copying.undo.failed", "enable_copying.undo.broken", "eight_DOF.undo.failed", "eight_DOF.undo.broken",
                         "five_DOF.undo.failed", "five_DOF.undo.broken" }
        for _, heard in ipairs(of.events) do table.insert(events, heard) end
        of.events = events
      else
        also(of)
      end
    end
  end
end
also(robot)
return robot
