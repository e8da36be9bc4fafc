-- The whole story of one robot of the coupling, in simulated time:  davit run examples/youbot_story.lua --clock simulated
--
-- Bring-up from nothing; the link is found good; the operator brings the arms together; the coupling engages; eight
-- degrees of freedom for a second, then five, then eight again, each measured; one frame undone by hand; down to nothing.

deploy("../deployments/youbot_arm.yaml")
wait_state("operational", 20)
local up = now()

wait_state("harmonizing", 5)            -- the link has been good for a second
wait_state("copying", 15)               -- the arms are aligned
wait_answer("eight_DOF.ok", 1)
assert_running("Dynamics")

wait(up + 15.4 - now())                 -- the hand of the operator leads the arm to and fro

-- A second of a mode, and what the coupling did in it: the force between the arms, and how far the base went.
local function act(mode, way)
  wait(0.5)                             -- what the base still had of its speed
  local s = sample{ every = 0.01, name = mode, signals = {
    force = "Cart_Impedance.f_raw_norm", x = "youbot.odometry.x", y = "youbot.odometry.y" } }
  wait(1)
  s:stop()
  local base = math.sqrt((s:max("x") - s:min("x"))^2 + (s:max("y") - s:min("y"))^2)
  figure{ name = mode .. ": force, rms", value = s:rms("force"), unit = "N" }
  expect{ name = mode .. ": force, largest", value = s:max("force"), max = 5, unit = "N" }
  expect{ name = mode .. ": way of the base", value = base, min = way.min, max = way.max, unit = "m" }
end

assert(property("Dynamics.force_gain")[1] == 0.1)
act("eight", { min = 0.002 })

raise("e_5dof")
wait_answer("five_DOF.ok", 1)
assert(property("Dynamics.force_gain")[1] == 0)
act("five", { max = 0.001 })            -- the base stands

raise("e_8dof")
wait_answer("eight_DOF.ok", 1)
act("eight_again", { min = 0.002 })

apply("profile_soft", { force = true })    -- no `operator:` lists it
wait_answer("profile_soft.ok", 1)
assert(property("Cart_Impedance.stiffness") == 70)
undo()
wait_answer("undo.done", 1)
assert(property("Cart_Impedance.stiffness") == 150)

shutdown()
