-- davit run examples/side_by_side/story.lua --clock simulated
deploy("deployment.yaml")
assert(property("Arm.speed") == 0.5)

raise("e_grasp")                       -- to both; only the gripper waits for it
wait_state("gripper:closing", 1)
wait_state("arm:careful", 1)           -- told by the gripper's `e_held`
wait_answer("arm_slow.ok", 1)
assert(property("Arm.speed") == 0.1 and property("Gripper.force") == 20)

raise("e_release")
wait_state("arm:ready", 1)
wait(0.1)
assert(property("Arm.speed") == 0.5 and property("Gripper.force") == 5)
say(table.concat(active(), " "))

shutdown()
