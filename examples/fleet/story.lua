-- Eight youBots in four couplings: all of them couple, one coupling is stopped alone and reset, then all eight at once.
--
--     cargo run --release -- run examples/fleet/story.lua --clock simulated
local all = { "first", "second", "third", "fourth" }
local function each(what)
  for _, coupling in ipairs(all) do
    for _, robot in ipairs { "left", "right" } do what(coupling .. "/" .. robot) end
  end
end

deploy("fleet.yaml")
each(function(robot) wait_state(robot .. ":copying", 30) end)
figure{ name = "all eight copy after", value = now(), unit = "s" }

-- A safety event of one coupling is heard in that one, and nowhere else.
raise("second/e_estop")
wait_state("second/left:fault", 0.01)
wait_state("second/right:fault", 0.01)
wait(0.5)
for _, coupling in ipairs { "first", "third", "fourth" } do
  for _, robot in ipairs { "left", "right" } do wait_state(coupling .. "/" .. robot .. ":copying", 0) end
end
wait(0.5)
raise("second/left/e_reset")
raise("second/right/e_reset")
wait_state("second/left:copying", 30)
wait_state("second/right:copying", 30)

-- One of the whole is given to all.
raise("e_estop")
each(function(robot) wait_state(robot .. ":fault", 0.01) end)
wait(1)
each(function(robot) raise(robot .. "/e_reset") end)
each(function(robot) wait_state(robot .. ":operational", 5) end)

shutdown()
say("four couplings, eight robots: up, one coupling stopped alone, then all at once, down")
