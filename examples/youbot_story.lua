-- The whole story of one robot of the coupling, in simulated time:  davit run examples/youbot_story.lua --clock simulated
--
-- Bring-up from nothing; the link is found good; the operator brings the arms together; the coupling engages; eight
-- degrees of freedom, then five, then eight again; one frame undone by hand; down to nothing.

deploy("../deployments/youbot_arm.yaml")
wait_state("operational", 20)

wait_state("harmonizing", 5)            -- the link has been good for a second
wait_state("copying", 15)               -- the arms are aligned
wait_answer("eight_DOF.ok", 1)
assert_running("Dynamics")
assert(property("Dynamics.force_gain")[1] == 0.1)

raise("e_5dof")
wait_answer("five_DOF.ok", 1)
assert(property("Dynamics.force_gain")[1] == 0)

raise("e_8dof")
wait_answer("eight_DOF.ok", 1)

apply("profile_soft", { force = true })    -- no `operator:` lists it
wait_answer("profile_soft.ok", 1)
assert(property("Cart_Impedance.stiffness") == 70)
undo()
wait_answer("undo.done", 1)
assert(property("Cart_Impedance.stiffness") == 150)

shutdown()
