-- Two subsystems of one file: brought up side by side, joined, led down since one of them wants to leave.
--   davit run examples/pair/story.lua --clock simulated

deploy("pair.yaml")
wait_state("pair:joined", 1)
assert(property("left/Drive.gain") == 0.7 and property("right/Drive.gain") == 0.5)

-- One fails: it says that it wants to leave, and leaves when nothing of its parent is connected to it any more.
fail("left/Drive")
wait_state("pair:idle", 5)
assert(#stack() == 0)
shutdown()
