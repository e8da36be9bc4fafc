-- What keeps one of two robots (`robot`) in the world that both are in: when its components are built it is placed there, and let go when it
-- wants to take them away. Whether it comes up or goes down, alone or not, is all the same, and so is what the other one does.
local function of(word) return robot .. "/" .. word end
local place = "place_" .. robot
local close, out, gone = "e_" .. robot .. "_close", "e_" .. robot .. "_out", "e_" .. robot .. "_gone"
local unplaced = "e_" .. robot .. "_unplaced"
-- What the world shows of its arm (`body`: which of the world's two it is) is told to it: its own driver may be dead.
local fell = "e_" .. body .. "_fell"

return state {

  -- There is no world: nothing is placed.
  idle      = state {},
  -- The world is to be taken away, and the robot is not in it. It is asked to end, too: whether it has nothing to do is told to who asks.
  closing   = state { entry = of "e_shutdown" },
  departing = state { entry = of "e_released" },

  -- It is not built.
  away     = state {},

  placing  = state { entry = place },
  placed   = state {},
  -- It could not be. While all of it is brought up that has failed with it; a robot whose arm is not there stops by itself.
  unplaced = state { entry = unplaced },

  lifting  = state { entry = place .. ".undo" },
  -- It could not be taken out: nothing is taken away under it. Who asks for the end once more has it tried again.
  tied     = state {},
  released = state { entry = of "e_released" },

  trans { src = "initial",  tgt = "idle" },
  trans { src = "idle",     tgt = "away",     events = { "e_made" } },
  trans { src = "idle",     tgt = "idle",     events = { close }, effect = out },
  trans { src = "idle",     tgt = "departing", events = { of "e_leaving" } },
  trans { src = "away",     tgt = "closing",  events = { close } },
  trans { src = "closing",  tgt = "departing", events = { of "e_leaving" } },
  trans { src = "closing",  tgt = "idle",     events = { of "down", of "e_shutdown.ignored" }, effect = out },
  trans { src = "departing", tgt = "departing", events = { of "e_leaving" } },
  trans { src = "departing", tgt = "idle",    events = { of "down" }, effect = out },
  trans { src = "departing", tgt = "released", events = { "e_made" } },
  trans { src = "away",     tgt = "placing",  events = { of "e_built" } },
  trans { src = "away",     tgt = "released", events = { of "e_leaving" } },
  trans { src = "placing",  tgt = "placed",   events = { place .. ".ok" } },
  trans { src = "placing",  tgt = "unplaced", events = { place .. ".failed", place .. ".broken" } },
  trans { src = "placing",  tgt = "lifting",  events = { of "e_leaving" } },
  trans { src = "placed",   tgt = "placed",   events = { fell }, effect = of "e_arm_fell" },
  trans { src = "placed",   tgt = "lifting",  events = { of "e_leaving" } },
  trans { src = "unplaced", tgt = "lifting",  events = { of "e_leaving" } },
  trans { src = "tied",     tgt = "lifting",  events = { of "e_leaving", "e_shutdown" } },
  trans { src = "lifting",  tgt = "released", events = { place .. ".undone" } },
  trans { src = "lifting",  tgt = "tied",     events = { place .. ".undo.failed", place .. ".undo.broken" } },
  -- A stop between the two made it ask again.
  trans { src = "released", tgt = "released", events = { of "e_leaving" } },
  trans { src = "released", tgt = "away",     events = { of "down" }, effect = gone },
}
